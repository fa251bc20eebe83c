//! The interface through which nodes share datasets: a store of small values under keys, and of files.
//!
//! Deliberately absent: the meaning of values and files. All calls block.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::io::{self, Read, Seek, Write};

/// A store that every node can reach, and that orders all writes.
///
/// Every method fails if the store is unreachable; a requested write may then have happened or not.
pub trait Shelf: Debug + Send + Sync + 'static {
    /// The last write of each key after the revision `after`, in order. Includes everything that was written anywhere
    /// before the call.
    ///
    /// # Errors
    /// See above.
    fn changes(&self, after: u64) -> io::Result<Changes>;

    /// Write `value` under `key` if the key's last write has the revision `expected` (0: never written). Returns the
    /// new revision, or `None` if the key was written meanwhile.
    ///
    /// # Errors
    /// See above.
    fn write(&self, key: &str, value: &str, expected: u64) -> io::Result<Option<u64>>;

    /// Remove a value, which counts as a write; `false` if the key was written meanwhile.
    ///
    /// # Errors
    /// See above.
    fn erase(&self, key: &str, expected: u64) -> io::Result<bool>;

    /// Store a file and return its identifier. An incomplete file is never found.
    ///
    /// # Errors
    /// See above, or that of reading it.
    fn put(&self, file: &mut dyn Source) -> io::Result<String>;

    /// Write a file to `to`; `false` if it does not exist. After a failure, part of it may have been written.
    ///
    /// # Errors
    /// See above, or that of writing it.
    fn fetch(&self, file: &str, to: &mut dyn Write) -> io::Result<bool>;

    /// All files, including incomplete ones.
    ///
    /// # Errors
    /// See above.
    fn files(&self) -> io::Result<BTreeSet<String>>;

    /// Remove a file, which may already be gone.
    ///
    /// # Errors
    /// See above.
    fn discard(&self, file: &str) -> io::Result<()>;
}

/// A file to be stored: read from the beginning, possibly more than once.
pub trait Source: Read + Seek {}

impl<T: Read + Seek> Source for T {}

/// A list of writes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Changes {
    /// Revision of the last of all writes; 0 before the first. If it is less than the requested one, this is a
    /// different store.
    pub revision: u64,
    /// In the order of their revisions.
    pub changes: Vec<Change>,
}

/// The last write of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The key.
    pub key: String,
    /// Its value; `None` if it was removed.
    pub value: Option<String>,
    /// Position in the order of all writes.
    pub revision: u64,
}
