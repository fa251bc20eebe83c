//! What the tags of an image say about its position and its no-data value.

use geotiff_core::geokeys::{self, GeoKeyDirectory};
use geotiff_core::tags;
use tiff_reader::{Ifd, TagValue};

use super::{OWN, malformed, unsupported};
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
    let code = |key| keys.get_short(key).filter(|code| *code != 0);
    let (projected, geographic) = (
        code(geokeys::PROJECTED_CRS_TYPE),
        code(geokeys::GEODETIC_CRS_TYPE),
    );
    let (model, name) = match keys.get_short(geokeys::GT_MODEL_TYPE) {
        Some(1) => ("projected", projected),
        Some(2) => ("geographic", geographic),
        Some(3) => {
            return Err(unsupported(
                "its coordinates are earth-centred",
                "geographic or projected",
            ));
        }
        // Some writers leave out the model; a code says it too.
        _ if projected.is_some() => ("projected", projected),
        _ if geographic.is_some() => ("geographic", geographic),
        _ => return Ok(None),
    };
    if model == "geographic"
        && let Some(unit) = code(geokeys::GEOG_ANGULAR_UNITS)
        && unit != DEGREE
    {
        return Err(unsupported(
            format!("its coordinates are in the unit EPSG:{unit}"),
            "degrees (EPSG:9102)",
        ));
    }
    match name {
        Some(OWN) | None => Err(DemError::UnusableCrs {
            crs: format!("of the file, {model}"),
            reason: "it is described without an EPSG code; rewrite the file with one, such as by gdalwarp -t_srs EPSG:4326".into(),
        }),
        Some(code) => {
            let crs = Crs::epsg(code)?;
            if crs.is_geographic() != (model == "geographic") {
                return Err(malformed(format!("it says that {crs} is {model}, which it is not")));
            }
            check_unit(keys, &crs)?;
            Ok(Some(crs))
        }
    }
}

/// Refuse coordinates on a map in another unit than the map's own.
fn check_unit(keys: &GeoKeyDirectory, crs: &Crs) -> Result<(), DemError> {
    /// Size of a unit of [`OWN`] description, metres.
    const LINEAR_UNIT_SIZE: u16 = 3077;
    let Some(own) = crs.metres() else {
        return Ok(());
    };
    let (metres, name) = match keys.get_short(geokeys::PROJ_LINEAR_UNITS) {
        None | Some(0) => return Ok(()),
        Some(OWN) => match keys.get_double(LINEAR_UNIT_SIZE) {
            Some(&[metres, ..]) => (Some(metres), format!("of {metres} m")),
            _ => return Ok(()),
        },
        Some(unit) => (metres_of(unit), format!("EPSG:{unit}")),
    };
    // The foot of the United States' surveys is two millionths longer than the foot.
    if metres.is_some_and(|metres| (metres / own - 1.0).abs() < 1e-7) {
        return Ok(());
    }
    Err(unsupported(
        format!("its coordinates are in the unit {name}, but {crs} has one of {own} m"),
        "in the reference system's own unit",
    ))
}

/// The length of a unit of the EPSG registry in which maps are drawn, metres.
fn metres_of(unit: u16) -> Option<f64> {
    Some(match unit {
        9001 => 1.0,
        // Feet: the international one, of surveys in the United States, Clarke's, Sears's, and of the Gold Coast.
        9002 => 0.3048,
        9003 => 1200.0 / 3937.0,
        9005 => 0.304_797_265_4,
        9041 => 0.304_799_471_538_676_2,
        9094 => 0.304_799_710_181_508_8,
        9031 => 1.000_013_596_5,
        9036 => 1000.0,
        // Yards: Clarke's, Sears's, and of India.
        9037 => 0.914_391_796_2,
        9040 => 0.914_398_414_616_028_7,
        9084 => 0.914_398_530_744_440_8,
        // Links and chains: Clarke's, the international link, Sears's, Benoit's, and Sears's cut short.
        9039 => 0.201_166_195_164,
        9098 => 0.201_168,
        9042 => 20.116_765_121_552_632,
        9062 => 20.116_782_494_375_872,
        9301 => 20.116_756,
        _ => return None,
    })
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
