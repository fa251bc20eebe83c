//! Two nodes over one shelf.

mod copies;
mod keeping;
mod sweeping;

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::memory::Memory;
use super::{Shared, Sharing};
use crate::catalogue::directories::Uploads as _;
use crate::catalogue::{CatalogueError, Checked, Claim, Declaration, Expected, Kept, Naming, Room};
use crate::geometry::geodesy::LatLon;
use crate::telemetry::Instruments;
use crate::terrain::{DatasetError, Found};

/// A node and its directory.
pub(super) struct Node {
    pub(super) shared: Shared,
    directory: TempDir,
}

impl Node {
    pub(super) fn new(shelf: &Arc<Memory>, grace: Duration, cache_bytes: u64) -> Self {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let sharing = sharing(shelf, directory.path(), grace).with_cache_bytes(cache_bytes);
        let shared = Shared::open(&sharing).expect("it can be made");
        Self { shared, directory }
    }

    /// The same node after a restart.
    pub(super) fn restarted(self, shelf: &Arc<Memory>, grace: Duration, cache_bytes: u64) -> Self {
        let Self { shared, directory } = self;
        drop(shared);
        let sharing = sharing(shelf, directory.path(), grace).with_cache_bytes(cache_bytes);
        let shared = Shared::open(&sharing).expect("nobody else has it");
        Self { shared, directory }
    }

    /// Files in the cache.
    pub(super) fn copies(&self) -> Vec<std::path::PathBuf> {
        let content = self.directory.path().join("cache/content");
        let entries = fs::read_dir(content).expect("it is there");
        entries
            .map(|entry| entry.expect("it is there").path())
            .collect()
    }

    fn checked(&self, height: u32) -> Checked {
        let mut staged = self.shared.stage(10_000).expect("there is room");
        staged
            .write_all(hill(height).as_bytes())
            .expect("it is short");
        staged
            .check(None, Declaration::default())
            .expect("it is right")
    }

    pub(super) fn keep(&self, name: &str, height: u32) -> Result<Kept, CatalogueError> {
        let kept = self
            .shared
            .keep(&self.checked(height), &naming(name), Room::ENDLESS);
        kept.map(|(kept, _)| kept)
    }

    fn find(&self, name: &str) -> Result<Found, DatasetError> {
        self.shared.find(name, None)
    }

    fn sweep(&self) -> usize {
        self.shared.sweep(&BTreeSet::new()).expect("it is swept")
    }
}

fn sharing(shelf: &Arc<Memory>, directory: &Path, grace: Duration) -> Sharing {
    let instruments = Arc::new(Instruments::default());
    Sharing::new(shelf.clone(), directory.join("cache"), instruments).with_grace(grace)
}

/// Level ground at one height, over one degree.
fn hill(height: u32) -> String {
    let head = "ncols 2\nnrows 2\nxllcenter 7\nyllcenter 47\ncellsize 1\n";
    format!("{head}{height} {height}\n{height} {height}\n")
}

pub(super) fn height(found: &Found) -> u32 {
    let place = LatLon {
        lat: 47.5,
        lon: 7.5,
    };
    let sampled = found.dataset.sample(&[place]).expect("it can be read");
    let height = sampled[0].expect("there is ground").round();
    format!("{height}").parse().expect("a height")
}

pub(super) fn naming(name: &str) -> Naming {
    Naming {
        name: name.to_owned(),
        by: Claim {
            owner: None,
            over_all: true,
        },
        now_ms: 7,
        expected: Expected::Anything,
    }
}

/// Two nodes that remove contents as soon as nothing refers to them.
fn two() -> (Arc<Memory>, Node, Node) {
    two_with(Duration::ZERO)
}

fn two_with(grace: Duration) -> (Arc<Memory>, Node, Node) {
    let shelf = Arc::new(Memory::default());
    let node = || Node::new(&shelf, grace, u64::MAX);
    let (a, b) = (node(), node());
    (shelf, a, b)
}
