//! What nodes share their datasets through: a place of small values under keys, and of files.
//!
//! Deliberately absent: what values and files mean. All of it blocks.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::io::{self, Read, Seek, Write};

/// A place that every node reaches, and that orders what they write.
///
/// Every method fails with an error when the place cannot be reached; what it was asked to write may then
/// have been written or not.
pub trait Shelf: Debug + Send + Sync + 'static {
    /// What has been written after the revision `after`, of each key the last, in order. What was written
    /// anywhere before the question is in the answer.
    ///
    /// # Errors
    /// See above.
    fn changes(&self, after: u64) -> io::Result<Changes>;

    /// Write `value` under `key` if the key was last written at the revision `expected`, or never with 0.
    /// The revision of this; `None` when the key was written meanwhile.
    ///
    /// # Errors
    /// See above.
    fn write(&self, key: &str, value: &str, expected: u64) -> io::Result<Option<u64>>;

    /// Take a value away, which is a write; false when the key was written meanwhile.
    ///
    /// # Errors
    /// See above.
    fn erase(&self, key: &str, expected: u64) -> io::Result<bool>;

    /// Keep a file; by what is returned it is found again. What is not whole is never found.
    ///
    /// # Errors
    /// See above, or that of reading it.
    fn put(&self, file: &mut dyn Source) -> io::Result<String>;

    /// Write a file to `to`; false when there is none. What fails midway has written some of it.
    ///
    /// # Errors
    /// See above, or that of writing it.
    fn fetch(&self, file: &str, to: &mut dyn Write) -> io::Result<bool>;

    /// Every file, those that are not whole among them.
    ///
    /// # Errors
    /// See above.
    fn files(&self) -> io::Result<BTreeSet<String>>;

    /// Remove a file, which may have gone already.
    ///
    /// # Errors
    /// See above.
    fn discard(&self, file: &str) -> io::Result<()>;
}

/// A file to be kept: read from its beginning, perhaps more than once.
pub trait Source: Read + Seek {}

impl<T: Read + Seek> Source for T {}

/// What has been written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Changes {
    /// That of the last of all writes; 0 before the first. One that is less than what was asked after is
    /// that of another place.
    pub revision: u64,
    /// In the order of their revisions.
    pub changes: Vec<Change>,
}

/// The last write of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Where.
    pub key: String,
    /// What stands there; `None` when it was taken away.
    pub value: Option<String>,
    /// When, in the order of all writes.
    pub revision: u64,
}
