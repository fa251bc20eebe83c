//! Why a catalogue refuses a request or fails.

use std::io;
use std::path::Path;

use crate::terrain::DatasetError;
use crate::terrain::dem::DemError;

/// Why a catalogue refuses a request or fails.
#[derive(Debug, thiserror::Error)]
pub enum CatalogueError {
    /// No dataset has this name.
    #[error("no dataset is called {name:?}")]
    Unknown {
        /// The requested name.
        name: String,
    },
    /// The operator's directory has a file with this name, which cannot be changed through the catalogue.
    #[error("{name} is a mounted file of the service")]
    Mounted {
        /// The name.
        name: String,
    },
    /// The name was expected to be new.
    #[error("{name} exists")]
    Exists {
        /// The name.
        name: String,
    },
    /// The name was expected to exist.
    #[error("no dataset is called {name:?}, and one was expected")]
    Absent {
        /// The name.
        name: String,
    },
    /// The name refers to other content than expected.
    #[error("{name} stands for another content than expected")]
    Changed {
        /// The name.
        name: String,
    },
    /// Another user uploaded it.
    #[error("{name} was uploaded by somebody else")]
    Owned {
        /// The name.
        name: String,
    },
    /// The file exists but cannot be used.
    #[error(transparent)]
    Unreadable(DemError),
    /// All uploads together would be longer than they may be.
    #[error("with this file all uploads would have more than {room} bytes")]
    Full {
        /// The greatest sum allowed.
        room: u64,
    },
    /// There are as many uploads as there may be.
    #[error("there are as many uploads as may be, {most}")]
    TooMany {
        /// The greatest number allowed.
        most: usize,
    },
    /// More bytes were sent than a file may have.
    #[error("the file is longer than {limit} bytes")]
    TooLarge {
        /// The greatest length allowed.
        limit: u64,
    },
    /// The files cannot be read or written at present.
    #[error("{what}: {error}")]
    Unavailable {
        /// What was attempted.
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

    /// An error without a system call as its cause.
    pub(super) fn away(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Unavailable {
            what: what.into(),
            error: io::Error::other(why.into()),
        }
    }

    /// The shelf failed.
    pub(super) fn shelf(error: io::Error) -> Self {
        Self::Unavailable {
            what: "the datasets that all nodes share cannot be reached".to_owned(),
            error,
        }
    }
}

impl From<DemError> for CatalogueError {
    fn from(error: DemError) -> Self {
        let is_passing = error.is_passing();
        match error {
            DemError::Io(error) if is_passing => Self::Unavailable {
                what: "a file of elevations cannot be read".to_owned(),
                error,
            },
            error => Self::Unreadable(error),
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
