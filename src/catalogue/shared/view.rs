//! A node's view of the shared names and contents: every write up to a revision, applied once.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::headers::Headers;
use crate::catalogue::Tally;
use crate::catalogue::records::{Content, Name};
use crate::catalogue::shelf::{Change, Changes};

/// The stored record of a content on the shelf.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Shelved {
    #[serde(flatten)]
    pub(super) content: Content,
    pub(super) headers: Headers,
    /// The file on the shelf that holds its bytes.
    pub(super) file: String,
    /// The mark: a node found that nothing refers to it. It is removed after a while, unless it is used.
    #[serde(default)]
    pub(super) unneeded: bool,
}

/// Names and contents up to a revision.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    pub(super) revision: u64,
    pub(super) names: BTreeMap<String, Name>,
    pub(super) contents: BTreeMap<String, Shelved>,
    /// Revision of each key's last write.
    written: HashMap<String, u64>,
    /// Keys whose values this version of the program cannot read.
    unread: BTreeSet<String>,
}

/// The key of a name.
pub(super) fn name_key(name: &str) -> String {
    format!("name.{name}")
}

/// The key of a content.
pub(super) fn content_key(sha256: &str) -> String {
    format!("content.{sha256}")
}

impl View {
    pub(super) fn tally(&self) -> Tally {
        let contents = self.contents.values();
        Tally {
            datasets: self.names.len() as u64,
            bytes: contents.map(|content| content.content.bytes).sum(),
            cached_bytes: 0,
        }
    }

    /// Apply later changes; those already known have no effect.
    pub(super) fn learn(&mut self, changes: Changes) {
        for change in changes.changes {
            if change.revision > self.written(&change.key) {
                self.take_in(change);
            }
        }
        self.revision = self.revision.max(changes.revision);
    }

    fn take_in(&mut self, change: Change) {
        let Change {
            key,
            value,
            revision,
        } = change;
        let value = value.as_deref();
        let read = if let Some(name) = key.strip_prefix("name.") {
            put(&mut self.names, name, value)
        } else if let Some(sha256) = key.strip_prefix("content.") {
            put(&mut self.contents, sha256, value)
        } else {
            value.is_none()
        };
        if read {
            self.unread.remove(&key);
        } else {
            tracing::error!(
                key,
                "a shared dataset's record cannot be read; a newer version may have written it"
            );
            self.unread.insert(key.clone());
        }
        self.written.insert(key, revision);
    }

    /// Revision of the last write of `key`; 0 if never written.
    pub(super) fn written(&self, key: &str) -> u64 {
        self.written.get(key).copied().unwrap_or(0)
    }

    /// Contents without a name.
    pub(super) fn unnamed(&self) -> BTreeSet<&String> {
        let named: BTreeSet<&String> = self.names.values().map(|name| &name.sha256).collect();
        let contents = self.contents.keys();
        contents
            .filter(|sha256| !self.has_unread() && !named.contains(sha256))
            .collect()
    }

    /// Whether some records cannot be read, so that nothing can be considered unneeded.
    pub(super) fn has_unread(&self) -> bool {
        !self.unread.is_empty()
    }

    /// Whether a content's bytes lie in `file`.
    pub(super) fn refers_to(&self, file: &str) -> bool {
        self.contents.values().any(|content| content.file == file)
    }
}

/// Store a record; `false` when it cannot be read.
fn put<T: DeserializeOwned>(
    records: &mut BTreeMap<String, T>,
    key: &str,
    value: Option<&str>,
) -> bool {
    records.remove(key);
    match value.map(serde_json::from_str).transpose() {
        Ok(record) => {
            records.extend(record.map(|record| (key.to_owned(), record)));
            true
        }
        Err(_) => false,
    }
}
