//! The operator's own files: a directory that is only read. Scenarios refer to a file by its name without the
//! extension, in lower case.

use std::collections::btree_map;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io;
use std::path::{Path, PathBuf};

use parking_lot::Mutex;

use super::content::{Declaration, Identity};
use super::stamp::Stamp;
use super::{CatalogueError, Entry, Tally, files};
use crate::terrain::dem::{Dataset, DemError, Survey};
use crate::terrain::{DatasetError, Datasets, Found, is_dataset_name};

/// Extensions of dataset files, in lower case.
const EXTENSIONS: [&str; 4] = ["tif", "tiff", "asc", "hgt"];

/// A directory of datasets that is only read.
#[derive(Debug)]
pub struct Mounted {
    directory: PathBuf,
    /// Cached facts, valid while the files are unchanged.
    known: Mutex<Known>,
}

#[derive(Debug, Default)]
struct Known {
    files: HashMap<PathBuf, Look>,
    /// Files for which a warning has been logged.
    passed_over: BTreeSet<PathBuf>,
}

/// What is known about a file while its stamp is unchanged.
#[derive(Debug, Clone)]
struct Look {
    stamp: Stamp,
    sha256: String,
    survey: Option<Survey>,
}

/// The name of the dataset in a file: the file's own in lower case, without the extension. Tiles of elevations are named
/// after their place, and what they are follows after a dot, as in `N36W085.SRTMGL3.hgt`.
fn dataset_name(path: &Path) -> String {
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    let stem = stem.unwrap_or_default().to_ascii_lowercase();
    let is_tile = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("hgt"));
    match stem.split_once('.') {
        Some((place, _)) if is_tile => place.to_owned(),
        _ => stem,
    }
}

impl Mounted {
    /// The files of `directory`, which is listed again for every request.
    ///
    /// # Errors
    /// [`CatalogueError::Unavailable`] when it cannot be read.
    pub fn open(directory: &Path) -> Result<Self, CatalogueError> {
        let mounted = Self {
            directory: directory.to_owned(),
            known: Mutex::default(),
        };
        mounted.files()?;
        Ok(mounted)
    }

    /// Whether a file has this name.
    pub(super) fn has(&self, name: &str) -> Result<bool, CatalogueError> {
        Ok(self.files()?.contains_key(name))
    }

    /// The readable files.
    pub(super) fn list(&self) -> Result<Vec<Entry>, CatalogueError> {
        let mut entries = Vec::new();
        for (name, path) in self.files()? {
            match self.describe(&name, &path, false) {
                Ok(entry) => entries.push(entry),
                Err(error) => self.pass_over(&path, &error.to_string()),
            }
        }
        Ok(entries)
    }

    /// Number and total length of all files, including unreadable ones.
    pub(super) fn tally(&self) -> Tally {
        let files = self.files().unwrap_or_default();
        let lengths = files.values().filter_map(|path| Stamp::of(path).ok());
        Tally {
            datasets: files.len() as u64,
            bytes: lengths.map(|stamp| stamp.bytes).sum(),
            cached_bytes: 0,
        }
    }

    pub(super) fn entry(&self, name: &str) -> Result<Entry, CatalogueError> {
        match self.files()?.get(name) {
            Some(path) => self.describe(name, path, true),
            None => Err(CatalogueError::Unknown {
                name: name.to_owned(),
            }),
        }
    }

    /// Files by name; the first of several with the same name.
    fn files(&self) -> Result<BTreeMap<String, PathBuf>, CatalogueError> {
        let mut paths = files::listed(&self.directory)?;
        paths.sort();
        let mut files = BTreeMap::new();
        for path in paths {
            let extension = path.extension().and_then(|extension| extension.to_str());
            let counts = extension.is_some_and(|extension| {
                EXTENSIONS.contains(&extension.to_ascii_lowercase().as_str())
            });
            if !counts || !path.is_file() {
                continue;
            }
            let name = dataset_name(&path);
            if is_dataset_name(&name) {
                match files.entry(name) {
                    btree_map::Entry::Vacant(place) => {
                        place.insert(path);
                    }
                    btree_map::Entry::Occupied(_) => {
                        self.pass_over(&path, "another file has the same name");
                    }
                }
            } else {
                self.pass_over(
                    &path,
                    "a dataset's name has letters, digits, and after the first of them - and _: rename the file",
                );
            }
        }
        Ok(files)
    }

    /// Log once that a file is not used.
    fn pass_over(&self, path: &Path, why: &str) {
        if self.known.lock().passed_over.insert(path.to_owned()) {
            tracing::warn!(file = %path.display(), why, "a mounted file is not used");
        }
    }

    fn open_file(path: &Path) -> Result<(Dataset, Declaration), DemError> {
        let filename = path.file_name().and_then(|name| name.to_str());
        let declaration = Declaration {
            crs: None,
            filename: filename.map(str::to_owned),
        };
        declaration.open(None, path)
    }

    fn describe(&self, name: &str, path: &Path, wholly: bool) -> Result<Entry, CatalogueError> {
        let (dataset, declaration) = Self::open_file(path)?;
        let look = if wholly {
            let mut look = self.look(path, &declaration)?;
            if look.survey.is_none() {
                look.survey = Some(dataset.survey()?);
                self.remember(path, &look);
            }
            Some(look)
        } else {
            self.remembered(path)?
        };
        Ok(Entry {
            name: name.to_owned(),
            sha256: look.as_ref().map(|look| look.sha256.clone()),
            bytes: Stamp::of(path).map_err(DemError::from)?.bytes,
            metadata: dataset.metadata().clone(),
            survey: look.and_then(|look| look.survey),
            uploaded_ms: None,
            owner: None,
        })
    }

    /// What is known about the file in its present state.
    fn remembered(&self, path: &Path) -> Result<Option<Look>, DemError> {
        let stamp = Stamp::of(path)?;
        let known = self.known.lock().files.get(path).cloned();
        Ok(known.filter(|look| look.stamp == stamp))
    }

    /// The same, found out if necessary.
    fn look(&self, path: &Path, declaration: &Declaration) -> Result<Look, DemError> {
        // A file that is being written is read again until it stays unchanged, a few times at most.
        for _ in 0..3 {
            if let Some(look) = self.remembered(path)? {
                return Ok(look);
            }
            let stamp = Stamp::of(path)?;
            let look = Look {
                stamp,
                sha256: Identity::of_file(path)?.with(declaration),
                survey: None,
            };
            self.remember(path, &look);
        }
        Err(io::Error::other("the file changes while it is read").into())
    }

    fn remember(&self, path: &Path, look: &Look) {
        self.known
            .lock()
            .files
            .insert(path.to_owned(), look.clone());
    }
}

impl Datasets for Mounted {
    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError> {
        let mut files = self.files()?;
        let Some(path) = files.remove(name) else {
            return Err(DatasetError::Unknown {
                names: files.into_keys().collect(),
            });
        };
        let (dataset, declaration) = Self::open_file(&path)?;
        let found = self.look(&path, &declaration)?.sha256;
        if sha256.is_some_and(|sha256| sha256 != found) {
            return Err(DatasetError::Replaced { sha256: found });
        }
        Ok(Found {
            sha256: found,
            dataset,
        })
    }
}
