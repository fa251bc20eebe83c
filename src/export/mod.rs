//! A delivered plan in the formats that people take away. Adding one is one file and one row.
//!
//! docs/FORMATS.md tells what each holds, by which datum, and what is lost in it. Deliberately
//! absent: clocks, and anything that the two stored documents do not say.

mod chart;
mod csv;
mod czml;
mod delivery;
pub mod document;
mod error;
mod file_name;
mod geojson;
mod gpx;
mod kml;
mod mission;
mod options;
mod outline;
mod svg;
mod words;

pub use delivery::Delivery;
pub use error::{ExportError, OptionFault};
pub use file_name::file_name;
pub use options::{Altitude, Firmware, OPTIONS, OptionRule, Options};

use crate::scenario::json::Rules;

/// A format of a result.
pub struct Format {
    /// As in `?format=` and `--format`.
    pub name: &'static str,
    /// As in `Accept` and `Content-Type`.
    pub media_type: &'static str,
    /// Of a file's name, without the dot.
    pub extension: &'static str,
    /// Positions in it are degrees, so that a plan in a local frame cannot be written.
    pub geodetic: bool,
    /// A vehicle flies it, or a map shows it as something to fly: not written of an infeasible plan
    /// unless the caller insists.
    pub flown: bool,
    /// Of [`OPTIONS`], those that it knows.
    pub options: &'static [&'static str],
    write: Write,
}

/// How a format is written.
enum Write {
    /// It is the stored result, byte for byte as it was finished.
    Stored,
    /// Of any plan.
    Plain(fn(&Delivery, &Options) -> String),
    /// Of a plan that can be flown as the options ask.
    Mission(fn(&Delivery, &Options) -> Result<String, ExportError>),
}

/// What a format is written from.
#[derive(Debug, Clone, Copy)]
pub struct ResultInput<'a> {
    /// The stored result document.
    pub result: &'a str,
    /// The accepted scenario document.
    pub scenario: &'a str,
    /// By which it was accepted; its limits do not count any more.
    pub rules: &'a Rules,
}

/// Every format; the first is served to who names none.
pub const ALL: &[Format] = &[
    Format {
        name: "json",
        media_type: "application/json",
        extension: "json",
        geodetic: false,
        flown: false,
        options: &[],
        write: Write::Stored,
    },
    Format {
        name: "svg",
        media_type: "image/svg+xml",
        extension: "svg",
        geodetic: false,
        flown: false,
        options: &[],
        write: Write::Plain(svg::write),
    },
    Format {
        name: "csv",
        media_type: "text/csv",
        extension: "csv",
        geodetic: false,
        flown: false,
        options: &[],
        write: Write::Plain(csv::write),
    },
    Format {
        name: "geojson",
        media_type: "application/geo+json",
        extension: "geojson",
        geodetic: true,
        flown: false,
        options: &[],
        write: Write::Plain(geojson::write),
    },
    Format {
        name: "kml",
        media_type: "application/vnd.google-earth.kml+xml",
        extension: "kml",
        geodetic: true,
        flown: true,
        options: &[],
        write: Write::Plain(kml::write),
    },
    Format {
        name: "czml",
        media_type: "application/vnd.cesium.czml+json",
        extension: "czml",
        geodetic: true,
        flown: true,
        options: &["epoch"],
        write: Write::Plain(czml::write),
    },
    Format {
        name: "gpx",
        media_type: "application/gpx+xml",
        extension: "gpx",
        geodetic: true,
        flown: true,
        options: &["epoch"],
        write: Write::Plain(gpx::write),
    },
    Format {
        name: "qgc",
        media_type: "application/vnd.qgroundcontrol.plan+json",
        extension: "plan",
        geodetic: true,
        flown: true,
        options: mission::OPTIONS,
        write: Write::Mission(mission::qgc::write),
    },
    Format {
        name: "wpl",
        media_type: "text/plain",
        extension: "waypoints",
        geodetic: true,
        flown: true,
        options: mission::OPTIONS,
        write: Write::Mission(mission::wpl::write),
    },
];

impl Format {
    /// The one of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        ALL.iter().find(|format| format.name == name)
    }

    /// The one whose files end in `extension`, in whatever case.
    #[must_use]
    pub fn of_extension(extension: &str) -> Option<&'static Self> {
        ALL.iter()
            .find(|format| format.extension.eq_ignore_ascii_case(extension))
    }

    /// Whether it is the stored result, byte for byte as it was finished.
    #[must_use]
    pub fn is_stored(&self) -> bool {
        matches!(self.write, Write::Stored)
    }

    /// Write a plan.
    ///
    /// # Errors
    /// [`ExportError::NoGeodeticFrame`] and [`ExportError::Infeasible`] by what the format is;
    /// [`ExportError::Unflyable`] when no mission can be made as the options ask;
    /// [`ExportError::Option`] when they contradict each other; [`ExportError::Damaged`] when the
    /// documents are none that this program wrote, or do not belong together.
    pub fn write(&self, input: &ResultInput, options: &Options) -> Result<String, ExportError> {
        match self.write {
            Write::Stored => Ok(input.result.to_owned()),
            Write::Plain(write) => Ok(write(&self.delivery(input, options)?, options)),
            Write::Mission(write) => write(&self.delivery(input, options)?, options),
        }
    }

    /// The plan, if it may be written so.
    fn delivery(&self, input: &ResultInput, options: &Options) -> Result<Delivery, ExportError> {
        let delivery = Delivery::read(input)?;
        if self.geodetic && delivery.chart.is_none() {
            return Err(ExportError::NoGeodeticFrame { format: self.name });
        }
        if self.flown && !delivery.result.feasible && !options.allow_infeasible {
            return Err(ExportError::Infeasible { format: self.name });
        }
        Ok(delivery)
    }
}

#[cfg(test)]
mod tests;
