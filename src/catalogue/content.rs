//! What stands for a dataset: its bytes, and what was declared that they do not say.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use data_encoding::HEXLOWER;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::Staged;
use crate::terrain::dem::{self, Dataset, Declared, DemError, Format, Metadata, Survey};

/// What a file does not say of itself and somebody else did.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Its reference system, such as `EPSG:32616`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crs: Option<String>,
    /// Its name, where that says which place it shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filename: Option<String>,
}

impl Declaration {
    /// For the reader of files.
    pub(super) fn declared(&self) -> Declared<'_> {
        Declared {
            format: None,
            crs: self.crs.as_deref(),
            name: self.filename.as_deref(),
        }
    }

    /// Open the file at `path` so declared, and keep of the declaration only what the file does not say
    /// itself: then equal ground has equal sums, however it was uploaded.
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

/// Sums up a dataset.
#[derive(Debug, Clone, Default)]
pub struct Identity(Sha256);

impl Identity {
    /// Of the file at `path`.
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

    /// That of the file alone, or of the file and a line for each thing that had to be declared.
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

/// A file that has come, and has been read from its first to its last sample.
#[derive(Debug)]
pub struct Checked {
    pub(super) staged: Staged,
    pub(super) sha256: String,
    pub(super) declaration: Declaration,
    pub(super) metadata: Metadata,
    pub(super) survey: Survey,
}

impl Checked {
    /// What stands for it.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }
}
