//! Where a scenario finds the datasets that it names. Deliberately contains no files: whoever stores them implements
//! [`Datasets`].

use std::fmt;

use super::dem::{self, DemError};

/// Longest name of a dataset, characters.
const MAX_DATASET_NAME: usize = 64;

/// Datasets by name and by content.
pub trait Datasets: fmt::Debug + Send + Sync {
    /// The dataset called `name`. With `sha256`, the one with that checksum even if the name now refers to another:
    /// an accepted job is planned over the ground it was accepted with.
    ///
    /// # Errors
    /// Why it was not found.
    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError>;
}

/// A dataset that was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Checksum of its content and of everything declared about it: 64 lower-case hexadecimal digits.
    pub sha256: String,
    /// A reader for it.
    pub dataset: dem::Dataset,
}

/// Why a dataset was not found.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// No dataset has this name.
    #[error("no dataset has this name")]
    Unknown {
        /// The names that exist, in order.
        names: Vec<String>,
    },
    /// The name now refers to other content, and the requested content is no longer kept.
    #[error("this content is no longer kept; the name now stands for {sha256}")]
    Replaced {
        /// Checksum of the present content.
        sha256: String,
    },
    /// It exists but cannot be used.
    #[error("it cannot be read: {0}")]
    Unreadable(DemError),
    /// Whether it exists cannot be determined.
    #[error("the datasets cannot be reached: {0}")]
    Unavailable(String),
}

impl From<DemError> for DatasetError {
    fn from(error: DemError) -> Self {
        if error.is_passing() {
            Self::Unavailable(error.to_string())
        } else {
            Self::Unreadable(error)
        }
    }
}

/// An empty collection.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoDatasets;

impl Datasets for NoDatasets {
    fn find(&self, _name: &str, _sha256: Option<&str>) -> Result<Found, DatasetError> {
        Err(DatasetError::Unknown { names: Vec::new() })
    }
}

/// Whether a dataset may have this name: lower-case letters, digits, and after the first character `-` and `_`.
#[must_use]
pub fn is_dataset_name(name: &str) -> bool {
    let plain = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit();
    let bytes = name.as_bytes();
    bytes.len() <= MAX_DATASET_NAME
        && bytes.first().copied().is_some_and(plain)
        && bytes.iter().all(|c| plain(*c) || [b'-', b'_'].contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain() {
        let long = "a".repeat(64);
        for name in ["jacksboro", "n36w085", "7", "a_b-c", &long] {
            assert!(is_dataset_name(name), "{name}");
        }
        for name in [
            "",
            "Jacksboro",
            "-a",
            "_a",
            "a.tif",
            "a/b",
            "..",
            "ä",
            &format!("{long}a"),
        ] {
            assert!(!is_dataset_name(name), "{name}");
        }
    }
}
