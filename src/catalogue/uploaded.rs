//! Uploads in a directory of the service: contents by checksum, and names that point at them.
//!
//! `content/SUM` is a file as received, `content/SUM.json` its declaration and what was found in it,
//! `names/NAME.json` the content of a name, and `incoming/` has incomplete files. Each is put in place atomically,
//! after what it refers to.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::content::Checked;
use super::records::{Content, Name};
use super::{CatalogueError, Entry, Kept, Naming, Room, Staged, Tally, Uploads, files};
use crate::durable;
use crate::terrain::dem;
use crate::terrain::{DatasetError, Found};

/// The directory of uploads.
#[derive(Debug)]
pub(super) struct Uploaded {
    directory: PathBuf,
    grace: Duration,
    state: Mutex<State>,
    /// Keeps other processes out.
    _lock: File,
}

#[derive(Debug, Default)]
struct State {
    names: BTreeMap<String, Name>,
    /// Records of names that cannot be read: nobody knows which contents they need.
    unread: BTreeSet<PathBuf>,
    contents: BTreeMap<String, Content>,
    /// When each content was last used.
    asked: HashMap<String, Instant>,
}

impl Uploaded {
    /// Open the directory, creating it if necessary, and remove files left incomplete by a dead process.
    pub(super) fn open(directory: &Path, grace: Duration) -> Result<Self, CatalogueError> {
        for part in ["incoming", "content", "names"] {
            let part = directory.join(part);
            durable::make_directory(&part)
                .map_err(|error| CatalogueError::unavailable("made", &part, error))?;
        }
        let lock = files::lock(directory)?;
        let uploaded = Self {
            directory: directory.to_owned(),
            grace,
            state: Mutex::default(),
            _lock: lock,
        };
        uploaded.load()?;
        Ok(uploaded)
    }

    fn load(&self) -> Result<(), CatalogueError> {
        let incoming = self.directory.join("incoming");
        for path in files::listed(&incoming)? {
            fs::remove_file(&path)
                .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
            tracing::info!(file = %path.display(), "removed an upload that was never finished");
        }
        let mut state = self.state.lock();
        for path in files::listed(&self.directory.join("content"))? {
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            let Some(sha256) = stem.filter(|_| path.extension().is_some()) else {
                continue;
            };
            if !self.content(sha256).is_file() {
                // Left by an incomplete upload or an incomplete removal.
                durable::remove(&path)
                    .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
            } else if let Some(content) = read(&path) {
                state.contents.insert(sha256.to_owned(), content);
            }
        }
        for path in files::listed(&self.directory.join("names"))? {
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            if let (Some(name), Some(record)) = (stem, read(&path)) {
                state.names.insert(name.to_owned(), record);
            } else {
                state.unread.insert(path);
            }
        }
        if !state.unread.is_empty() {
            tracing::warn!(
                "datasets without a name are kept until every name's record can be read"
            );
        }
        Ok(())
    }

    fn keep_content(
        &self,
        state: &mut State,
        file: &Checked,
        room: Room,
    ) -> Result<(), CatalogueError> {
        let path = self.content(&file.sha256);
        if state.contents.contains_key(&file.sha256) && path.is_file() {
            return Ok(());
        }
        let content = Content::of(file);
        // What was lost from the disk is counted already.
        if !state.contents.contains_key(&file.sha256) {
            room.admit(state.contents.values(), content.bytes)?;
        }
        self.write(&path.with_extension("json"), &content)?;
        file.staged
            .put(&path)
            .map_err(|error| CatalogueError::unavailable("written", &path, error))?;
        state.contents.insert(file.sha256.clone(), content);
        Ok(())
    }

    fn content(&self, sha256: &str) -> PathBuf {
        self.directory.join("content").join(sha256)
    }

    fn name(&self, name: &str) -> PathBuf {
        self.directory.join("names").join(format!("{name}.json"))
    }

    fn write(&self, path: &Path, record: &impl Serialize) -> Result<(), CatalogueError> {
        let text = serde_json::to_string(record).expect("records have text keys");
        files::write(&self.directory.join("incoming"), path, &text)
            .map_err(|error| CatalogueError::unavailable("written", path, error))
    }
}

impl Uploads for Uploaded {
    fn entries(&self) -> Result<Vec<Entry>, CatalogueError> {
        let names: Vec<String> = self.state.lock().names.keys().cloned().collect();
        let mut entries = Vec::new();
        for name in names {
            match self.entry(&name) {
                Ok(entry) => entries.push(entry),
                // It was removed meanwhile.
                Err(CatalogueError::Unknown { .. }) => {}
                Err(error) => {
                    tracing::error!(name, %error, "an uploaded dataset cannot be read any more");
                }
            }
        }
        Ok(entries)
    }

    fn tally(&self) -> Tally {
        self.state.lock().tally()
    }

    fn stage(&self, limit: u64) -> Result<Staged, CatalogueError> {
        Staged::new(&self.directory.join("incoming"), limit)
    }

    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError> {
        let (sha256, declared) = {
            let mut state = self.state.lock();
            let wanted = Name::wanted(&state.names, name, sha256)?.to_owned();
            let Some(content) = state.contents.get(&wanted) else {
                // A content is removed before its record, so one that is there has a record that cannot be read.
                let is_unread = self.content(&wanted).is_file();
                return Err(Name::missing(&state.names, name, &wanted, is_unread));
            };
            let declared = content.declared.clone();
            state.asked.insert(wanted.clone(), Instant::now());
            (wanted, declared)
        };
        let dataset = dem::open(&self.content(&sha256), declared.declared())?;
        Ok(Found { sha256, dataset })
    }

    fn entry(&self, name: &str) -> Result<Entry, CatalogueError> {
        let known = {
            let state = self.state.lock();
            let known = state.names.get(name).cloned();
            known.and_then(|record| {
                let content = state.contents.get(&record.sha256).cloned()?;
                Some((record, content))
            })
        };
        let unknown = || CatalogueError::Unknown {
            name: name.to_owned(),
        };
        let (record, content) = known.ok_or_else(unknown)?;
        let path = self.content(&record.sha256);
        let dataset = dem::open(&path, content.declared.declared()).map_err(|error| {
            // It may have been deleted and swept meanwhile.
            let is_kept = self.state.lock().contents.contains_key(&record.sha256);
            if is_kept { error.into() } else { unknown() }
        })?;
        let metadata = dataset.metadata().clone();
        Ok(record.entry(name, content.bytes, metadata, content.survey()))
    }

    fn permit(&self, naming: &Naming, room: Room) -> Result<(), CatalogueError> {
        Name::assignable(&self.state.lock().names, naming, room).map(drop)
    }

    fn keep(
        &self,
        file: &Checked,
        naming: &Naming,
        room: Room,
    ) -> Result<(Kept, Name), CatalogueError> {
        let name = naming.name.clone();
        let mut state = self.state.lock();
        let before = Name::assignable(&state.names, naming, room)?.cloned();
        self.keep_content(&mut state, file, room)?;
        let (kept, record) = Name::assigned(before.as_ref(), file, naming);
        if kept == Kept::Unchanged {
            return Ok((kept, record));
        }
        let path = self.name(&name);
        self.write(&path, &record)?;
        state.unread.remove(&path);
        state.names.insert(name, record.clone());
        if let Some(before) = before {
            // A plan over the old content may be about to name it.
            state.asked.insert(before.sha256, Instant::now());
        }
        Ok((kept, record))
    }

    fn removable(&self, naming: &Naming) -> Result<String, CatalogueError> {
        let state = self.state.lock();
        Name::removable(state.names.get(&naming.name), naming).map(str::to_owned)
    }

    fn remove(&self, naming: &Naming) -> Result<(), CatalogueError> {
        let name = &*naming.name;
        let mut state = self.state.lock();
        Name::removable(state.names.get(name), naming)?;
        let path = self.name(name);
        durable::remove(&path)
            .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
        state.names.remove(name);
        Ok(())
    }

    fn has_unnamed(&self) -> bool {
        !self.state.lock().unnamed().is_empty()
    }

    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError> {
        let mut state = self.state.lock();
        let mut removed = 0;
        for sha256 in state.unnamed() {
            let asked = state.asked.get(&sha256);
            let lately = asked.is_some_and(|asked| asked.elapsed() < self.grace);
            if lately || used.contains(&sha256) {
                continue;
            }
            let path = self.content(&sha256);
            for path in [path.clone(), path.with_extension("json")] {
                durable::remove(&path)
                    .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
            }
            state.contents.remove(&sha256);
            state.asked.remove(&sha256);
            tracing::info!(sha256, "removed a dataset that nothing refers to");
            removed += 1;
        }
        Ok(removed)
    }
}

impl State {
    fn tally(&self) -> Tally {
        Tally {
            datasets: self.names.len() as u64,
            bytes: self.contents.values().map(|content| content.bytes).sum(),
            cached_bytes: 0,
        }
    }

    /// Contents without a name; none while a record that cannot be read may name them.
    fn unnamed(&self) -> Vec<String> {
        if !self.unread.is_empty() {
            return Vec::new();
        }
        let named: BTreeSet<&String> = self.names.values().map(|name| &name.sha256).collect();
        let contents = self.contents.keys();
        contents
            .filter(|sha256| !named.contains(sha256))
            .cloned()
            .collect()
    }
}

/// A record; one that cannot be read is skipped, and left for the operator to inspect.
fn read<T: DeserializeOwned>(path: &Path) -> Option<T> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string());
    let record =
        text.and_then(|text| serde_json::from_str(&text).map_err(|error| error.to_string()));
    match record {
        Ok(record) => Some(record),
        Err(error) => {
            tracing::error!(file = %path.display(), %error, "a dataset's record cannot be read");
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;
    use crate::catalogue::{Claim, Declaration, Expected};

    /// Level ground at one height, over one degree, in place of what the name `hill` referred to; its checksum.
    fn keep(uploaded: &Uploaded, height: u32) -> String {
        let head = "ncols 2\nnrows 2\nxllcenter 7\nyllcenter 47\ncellsize 1";
        let mut staged = uploaded.stage(10_000).expect("there is room");
        writeln!(staged, "{head}\n{height} {height}\n{height} {height}").expect("it is short");
        let checked = staged
            .check(None, Declaration::default())
            .expect("it is right");
        let naming = Naming {
            name: "hill".to_owned(),
            by: Claim {
                owner: None,
                over_all: true,
            },
            now_ms: 7,
            expected: Expected::Anything,
        };
        let kept = uploaded.keep(&checked, &naming, Room::ENDLESS);
        kept.expect("it is kept");
        checked.sha256
    }

    /// The record may be damaged, or of a newer version: plans over its content wait until it can be read.
    #[test]
    fn a_content_whose_record_cannot_be_read_may_be_had_later() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let open = || Uploaded::open(directory.path(), Duration::ZERO).expect("nobody else has it");
        let uploaded = open();
        let [old, new] = [100, 50].map(|height| keep(&uploaded, height));
        drop(uploaded);
        let unavailable = |found| matches!(found, Err(DatasetError::Unavailable(_)));

        let record = |sha256: &str| directory.path().join(format!("content/{sha256}.json"));
        for (damaged, other) in [(&new, &old), (&old, &new)] {
            let record = record(damaged);
            let text = fs::read_to_string(&record).expect("it is there");
            fs::write(&record, "").expect("written");
            let uploaded = open();
            assert!(unavailable(uploaded.find("hill", Some(damaged))));
            assert!(uploaded.find("hill", Some(other)).is_ok());
            assert_eq!(unavailable(uploaded.find("hill", None)), *damaged == new);
            drop(uploaded);
            fs::write(&record, text).expect("written");
            assert!(open().find("hill", Some(damaged)).is_ok());
        }

        let uploaded = open();
        assert_eq!(uploaded.sweep(&BTreeSet::new()).expect("swept"), 1);
        let gone = uploaded.find("hill", Some(&old));
        assert!(matches!(gone, Err(DatasetError::Replaced { sha256 }) if sha256 == new));
    }
}
