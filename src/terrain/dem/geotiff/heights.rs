//! What the tags of an image say about its heights: only metres above sea level, as they are, can be used.

use geotiff_core::geokeys::{self, GeoKeyDirectory};
use tiff_reader::Ifd;

use super::{OWN, unsupported};
use crate::terrain::dem::{DemError, heights};

/// A tag that no library defines.
const GDAL_METADATA: u16 = 42112;

/// Refuse elevations that are not metres above sea level.
pub(super) fn check_heights(ifd: &Ifd, keys: &GeoKeyDirectory) -> Result<(), DemError> {
    check_reference(keys)?;
    let items = Items(
        ifd.tag(GDAL_METADATA)
            .and_then(|tag| tag.value.as_str())
            .unwrap_or_default(),
    );
    if let Some(unit) = items.first("unittype").filter(|unit| !is_metre(unit)) {
        return Err(unsupported(
            format!(
                "its elevations are in the unit {:?} (GDAL_METADATA)",
                unit.chars().take(40).collect::<String>()
            ),
            "metres",
        ));
    }
    let scaled = [("scale", 1.0), ("offset", 0.0)]
        .iter()
        .any(|(role, neutral)| {
            let value = items.first(role);
            value.is_some_and(|value| value.parse() != Ok(*neutral))
        });
    if scaled {
        return Err(unsupported(
            "its samples are to be scaled or shifted (GDAL_METADATA)",
            "elevations in metres as they are",
        ));
    }
    Ok(())
}

/// Refuse a vertical reference system and a unit, as stated by the geo keys, that are not metres above sea level.
fn check_reference(keys: &GeoKeyDirectory) -> Result<(), DemError> {
    const METRE: u16 = 9001;
    /// Newlyn, NGVD 29, NAVD 88, the Yellow Sea and the Baltic, by their codes in `GeoTIFF` 1.0, which imply no unit.
    const OLD: std::ops::RangeInclusive<u16> = 5101..=5105;
    let code = |key| keys.get_short(key).filter(|code| *code != 0);
    let unit = code(geokeys::VERTICAL_UNITS);
    if let Some(unit) = unit
        && ![METRE, OWN].contains(&unit)
    {
        return Err(unsupported(
            format!("its elevations are in the unit EPSG:{unit}"),
            "metres (EPSG:9001)",
        ));
    }
    match code(geokeys::VERTICAL_CS_TYPE) {
        None => Ok(()),
        Some(vertical) if heights::are_above_sea_level(vertical) => Ok(()),
        Some(vertical) if unit == Some(METRE) && (vertical == OWN || OLD.contains(&vertical)) => {
            Ok(())
        }
        Some(vertical) if heights::stand_for_ellipsoid(vertical) => Err(unsupported(
            format!("its heights are above the ellipsoid (EPSG:{vertical})"),
            "heights above sea level, as gdalwarp -t_srs EPSG:4326+5773 writes them",
        )),
        Some(OWN) => Err(unsupported(
            "its vertical reference system has neither an EPSG code nor a known unit",
            "metres above sea level, such as EPSG:5773",
        )),
        Some(vertical) => Err(unsupported(
            format!("its elevations are in the vertical reference system EPSG:{vertical}"),
            "metres above sea level, such as EPSG:5773",
        )),
    }
}

/// The items of GDAL's metadata: `<Item name="UNITTYPE" sample="0" role="unittype">m</Item>`.
struct Items<'a>(&'a str);

impl<'a> Items<'a> {
    /// The text of the first item with this role.
    fn first(&self, role: &str) -> Option<&'a str> {
        let (_, rest) = self.0.split_once(&format!("role=\"{role}\">"))?;
        rest.split('<').next().map(str::trim)
    }
}

/// Whether the name of a unit says metre, or nothing.
fn is_metre(unit: &str) -> bool {
    ["", "m", "metre", "meter", "metres", "meters"]
        .iter()
        .any(|known| unit.eq_ignore_ascii_case(known))
}
