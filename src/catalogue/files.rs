//! Atomic file operations: a file is either complete or absent.

use std::fs::{self, DirBuilder, File};
use std::io::{self, Write as _};
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

use uuid::Uuid;

use super::CatalogueError;

/// Create a directory and its parents, accessible to the owner only.
pub(super) fn make_directory(path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)
}

/// An unused name in `directory`.
pub(super) fn fresh_name(directory: &Path) -> PathBuf {
    directory.join(format!("{}.part", Uuid::now_v7()))
}

/// Move `from`, which has been synced to disk, to `to`, durably.
pub(super) fn put(from: &Path, to: &Path) -> io::Result<()> {
    fs::rename(from, to)?;
    sync_parent(to)
}

/// Write a small file at `path` atomically, by way of `incoming`.
pub(super) fn write(incoming: &Path, path: &Path, text: &str) -> io::Result<()> {
    let part = fresh_name(incoming);
    let written = File::create_new(&part)
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.sync_all()
        })
        .and_then(|()| put(&part, path));
    if written.is_err() {
        let _ = fs::remove_file(&part);
    }
    written
}

/// Remove a file, which may already be gone, durably.
pub(super) fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => sync_parent(path),
    }
}

/// A change survives a power failure only if its directory is synced too.
fn sync_parent(path: &Path) -> io::Result<()> {
    if let Some(parent) = path.parent() {
        File::open(parent)?.sync_all()?;
    }
    Ok(())
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
    let unusable = |error| CatalogueError::unavailable("locked", &path, error);
    let lock = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .map_err(unusable)?;
    lock.try_lock().map_err(|error| unusable(error.into()))?;
    Ok(lock)
}
