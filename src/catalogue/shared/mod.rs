//! What was uploaded, where every node finds it: names and contents on a shelf, files cached by their sums.
//!
//! On the shelf, `name.NAME` says which content a name stands for, and `content.SUM` what is known of a
//! content and which file holds it. A file is put there before the content that refers to it, and a content
//! before the name. A content that nothing refers to is marked first, and taken away when the mark has
//! stood for [`GRACE`] by the clock of the node that takes it away; who needs it meanwhile
//! takes the mark off, and a write after the last one that the other side saw is refused. So of a removal
//! and a use that race, one sees the other, whatever the clocks of the nodes say.

mod cache;
mod headers;
mod retire;
mod view;

#[cfg(test)]
mod memory;
#[cfg(test)]
mod model;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use serde::Serialize;

use self::cache::Cache;
use self::headers::Headers;
use self::retire::Watched;
use self::view::{Shelved, View, content_key, name_key};
use super::both::Uploads;
use super::records::{Content, Name};
use super::{CatalogueError, Checked, Claim, Entry, GRACE, Kept, Naming, Shelf, Staged, Tally};
use crate::telemetry::Instruments;
use crate::terrain::dem;
use crate::terrain::{DatasetError, Found};

/// A file that was put a moment ago may not have come to every server.
const TRIES: u32 = 4;

/// Between the first two of them; twice as long each time.
const PAUSE: Duration = Duration::from_millis(50);

/// Files kept on a node, bytes, unless they are asked for all the time.
const CACHE_BYTES: u64 = 8 << 30;

/// How nodes share what is uploaded.
#[derive(Debug, Clone)]
pub struct Sharing {
    shelf: Arc<dyn Shelf>,
    cache: PathBuf,
    instruments: Arc<Instruments>,
    cache_bytes: u64,
    grace: Duration,
}

impl Sharing {
    /// On `shelf`, with a directory of this process alone for copies, made if need be. Fetches are counted
    /// in `instruments`.
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

    /// With another time than [`GRACE`].
    #[must_use]
    pub fn with_grace(self, grace: Duration) -> Self {
        Self { grace, ..self }
    }

    /// With copies of at most so many bytes, besides those in use.
    #[must_use]
    pub fn with_cache_bytes(self, cache_bytes: u64) -> Self {
        Self {
            cache_bytes,
            ..self
        }
    }

    /// Whether nothing has ever been uploaded there.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`].
    pub fn is_new(&self) -> Result<bool, CatalogueError> {
        let changes = self.shelf.changes(0).map_err(CatalogueError::shelf)?;
        Ok(changes.revision == 0)
    }
}

/// Uploads on a shelf.
#[derive(Debug)]
pub(super) struct Shared {
    shelf: Arc<dyn Shelf>,
    cache: Cache,
    instruments: Arc<Instruments>,
    grace: Duration,
    view: Mutex<Arc<View>>,
    watched: Mutex<Watched>,
}

impl Shared {
    pub(super) fn open(sharing: &Sharing) -> Result<Self, CatalogueError> {
        let cache = Cache::open(&sharing.cache, sharing.cache_bytes, sharing.grace)?;
        Ok(Self {
            shelf: sharing.shelf.clone(),
            cache,
            instruments: sharing.instruments.clone(),
            grace: sharing.grace,
            view: Mutex::default(),
            watched: Mutex::default(),
        })
    }

    /// All that any node had written when this was called.
    fn view(&self) -> Result<Arc<View>, CatalogueError> {
        let known = self.last_view();
        let mut changes = self.changes(known.revision)?;
        let is_another = changes.revision < known.revision;
        if is_another {
            tracing::warn!("the shared datasets were replaced as a whole");
            changes = self.changes(0)?;
        }
        let mut view = self.view.lock().unwrap_or_else(PoisonError::into_inner);
        if is_another {
            *view = Arc::default();
        }
        if changes.revision != view.revision {
            Arc::make_mut(&mut view).learn(changes);
        }
        Ok(view.clone())
    }

    fn last_view(&self) -> Arc<View> {
        let view = self.view.lock().unwrap_or_else(PoisonError::into_inner);
        view.clone()
    }

    fn changes(&self, after: u64) -> Result<super::Changes, CatalogueError> {
        self.shelf.changes(after).map_err(CatalogueError::shelf)
    }

    /// Write a record over the one of the revision `expected`; the new revision, or `None` when somebody
    /// else was faster.
    fn write(
        &self,
        key: &str,
        record: &impl Serialize,
        expected: u64,
    ) -> Result<Option<u64>, CatalogueError> {
        let record = serde_json::to_string(record).expect("records have text keys");
        let written = self.shelf.write(key, &record, expected);
        written.map_err(CatalogueError::shelf)
    }

    /// The same, with nothing.
    fn erase(&self, key: &str, expected: u64) -> Result<bool, CatalogueError> {
        let erased = self.shelf.erase(key, expected);
        erased.map_err(CatalogueError::shelf)
    }

    /// Take the mark off a content that is needed; false when it has gone or changed meanwhile.
    fn need(&self, view: &View, sha256: &str) -> Result<bool, CatalogueError> {
        let Some(content) = view.contents.get(sha256) else {
            return Ok(false);
        };
        if !content.unneeded {
            return Ok(true);
        }
        let needed = Shelved {
            unneeded: false,
            ..content.clone()
        };
        let key = content_key(sha256);
        let written = self.write(&key, &needed, view.written(&key))?;
        Ok(written.is_some())
    }

    /// Have a content on the shelf that is not about to go.
    fn shelve(&self, file: &Checked) -> Result<(), CatalogueError> {
        let sha256 = &file.sha256;
        loop {
            let view = self.view()?;
            if self.need(&view, sha256)? {
                return Ok(());
            }
            if view.contents.contains_key(sha256) {
                continue;
            }
            let mut bytes = file
                .staged
                .reader()
                .map_err(|error| CatalogueError::unavailable("read", file.staged.path(), error))?;
            let put = self.shelf.put(&mut bytes).map_err(CatalogueError::shelf)?;
            let content = Shelved {
                content: Content::of(file),
                headers: Headers::of(&file.metadata),
                file: put.clone(),
                unneeded: false,
            };
            // When this fails it may have been written all the same: the file stays until that is seen.
            let key = content_key(sha256);
            let written = self.write(&key, &content, view.written(&key))?;
            if written.is_some() {
                return Ok(());
            }
            self.discard(&put);
        }
    }

    /// Remove a file, or leave that to a sweep.
    fn discard(&self, file: &str) {
        if let Err(error) = self.shelf.discard(file) {
            tracing::warn!(file, %error, "a file that nothing refers to is left for a later sweep");
        }
    }

    /// The content that is meant, with no mark on it.
    fn meant(&self, name: &str, sha256: Option<&str>) -> Result<(String, Shelved), DatasetError> {
        loop {
            let view = match self.view() {
                Ok(view) => view,
                // What has a sum never changes: a copy is as good as the original.
                Err(away) => return self.copied(sha256).ok_or_else(|| away.into()),
            };
            let unknown = || DatasetError::Unknown {
                names: view.names.keys().cloned().collect(),
            };
            let named = view.names.get(name).map(|name| &name.sha256);
            let wanted = match (sha256, named) {
                (Some(sha256), _) => sha256,
                (None, Some(named)) => named,
                (None, None) => return Err(unknown()),
            };
            let Some(content) = view.contents.get(wanted) else {
                return Err(match named {
                    Some(named) if named == wanted || view.has_unread() => {
                        let why = format!("nothing is known of the content {wanted}");
                        DatasetError::Unavailable(why)
                    }
                    Some(named) => DatasetError::Replaced {
                        sha256: named.clone(),
                    },
                    None => unknown(),
                });
            };
            if self.need(&view, wanted)? {
                return Ok((wanted.to_owned(), content.clone()));
            }
        }
    }

    /// What was known of a content whose bytes are on this node.
    fn copied(&self, sha256: Option<&str>) -> Option<(String, Shelved)> {
        let (sha256, view) = (sha256?, self.last_view());
        let content = view.contents.get(sha256)?;
        let path = self.cache.find(sha256, &content.content.declared);
        path.ok()??;
        Some((sha256.to_owned(), content.clone()))
    }

    /// Where the bytes of a content lie on this node.
    fn fetched(&self, sha256: &str, content: &Shelved) -> Result<PathBuf, CatalogueError> {
        let Content {
            bytes, declared, ..
        } = &content.content;
        let mut tries = 0;
        loop {
            let path = self
                .cache
                .find_or_fetch(sha256, declared, *bytes, |staged| {
                    let fetched = self.fetch(&content.file, staged);
                    let metrics = &self.instruments.metrics;
                    metrics.terrain_fetched(fetched.is_ok(), staged.bytes());
                    fetched
                });
            tries += 1;
            match path {
                Err(error) if tries < TRIES => {
                    tracing::debug!(sha256, %error, "a dataset could not be fetched; trying again");
                    thread::sleep(PAUSE * (1 << tries));
                }
                path => return path,
            }
        }
    }

    fn fetch(&self, file: &str, to: &mut Staged) -> Result<(), CatalogueError> {
        match self.shelf.fetch(file, to) {
            Ok(true) => Ok(()),
            Ok(false) => Err(CatalogueError::away(
                "the datasets that all nodes share cannot be reached",
                format!("the file {file} is not there"),
            )),
            Err(error) => Err(to.failure().unwrap_or_else(|| CatalogueError::shelf(error))),
        }
    }

    fn describe(view: &View, name: &str) -> Result<Entry, CatalogueError> {
        let unknown = || CatalogueError::Unknown {
            name: name.to_owned(),
        };
        let record = view.names.get(name).ok_or_else(unknown)?;
        let shelved = view.contents.get(&record.sha256).ok_or_else(unknown)?;
        Ok(Entry {
            name: name.to_owned(),
            sha256: Some(record.sha256.clone()),
            bytes: shelved.content.bytes,
            metadata: shelved.headers.metadata()?,
            survey: Some(shelved.content.survey()),
            uploaded_ms: Some(record.uploaded_ms),
            owner: record.owner.clone(),
        })
    }

    fn watched(&self) -> MutexGuard<'_, Watched> {
        self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Uploads for Shared {
    fn entries(&self) -> Result<Vec<Entry>, CatalogueError> {
        let view = self.view()?;
        let mut entries = Vec::new();
        for name in view.names.keys() {
            match Self::describe(&view, name) {
                Ok(entry) => entries.push(entry),
                Err(error) => tracing::error!(name, %error, "a shared dataset cannot be shown"),
            }
        }
        Ok(entries)
    }

    fn tally(&self) -> Tally {
        let view = self.last_view();
        let contents = view.contents.values();
        Tally {
            datasets: view.names.len() as u64,
            bytes: contents.map(|content| content.content.bytes).sum(),
            cached_bytes: self.cache.bytes(),
        }
    }

    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError> {
        let (sha256, content) = self.meant(name, sha256)?;
        let path = self.fetched(&sha256, &content)?;
        let dataset = dem::open(&path, content.content.declared.declared())?;
        Ok(Found { sha256, dataset })
    }

    fn entry(&self, name: &str) -> Result<Entry, CatalogueError> {
        Self::describe(&*self.view()?, name)
    }

    fn stage(&self, limit: u64) -> Result<Staged, CatalogueError> {
        self.cache.stage(limit)
    }

    fn permit(&self, naming: &Naming) -> Result<(), CatalogueError> {
        Name::permit(self.view()?.names.get(&naming.name), naming)
    }

    fn keep(&self, file: &Checked, naming: &Naming) -> Result<Kept, CatalogueError> {
        // Before bytes are sent for nothing.
        self.permit(naming)?;
        self.shelve(file)?;
        let key = name_key(&naming.name);
        let kept = loop {
            let view = self.view()?;
            let before = view.names.get(&naming.name);
            Name::permit(before, naming)?;
            let kept = Name::kept(before, file);
            let record = Name::new(file, naming);
            let is_so =
                kept == Kept::Unchanged || self.write(&key, &record, view.written(&key))?.is_some();
            if is_so {
                break kept;
            }
        };
        // Who was taking the content away before it had the name has done so by now, or sees the name.
        self.shelve(file)?;
        if let Err(error) = self.cache.adopt(file) {
            tracing::warn!(%error, "an uploaded dataset is not kept on this node; it will be fetched");
        }
        Ok(kept)
    }

    fn removable(&self, name: &str, by: &Claim) -> Result<String, CatalogueError> {
        let view = self.view()?;
        Name::removable(view.names.get(name), name, by).map(str::to_owned)
    }

    fn remove(&self, name: &str, by: &Claim) -> Result<(), CatalogueError> {
        loop {
            let view = self.view()?;
            Name::removable(view.names.get(name), name, by)?;
            let key = name_key(name);
            if self.erase(&key, view.written(&key))? {
                return Ok(());
            }
        }
    }

    fn has_unnamed(&self) -> bool {
        let view = self.view();
        let looks = self.is_time_to_look(&self.watched());
        looks || view.is_ok_and(|view| !view.unnamed().is_empty())
    }

    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError> {
        let mut watched = self.watched();
        let removed = self.retire_all(used, &mut watched)?;
        self.tidy(&mut watched)?;
        drop(watched);
        let view = self.view()?;
        self.cache
            .sweep(|sha256| view.contents.contains_key(sha256))?;
        Ok(removed)
    }
}
