//! The datasets of a service: which exist, their names, and where their bytes are.
//!
//! An upload is stored by its checksum, and a name only points at it: other content under the same name does not
//! change the ground of an accepted plan. All calls block on files, so they must not be made from a thread that
//! serves requests. Deliberately absent: what is in a file (`terrain::dem`), and which plans use it, which only the
//! store knows.

mod content;
mod directories;
mod error;
mod files;
mod mounted;
mod records;
mod room;
mod shared;
mod shelf;
mod shipped;
mod staged;
mod stamp;
mod uploaded;

pub use content::{Checked, Declaration, Identity};
pub use directories::Directories;
pub use error::CatalogueError;
pub use mounted::Mounted;
pub use room::Room;
pub use shared::Sharing;
pub use shelf::{Change, Changes, Shelf, Source};
pub use shipped::lay_down;
pub use staged::Staged;

use directories::Uploads;
use std::collections::BTreeSet;
use std::time::Duration;

use crate::terrain::Datasets;
use crate::terrain::dem::{Metadata, Survey};

/// How long content without a name and without a plan is kept after its last use: a plan over it may be about to be
/// accepted.
pub const GRACE: Duration = Duration::from_secs(600);

/// Datasets that can be listed, added and removed.
pub trait Catalogue: Datasets {
    /// Every readable dataset, by name. Entries of mounted files contain only what has already been needed.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    fn list(&self) -> Result<Vec<Entry>, CatalogueError>;

    /// Number and total size of the datasets. Looks at the mounted directory.
    fn tally(&self) -> Tally;

    /// One dataset, with everything that can be found out about it.
    ///
    /// # Errors
    /// [`CatalogueError::Unknown`], [`CatalogueError::Unreadable`], [`CatalogueError::Unavailable`].
    fn entry(&self, name: &str) -> Result<Entry, CatalogueError>;

    /// A place to write an incoming file of at most `limit` bytes.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    fn stage(&self, limit: u64) -> Result<Staged, CatalogueError>;

    /// Whether a file may be kept under this name at present.
    ///
    /// # Errors
    /// As [`Catalogue::keep`].
    fn permit(&self, naming: &Naming, room: Room) -> Result<(), CatalogueError>;

    /// Keep a received file under a name, durably and atomically, where all uploads together need no more than `room`
    /// with it. Uploads that end at the same moment on several nodes may exceed it. Also returns what is known about
    /// it, whatever is uploaded under the name right after.
    ///
    /// # Errors
    /// [`CatalogueError::Mounted`], [`CatalogueError::Exists`], [`CatalogueError::Absent`],
    /// [`CatalogueError::Changed`], [`CatalogueError::Owned`], [`CatalogueError::Full`], [`CatalogueError::TooMany`],
    /// [`CatalogueError::Unavailable`].
    fn keep(
        &self,
        file: Checked,
        naming: &Naming,
        room: Room,
    ) -> Result<(Kept, Entry), CatalogueError>;

    /// The checksum of the content to which a removable name refers.
    ///
    /// # Errors
    /// As [`Catalogue::remove`].
    fn removable(&self, naming: &Naming) -> Result<String, CatalogueError>;

    /// Remove a name. Its content stays until nothing needs it.
    ///
    /// # Errors
    /// [`CatalogueError::Unknown`], and as [`Catalogue::keep`].
    fn remove(&self, naming: &Naming) -> Result<(), CatalogueError>;

    /// Whether there is content without a name, so that [`Catalogue::sweep`] may have work.
    fn has_unnamed(&self) -> bool;

    /// Remove content that has no name, is not in `used` and has not been used lately; returns how many were removed.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError>;
}

/// What is known about a dataset.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The name used in scenarios.
    pub name: String,
    /// Checksum of its content; `None` for a mounted file that has not been read yet.
    pub sha256: Option<String>,
    /// Length of the file, bytes.
    pub bytes: u64,
    /// Its headers.
    pub metadata: Metadata,
    /// Summary of its samples; `None` for a mounted file that has not been read yet.
    pub survey: Option<Survey>,
    /// When this content was given this name, milliseconds since 1970; `None` for a mounted file.
    pub uploaded_ms: Option<i64>,
    /// Who uploaded it; `None` where callers have no names, and for a mounted file.
    pub owner: Option<String>,
}

impl Entry {
    /// Whether it is in the operator's directory.
    #[must_use]
    pub fn is_mounted(&self) -> bool {
        self.uploaded_ms.is_none()
    }
}

/// Counts of datasets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Names that plans can use.
    pub datasets: u64,
    /// Bytes of their files, and of those that only plans still need.
    pub bytes: u64,
    /// Bytes of copies on this node, where datasets are shared.
    pub cached_bytes: u64,
}

impl Tally {
    fn plus(self, other: Self) -> Self {
        Self {
            datasets: self.datasets + other.datasets,
            bytes: self.bytes + other.bytes,
            cached_bytes: self.cached_bytes + other.cached_bytes,
        }
    }
}

/// Who wants to change a name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Claim {
    /// Their name, where callers have names.
    pub owner: Option<String>,
    /// Whether they may change others' datasets.
    pub over_all: bool,
}

impl Claim {
    fn covers(&self, owner: Option<&String>) -> bool {
        self.over_all || (owner.is_some() && self.owner.as_ref() == owner)
    }
}

/// A change of a name: assigning it to a file, or removing it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Naming {
    /// The name, which must be valid.
    pub name: String,
    /// Who makes the change.
    pub by: Claim,
    /// Time of the change, milliseconds since 1970.
    pub now_ms: i64,
    /// What the name must refer to before.
    pub expected: Expected,
}

/// What a name must refer to before it is assigned to other content or removed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expected {
    /// Anything or nothing.
    Anything,
    /// Nothing.
    Nothing,
    /// One of these contents.
    OneOf(Vec<String>),
    /// Nothing, or none of these contents.
    NoneOf(Vec<String>),
}

/// Result of keeping a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// The name is new.
    Created,
    /// The name referred to other content.
    Replaced,
    /// The name referred to the same content.
    Unchanged,
}
