//! Why a catalogue does not do what it is asked.

use std::io;
use std::path::Path;

use crate::terrain::DatasetError;
use crate::terrain::dem::DemError;

/// Why a catalogue does not do what it is asked.
#[derive(Debug, thiserror::Error)]
pub enum CatalogueError {
    /// No dataset is called so.
    #[error("no dataset is called {name:?}")]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// The operator's directory has a file of this name, which nobody can change from here.
    #[error("{name} is a mounted file of the service")]
    Mounted {
        /// The name.
        name: String,
    },
    /// The name was to be new.
    #[error("{name} exists")]
    Exists {
        /// The name.
        name: String,
    },
    /// The name was to stand for something.
    #[error("no dataset is called {name:?}, and one was expected")]
    Absent {
        /// The name.
        name: String,
    },
    /// The name stands for another content than was expected.
    #[error("{name} stands for another content than expected")]
    Changed {
        /// The name.
        name: String,
    },
    /// Somebody else uploaded it.
    #[error("{name} was uploaded by somebody else")]
    Owned {
        /// The name.
        name: String,
    },
    /// The file is there and cannot be used.
    #[error(transparent)]
    Unreadable(#[from] DemError),
    /// More bytes came than a file may have.
    #[error("the file is longer than {limit} bytes")]
    TooLarge {
        /// As many as it may have.
        limit: u64,
    },
    /// The files cannot be read or written now.
    #[error("{what}: {error}")]
    Unavailable {
        /// What was tried.
        what: String,
        /// Why it failed.
        error: io::Error,
    },
}

impl CatalogueError {
    pub(super) fn unavailable(what: &str, path: &Path, error: io::Error) -> Self {
        Self::Unavailable {
            what: format!("{} cannot be {what}", path.display()),
            error,
        }
    }

    /// For a reason that no system call gave.
    pub(super) fn away(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Unavailable {
            what: what.into(),
            error: io::Error::other(why.into()),
        }
    }

    /// The shelf did not do what it was asked.
    pub(super) fn shelf(error: io::Error) -> Self {
        Self::Unavailable {
            what: "the datasets that all nodes share cannot be reached".to_owned(),
            error,
        }
    }
}

impl From<CatalogueError> for DatasetError {
    fn from(error: CatalogueError) -> Self {
        match error {
            CatalogueError::Unreadable(error) => Self::Unreadable(error),
            other => Self::Unavailable(other.to_string()),
        }
    }
}
