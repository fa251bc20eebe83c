//! Zones of airspace with a floor and a ceiling, as authorities publish them: in OpenAir and in two formats of
//! EUROCAE.
//!
//! Where a file leaves a choice, more is kept clear of: an arc's corners lie outside it, an outline that crosses itself
//! becomes its convex hull, and a floor or a ceiling above ground, whose height is not known here, becomes none.

mod arc;
pub(super) mod ed269;
pub(super) mod ed318;
pub(super) mod openair;

use serde_json::Value;

use super::draft::Draft;
use super::facts::begin;
use super::place::Place;
use super::threat::{Made, Shape, Threat};
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::geometry::{ring, simple};

/// Corners nearer to the one before, metres, are taken for the same: where an arc ends and a line goes on.
const SAME_M: f64 = 0.1;

/// An outline of more corners than this is not looked at: that it crosses itself is said when it is planned.
const MOST_LOOKED_AT: usize = 5_000;

/// A floor or a ceiling.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Height {
    /// The surface below, or no limit above.
    Open,
    /// Metres above mean sea level.
    AboveSea(f64),
    /// A flight level: metres above mean sea level in the standard atmosphere.
    Level(f64),
    /// Above ground, or above something else that is not known here, or no number.
    Unknown,
}

/// How many zones had to be made larger or taken to be otherwise than the file says, and why.
#[derive(Debug, Default)]
pub(super) struct Widened {
    floors: usize,
    ceilings: usize,
    levels: usize,
    outlines: usize,
}

/// A zone of the file.
#[derive(Debug)]
pub(super) struct Zone {
    name: Option<String>,
    outline: Outline,
    floor: Height,
    ceiling: Height,
}

/// Seen from above.
#[derive(Debug)]
enum Outline {
    /// With its radius in metres.
    Circle(Place, f64),
    /// Closed or not.
    Ring(Vec<Place>),
}

/// Metres, a foot being 0.3048 of them; so written, 4500 feet are 1371.6 to the last digit.
fn from_feet(feet: f64) -> f64 {
    feet * 3048.0 / 10_000.0
}

impl Height {
    /// `None` where it does not limit a threat.
    fn metres(self) -> Option<f64> {
        match self {
            Self::AboveSea(height) | Self::Level(height) => Some(height),
            Self::Open | Self::Unknown => None,
        }
    }

    /// By a number and the names of its unit and of what it is measured from, as EUROCAE's formats have them.
    fn measured(limit: &Value, unit: &str, from: &str) -> Self {
        let Some(limit) = limit.as_f64() else {
            return if limit.is_null() {
                Self::Open
            } else {
                Self::Unknown
            };
        };
        match (from, unit.to_ascii_uppercase().as_str()) {
            ("AMSL", "M") => Self::AboveSea(limit),
            ("AMSL", "FT") => Self::AboveSea(from_feet(limit)),
            ("AGL", _) if limit <= 0.0 => Self::Open,
            _ => Self::Unknown,
        }
    }
}

impl Widened {
    /// Add those of another count.
    pub(super) fn join(&mut self, other: &Self) {
        self.floors += other.floors;
        self.ceilings += other.ceilings;
        self.levels += other.levels;
        self.outlines += other.outlines;
    }

    /// What there is to say of it.
    pub(super) fn reasons(self) -> impl Iterator<Item = String> {
        let said = [
            (
                self.floors,
                "without a base: the floor in the file is above ground, or above something else that is not known here",
            ),
            (
                self.ceilings,
                "without a top: the ceiling in the file is above ground, or above something else that is not known here",
            ),
            (
                self.levels,
                "with flight levels as heights above mean sea level, which they are in the standard atmosphere",
            ),
            (
                self.outlines,
                "as convex hulls: their outlines cross or touch themselves",
            ),
        ];
        let some = said.into_iter().filter(|(count, _)| *count > 0);
        some.map(|(count, what)| format!("{count} of them {what}"))
    }
}

/// Add a zone to a draft: a threat for each of its outlines, between its floor and its ceiling.
fn add(
    draft: &mut Draft,
    at: &str,
    name: Option<&str>,
    outlines: Result<Vec<Outline>, String>,
    [floor, ceiling]: [Height; 2],
) {
    match outlines {
        Ok(outlines) => {
            for outline in outlines {
                let name = name.map(begin);
                draft.zone(
                    at,
                    Zone {
                        name,
                        outline,
                        floor,
                        ceiling,
                    },
                );
            }
        }
        Err(reason) => draft.leave(at, reason),
    }
}

impl Zone {
    /// As a threat, and what had to be changed for it.
    pub(super) fn threat(self) -> Result<(Made, Widened), String> {
        let (shape, is_hull) = match self.outline {
            Outline::Circle(center, radius) => (Shape::circle(center, radius)?, false),
            Outline::Ring(places) => polygon(&places)?,
        };
        let heights = [self.floor, self.ceiling];
        let is_level = |height| matches!(height, Height::Level(_));
        let widened = Widened {
            floors: usize::from(self.floor == Height::Unknown),
            ceilings: usize::from(self.ceiling == Height::Unknown),
            levels: usize::from(heights.into_iter().any(is_level)),
            outlines: usize::from(is_hull),
        };
        let heights = heights.map(Height::metres);
        Ok((Threat::new(self.name, shape, Ok(heights)), widened))
    }
}

/// The polygon of an outline, or its hull, and whether it is that.
fn polygon(places: &[Place]) -> Result<(Shape, bool), String> {
    let Some(first) = places.first() else {
        return Err("a zone without an outline".to_owned());
    };
    let plane = TangentPlane::at(LatLon::from(*first), 0.0);
    let mut corners: Vec<_> = places
        .iter()
        .map(|place| (plane.local(LatLon::from(*place)), *place))
        .collect();
    corners.dedup_by(|next, corner| (next.0 - corner.0).norm() < SAME_M);
    while corners.len() > 1 && (corners[corners.len() - 1].0 - corners[0].0).norm() < SAME_M {
        corners.pop();
    }
    let (points, places): (Vec<_>, Vec<_>) = corners.into_iter().unzip();
    if points.len() > MOST_LOOKED_AT || simple::check(&points).is_ok() {
        return Ok((Shape::polygon(places), false));
    }
    let hull = ring::distinct(simple::hull(&points));
    if simple::check(&hull).is_err() {
        let count = points.len();
        return Err(format!("an outline of {count} corners that has no inside"));
    }
    let places = hull.into_iter().map(|at| plane.geodetic(at).into());
    Ok((Shape::polygon(places.collect()), true))
}
