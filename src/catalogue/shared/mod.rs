//! Uploads shared by all nodes: names and contents on a shelf, files cached by their checksums.
//!
//! On the shelf, `name.NAME` says to which content a name refers, and `content.SUM` what is known about a content and
//! which file holds it. A file is put there before the content that refers to it, and a content before its name. A
//! content that nothing refers to is marked first, and removed when the mark is older than [`GRACE`](super::GRACE) by
//! the clock of the removing node. A node that needs the content meanwhile removes the mark, and a write based on an
//! outdated revision is refused. So if a removal and a use race, one of them sees the other, whatever the clocks of
//! the nodes say.

mod cache;
mod contents;
mod headers;
mod retire;
mod sharing;
mod view;

#[cfg(test)]
mod memory;
#[cfg(test)]
mod model;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use serde::Serialize;

pub use self::sharing::Sharing;

use self::cache::Cache;
use self::retire::Watched;
use self::view::{View, name_key};
use super::directories::Uploads;
use super::records::Name;
use super::{CatalogueError, Checked, Entry, Kept, Naming, Room, Shelf, Staged, Tally};
use crate::telemetry::Instruments;
use crate::terrain::dem;
use crate::terrain::{DatasetError, Found};

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

    /// The state including everything that any node had written before this call.
    fn view(&self) -> Result<Arc<View>, CatalogueError> {
        let known = self.last_view();
        let mut changes = self.changes(known.revision)?;
        let is_another = changes.revision < known.revision;
        if is_another {
            tracing::warn!("the shared datasets were replaced as a whole");
            changes = self.changes(0)?;
        }
        let mut view = self.view.lock();
        if is_another {
            *view = Arc::default();
        }
        if changes.revision != view.revision {
            Arc::make_mut(&mut view).learn(changes);
        }
        Ok(view.clone())
    }

    fn last_view(&self) -> Arc<View> {
        let view = self.view.lock();
        view.clone()
    }

    fn changes(&self, after: u64) -> Result<super::Changes, CatalogueError> {
        self.shelf.changes(after).map_err(CatalogueError::shelf)
    }

    /// Replace the record at revision `expected`; returns the new revision, or `None` if another write came first.
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

    /// The same, but removes the record.
    fn erase(&self, key: &str, expected: u64) -> Result<bool, CatalogueError> {
        let erased = self.shelf.erase(key, expected);
        erased.map_err(CatalogueError::shelf)
    }

    fn describe(view: &View, name: &str) -> Result<Entry, CatalogueError> {
        let unknown = || CatalogueError::Unknown {
            name: name.to_owned(),
        };
        let record = view.names.get(name).ok_or_else(unknown)?;
        let shelved = view.contents.get(&record.sha256).ok_or_else(unknown)?;
        let (content, metadata) = (&shelved.content, shelved.headers.metadata()?);
        let record = record.clone();
        Ok(record.entry(name, content.bytes, metadata, content.survey()))
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
        Tally {
            cached_bytes: self.cache.bytes(),
            ..self.last_view().tally()
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

    fn permit(&self, naming: &Naming, room: Room) -> Result<(), CatalogueError> {
        Name::assignable(&self.view()?.names, naming, room).map(drop)
    }

    fn keep(
        &self,
        file: &Checked,
        naming: &Naming,
        room: Room,
    ) -> Result<(Kept, Name), CatalogueError> {
        // Before sending bytes in vain.
        self.permit(naming, room)?;
        self.shelve(file, room)?;
        let key = name_key(&naming.name);
        let kept = loop {
            let view = self.view()?;
            let before = Name::assignable(&view.names, naming, room)?;
            let (kept, record) = Name::assigned(before, file, naming);
            let is_so =
                kept == Kept::Unchanged || self.write(&key, &record, view.written(&key))?.is_some();
            if is_so {
                break (kept, record);
            }
        };
        // A removal of the content that began before it had the name is either complete now or will see the name.
        self.shelve(file, Room::ENDLESS)?;
        if let Err(error) = self.cache.adopt(file) {
            tracing::warn!(%error, "an uploaded dataset is not kept on this node; it will be fetched");
        }
        Ok(kept)
    }

    fn removable(&self, naming: &Naming) -> Result<String, CatalogueError> {
        let view = self.view()?;
        Name::removable(view.names.get(&naming.name), naming).map(str::to_owned)
    }

    fn remove(&self, naming: &Naming) -> Result<(), CatalogueError> {
        let key = name_key(&naming.name);
        loop {
            let view = self.view()?;
            Name::removable(view.names.get(&naming.name), naming)?;
            if self.erase(&key, view.written(&key))? {
                return Ok(());
            }
        }
    }

    fn has_unnamed(&self) -> bool {
        let view = self.view();
        let looks = self.is_time_to_look(&self.watched.lock());
        looks || view.is_ok_and(|view| !view.unnamed().is_empty())
    }

    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError> {
        let mut watched = self.watched.lock();
        let removed = self.retire_all(used, &mut watched)?;
        self.tidy(&mut watched)?;
        drop(watched);
        let view = self.view()?;
        self.cache
            .sweep(|sha256| view.contents.contains_key(sha256))?;
        Ok(removed)
    }
}
