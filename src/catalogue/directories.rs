//! The catalogue of a service: uploads, on this machine or on a shelf shared by all nodes, and the operator's mounted
//! files, which take precedence.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;

use super::records::Name;
use super::shared::Shared;
use super::uploaded::Uploaded;
use super::{
    Catalogue, CatalogueError, Checked, Entry, GRACE, Kept, Mounted, Naming, Room, Sharing, Staged,
    Tally,
};
use crate::terrain::{DatasetError, Datasets, Found};

/// Uploaded datasets. Methods are as in [`Catalogue`].
pub(super) trait Uploads: Debug + Send + Sync {
    fn entries(&self) -> Result<Vec<Entry>, CatalogueError>;
    fn tally(&self) -> Tally;
    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError>;
    fn entry(&self, name: &str) -> Result<Entry, CatalogueError>;
    fn stage(&self, limit: u64) -> Result<Staged, CatalogueError>;
    fn permit(&self, naming: &Naming, room: Room) -> Result<(), CatalogueError>;
    /// With the record that the name has now.
    fn keep(
        &self,
        file: &Checked,
        naming: &Naming,
        room: Room,
    ) -> Result<(Kept, Name), CatalogueError>;
    fn removable(&self, naming: &Naming) -> Result<String, CatalogueError>;
    fn remove(&self, naming: &Naming) -> Result<(), CatalogueError>;
    fn has_unnamed(&self) -> bool;
    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError>;
}

/// Uploads in one location, mounted files in another.
#[derive(Debug)]
pub struct Directories {
    location: Location,
    mounted: Option<Mounted>,
    /// Opened as soon as possible: a disk that is read-only now may become writable.
    uploaded: Mutex<Option<Arc<dyn Uploads>>>,
}

/// Where uploads are kept.
#[derive(Debug)]
enum Location {
    /// On this machine only.
    Own { directory: PathBuf, grace: Duration },
    /// On a shelf that every node can reach.
    Shared(Sharing),
}

impl Directories {
    /// Uploads in `uploads`, which is reached, and created if necessary, when it is first needed.
    #[must_use]
    pub fn new(uploads: PathBuf, mounted: Option<Mounted>) -> Self {
        Self::with_grace(uploads, mounted, GRACE)
    }

    /// The same, with a grace period other than [`GRACE`].
    #[must_use]
    pub fn with_grace(uploads: PathBuf, mounted: Option<Mounted>, grace: Duration) -> Self {
        let directory = uploads;
        Self::at(Location::Own { directory, grace }, mounted)
    }

    /// Uploads on a shelf shared with other nodes, which is reached when it is first needed. Mounted files belong to
    /// this node: plans over them can only be run by nodes that mount the same files.
    #[must_use]
    pub fn shared(sharing: Sharing, mounted: Option<Mounted>) -> Self {
        Self::at(Location::Shared(sharing), mounted)
    }

    /// Reach the uploads now, so that later callers need not wait for it.
    pub fn reach(&self) {
        if let Err(error) = self.uploaded() {
            tracing::error!(%error, "uploaded datasets cannot be reached; trying again when they are asked for");
        }
    }

    fn at(location: Location, mounted: Option<Mounted>) -> Self {
        Self {
            location,
            mounted,
            uploaded: Mutex::default(),
        }
    }

    fn uploaded(&self) -> Result<Arc<dyn Uploads>, CatalogueError> {
        let mut uploaded = self.uploaded.lock();
        if let Some(uploaded) = &*uploaded {
            return Ok(uploaded.clone());
        }
        let opened: Arc<dyn Uploads> = match &self.location {
            Location::Own { directory, grace } => Arc::new(Uploaded::open(directory, *grace)?),
            Location::Shared(sharing) => Arc::new(Shared::open(sharing)?),
        };
        *uploaded = Some(opened.clone());
        Ok(opened)
    }

    /// Mounted files cannot be changed through the catalogue.
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
            // It may have been uploaded before a file with this name was mounted.
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
        for entry in self.uploaded()?.entries()? {
            if !entries.iter().any(|mounted| mounted.name == entry.name) {
                entries.push(entry);
            }
        }
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(entries)
    }

    fn tally(&self) -> Tally {
        let uploaded = self.uploaded().map(|uploaded| uploaded.tally());
        let mounted = self.mounted.as_ref().map(Mounted::tally);
        [uploaded.ok(), mounted]
            .into_iter()
            .flatten()
            .fold(Tally::default(), Tally::plus)
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

    fn permit(&self, naming: &Naming, room: Room) -> Result<(), CatalogueError> {
        self.check_not_mounted(&naming.name)?;
        self.uploaded()?.permit(naming, room)
    }

    fn keep(
        &self,
        file: Checked,
        naming: &Naming,
        room: Room,
    ) -> Result<(Kept, Entry), CatalogueError> {
        self.check_not_mounted(&naming.name)?;
        let (kept, record) = self.uploaded()?.keep(&file, naming, room)?;
        let bytes = file.staged.bytes();
        let entry = record.entry(&naming.name, bytes, file.metadata, file.survey);
        Ok((kept, entry))
    }

    fn removable(&self, naming: &Naming) -> Result<String, CatalogueError> {
        self.check_not_mounted(&naming.name)?;
        self.uploaded()?.removable(naming)
    }

    fn remove(&self, naming: &Naming) -> Result<(), CatalogueError> {
        self.check_not_mounted(&naming.name)?;
        self.uploaded()?.remove(naming)
    }

    fn has_unnamed(&self) -> bool {
        self.uploaded().is_ok_and(|uploaded| uploaded.has_unnamed())
    }

    fn sweep(&self, used: &BTreeSet<String>) -> Result<usize, CatalogueError> {
        self.uploaded()?.sweep(used)
    }
}
