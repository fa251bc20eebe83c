//! The datasets of a service: which there are, what they are called, where their bytes lie.
//!
//! What is uploaded is kept by its sum, and a name only points at it: another content under the same
//! name changes no ground that an accepted plan was promised. All of it blocks on files, so nobody
//! calls it from a thread that answers. Deliberately absent: what is in a file (`terrain::dem`), and
//! which plans use it, which only the store knows.

mod both;
mod content;
mod error;
mod files;
mod mounted;
mod records;
mod shared;
mod shelf;
mod shipped;
mod staged;
mod stamp;
mod uploaded;

pub use both::Directories;
pub use content::{Checked, Declaration, Identity};
pub use error::CatalogueError;
pub use mounted::Mounted;
pub use shared::Sharing;
pub use shelf::{Change, Changes, Shelf, Source};
pub use shipped::lay_down;
pub use staged::Staged;

use both::Uploads;
use std::collections::BTreeSet;
use std::time::Duration;

use crate::terrain::Datasets;
use crate::terrain::dem::{Metadata, Survey};

/// What nobody names and no plan uses is kept for so long after it was last asked for: a plan over it
/// may be about to be accepted.
pub const GRACE: Duration = Duration::from_secs(600);

/// Datasets that can be listed, added and removed.
pub trait Catalogue: Datasets {
    /// Every dataset that can be read, by name. What has not been needed yet is not known of mounted
    /// ones.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    fn list(&self) -> Result<Vec<Entry>, CatalogueError>;

    /// How many there are and how long they are, as far as that is known at once.
    fn tally(&self) -> Tally;

    /// One dataset, with all that can be known of it.
    ///
    /// # Errors
    /// [`CatalogueError::Unknown`], [`CatalogueError::Unreadable`], [`CatalogueError::Unavailable`].
    fn entry(&self, name: &str) -> Result<Entry, CatalogueError>;

    /// Room for a file of at most `limit` bytes that is about to come.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    fn stage(&self, limit: u64) -> Result<Staged, CatalogueError>;

    /// Whether a file may be kept so, as it stands.
    ///
    /// # Errors
    /// As [`Catalogue::keep`].
    fn permit(&self, naming: &Naming) -> Result<(), CatalogueError>;

    /// Keep a file that has come under a name, durably, wholly or not at all.
    ///
    /// # Errors
    /// [`CatalogueError::Mounted`], [`CatalogueError::Exists`], [`CatalogueError::Changed`],
    /// [`CatalogueError::Owned`], [`CatalogueError::Unavailable`].
    fn keep(&self, file: Checked, naming: &Naming) -> Result<Kept, CatalogueError>;

    /// The sum of what a name stands for that may be taken away.
    ///
    /// # Errors
    /// As [`Catalogue::remove`].
    fn removable(&self, naming: &Naming) -> Result<String, CatalogueError>;

    /// Take a name away. Its content stays until nothing needs it.
    ///
    /// # Errors
    /// [`CatalogueError::Unknown`], and as [`Catalogue::keep`].
    fn remove(&self, naming: &Naming) -> Result<(), CatalogueError>;

    /// Whether there is content that no name stands for, so that [`Catalogue::sweep`] may find work.
    fn has_unnamed(&self) -> bool;

    /// Remove content that no name stands for, that is not among `used` and that nobody has asked for
    /// lately; returns how many.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError>;
}

/// What is known of a dataset.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// As scenarios name it.
    pub name: String,
    /// Stands for its content; `None` of a mounted file that has not been read yet.
    pub sha256: Option<String>,
    /// Length of the file.
    pub bytes: u64,
    /// What its headers say.
    pub metadata: Metadata,
    /// What its samples say; `None` of a mounted file that has not been read yet.
    pub survey: Option<Survey>,
    /// When this content came under this name, milliseconds since 1970; `None` of a mounted file.
    pub uploaded_ms: Option<i64>,
    /// Who uploaded it; `None` where nobody has a name, and of a mounted file.
    pub owner: Option<String>,
}

impl Entry {
    /// Whether it lies in the operator's directory.
    #[must_use]
    pub fn is_mounted(&self) -> bool {
        self.uploaded_ms.is_none()
    }
}

/// Counts of datasets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Names that can be planned over.
    pub datasets: u64,
    /// Of their files, and of those that only plans still need.
    pub bytes: u64,
    /// Of copies on this node, where datasets are shared.
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

/// Who wants to change what a name stands for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Claim {
    /// Their name, where people have names.
    pub owner: Option<String>,
    /// Whether others' datasets are theirs to change.
    pub over_all: bool,
}

impl Claim {
    fn covers(&self, owner: Option<&String>) -> bool {
        self.over_all || (owner.is_some() && self.owner.as_ref() == owner)
    }
}

/// What is done to a name: it is given to a file, or taken away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Naming {
    /// The name, which must be one.
    pub name: String,
    /// By whom.
    pub by: Claim,
    /// When, milliseconds since 1970.
    pub now_ms: i64,
    /// What the name must stand for until now.
    pub expected: Expected,
}

/// What a name must stand for before it is given to another content, or to none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expected {
    /// Whatever it is.
    Anything,
    /// Nothing.
    Nothing,
    /// One of these contents.
    OneOf(Vec<String>),
    /// Nothing, or none of these contents.
    NoneOf(Vec<String>),
}

/// What came of keeping a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// The name is new.
    Created,
    /// The name stood for something else.
    Replaced,
    /// The name stood for the same content.
    Unchanged,
}
