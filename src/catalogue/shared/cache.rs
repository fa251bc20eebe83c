//! Copies of the shelf's files on the node's own disk, by checksum. A copy is trusted only if its checksum was
//! verified since the process started and the file last changed.

use std::array;
use std::collections::HashMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};

use crate::catalogue::content::{Checked, Declaration, Identity};
use crate::catalogue::stamp::Stamp;
use crate::catalogue::{CatalogueError, Staged, files};
use crate::durable;

/// Files that are fetched or hashed concurrently.
const LANES: usize = 16;

/// Most nodes on one machine that may share a data directory.
const MOST_NODES: usize = 64;

/// The directory of files.
#[derive(Debug)]
pub(super) struct Cache {
    directory: PathBuf,
    /// Greatest total length of the files, bytes; recently used ones are kept even beyond.
    limit: u64,
    /// Files used within this time are kept: they are being read, or soon will be.
    grace: Duration,
    files: Mutex<HashMap<String, Held>>,
    /// Locks by checksum, so that a file is fetched only once at a time.
    lanes: [Mutex<()>; LANES],
    /// Keeps other processes out.
    _lock: File,
}

/// A file in the cache.
#[derive(Debug, Clone, Copy)]
struct Held {
    bytes: u64,
    /// Its stamp when its checksum was verified.
    stamp: Option<Stamp>,
    asked: Option<Instant>,
}

impl Cache {
    /// Open the directory, creating it if necessary, and remove files left incomplete by a dead process. If another
    /// node has locked it, open one beside it.
    pub(super) fn open(
        directory: &Path,
        limit: u64,
        grace: Duration,
    ) -> Result<Self, CatalogueError> {
        let beside = (2..=MOST_NODES).map(|node| directory.with_extension(node.to_string()));
        let mut taken = Self::open_own(directory, limit, grace);
        for directory in beside {
            match &taken {
                Err(CatalogueError::Unavailable { error, .. })
                    if error.kind() == io::ErrorKind::WouldBlock => {}
                _ => break,
            }
            taken = Self::open_own(&directory, limit, grace);
        }
        taken
    }

    fn open_own(directory: &Path, limit: u64, grace: Duration) -> Result<Self, CatalogueError> {
        for part in ["incoming", "content"] {
            let part = directory.join(part);
            durable::make_directory(&part)
                .map_err(|error| CatalogueError::unavailable("made", &part, error))?;
        }
        let lock = files::lock(directory)?;
        for path in files::listed(&directory.join("incoming"))? {
            remove(&path)?;
        }
        let mut found = HashMap::new();
        for path in files::listed(&directory.join("content"))? {
            let name = path.file_name().and_then(|name| name.to_str());
            let (Some(sha256), Ok(stamp)) = (name, Stamp::of(&path)) else {
                continue;
            };
            let held = Held {
                bytes: stamp.bytes,
                stamp: None,
                asked: None,
            };
            found.insert(sha256.to_owned(), held);
        }
        Ok(Self {
            directory: directory.to_owned(),
            limit,
            grace,
            files: Mutex::new(found),
            lanes: array::from_fn(|_| Mutex::default()),
            _lock: lock,
        })
    }

    pub(super) fn stage(&self, limit: u64) -> Result<Staged, CatalogueError> {
        Staged::new(&self.directory.join("incoming"), limit)
    }

    /// Total length of all files, bytes.
    pub(super) fn bytes(&self) -> u64 {
        self.files.lock().values().map(|held| held.bytes).sum()
    }

    /// Path of the file with this checksum, if it is cached and intact.
    pub(super) fn find(
        &self,
        sha256: &str,
        declared: &Declaration,
    ) -> Result<Option<PathBuf>, CatalogueError> {
        let path = self.path(sha256);
        let Ok(stamp) = Stamp::of(&path) else {
            return Ok(None);
        };
        if self.is_known(sha256, stamp) {
            return Ok(Some(path));
        }
        let _lane = self.lane(sha256);
        if self.is_known(sha256, stamp) {
            return Ok(Some(path));
        }
        let sum = Identity::of_file(&path).map(|identity| identity.with(declared));
        match sum {
            Ok(sum) if sum == sha256 => {
                self.hold(sha256, stamp);
                Ok(Some(path))
            }
            wrong => {
                let error = wrong.err();
                tracing::warn!(
                    sha256,
                    ?error,
                    "a cached dataset is damaged; it is fetched again"
                );
                self.drop_file(sha256)?;
                Ok(None)
            }
        }
    }

    /// The same, or else the file that `fetch` writes.
    pub(super) fn find_or_fetch(
        &self,
        sha256: &str,
        declared: &Declaration,
        bytes: u64,
        fetch: impl FnOnce(&mut Staged) -> Result<(), CatalogueError>,
    ) -> Result<PathBuf, CatalogueError> {
        loop {
            if let Some(path) = self.find(sha256, declared)? {
                return Ok(path);
            }
            let lane = self.lane(sha256);
            if self.path(sha256).exists() {
                // Another thread has fetched it meanwhile.
                drop(lane);
                continue;
            }
            let mut staged = self.stage(bytes)?;
            fetch(&mut staged)?;
            if staged.sum(declared) != sha256 {
                return Err(CatalogueError::away(
                    format!("dataset {sha256} cannot be fetched"),
                    "what came is something else",
                ));
            }
            let path = self.take(&staged, sha256)?;
            drop(lane);
            self.make_room()?;
            return Ok(path);
        }
    }

    /// Keep a file that is already on the shelf.
    pub(super) fn adopt(&self, file: &Checked) -> Result<(), CatalogueError> {
        {
            let _lane = self.lane(&file.sha256);
            self.take(&file.staged, &file.sha256)?;
        }
        self.make_room()
    }

    fn take(&self, staged: &Staged, sha256: &str) -> Result<PathBuf, CatalogueError> {
        let path = self.path(sha256);
        staged
            .put(&path)
            .and_then(|()| Stamp::of(&path))
            .map(|stamp| self.hold(sha256, stamp))
            .map_err(|error| CatalogueError::unavailable("written", &path, error))?;
        Ok(path)
    }

    /// Remove the files that are not `needed`.
    pub(super) fn sweep(&self, needed: impl Fn(&str) -> bool) -> Result<(), CatalogueError> {
        let held: Vec<String> = self.files.lock().keys().cloned().collect();
        for sha256 in held.iter().filter(|sha256| !needed(sha256)) {
            let _lane = self.lane(sha256);
            if !self.was_asked_lately(sha256) {
                self.drop_file(sha256)?;
            }
        }
        self.make_room()
    }

    /// Remove the least recently used files until the others fit.
    fn make_room(&self) -> Result<(), CatalogueError> {
        let mut oldest: Vec<(Option<Instant>, String, u64)> = {
            let files = self.files.lock();
            let files = files.iter();
            files
                .map(|(sha256, held)| (held.asked, sha256.clone(), held.bytes))
                .collect()
        };
        oldest.sort();
        let mut bytes: u64 = oldest.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, sha256, length) in oldest {
            if bytes <= self.limit {
                break;
            }
            let _lane = self.lane(&sha256);
            if !self.was_asked_lately(&sha256) {
                self.drop_file(&sha256)?;
                bytes -= length;
            }
        }
        Ok(())
    }

    fn was_asked_lately(&self, sha256: &str) -> bool {
        let asked = self.files.lock().get(sha256).and_then(|held| held.asked);
        asked.is_some_and(|asked| asked.elapsed() < self.grace)
    }

    /// Whether the file is unchanged since its checksum was verified; also marks it as used.
    fn is_known(&self, sha256: &str, stamp: Stamp) -> bool {
        let mut files = self.files.lock();
        let held = files.get_mut(sha256);
        held.filter(|held| held.stamp == Some(stamp))
            .map(|held| held.asked = Some(Instant::now()))
            .is_some()
    }

    fn hold(&self, sha256: &str, stamp: Stamp) {
        let held = Held {
            bytes: stamp.bytes,
            stamp: Some(stamp),
            asked: Some(Instant::now()),
        };
        self.files.lock().insert(sha256.to_owned(), held);
    }

    fn drop_file(&self, sha256: &str) -> Result<(), CatalogueError> {
        self.files.lock().remove(sha256);
        remove(&self.path(sha256))
    }

    fn path(&self, sha256: &str) -> PathBuf {
        self.directory.join("content").join(sha256)
    }

    fn lane(&self, sha256: &str) -> MutexGuard<'_, ()> {
        let sum = sha256.bytes().map(usize::from).sum::<usize>();
        let lane = &self.lanes[sum % LANES];
        lane.lock()
    }
}

fn remove(path: &Path) -> Result<(), CatalogueError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(CatalogueError::unavailable("removed", path, error))
        }
        _ => Ok(()),
    }
}
