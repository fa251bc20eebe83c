//! Files of other programs as scenarios: GeoJSON, KML, plans of QGroundControl.
//!
//! What a file says and a scenario has no place for is listed as unused, and what a scenario needs
//! and a file does not say as assumed. Nothing here plans or judges a scenario: who hands it in is
//! told what is wrong with it. Deliberately absent: the size of the file, which is checked before
//! its text is here, and anything that a file refers to.

mod antimeridian;
mod draft;
mod facts;
mod geojson;
mod kml;
mod plan;

use serde::Serialize;
use serde_json::Value;
use thiserror::Error;

/// What became of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conversion {
    /// A scenario document in the frame `wgs84`.
    pub scenario: Value,
    /// What the document needs and the file does not say.
    pub assumed: Vec<Assumed>,
    /// What the file says and the document cannot.
    pub unused: Vec<Unused>,
}

/// A part of the document that the file does not say.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Assumed {
    /// Into the document, RFC 6901.
    pub pointer: String,
    /// What was taken, and why.
    pub reason: String,
}

/// A part of the file that was not used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unused {
    /// A JSON pointer into the file; of KML the line and the name.
    #[serde(rename = "where")]
    pub place: String,
    /// Why.
    pub reason: String,
}

/// How a file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Syntax {
    /// GeoJSON, or a plan of QGroundControl.
    Json,
    /// KML.
    Xml,
}

/// Why a file is no scenario.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ImportError {
    /// It is not JSON.
    #[error("line {line}, column {column}: {detail}")]
    NotJson {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What was met.
        detail: String,
    },
    /// It is not XML, or of a kind that is not read.
    #[error("{0}")]
    NotXml(String),
    /// It is well-formed, but holds no scenario.
    #[error("{detail}")]
    NoScenario {
        /// What is missing.
        detail: String,
        /// What it holds instead.
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
    /// By how a text begins.
    #[must_use]
    pub fn of(text: &[u8]) -> Self {
        let begin = without_mark(text).trim_ascii_start();
        if begin.starts_with(b"<") {
            Self::Xml
        } else {
            Self::Json
        }
    }
}

/// Make a scenario document of a file.
///
/// # Errors
/// [`ImportError::NotJson`] and [`ImportError::NotXml`] when `text` is not of that syntax,
/// [`ImportError::NoScenario`] when it is and has no start or no target.
pub fn convert(text: &[u8], syntax: Syntax) -> Result<Conversion, ImportError> {
    let text = without_mark(text);
    if text.starts_with(b"PK\x03\x04") {
        let found = "a zip archive, as KMZ is: unpack it and take the doc.kml in it";
        return Err(ImportError::NotXml(found.to_owned()));
    }
    match syntax {
        Syntax::Xml => kml::convert(text),
        Syntax::Json => {
            let document = json(text)?;
            if document["fileType"] == "Plan" {
                plan::convert(&document)
            } else {
                geojson::convert(document)
            }
        }
    }
}

/// Nested no deeper than the library reads, 127 levels.
fn json(text: &[u8]) -> Result<Value, ImportError> {
    serde_json::from_slice(text).map_err(|error| ImportError::NotJson {
        line: error.line().max(1),
        column: error.column().max(1),
        detail: detail(&error),
    })
}

/// Without the place, which is told beside.
fn detail(error: &serde_json::Error) -> String {
    let whole = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    whole.strip_suffix(&place).unwrap_or(&whole).to_owned()
}

/// Without the mark that some programs begin UTF-8 with.
fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

#[cfg(test)]
mod tests;
