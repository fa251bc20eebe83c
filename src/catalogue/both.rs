//! The catalogue of one service on one machine: uploads in its data directory, and the operator's files
//! beside them, which count first.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::uploaded::Uploaded;
use super::{
    Catalogue, CatalogueError, Checked, Claim, Entry, GRACE, Kept, Mounted, Naming, Staged,
};
use crate::terrain::{DatasetError, Datasets, Found};

/// Uploads in one directory, mounted files in another.
#[derive(Debug)]
pub struct Directories {
    uploads: PathBuf,
    grace: Duration,
    mounted: Option<Mounted>,
    /// Opened as soon as it can be: a disk that is read-only now may not be so for ever.
    uploaded: Mutex<Option<Arc<Uploaded>>>,
}

impl Directories {
    /// Uploads in `uploads`, made if need be.
    #[must_use]
    pub fn new(uploads: PathBuf, mounted: Option<Mounted>) -> Self {
        Self::with_grace(uploads, mounted, GRACE)
    }

    /// The same, with another time than [`GRACE`].
    #[must_use]
    pub fn with_grace(uploads: PathBuf, mounted: Option<Mounted>, grace: Duration) -> Self {
        let directories = Self {
            uploads,
            grace,
            mounted,
            uploaded: Mutex::default(),
        };
        if let Err(error) = directories.uploaded() {
            tracing::error!(%error, "uploaded datasets cannot be reached; trying again when they are asked for");
        }
        directories
    }

    fn uploaded(&self) -> Result<Arc<Uploaded>, CatalogueError> {
        let mut uploaded = self.uploaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(uploaded) = &*uploaded {
            return Ok(uploaded.clone());
        }
        let opened = Arc::new(Uploaded::open(&self.uploads, self.grace)?);
        *uploaded = Some(opened.clone());
        Ok(opened)
    }

    /// What is mounted is not to be changed from here.
    fn check_not_mounted(&self, name: &str) -> Result<(), CatalogueError> {
        match &self.mounted {
            Some(mounted) if mounted.has(name)? => Err(CatalogueError::Mounted {
                name: name.to_owned(),
            }),
            _ => Ok(()),
        }
    }
}

impl Datasets for Directories {
    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError> {
        let Some(mounted) = &self.mounted else {
            return self.uploaded()?.find(name, sha256);
        };
        let of_mounted = match mounted.find(name, sha256) {
            Ok(found) => return Ok(found),
            Err(error) => error,
        };
        match of_mounted {
            DatasetError::Unknown { names: mounted } => {
                let found = self.uploaded()?.find(name, sha256);
                found.map_err(|error| match error {
                    DatasetError::Unknown { mut names } => {
                        names.extend(mounted);
                        names.sort();
                        DatasetError::Unknown { names }
                    }
                    other => other,
                })
            }
            // What was uploaded before a file of this name was mounted.
            error if sha256.is_some() => self.uploaded()?.find(name, sha256).map_err(|_| error),
            error => Err(error),
        }
    }
}

impl Catalogue for Directories {
    fn list(&self) -> Result<Vec<Entry>, CatalogueError> {
        let mut entries = match &self.mounted {
            Some(mounted) => mounted.list()?,
            None => Vec::new(),
        };
        let uploaded = self.uploaded()?;
        for name in uploaded.names() {
            if entries.iter().any(|entry| entry.name == name) {
                continue;
            }
            match uploaded.entry(&name) {
                Ok(entry) => entries.push(entry),
                // Removed since.
                Err(CatalogueError::Unknown { .. }) => {}
                Err(error) => {
                    tracing::error!(name, %error, "an uploaded dataset cannot be read any more");
                }
            }
        }
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(entries)
    }

    fn entry(&self, name: &str) -> Result<Entry, CatalogueError> {
        match &self.mounted {
            Some(mounted) if mounted.has(name)? => mounted.entry(name),
            _ => self.uploaded()?.entry(name),
        }
    }

    fn stage(&self, limit: u64) -> Result<Staged, CatalogueError> {
        self.uploaded()?.stage(limit)
    }

    fn permit(&self, naming: &Naming) -> Result<(), CatalogueError> {
        self.check_not_mounted(&naming.name)?;
        self.uploaded()?.permit(naming)
    }

    fn keep(&self, file: Checked, naming: &Naming) -> Result<Kept, CatalogueError> {
        self.check_not_mounted(&naming.name)?;
        self.uploaded()?.keep(&file, naming)
    }

    fn removable(&self, name: &str, by: &Claim) -> Result<String, CatalogueError> {
        self.check_not_mounted(name)?;
        self.uploaded()?.removable(name, by)
    }

    fn remove(&self, name: &str, by: &Claim) -> Result<(), CatalogueError> {
        self.check_not_mounted(name)?;
        self.uploaded()?.remove(name, by)
    }

    fn has_unnamed(&self) -> bool {
        self.uploaded().is_ok_and(|uploaded| uploaded.has_unnamed())
    }

    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError> {
        self.uploaded()?.sweep(used)
    }
}
