//! What was uploaded, in a directory of the service: contents by their sums, and names that point at
//! them.
//!
//! `content/SUM` is a file as it came, `content/SUM.json` what was declared of it and what was found in
//! it, `names/NAME.json` what a name stands for, and `incoming/` what is not whole yet. Each is put in
//! its place in one step, after what it points at.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::content::{Checked, Declaration};
use super::{CatalogueError, Claim, Entry, Expected, Kept, Naming, Staged, files};
use crate::terrain::dem::{self, Survey};
use crate::terrain::{DatasetError, Found};

/// The directory of uploads.
#[derive(Debug)]
pub(super) struct Uploaded {
    directory: PathBuf,
    grace: Duration,
    state: Mutex<State>,
    /// Keeps a second process out.
    _lock: File,
}

#[derive(Debug, Default)]
struct State {
    names: BTreeMap<String, Name>,
    contents: BTreeMap<String, Content>,
    /// When a content was last asked for.
    asked: HashMap<String, Instant>,
}

/// What a name stands for, as it lies on the disk.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Name {
    sha256: String,
    uploaded_ms: i64,
    owner: Option<String>,
}

/// What is known of a content, as it lies on the disk.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Content {
    bytes: u64,
    #[serde(default)]
    declared: Declaration,
    /// `None` when no sample holds any.
    min: Option<f64>,
    max: Option<f64>,
    no_data_share: f64,
}

impl Content {
    fn survey(&self) -> Survey {
        Survey {
            min: self.min.unwrap_or(f64::INFINITY),
            max: self.max.unwrap_or(f64::NEG_INFINITY),
            no_data_share: self.no_data_share,
        }
    }
}

impl Uploaded {
    /// Open the directory, made if need be, and remove what was on its way in when a process died.
    pub(super) fn open(directory: &Path, grace: Duration) -> Result<Self, CatalogueError> {
        for part in ["incoming", "content", "names"] {
            let part = directory.join(part);
            files::make_directory(&part)
                .map_err(|error| CatalogueError::unavailable("made", &part, error))?;
        }
        let path = directory.join("lock");
        let unusable = |error| CatalogueError::unavailable("locked", &path, error);
        let lock = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .map_err(unusable)?;
        lock.try_lock().map_err(|error| unusable(error.into()))?;
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
        for path in listed(&incoming)? {
            fs::remove_file(&path)
                .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
            tracing::info!(file = %path.display(), "removed an upload that was never finished");
        }
        let mut state = self.lock();
        for path in listed(&self.directory.join("content"))? {
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            let Some(sha256) = stem.filter(|_| path.extension().is_some()) else {
                continue;
            };
            if !self.content(sha256).is_file() {
                // Of an upload that did not come so far, or a removal that did not come farther.
                files::remove(&path)
                    .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
            } else if let Some(content) = read(&path) {
                state.contents.insert(sha256.to_owned(), content);
            }
        }
        for path in listed(&self.directory.join("names"))? {
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            if let (Some(name), Some(record)) = (stem, read(&path)) {
                state.names.insert(name.to_owned(), record);
            }
        }
        Ok(())
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.lock().names.keys().cloned().collect()
    }

    pub(super) fn stage(&self, limit: u64) -> Result<Staged, CatalogueError> {
        Staged::new(&self.directory.join("incoming"), limit)
    }

    pub(super) fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError> {
        let (sha256, declared) = {
            let mut state = self.lock();
            let named = state.names.get(name).map(|name| name.sha256.clone());
            let wanted = match (sha256, &named) {
                (Some(sha256), _) => sha256.to_owned(),
                (None, Some(named)) => named.clone(),
                (None, None) => {
                    let names = state.names.keys().cloned().collect();
                    return Err(DatasetError::Unknown { names });
                }
            };
            let Some(content) = state.contents.get(&wanted) else {
                return Err(match named {
                    Some(sha256) => DatasetError::Replaced { sha256 },
                    None => DatasetError::Unknown {
                        names: state.names.keys().cloned().collect(),
                    },
                });
            };
            let declared = content.declared.clone();
            state.asked.insert(wanted.clone(), Instant::now());
            (wanted, declared)
        };
        let dataset = dem::open(&self.content(&sha256), declared.declared())?;
        Ok(Found { sha256, dataset })
    }

    pub(super) fn entry(&self, name: &str) -> Result<Entry, CatalogueError> {
        let known = {
            let state = self.lock();
            let known = state.names.get(name).cloned();
            known.and_then(|record| {
                let content = state.contents.get(&record.sha256).cloned()?;
                Some((record, content))
            })
        };
        let Some((record, content)) = known else {
            return Err(CatalogueError::Unknown {
                name: name.to_owned(),
            });
        };
        let path = self.content(&record.sha256);
        let dataset = dem::open(&path, content.declared.declared())?;
        Ok(Entry {
            name: name.to_owned(),
            sha256: Some(record.sha256),
            bytes: content.bytes,
            metadata: dataset.metadata().clone(),
            survey: Some(content.survey()),
            uploaded_ms: Some(record.uploaded_ms),
            owner: record.owner,
        })
    }

    pub(super) fn permit(&self, naming: &Naming) -> Result<(), CatalogueError> {
        self.lock().permit(naming)
    }

    pub(super) fn keep(&self, file: &Checked, naming: &Naming) -> Result<Kept, CatalogueError> {
        let name = naming.name.clone();
        let mut state = self.lock();
        state.permit(naming)?;
        let before = state.names.get(&name).map(|before| before.sha256.clone());
        self.keep_content(&mut state, file)?;
        if before.as_ref() == Some(&file.sha256) {
            return Ok(Kept::Unchanged);
        }
        let record = Name {
            sha256: file.sha256.clone(),
            uploaded_ms: naming.now_ms,
            owner: naming.by.owner.clone(),
        };
        self.write(&self.name(&name), &record)?;
        state.names.insert(name, record);
        let now = Instant::now();
        state.asked.insert(file.sha256.clone(), now);
        Ok(match before {
            Some(before) => {
                state.asked.insert(before, now);
                Kept::Replaced
            }
            None => Kept::Created,
        })
    }

    fn keep_content(&self, state: &mut State, file: &Checked) -> Result<(), CatalogueError> {
        let path = self.content(&file.sha256);
        if state.contents.contains_key(&file.sha256) && path.is_file() {
            return Ok(());
        }
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let content = Content {
            bytes: file.staged.bytes(),
            declared: file.declaration.clone(),
            min: finite(file.survey.min),
            max: finite(file.survey.max),
            no_data_share: file.survey.no_data_share,
        };
        self.write(&path.with_extension("json"), &content)?;
        file.staged
            .put(&path)
            .map_err(|error| CatalogueError::unavailable("written", &path, error))?;
        state.contents.insert(file.sha256.clone(), content);
        Ok(())
    }

    pub(super) fn removable(&self, name: &str, by: &Claim) -> Result<String, CatalogueError> {
        self.lock().removable(name, by)
    }

    pub(super) fn remove(&self, name: &str, by: &Claim) -> Result<(), CatalogueError> {
        let mut state = self.lock();
        let sha256 = state.removable(name, by)?;
        let path = self.name(name);
        files::remove(&path)
            .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
        state.names.remove(name);
        state.asked.insert(sha256, Instant::now());
        Ok(())
    }

    pub(super) fn has_unnamed(&self) -> bool {
        !self.lock().unnamed().is_empty()
    }

    pub(super) fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError> {
        let mut state = self.lock();
        let mut removed = 0;
        for sha256 in state.unnamed() {
            let asked = state.asked.get(&sha256);
            let lately = asked.is_some_and(|asked| asked.elapsed() < self.grace);
            if lately || used.contains(&sha256) {
                continue;
            }
            let path = self.content(&sha256);
            for path in [path.clone(), path.with_extension("json")] {
                files::remove(&path)
                    .map_err(|error| CatalogueError::unavailable("removed", &path, error))?;
            }
            state.contents.remove(&sha256);
            state.asked.remove(&sha256);
            tracing::info!(sha256, "removed a dataset that nothing refers to");
            removed += 1;
        }
        Ok(removed)
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

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Whether a name may be given to another content.
    fn permit(&self, naming: &Naming) -> Result<(), CatalogueError> {
        let name = naming.name.clone();
        let before = self.names.get(&name);
        match (&naming.expected, before) {
            (Expected::Nothing, Some(_)) => return Err(CatalogueError::Exists { name }),
            (Expected::OneOf(_), None) => return Err(CatalogueError::Changed { name }),
            (Expected::OneOf(sums), Some(before))
                if !sums.iter().any(|sum| *sum == before.sha256 || sum == "*") =>
            {
                return Err(CatalogueError::Changed { name });
            }
            _ => {}
        }
        if before.is_some_and(|before| !naming.by.covers(before.owner.as_ref())) {
            return Err(CatalogueError::Owned { name });
        }
        Ok(())
    }

    /// The sum of what a name stands for that may be taken away.
    fn removable(&self, name: &str, by: &Claim) -> Result<String, CatalogueError> {
        let name = name.to_owned();
        match self.names.get(&name) {
            None => Err(CatalogueError::Unknown { name }),
            Some(record) if !by.covers(record.owner.as_ref()) => {
                Err(CatalogueError::Owned { name })
            }
            Some(record) => Ok(record.sha256.clone()),
        }
    }

    /// Contents that no name stands for.
    fn unnamed(&self) -> Vec<String> {
        let named: BTreeSet<&String> = self.names.values().map(|name| &name.sha256).collect();
        let contents = self.contents.keys();
        contents
            .filter(|sha256| !named.contains(sha256))
            .cloned()
            .collect()
    }
}

/// What lies in a directory.
fn listed(directory: &Path) -> Result<Vec<PathBuf>, CatalogueError> {
    let unreadable = |error| CatalogueError::unavailable("read", directory, error);
    let entries = fs::read_dir(directory).map_err(unreadable)?;
    entries
        .map(|entry| Ok(entry.map_err(unreadable)?.path()))
        .collect()
}

/// A record; one that cannot be read is passed over, and left for the operator to look at.
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
