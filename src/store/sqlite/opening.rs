//! The files in the data directory: created, locked, opened, and made to survive a power failure.

use std::fs::{File, TryLockError};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use rusqlite::Connection;

use super::{BUSY_TIMEOUT, schema};
use crate::durable;
use crate::store::{StoreError, Trouble};

/// Name of the file in the data directory whose lock keeps a second process out.
const LOCK: &str = "noctule.lock";

pub(super) fn create_directory(data_dir: &Path) -> Result<(), StoreError> {
    durable::make_directory(data_dir).map_err(|error| {
        let what = format!("data directory {} cannot be made", data_dir.display());
        failed(&what, &error)
    })
}

pub(super) fn lock(data_dir: &Path) -> Result<File, StoreError> {
    let path = data_dir.join(LOCK);
    durable::hold(&path).map_err(|error| match error {
        TryLockError::WouldBlock => StoreError::InUse(data_dir.to_owned()),
        TryLockError::Error(error) => failed(&format!("lock file {}", path.display()), &error),
    })
}

pub(super) fn open_database(file: &Path) -> Result<Connection, StoreError> {
    let mut connection = Connection::open(file)?;
    connection.busy_timeout(BUSY_TIMEOUT)?;
    connection.set_prepared_statement_cache_capacity(64);
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "foreign_keys", true)?;
    // Pages of 4 KiB: the log is folded into the database at 16 MiB.
    connection.pragma_update(None, "wal_autocheckpoint", 4_096)?;
    connection.pragma_update(None, "journal_size_limit", 64 * 1_024 * 1_024)?;
    schema::prepare(&mut connection)?;
    Ok(connection)
}

pub(super) fn sync_directory(data_dir: &Path) -> Result<(), StoreError> {
    durable::sync_directory(data_dir)
        .map_err(|error| failed(&format!("data directory {}", data_dir.display()), &error))
}

/// Where the open file is: what is written to one that was moved or replaced is lost with the process.
pub(super) struct Place {
    path: PathBuf,
    /// Device and number of the file.
    file: (u64, u64),
}

impl Place {
    pub(super) fn of(path: PathBuf) -> Result<Self, StoreError> {
        let file = identity(&path).map_err(|error| failed(&path.display().to_string(), &error))?;
        Ok(Self { path, file })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file is still there.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        if identity(&self.path).is_ok_and(|file| file == self.file) {
            return Ok(());
        }
        Err(StoreError::Unavailable {
            trouble: Trouble::Moved,
            detail: format!("{} is another file now, or gone", self.path.display()),
        })
    }
}

fn identity(path: &Path) -> std::io::Result<(u64, u64)> {
    std::fs::metadata(path).map(|file| (file.dev(), file.ino()))
}

fn failed(what: &str, error: &std::io::Error) -> StoreError {
    StoreError::Unavailable {
        trouble: match error.kind() {
            std::io::ErrorKind::StorageFull => Trouble::Full,
            _ => Trouble::ReadOnly,
        },
        detail: format!("{what}: {error}"),
    }
}
