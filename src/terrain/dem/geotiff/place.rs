//! What the tags of an image say about its position and its no-data value.

use geotiff_core::geokeys::{self, GeoKeyDirectory};
use geotiff_core::tags;
use tiff_reader::{Ifd, TagValue};

use super::{malformed, unsupported};
use crate::terrain::dem::{Crs, DemError};

/// The geo keys of an image; a missing directory counts as an empty one.
pub(super) fn keys(ifd: &Ifd) -> Result<GeoKeyDirectory, DemError> {
    let Some(directory) = ifd.tag(tags::TAG_GEO_KEY_DIRECTORY) else {
        return Ok(GeoKeyDirectory::new());
    };
    let value = |tag| ifd.tag(tag).map(|tag| &tag.value);
    let doubles = match value(tags::TAG_GEO_DOUBLE_PARAMS) {
        Some(TagValue::Double(doubles)) => doubles.as_slice(),
        _ => &[],
    };
    let text = value(tags::TAG_GEO_ASCII_PARAMS)
        .and_then(TagValue::as_str)
        .unwrap_or_default();
    directory
        .value
        .as_u16_slice()
        .and_then(|directory| GeoKeyDirectory::parse(directory, doubles, text))
        .ok_or_else(|| malformed("its directory of geo keys cannot be read"))
}

/// Position of the first node, and the steps to the next column and row.
pub(super) fn nodes(ifd: &Ifd, keys: &GeoKeyDirectory) -> Result<([f64; 2], [f64; 2]), DemError> {
    const POINT: u16 = 2;
    let doubles = |tag| match ifd.tag(tag).map(|tag| &tag.value) {
        Some(TagValue::Double(values)) => Some(values.as_slice()),
        _ => None,
    };
    // Offset from the corner of a pixel to its centre, when pixels are areas.
    let middle = if keys.get_short(geokeys::GT_RASTER_TYPE) == Some(POINT) {
        0.0
    } else {
        0.5
    };
    let (first, step) = match (
        doubles(tags::TAG_MODEL_TRANSFORMATION),
        doubles(tags::TAG_MODEL_TIEPOINT),
        doubles(tags::TAG_MODEL_PIXEL_SCALE),
    ) {
        (None, Some(&[column, row, _, east, north, _]), Some(&[width, height, ..])) => (
            [
                east + (middle - column) * width,
                north - (middle - row) * height.abs(),
            ],
            [width, -height.abs()],
        ),
        (Some(&[a, b, _, east, d, e, _, north, ..]), _, _) => {
            if b != 0.0 || d != 0.0 {
                return Err(unsupported("the image is rotated", "north up"));
            }
            ([east + middle * a, north + middle * e], [a, e])
        }
        _ => {
            return Err(unsupported(
                "the image is placed by neither one tie point and a pixel scale nor a transformation",
                "one of them",
            ));
        }
    };
    if !first.iter().chain(&step).all(|value| value.is_finite()) || step[0] <= 0.0 || step[1] == 0.0
    {
        return Err(malformed(format!(
            "its pixels are {} by {} at {}, {}; must be wider than 0 and finite",
            step[0], -step[1], first[0], first[1]
        )));
    }
    Ok((first, step))
}

/// The reference system stated by the keys.
pub(super) fn crs(keys: &GeoKeyDirectory) -> Result<Option<Crs>, DemError> {
    const DEGREE: u16 = 9102;
    const OWN: u16 = 32767;
    let code = |key| keys.get_short(key).filter(|code| *code != 0);
    let (model, name) = match keys.get_short(geokeys::GT_MODEL_TYPE) {
        Some(1) => ("projected", code(geokeys::PROJECTED_CRS_TYPE)),
        Some(2) => {
            if let Some(unit) = code(geokeys::GEOG_ANGULAR_UNITS)
                && unit != DEGREE
            {
                return Err(unsupported(
                    format!("its coordinates are in the unit EPSG:{unit}"),
                    "degrees (EPSG:9102)",
                ));
            }
            ("geographic", code(geokeys::GEODETIC_CRS_TYPE))
        }
        Some(3) => {
            return Err(unsupported(
                "its coordinates are earth-centred",
                "geographic or projected",
            ));
        }
        _ => return Ok(None),
    };
    match name {
        Some(OWN) | None => Err(DemError::UnusableCrs {
            crs: format!("of the file, {model}"),
            reason: "it is described without an EPSG code; rewrite the file with one, such as by gdalwarp -t_srs EPSG:4326".into(),
        }),
        Some(code) => {
            let crs = Crs::epsg(code)?;
            if crs.is_geographic() == (model == "geographic") {
                Ok(Some(crs))
            } else {
                Err(malformed(format!("it says that {crs} is {model}, which it is not")))
            }
        }
    }
}

pub(super) fn no_data(ifd: &Ifd) -> Result<Option<f64>, DemError> {
    let Some(tag) = ifd.tag(tags::TAG_GDAL_NODATA) else {
        return Ok(None);
    };
    let text = tag.value.as_str().unwrap_or_default();
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    match text.parse() {
        Ok(value) => Ok(Some(value)),
        Err(_) => Err(malformed(format!(
            "its no-data value is {:?}, must be a number",
            text.chars().take(40).collect::<String>()
        ))),
    }
}
