//! What all uploads together may take.

use super::CatalogueError;
use super::records::Content;

/// What all uploads together may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// Length of their files, bytes.
    pub bytes: u64,
    /// Number of names, and of files: the smallest file takes a few blocks of a disk.
    pub datasets: usize,
}

impl Room {
    /// For what is known already.
    pub(super) const ENDLESS: Self = Self {
        bytes: u64::MAX,
        datasets: usize::MAX,
    };

    /// Fails unless one more file of this length finds room beside these.
    pub(super) fn admit<'a>(
        self,
        contents: impl ExactSizeIterator<Item = &'a Content>,
        more: u64,
    ) -> Result<(), CatalogueError> {
        self.admit_one(contents.len())?;
        let bytes = contents.map(|content| content.bytes).sum::<u64>();
        if bytes.saturating_add(more) > self.bytes {
            return Err(CatalogueError::Full { room: self.bytes });
        }
        Ok(())
    }

    /// Fails unless there may be one more than so many.
    pub(super) fn admit_one(self, known: usize) -> Result<(), CatalogueError> {
        if known >= self.datasets {
            return Err(CatalogueError::TooMany {
                most: self.datasets,
            });
        }
        Ok(())
    }
}
