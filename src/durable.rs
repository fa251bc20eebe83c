//! Files that outlive a power failure: readable by their owner alone, held by one process, and given their names when
//! they are complete.

use std::fs::{self, DirBuilder, File, TryLockError};
use std::io;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::Path;

/// Create a directory and its parents, accessible to the owner only.
///
/// # Errors
/// Those of the system.
pub fn make_directory(path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)
}

/// Lock the file at `path`, which is made if there is none, for this process, until the returned file is dropped.
///
/// # Errors
/// [`TryLockError::WouldBlock`] while another process holds it, and those of the system.
pub fn hold(path: &Path) -> Result<File, TryLockError> {
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(path)
        .map_err(TryLockError::Error)?;
    file.try_lock()?;
    Ok(file)
}

/// Move `from`, which has been synced to disk, to `to`, in the same file system.
///
/// # Errors
/// Those of the system.
pub fn put(from: &Path, to: &Path) -> io::Result<()> {
    fs::rename(from, to)?;
    sync_parent(to)
}

/// Remove a file, which may already be gone.
///
/// # Errors
/// Those of the system.
pub fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => sync_parent(path),
    }
}

/// What was made, named or removed in a directory survives a power failure only if the directory is synced too.
///
/// # Errors
/// Those of the system.
pub fn sync_directory(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

fn sync_parent(path: &Path) -> io::Result<()> {
    let parent = path.parent().unwrap_or(Path::new("/"));
    // That of a bare name is the directory we are in.
    let is_here = parent.as_os_str().is_empty();
    sync_directory(if is_here { Path::new(".") } else { parent })
}
