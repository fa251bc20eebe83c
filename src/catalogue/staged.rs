//! An incoming file: written and hashed as it is received, deleted unless it is kept.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::content::{Checked, Declaration, Identity};
use super::{CatalogueError, files};
use crate::durable;
use crate::terrain::dem::{DemError, Format, Lattice};

/// An incoming file.
#[derive(Debug)]
pub struct Staged {
    file: File,
    path: PathBuf,
    limit: u64,
    bytes: u64,
    identity: Identity,
    /// Why writing failed.
    failure: Option<CatalogueError>,
}

impl Staged {
    /// A new file in `directory`, of at most `limit` bytes.
    pub(super) fn new(directory: &Path, limit: u64) -> Result<Self, CatalogueError> {
        let path = files::fresh_name(directory);
        let file = File::create_new(&path)
            .map_err(|error| CatalogueError::unavailable("made", &path, error))?;
        Ok(Self {
            file,
            path,
            limit,
            bytes: 0,
            identity: Identity::default(),
            failure: None,
        })
    }

    /// Bytes received so far.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Why a write failed, if one did.
    pub fn failure(&mut self) -> Option<CatalogueError> {
        self.failure.take()
    }

    /// Everything has been received: sync the file to disk, and read all of its samples.
    ///
    /// # Errors
    /// [`CatalogueError::Unreadable`], [`CatalogueError::Unavailable`].
    pub fn check(
        self,
        format: Option<Format>,
        declaration: Declaration,
    ) -> Result<Checked, CatalogueError> {
        self.file
            .sync_all()
            .map_err(|error| CatalogueError::unavailable("written", &self.path, error))?;
        let (dataset, declaration) = declaration.canonical().open(format, &self.path)?;
        let survey = dataset.survey()?;
        if survey.is_empty() {
            // It would be listed, and every plan over it refused.
            let Lattice { columns, rows, .. } = dataset.metadata().lattice;
            return Err(DemError::Empty { columns, rows }.into());
        }
        Ok(Checked {
            sha256: self.sum(&declaration),
            staged: self,
            declaration,
            metadata: dataset.metadata().clone(),
            survey,
        })
    }

    /// The checksum of the received bytes with this declaration.
    pub(super) fn sum(&self, declaration: &Declaration) -> String {
        self.identity.clone().with(declaration)
    }

    /// Path of the file, unless it was kept.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// A reader of the received bytes.
    pub(super) fn reader(&self) -> io::Result<File> {
        File::open(&self.path)
    }

    /// Move the file to `to`.
    pub(super) fn put(&self, to: &Path) -> io::Result<()> {
        durable::put(&self.path, to)
    }
}

impl Write for Staged {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let limit = self.limit;
        if self.bytes.saturating_add(bytes.len() as u64) > limit {
            self.failure = Some(CatalogueError::TooLarge { limit });
            return Err(io::Error::other("too many bytes"));
        }
        if let Err(error) = self.file.write_all(bytes) {
            let kind = error.kind();
            self.failure = Some(CatalogueError::unavailable("written", &self.path, error));
            return Err(kind.into());
        }
        self.identity.add(bytes);
        self.bytes += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // If it was kept, it has another name now.
        let _ = fs::remove_file(&self.path);
    }
}
