//! Identity of a dataset: its bytes, and what was declared because the file does not say it.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use data_encoding::HEXLOWER;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::Staged;
use crate::terrain::dem::{self, Dataset, Declared, DemError, Format, Metadata, Survey};

/// Facts about a file that it does not contain.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Its reference system, such as `EPSG:32616`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crs: Option<String>,
    /// Its file name, if the format takes its position from that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filename: Option<String>,
}

impl Declaration {
    /// The same for the file reader.
    pub(super) fn declared(&self) -> Declared<'_> {
        Declared {
            format: None,
            crs: self.crs.as_deref(),
            name: self.filename.as_deref(),
        }
    }

    /// The same with one of the names that a tile may have. Contents that were kept under another have checksums with
    /// that, so it is for new uploads only.
    pub(super) fn canonical(self) -> Self {
        let canonical = |name: String| dem::canonical_tile(&name).unwrap_or(name);
        Self {
            filename: self.filename.map(canonical),
            ..self
        }
    }

    /// Open the file at `path` with this declaration, and keep only what the file does not say itself: then equal
    /// ground has equal checksums, however it was uploaded.
    pub(super) fn open(
        self,
        format: Option<Format>,
        path: &Path,
    ) -> Result<(Dataset, Self), DemError> {
        let dataset = dem::open(
            path,
            Declared {
                format,
                ..self.declared()
            },
        )?;
        let mut needed = self;
        if dataset.metadata().format != Format::Hgt {
            needed.filename = None;
        }
        if needed.crs.is_some() {
            let without = Declaration {
                crs: None,
                ..needed.clone()
            };
            let same = dem::open(path, without.declared())
                .is_ok_and(|other| other.metadata() == dataset.metadata());
            if same {
                needed = without;
            } else {
                needed.crs = Some(dataset.metadata().lattice.crs.to_string());
            }
        }
        Ok((dataset, needed))
    }
}

/// Computes the checksum of a dataset.
#[derive(Debug, Clone, Default)]
pub struct Identity(Sha256);

impl Identity {
    /// Hash the file at `path`.
    pub(super) fn of_file(path: &Path) -> io::Result<Self> {
        let mut identity = Self::default();
        let mut file = File::open(path)?;
        let mut buffer = vec![0; 1 << 16];
        loop {
            match file.read(&mut buffer)? {
                0 => return Ok(identity),
                length => identity.add(&buffer[..length]),
            }
        }
    }

    pub(super) fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The checksum of the file, followed by a line for each necessary declaration.
    pub(super) fn with(mut self, declaration: &Declaration) -> String {
        for (name, value) in [
            ("crs", &declaration.crs),
            ("filename", &declaration.filename),
        ] {
            if let Some(value) = value {
                self.add(format!("\n{name}={value}").as_bytes());
            }
        }
        HEXLOWER.encode(&self.0.finalize())
    }
}

/// An uploaded file whose samples have all been read and checked.
#[derive(Debug)]
pub struct Checked {
    pub(super) staged: Staged,
    pub(super) sha256: String,
    pub(super) declaration: Declaration,
    pub(super) metadata: Metadata,
    pub(super) survey: Survey,
}

impl Checked {
    /// Its checksum.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }
}
