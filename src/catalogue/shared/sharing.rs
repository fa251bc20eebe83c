//! How nodes share uploads.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::catalogue::{CatalogueError, GRACE, Shelf};
use crate::telemetry::Instruments;

/// Greatest total length of files cached on a node, bytes, except for recently used ones.
const CACHE_BYTES: u64 = 8 << 30;

/// How nodes share uploads.
#[derive(Debug, Clone)]
pub struct Sharing {
    pub(super) shelf: Arc<dyn Shelf>,
    pub(super) cache: PathBuf,
    pub(super) instruments: Arc<Instruments>,
    pub(super) cache_bytes: u64,
    pub(super) grace: Duration,
}

impl Sharing {
    /// Sharing through `shelf`, with a cache directory for this process alone, created if necessary. Fetches are
    /// counted in `instruments`.
    #[must_use]
    pub fn new(shelf: Arc<dyn Shelf>, cache: PathBuf, instruments: Arc<Instruments>) -> Self {
        Self {
            shelf,
            cache,
            instruments,
            cache_bytes: CACHE_BYTES,
            grace: GRACE,
        }
    }

    /// The same, with a grace period other than [`GRACE`].
    #[must_use]
    pub fn with_grace(self, grace: Duration) -> Self {
        Self { grace, ..self }
    }

    /// The same, with copies of at most `cache_bytes`, besides those in use.
    #[must_use]
    pub fn with_cache_bytes(self, cache_bytes: u64) -> Self {
        Self {
            cache_bytes,
            ..self
        }
    }

    /// Whether nothing has ever been uploaded to the shelf.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    pub fn is_new(&self) -> Result<bool, CatalogueError> {
        let changes = self.shelf.changes(0).map_err(CatalogueError::shelf)?;
        Ok(changes.revision == 0)
    }
}
