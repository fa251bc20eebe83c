//! The stored headers of a file, so that a node can describe a dataset whose bytes it does not have.

use serde::{Deserialize, Serialize};

use crate::terrain::dem::{Crs, Degrees, DemError, Format, Lattice, Metadata, SampleType};

/// The headers of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Headers {
    #[serde(with = "FormatName")]
    format: Format,
    #[serde(with = "SampleTypeName")]
    sample_type: SampleType,
    crs: String,
    columns: usize,
    rows: usize,
    first: [f64; 2],
    step: [f64; 2],
    #[serde(with = "Corners")]
    degrees: Degrees,
    /// As text, because it may be NaN.
    no_data: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Format", rename_all = "kebab-case")]
enum FormatName {
    GeoTiff,
    AsciiGrid,
    Hgt,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "SampleType", rename_all = "kebab-case")]
enum SampleTypeName {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
    Text,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Degrees")]
struct Corners {
    west: f64,
    south: f64,
    east: f64,
    north: f64,
}

impl Headers {
    pub(super) fn of(metadata: &Metadata) -> Self {
        let lattice = &metadata.lattice;
        Self {
            format: metadata.format,
            sample_type: metadata.sample_type,
            crs: lattice.crs.to_string(),
            columns: lattice.columns,
            rows: lattice.rows,
            first: lattice.first,
            step: lattice.step,
            degrees: metadata.degrees,
            no_data: metadata.no_data.map(|value| value.to_string()),
        }
    }

    /// # Errors
    /// [`DemError`] when this version of the program does not know the reference system.
    pub(super) fn metadata(&self) -> Result<Metadata, DemError> {
        Ok(Metadata {
            format: self.format,
            lattice: Lattice {
                crs: Crs::parse(&self.crs)?,
                columns: self.columns,
                rows: self.rows,
                first: self.first,
                step: self.step,
            },
            degrees: self.degrees,
            sample_type: self.sample_type,
            no_data: self.no_data.as_ref().and_then(|text| text.parse().ok()),
        })
    }
}
