//! Exports a plan to various formats. A new format needs one file and one row here.
//!
//! docs/FORMATS.md describes what each contains, its datums, and what is lost. Deliberately absent: clocks, and
//! anything that is not in the two stored documents.

mod antimeridian;
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

use delivery::Delivery;
pub use error::{ExportError, OptionFault};
pub use file_name::{file_name, file_name_in_full};
pub use options::{Altitude, Firmware, OPTIONS, OptionRule, Options};

use crate::scenario::json::Rules;

/// An export format.
#[derive(Debug)]
pub struct Format {
    /// As used in `?format=` and `--format`.
    pub name: &'static str,
    /// As used in `Accept` and `Content-Type`.
    pub media_type: &'static str,
    /// Extension of a file name, without the dot.
    pub extension: &'static str,
    /// Positions are in degrees, so a plan in a local frame cannot be written.
    pub geodetic: bool,
    /// A browser shows it; others are saved.
    pub shown: bool,
    /// It is flown by a vehicle, or shown on a map as something to fly. An infeasible plan is written only if the
    /// caller insists.
    pub flown: bool,
    /// The subset of [`OPTIONS`] that it supports.
    pub options: &'static [&'static str],
    write: Write,
}

/// How a format is written.
#[derive(Debug)]
enum Write {
    /// The stored result, byte for byte.
    Stored,
    /// Any plan.
    Plain(fn(&Delivery, &Options) -> String),
    /// A plan that can be flown with the given options, if these agree with each other.
    Mission {
        fits: fn(&Options) -> Result<(), OptionFault>,
        write: fn(&Delivery, &Options) -> Result<String, ExportError>,
    },
}

/// The input of a format.
#[derive(Debug, Clone, Copy)]
pub struct ResultInput<'a> {
    /// The stored result document.
    pub result: &'a str,
    /// The accepted scenario document.
    pub scenario: &'a str,
    /// The rules that accepted it; limits are not checked again.
    pub rules: &'a Rules,
}

/// Every format; the first one is the default.
pub const ALL: &[Format] = &[
    Format {
        name: "json",
        media_type: "application/json",
        extension: "json",
        geodetic: false,
        shown: true,
        flown: false,
        options: &[],
        write: Write::Stored,
    },
    Format {
        name: "svg",
        media_type: "image/svg+xml",
        extension: "svg",
        geodetic: false,
        shown: true,
        flown: false,
        options: &[],
        write: Write::Plain(svg::write),
    },
    Format {
        name: "csv",
        media_type: "text/csv",
        extension: "csv",
        geodetic: false,
        shown: false,
        flown: false,
        options: &[],
        write: Write::Plain(csv::write),
    },
    Format {
        name: "geojson",
        media_type: "application/geo+json",
        extension: "geojson",
        geodetic: true,
        shown: false,
        flown: false,
        options: &[],
        write: Write::Plain(geojson::write),
    },
    Format {
        name: "kml",
        media_type: "application/vnd.google-earth.kml+xml",
        extension: "kml",
        geodetic: true,
        shown: false,
        flown: true,
        options: &[],
        write: Write::Plain(kml::write),
    },
    Format {
        name: "czml",
        media_type: "application/vnd.cesium.czml+json",
        extension: "czml",
        geodetic: true,
        shown: false,
        flown: true,
        options: &["epoch"],
        write: Write::Plain(czml::write),
    },
    Format {
        name: "gpx",
        media_type: "application/gpx+xml",
        extension: "gpx",
        geodetic: true,
        shown: false,
        flown: true,
        options: &["epoch"],
        write: Write::Plain(gpx::write),
    },
    Format {
        name: "qgc",
        media_type: "application/vnd.qgroundcontrol.plan+json",
        extension: "plan",
        geodetic: true,
        shown: false,
        flown: true,
        options: mission::OPTIONS,
        write: Write::Mission {
            fits: |_| Ok(()),
            write: mission::qgc::write,
        },
    },
    Format {
        name: "wpl",
        media_type: "text/plain",
        extension: "waypoints",
        geodetic: true,
        shown: false,
        flown: true,
        options: mission::OPTIONS,
        write: Write::Mission {
            fits: mission::wpl::fits,
            write: mission::wpl::write,
        },
    },
];

impl Format {
    /// The format with that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        ALL.iter().find(|format| format.name == name)
    }

    /// The format with that file extension, in any case.
    #[must_use]
    pub fn of_extension(extension: &str) -> Option<&'static Self> {
        ALL.iter()
            .find(|format| format.extension.eq_ignore_ascii_case(extension))
    }

    /// Whether it is the stored result, byte for byte.
    #[must_use]
    pub fn is_stored(&self) -> bool {
        matches!(self.write, Write::Stored)
    }

    /// Write a plan.
    ///
    /// # Errors
    /// [`ExportError::NoGeodeticFrame`] and [`ExportError::Infeasible`] depending on the format;
    /// [`ExportError::Unflyable`] when no mission is possible with the options; [`ExportError::Option`] when they
    /// contradict each other; [`ExportError::Unread`] and [`ExportError::Damaged`] when request or result cannot be read.
    pub fn write(&self, input: &ResultInput, options: &Options) -> Result<String, ExportError> {
        match self.write {
            Write::Stored => Ok(input.result.to_owned()),
            Write::Plain(write) => Ok(write(&self.delivery(input, options)?, options)),
            Write::Mission { fits, write } => {
                fits(options)?;
                write(&self.delivery(input, options)?, options)
            }
        }
    }

    /// Whether the options agree with each other, which is known without a plan.
    ///
    /// # Errors
    /// The option that does not fit.
    pub fn fits(&self, options: &Options) -> Result<(), OptionFault> {
        match self.write {
            Write::Stored | Write::Plain(_) => Ok(()),
            Write::Mission { fits, .. } => fits(options),
        }
    }

    /// The plan, if this format may be written.
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
