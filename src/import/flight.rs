//! The flight for which a map of zones is converted: such a map says where not to fly, not from where to where.

use std::ops::RangeInclusive;
use std::str::FromStr;

use super::place::Place;

/// How far beyond the box of its ends, metres, a flight may be let.
pub const WITHIN_M: RangeInclusive<f64> = 1.0..=100e3;

/// Ends that are not in the file, or count in place of those.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Flight {
    /// Where it begins.
    pub start: Option<End>,
    /// Where it ends.
    pub target: Option<End>,
    /// How far beyond the box of its ends it may lead, metres; by default half of the way between them, and a
    /// kilometre at least.
    pub within_m: Option<f64>,
}

/// A start or a target: `LAT,LON` or `LAT,LON,ALT`, in degrees and metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    pub(super) place: Place,
    /// Metres in the datum of the converted document.
    pub(super) alt: Option<f64>,
}

impl End {
    /// What may be written for one.
    pub const ALLOWED: &str = "latitude,longitude or latitude,longitude,altitude, in degrees (-90 to 90, -180 to 180) and metres";
}

impl FromStr for End {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> =
            text.split(',').map(|part| part.trim().parse()).collect();
        let read = match numbers.as_deref() {
            Ok([lat, lon]) => Some((*lat, *lon, None)),
            Ok([lat, lon, alt]) if alt.is_finite() => Some((*lat, *lon, Some(*alt))),
            _ => None,
        };
        let end = read.and_then(|(lat, lon, alt)| {
            let place = Place::new(lon, lat).ok()?;
            Some(Self { place, alt })
        });
        end.ok_or_else(|| format!("must be {}", Self::ALLOWED))
    }
}
