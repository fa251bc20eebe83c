//! Where a scenario finds the datasets that it names. Deliberately absent: files; who keeps them
//! implements [`Datasets`].

use std::fmt;

use super::dem::{self, DemError};

/// Names of datasets have at most so many characters.
const MAX_DATASET_NAME: usize = 64;

/// Datasets by name, and by what they hold.
pub trait Datasets: fmt::Debug + Send + Sync {
    /// The dataset called `name`. With `sha256`, the one with that sum, whatever the name stands for
    /// by now: what was accepted is planned over the same ground.
    ///
    /// # Errors
    /// Why there is none.
    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError>;
}

/// A dataset that was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Stands for its content and all that was declared of it: 64 hexadecimal digits in lower case.
    pub sha256: String,
    /// To read it.
    pub dataset: dem::Dataset,
}

/// Why a dataset is not found.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// No dataset is called so.
    #[error("no dataset has this name")]
    Unknown {
        /// What there is, in order.
        names: Vec<String>,
    },
    /// The name stands for another content by now, and the one that was asked for is no longer kept.
    #[error("this content is no longer kept; the name now stands for {sha256}")]
    Replaced {
        /// That of the present content.
        sha256: String,
    },
    /// It is there and cannot be used.
    #[error("it cannot be read: {0}")]
    Unreadable(#[from] DemError),
    /// Whether it is there cannot be told.
    #[error("the datasets cannot be reached: {0}")]
    Unavailable(String),
}

/// None at all.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoDatasets;

impl Datasets for NoDatasets {
    fn find(&self, _name: &str, _sha256: Option<&str>) -> Result<Found, DatasetError> {
        Err(DatasetError::Unknown { names: Vec::new() })
    }
}

/// Whether a dataset may be called so: lower-case letters, digits, and after the first of them `-` and `_`.
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
