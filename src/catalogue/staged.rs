//! A file on its way in: written as it comes, summed up as it is written, gone unless it is kept.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::content::{Checked, Declaration, Identity};
use super::{CatalogueError, files};
use crate::terrain::dem::Format;

/// A file on its way in.
#[derive(Debug)]
pub struct Staged {
    file: File,
    path: PathBuf,
    limit: u64,
    bytes: u64,
    identity: Identity,
    /// Why no more could be written.
    failure: Option<CatalogueError>,
}

impl Staged {
    /// In `directory`, at most `limit` bytes.
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

    /// So many bytes have come.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Why a write failed, when one did.
    pub fn failure(&mut self) -> Option<CatalogueError> {
        self.failure.take()
    }

    /// All of it has come: put it on the disk, and read it from the first to the last sample.
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
        let (dataset, declaration) = declaration.open(format, &self.path)?;
        let survey = dataset.survey()?;
        Ok(Checked {
            sha256: self.sum(&declaration),
            staged: self,
            declaration,
            metadata: dataset.metadata().clone(),
            survey,
        })
    }

    /// What stands for what has come, so declared.
    pub(super) fn sum(&self, declaration: &Declaration) -> String {
        self.identity.clone().with(declaration)
    }

    /// Where it is, unless it was kept.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// To read what has come.
    pub(super) fn reader(&self) -> io::Result<File> {
        File::open(&self.path)
    }

    /// Put it at `to`.
    pub(super) fn put(&self, to: &Path) -> io::Result<()> {
        files::put(&self.path, to)
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
        // It has another name by now when it was kept.
        let _ = fs::remove_file(&self.path);
    }
}
