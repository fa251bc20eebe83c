//! Atomic file operations: a file is either complete or absent.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use uuid::Uuid;

use super::CatalogueError;
use crate::durable;

/// An unused name in `directory`.
pub(super) fn fresh_name(directory: &Path) -> PathBuf {
    directory.join(format!("{}.part", Uuid::now_v7()))
}

/// Write a small file at `path` atomically, by way of `incoming`.
pub(super) fn write(incoming: &Path, path: &Path, text: &str) -> io::Result<()> {
    let part = fresh_name(incoming);
    let written = File::create_new(&part)
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.sync_all()
        })
        .and_then(|()| durable::put(&part, path));
    if written.is_err() {
        let _ = fs::remove_file(&part);
    }
    written
}

/// The files in a directory.
pub(super) fn listed(directory: &Path) -> Result<Vec<PathBuf>, CatalogueError> {
    let unreadable = |error| CatalogueError::unavailable("read", directory, error);
    let entries = fs::read_dir(directory).map_err(unreadable)?;
    entries
        .map(|entry| Ok(entry.map_err(unreadable)?.path()))
        .collect()
}

/// Lock a directory for this process, until the returned file is dropped.
pub(super) fn lock(directory: &Path) -> Result<File, CatalogueError> {
    let path = directory.join("lock");
    let unusable = |error: io::Error| CatalogueError::unavailable("locked", &path, error);
    durable::hold(&path).map_err(|error| unusable(error.into()))
}
