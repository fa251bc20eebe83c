//! `noctule terrain`: the content of an elevation file, and its elevations at points.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Subcommand};
use serde_json::{Value, json};

use super::{exit, files};
use crate::geometry::geodesy::LatLon;
use crate::terrain::dem::{self, Dataset, Declared, Degrees, Metadata, SampleType};

/// Inspect a file of elevations: `GeoTIFF`, ESRI ASCII grid or SRTM .hgt.
#[derive(Subcommand)]
pub(super) enum Command {
    /// Read a whole file and describe it as JSON; exits with 1 if it is damaged
    Info {
        #[command(flatten)]
        file: File,
    },
    /// Print the elevation at each point in metres, bilinear between the samples of the file; `none` outside
    /// them and where they hold no data
    Sample {
        #[command(flatten)]
        file: File,
        /// File with one point a line, latitude and longitude in degrees, or - for standard input; empty lines are left out
        #[arg(long, value_name = "FILE")]
        points: PathBuf,
    },
}

#[derive(Args)]
pub(super) struct File {
    /// The file
    #[arg(value_name = "FILE")]
    path: PathBuf,
    /// Its coordinate reference system, if the file names none
    #[arg(long, value_name = "EPSG:CODE")]
    crs: Option<String>,
    /// Its own name, if it was given another: an SRTM tile says where it lies by its name alone
    #[arg(long = "filename", value_name = "NAME")]
    own_name: Option<String>,
}

impl File {
    fn open(&self) -> anyhow::Result<Dataset> {
        let declared = Declared {
            crs: self.crs.as_deref(),
            name: self.own_name.as_deref(),
            ..Declared::default()
        };
        dem::open(&self.path, declared).with_context(|| self.name())
    }

    /// For errors, which tell what is wrong but not where.
    fn name(&self) -> String {
        self.path.display().to_string()
    }
}

pub(super) fn run(command: &Command) -> anyhow::Result<u8> {
    let text = match command {
        Command::Info { file } => info(file)?,
        Command::Sample { file, points } => sample(file, points)?,
    };
    files::print(&text)?;
    Ok(exit::DONE)
}

fn info(file: &File) -> anyhow::Result<String> {
    let dataset = file.open()?;
    let survey = dataset.survey().with_context(|| file.name())?;
    let Metadata {
        format,
        lattice,
        degrees,
        sample_type,
        no_data,
    } = dataset.metadata();
    let [[west, east], [south, north]] = lattice.extent();
    let finite = |value: f64| value.is_finite().then_some(value);
    let text = serde_json::to_string_pretty(&json!({
        "format": format.to_string(),
        "crs": lattice.crs.to_string(),
        "columns": lattice.columns,
        "rows": lattice.rows,
        "cell": [lattice.step[0], lattice.step[1].abs()],
        "extent": [[west, south], [east, north]],
        "degrees": corners(*degrees),
        "sample_type": name(*sample_type),
        "no_data": no_data.and_then(finite),
        "min": finite(survey.min),
        "max": finite(survey.max),
        "no_data_share": survey.no_data_share,
    }))?;
    Ok(text + "\n")
}

fn corners(degrees: Degrees) -> Value {
    json!({
        "south": degrees.south, "west": degrees.west, "north": degrees.north, "east": degrees.east,
    })
}

fn name(sample_type: SampleType) -> &'static str {
    match sample_type {
        SampleType::U8 => "uint8",
        SampleType::I8 => "int8",
        SampleType::U16 => "uint16",
        SampleType::I16 => "int16",
        SampleType::U32 => "uint32",
        SampleType::I32 => "int32",
        SampleType::F32 => "float32",
        SampleType::F64 => "float64",
        SampleType::Text => "text",
    }
}

fn sample(file: &File, points: &Path) -> anyhow::Result<String> {
    let dataset = file.open()?;
    let text = String::from_utf8(files::read(points)?)
        .with_context(|| format!("cannot read {}", points.display()))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let lines = text.lines().enumerate();
    let places = lines
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(idx, line)| {
            place(line).with_context(|| {
                format!(
                    "line {} is {line:?}, must be a latitude and a longitude",
                    idx + 1
                )
            })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let mut text = String::new();
    let elevations = dataset.sample(&places).with_context(|| file.name())?;
    for elevation in elevations {
        match elevation {
            Some(elevation) => writeln!(text, "{elevation}")?,
            None => writeln!(text, "none")?,
        }
    }
    Ok(text)
}

fn place(line: &str) -> Option<LatLon> {
    let mut words = line.split([',', ' ', '\t']).filter(|word| !word.is_empty());
    let mut degrees = |most: f64| {
        let value: f64 = words.next()?.parse().ok()?;
        (value.abs() <= most).then_some(value)
    };
    let place = LatLon {
        lat: degrees(90.0)?,
        lon: degrees(360.0)?,
    };
    words.next().is_none().then_some(place)
}
