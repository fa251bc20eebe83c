//! Whether one more upload finds room.

use super::CatalogueError;
use super::records::Content;

/// What all uploads together may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// Length of their files, bytes.
    pub bytes: u64,
    /// Number of names. There may be twice as many files, since those of replaced and deleted datasets stay for a
    /// while; the smallest takes a few blocks of a disk.
    pub datasets: usize,
}

impl Room {
    /// For what must not be refused.
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
        self.admit_one(contents.len(), self.datasets.saturating_mul(2))?;
        let bytes = contents.map(|content| content.bytes).sum::<u64>();
        if bytes.saturating_add(more) > self.bytes {
            return Err(CatalogueError::Full { room: self.bytes });
        }
        Ok(())
    }

    /// Fails unless there may be one more name than these.
    pub(super) fn admit_name(self, names: usize) -> Result<(), CatalogueError> {
        self.admit_one(names, self.datasets)
    }

    fn admit_one(self, known: usize, most: usize) -> Result<(), CatalogueError> {
        if known >= most {
            return Err(CatalogueError::TooMany {
                most: self.datasets,
            });
        }
        Ok(())
    }
}
