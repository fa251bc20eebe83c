//! How much memory the documents take that wait for the writing thread.
//!
//! Callers of a disk that stalls give up and try again, and what they sent is still waiting. Other changes need no such
//! limit: there is one for each running plan, or they are short.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::store::StoreError;

/// Bytes that may wait at once.
const ROOM: usize = 256 << 20;

/// The room for documents that wait.
pub(super) struct Unwritten(Arc<Semaphore>);

impl Unwritten {
    pub(super) fn new() -> Self {
        Self(Arc::new(Semaphore::new(ROOM)))
    }

    /// The share of a document of so many bytes, until it is dropped. One always fits.
    ///
    /// # Errors
    /// [`StoreError::Unavailable`] when others take the room.
    pub(super) fn share(&self, bytes: usize) -> Result<OwnedSemaphorePermit, StoreError> {
        let bytes = u32::try_from(bytes.min(ROOM)).expect("the room is smaller");
        let share = self.0.clone().try_acquire_many_owned(bytes);
        share.map_err(|_| {
            StoreError::unavailable(format!(
                "{ROOM} bytes of plans are waiting to be written already"
            ))
        })
    }
}
