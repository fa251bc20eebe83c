//! Removal of what is no longer needed: contents are marked, and removed when the mark is old enough; files of broken
//! uploads are removed when nothing refers to them for long enough.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::time::Instant;

use super::Shared;
use super::view::{Shelved, View, content_key};
use crate::catalogue::CatalogueError;

/// Files without a content may belong to uploads in progress: they are kept for this many grace periods.
const GRACES_OF_FILES: u32 = 6;

/// Searches for such files per grace period.
const LOOKS_PER_GRACE: u32 = 10;

/// Candidates for removal that this node has seen.
#[derive(Debug, Default)]
pub(super) struct Watched {
    /// Marked contents: the revision of the mark, and since when it was seen.
    contents: HashMap<String, (u64, Instant)>,
    /// Files without a content.
    files: BTreeMap<String, Instant>,
    /// When files were last searched for.
    looked: Option<Instant>,
}

impl Shared {
    /// Mark the contents that neither a name nor `used` refers to, and remove those whose mark is old enough; returns
    /// how many were removed.
    pub(super) fn retire_all(
        &self,
        used: &BTreeSet<String>,
        watched: &mut Watched,
    ) -> Result<usize, CatalogueError> {
        let view = self.view()?;
        let needless: BTreeSet<&String> = view
            .unnamed()
            .into_iter()
            .filter(|sha256| !used.contains(*sha256))
            .collect();
        watched
            .contents
            .retain(|sha256, _| needless.contains(sha256));
        let mut removed = 0;
        for sha256 in needless {
            removed += usize::from(self.retire(&view, sha256, watched)?);
        }
        Ok(removed)
    }

    /// Mark a content that nothing refers to, or remove it if its mark is old enough.
    fn retire(
        &self,
        view: &View,
        sha256: &str,
        watched: &mut Watched,
    ) -> Result<bool, CatalogueError> {
        let (key, content) = (content_key(sha256), &view.contents[sha256]);
        let mut revision = view.written(&key);
        if !content.unneeded {
            let marked = Shelved {
                unneeded: true,
                ..content.clone()
            };
            let Some(marked) = self.write(&key, &marked, revision)? else {
                return Ok(false);
            };
            revision = marked;
        }
        let seen = watched
            .contents
            .entry(sha256.to_owned())
            .or_insert_with(|| (revision, Instant::now()));
        if seen.0 != revision {
            *seen = (revision, Instant::now());
        }
        if seen.1.elapsed() < self.grace {
            return Ok(false);
        }
        watched.contents.remove(sha256);
        let removed = self.erase(&key, revision)?;
        if removed {
            self.discard(&content.file);
            tracing::info!(sha256, "removed a dataset that nothing refers to");
        }
        Ok(removed)
    }

    /// Remove the files of incomplete uploads and incomplete removals.
    pub(super) fn tidy(&self, watched: &mut Watched) -> Result<(), CatalogueError> {
        if !self.is_time_to_look(watched) {
            return Ok(());
        }
        let files = self.shelf.files().map_err(CatalogueError::shelf)?;
        let view = self.view()?;
        watched.looked = Some(Instant::now());
        let lost = |file: &String| files.contains(file) && !view.refers_to(file);
        watched.files.retain(|file, _| lost(file));
        if view.has_unread() {
            return Ok(());
        }
        for file in files.iter().filter(|file| lost(file)) {
            let since = watched.files.entry(file.clone());
            let since = since.or_insert_with(Instant::now);
            if since.elapsed() >= self.grace * GRACES_OF_FILES {
                self.shelf.discard(file).map_err(CatalogueError::shelf)?;
                tracing::info!(file, "removed a file that no dataset refers to");
            }
        }
        Ok(())
    }

    pub(super) fn is_time_to_look(&self, watched: &Watched) -> bool {
        let looked = watched.looked.map(|looked| looked.elapsed());
        looked.is_none_or(|since| since >= self.grace / LOOKS_PER_GRACE)
    }
}
