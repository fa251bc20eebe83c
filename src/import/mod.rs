//! Converts files of other programs to scenarios: GeoJSON, KML, QGroundControl plans, and maps of airspace.
//!
//! Parts of a file that a scenario cannot represent are listed as unused; parts of a scenario that the file does not
//! give are listed as assumed. Scenarios are not validated here; that happens when they are submitted. Deliberately
//! absent: the size limit of the file, which is checked before, and anything that the file links to.

mod antimeridian;
mod draft;
mod edges;
mod facts;
mod flight;
mod geojson;
mod kml;
mod near;
mod place;
mod plan;
mod text;
mod threat;
mod xml;
mod zones;

pub use flight::{End, Flight, WITHIN_M};

use serde::Serialize;
use serde_json::Value;
use thiserror::Error;

use zones::{ed269, openair};

/// The result of a conversion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conversion {
    /// A scenario document in the frame `wgs84`.
    pub scenario: Value,
    /// What the document needs but the file does not give.
    pub assumed: Vec<Assumed>,
    /// What the file gives but the document cannot represent.
    pub unused: Vec<Unused>,
}

/// A part of the document that the file does not give.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Assumed {
    /// JSON pointer into the document (RFC 6901).
    pub pointer: String,
    /// The value used, and why.
    pub reason: String,
}

/// A part of the file that was not used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unused {
    /// JSON pointer into the file; for KML and OpenAir, the line and the name.
    #[serde(rename = "where")]
    pub place: String,
    /// Why.
    pub reason: String,
}

/// The most that a scenario may have of what files have many of; one with more would only be refused later.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Most {
    /// Threats in a scenario.
    pub threats: usize,
    /// Vertices of all polygons together.
    pub polygon_vertices: usize,
}

/// Syntax of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Syntax {
    /// GeoJSON, ED-269, ED-318, or a QGroundControl plan.
    Json,
    /// Lines of text: OpenAir.
    Lines,
    /// KML.
    Xml,
}

/// Why a file cannot be converted to a scenario.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ImportError {
    /// It is not JSON.
    #[error("line {line}, column {column}: {detail}")]
    NotJson {
        /// Starts at 1.
        line: usize,
        /// Starts at 1.
        column: usize,
        /// What the parser found.
        detail: String,
    },
    /// It is not XML, or of an unsupported kind.
    #[error("{0}")]
    NotXml(String),
    /// It is well-formed, but contains no scenario.
    #[error("{detail}")]
    NoScenario {
        /// What is missing, or too many.
        detail: String,
        /// What it contains instead.
        unused: Vec<Unused>,
    },
}

impl ImportError {
    fn no_scenario(detail: impl Into<String>) -> Self {
        Self::NoScenario {
            detail: detail.into(),
            unused: Vec::new(),
        }
    }
}

impl Syntax {
    /// Detect the syntax from the beginning of a text.
    #[must_use]
    pub fn of(text: &[u8]) -> Self {
        let text = text::decoded(text);
        if text.trim_ascii_start().starts_with(b"<") {
            Self::Xml
        } else if openair::is_one(&text) {
            Self::Lines
        } else {
            Self::Json
        }
    }
}

/// Convert a file to a scenario document. The ends of `flight` count before those of the file; where both are given, the
/// flight is kept within an area around them, and threats outside it are left out.
///
/// # Errors
/// [`ImportError::NotJson`] and [`ImportError::NotXml`] when `text` does not have that syntax,
/// [`ImportError::NoScenario`] when it does but has no start or no target, or one whose altitude is not known, or has
/// more than `most`.
pub fn convert(
    text: &[u8],
    syntax: Syntax,
    most: Most,
    flight: &Flight,
) -> Result<Conversion, ImportError> {
    let text = &*text::decoded(text);
    if text.starts_with(b"PK\x03\x04") {
        let found = "a zip archive, as KMZ is: unpack it and take the doc.kml in it";
        return Err(ImportError::NotXml(found.to_owned()));
    }
    match syntax {
        Syntax::Xml => kml::convert(text, most, flight),
        Syntax::Lines => openair::convert(text, most, flight),
        Syntax::Json => {
            let document = json(text)?;
            if document["fileType"] == "Plan" {
                plan::convert(&document, most, flight)
            } else if ed269::is_one(&document) {
                ed269::convert(&document, most, flight)
            } else {
                geojson::convert(document, most, flight)
            }
        }
    }
}

/// Most memory, about, that the values of a file may take: many times its length, where they are small.
const MOST_BYTES: usize = 128 << 20;

/// About how much memory the values of a JSON text take; each list or object, and each further member, costs the same
/// whatever it holds.
fn size_in_memory(text: &[u8]) -> usize {
    const OBJECT: usize = 450;
    const VALUE: usize = 50;
    let (mut quoted, mut escaped, mut bytes) = (false, false, text.len());
    for byte in text {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = quoted,
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b'{' => bytes += OBJECT,
            b'[' | b',' => bytes += VALUE,
            _ => {}
        }
    }
    bytes
}

/// Nesting is limited by the library to 127 levels.
fn json(text: &[u8]) -> Result<Value, ImportError> {
    if size_in_memory(text) > MOST_BYTES {
        let most = MOST_BYTES >> 20;
        return Err(ImportError::no_scenario(format!(
            "it has so many values that they would take more than {most} MiB of memory: leave out what no scenario needs"
        )));
    }
    serde_json::from_slice(text).map_err(|error| ImportError::NotJson {
        line: error.line().max(1),
        column: error.column().max(1),
        detail: detail(&error),
    })
}

/// The message without its position, which is reported separately.
fn detail(error: &serde_json::Error) -> String {
    let whole = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    whole.strip_suffix(&place).unwrap_or(&whole).to_owned()
}

#[cfg(test)]
mod tests;
