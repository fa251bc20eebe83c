//! Two nodes over one shelf.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use tempfile::TempDir;

use super::memory::{Memory, Trouble};
use super::{Shared, Sharing};
use crate::catalogue::both::Uploads as _;
use crate::catalogue::{
    CatalogueError, Checked, Claim, Declaration, Expected, Kept, Naming, Shelf as _,
};
use crate::geometry::geodesy::LatLon;
use crate::telemetry::Instruments;
use crate::telemetry::metrics::Queue;
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

    /// Files of the cache.
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
        self.shared.keep(&self.checked(height), &naming(name))
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

/// Ground of one height, on one degree.
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

fn naming(name: &str) -> Naming {
    Naming {
        name: name.to_owned(),
        by: everybody(),
        now_ms: 7,
        expected: Expected::Anything,
    }
}

pub(super) fn everybody() -> Claim {
    Claim {
        owner: None,
        over_all: true,
    }
}

/// Two nodes, whose contents go as soon as nothing refers to them.
fn two() -> (Arc<Memory>, Node, Node) {
    two_with(Duration::ZERO)
}

fn two_with(grace: Duration) -> (Arc<Memory>, Node, Node) {
    let shelf = Arc::new(Memory::default());
    let node = || Node::new(&shelf, grace, u64::MAX);
    let (a, b) = (node(), node());
    (shelf, a, b)
}

const AGES: Duration = Duration::from_secs(3600);

#[test]
fn what_one_node_keeps_every_node_finds() {
    let (_, a, b) = two();
    assert!(b.shared.entries().expect("it is there").is_empty());
    assert_eq!(a.keep("hill", 100).expect("kept"), Kept::Created);
    let found = b.find("hill").expect("found");
    assert_eq!(height(&found), 100);
    assert_eq!(b.keep("hill", 50).expect("kept"), Kept::Replaced);
    assert_eq!(height(&a.find("hill").expect("found")), 50);
    // What was accepted is planned over the ground that it was accepted over.
    for node in [&a, &b] {
        let pinned = node.shared.find("hill", Some(&found.sha256));
        assert_eq!(height(&pinned.expect("found")), 100);
    }
    assert_eq!(
        a.shared.entry("hill").expect("there"),
        b.shared.entry("hill").expect("there")
    );
    let entry = b.shared.entry("hill").expect("there");
    let own = b.find("hill").expect("found");
    assert_eq!(&entry.metadata, own.dataset.metadata());
    assert_eq!(entry.survey, Some(own.dataset.survey().expect("read")));
    let used = BTreeSet::from([found.sha256.clone()]);
    assert_eq!(a.shared.sweep(&used).expect("swept"), 0);
    assert_eq!(a.sweep() + b.sweep(), 1);
    let gone = a.shared.find("hill", Some(&found.sha256));
    assert!(matches!(gone, Err(DatasetError::Replaced { sha256 }) if sha256 == own.sha256));
    assert_eq!(b.copies().len(), 1, "copies of what has gone go, too");
    a.shared.remove("hill", &everybody()).expect("removed");
    assert!(matches!(b.find("hill"), Err(DatasetError::Unknown { names }) if names.is_empty()));
}

#[test]
fn who_expects_something_else_or_owns_nothing_is_refused_on_every_node() {
    let (_, a, b) = two();
    let by = |owner: &str| Claim {
        owner: Some(owner.to_owned()),
        over_all: false,
    };
    let naming = |owner: &str, expected: Expected| Naming {
        by: by(owner),
        expected,
        ..naming("hill")
    };
    let keep = |node: &Node, height: u32, naming: &Naming| {
        let checked = node.checked(height);
        let sha256 = checked.sha256().to_owned();
        node.shared.keep(&checked, naming).map(|_| sha256)
    };
    let first = keep(&a, 1, &naming("ada", Expected::Nothing)).expect("it is new");
    let refused = |error: CatalogueError, expected: &str| {
        assert!(format!("{error:?}").starts_with(expected), "{error:?}");
    };
    let error = keep(&b, 2, &naming("ada", Expected::Nothing)).expect_err("it is not new");
    refused(error, "Exists");
    let error = keep(&b, 2, &naming("bob", Expected::Anything)).expect_err("it is ada's");
    refused(error, "Owned");
    let other = Expected::OneOf(vec!["0".repeat(64)]);
    let error = keep(&b, 2, &naming("ada", other)).expect_err("it is another");
    refused(error, "Changed");
    refused(
        b.shared
            .removable("hill", &by("bob"))
            .expect_err("it is ada's"),
        "Owned",
    );
    refused(
        b.shared
            .remove("hill", &by("bob"))
            .expect_err("it is ada's"),
        "Owned",
    );
    keep(&b, 2, &naming("ada", Expected::OneOf(vec![first]))).expect("as expected");
    assert_eq!(height(&a.find("hill").expect("found")), 2);
}

/// Of two who both expect what is there, one is refused, at whatever step the other comes.
#[test]
fn of_two_replacements_one_is_refused() {
    for step in 0..8 {
        let (shelf, a, b) = two();
        a.keep("hill", 1).expect("kept");
        let naming = Naming {
            expected: Expected::OneOf(vec![a.find("hill").expect("found").sha256]),
            ..naming("hill")
        };
        let (tell, told) = mpsc::channel();
        let theirs = naming.clone();
        let meanwhile = move || {
            let kept = b.shared.keep(&b.checked(2), &theirs);
            tell.send(kept).expect("somebody listens");
        };
        shelf.trouble_in(step, Trouble::Interrupted(Box::new(meanwhile)));
        let ours = a.shared.keep(&a.checked(3), &naming);
        let Ok(theirs) = told.try_recv() else {
            assert!(step > 5 && shelf.calm() && ours.is_ok(), "step {step}");
            continue;
        };
        let now = height(&a.find("hill").expect("found"));
        let refused = |kept| matches!(kept, Err(CatalogueError::Changed { .. }));
        match ours {
            Ok(_) => assert!(now == 3 && refused(theirs), "step {step}"),
            ours => assert!(now == 2 && refused(ours) && theirs.is_ok(), "step {step}"),
        }
    }
}

/// A node that sweeps with no grace at all, at any step of an upload on another.
#[test]
fn a_sweep_amid_an_upload_takes_nothing_that_has_a_name() {
    for step in 0..12 {
        let (shelf, a, b) = two();
        a.keep("other", 1).expect("kept");
        a.keep("other", 2).expect("kept");
        // The first content has no name now, and is about to go.
        let swept = move || {
            b.sweep();
            drop(b);
        };
        shelf.trouble_in(step, Trouble::Interrupted(Box::new(swept)));
        assert_eq!(a.keep("hill", 1).expect("kept"), Kept::Created);
        shelf.calm();
        a.sweep();
        let c = Node::new(&shelf, Duration::ZERO, u64::MAX);
        assert_eq!(height(&c.find("hill").expect("found")), 1, "step {step}");
        assert_eq!(shelf.counts(), [2, 0], "step {step}");
    }
}

/// The mark is seen by everybody, and who asks takes it off.
#[test]
fn what_was_asked_for_lately_on_any_node_is_kept() {
    let grace = Duration::from_millis(300);
    let (shelf, a, b) = two_with(grace);
    a.keep("hill", 1).expect("kept");
    let sha256 = b.find("hill").expect("found").sha256;
    b.shared.remove("hill", &everybody()).expect("removed");
    assert!(a.shared.has_unnamed());
    for _ in 0..5 {
        assert_eq!(a.sweep(), 0);
        b.shared.find("hill", Some(&sha256)).expect("still there");
        std::thread::sleep(grace / 2);
    }
    assert_eq!(a.sweep() + b.sweep(), 0, "it was marked anew");
    std::thread::sleep(grace * 2);
    assert_eq!(a.sweep() + b.sweep(), 1, "by one of them");
    assert_eq!(shelf.counts(), [0, 0]);
}

#[test]
fn what_broke_midway_leaves_nothing_that_is_seen_and_is_removed() {
    for trouble in [|| Trouble::FailsBefore, || Trouble::FailsAfter] {
        for step in 0..16 {
            let (shelf, a, b) = two();
            a.keep("hill", 1).expect("kept");
            shelf.trouble_in(step, trouble());
            let kept = a.keep("hill", 2);
            let was_calm = shelf.calm();
            let now = height(&b.find("hill").expect("found"));
            match kept {
                Ok(_) => assert_eq!(now, 2, "step {step}"),
                Err(error) => {
                    assert!(!was_calm && matches!(error, CatalogueError::Unavailable { .. }));
                    assert!([1, 2].contains(&now), "step {step}");
                }
            }
            a.sweep();
            b.sweep();
            assert_eq!(shelf.counts(), [1, 0], "step {step}");
            // Who asks again gets what was wanted.
            a.keep("hill", 2).expect("kept");
            assert_eq!(height(&b.find("hill").expect("found")), 2);
        }
    }
}

#[test]
fn a_sweep_that_breaks_at_any_step_is_finished_by_the_next() {
    for trouble in [|| Trouble::FailsBefore, || Trouble::FailsAfter] {
        for step in 0..8 {
            let (shelf, a, b) = two();
            for height in 1..4 {
                a.keep("hill", height).expect("kept");
            }
            shelf.trouble_in(step, trouble());
            let _ = a.shared.sweep(&BTreeSet::new());
            shelf.calm();
            b.sweep();
            assert_eq!(height(&b.find("hill").expect("found")), 3);
            assert_eq!(shelf.counts(), [1, 0], "step {step}");
        }
    }
}

#[test]
fn a_damaged_copy_is_fetched_again() {
    let (shelf, a, b) = two_with(AGES);
    a.keep("hill", 100).expect("kept");
    b.find("hill").expect("found");
    let copy = b.copies().remove(0);
    for damage in [hill(200), "nothing".to_owned(), String::new()] {
        fs::write(&copy, damage).expect("written");
        assert_eq!(height(&b.find("hill").expect("found")), 100);
    }
    fs::remove_file(&copy).expect("removed");
    assert_eq!(height(&b.find("hill").expect("found")), 100);
    // Also when it was damaged while nobody looked.
    fs::write(&copy, hill(200)).expect("written");
    let b = b.restarted(&shelf, AGES, u64::MAX);
    assert_eq!(height(&b.find("hill").expect("found")), 100);
}

#[test]
fn copies_are_counted() {
    let (shelf, a, b) = two_with(AGES);
    a.keep("hill", 100).expect("kept");
    b.find("hill").expect("found");
    b.find("hill").expect("found");
    a.keep("hill", 50).expect("kept");
    // Of the three calls of a find the second is the fetch.
    shelf.trouble_in(1, Trouble::FailsBefore);
    b.find("hill").expect("found at the second try");
    let queue = Queue {
        queued: None,
        running: None,
        oldest_queued_ms: None,
        limit: 1,
        workers: 1,
    };
    let text = b.shared.instruments.metrics.text(queue);
    for (series, expected) in [
        ("fetches_total{outcome=\"fetched\"}", 2),
        ("fetches_total{outcome=\"failed\"}", 1),
        (
            "fetched_bytes_total",
            hill(100).len() + hill(50).len() + hill(50).len() / 2,
        ),
    ] {
        let line = format!("noctule_terrain_{series} {expected}");
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
    let tally = b.shared.tally();
    assert_eq!((tally.datasets, tally.bytes), (1, tally.cached_bytes));
}

#[test]
fn copies_serve_what_is_pinned_while_the_shelf_is_away() {
    let (shelf, a, b) = two_with(AGES);
    a.keep("hill", 100).expect("kept");
    let sha256 = b.find("hill").expect("found").sha256;
    a.keep("other", 50).expect("kept");
    let other = a.find("other").expect("found").sha256;
    shelf.be_away(true);
    let found = b.shared.find("hill", Some(&sha256)).expect("a copy");
    assert_eq!(height(&found), 100);
    for away in [b.find("hill"), b.shared.find("other", Some(&other))] {
        assert!(
            matches!(away, Err(DatasetError::Unavailable(_))),
            "{away:?}"
        );
    }
    let kept = b.keep("hill", 7);
    assert!(matches!(kept, Err(CatalogueError::Unavailable { .. })));
    assert!(b.shared.entries().is_err());
    assert_eq!(b.shared.tally().datasets, 1, "what was known last");
    shelf.be_away(false);
    assert_eq!(height(&b.find("other").expect("found")), 50);
}

/// Two workers of one machine and user.
#[test]
fn nodes_with_one_directory_have_a_cache_each() {
    let shelf = Arc::new(Memory::default());
    let directory = tempfile::tempdir().expect("a temporary directory");
    let open = || Shared::open(&sharing(&shelf, directory.path(), AGES)).expect("there is room");
    let nodes = [open(), open(), open()];
    let checked = nodes[0].stage(10_000).map(|mut staged| {
        staged.write_all(hill(9).as_bytes()).expect("it is short");
        staged.check(None, Declaration::default()).expect("right")
    });
    let checked = checked.expect("there is room");
    nodes[0].keep(&checked, &naming("hill")).expect("kept");
    for node in &nodes {
        assert_eq!(height(&node.find("hill", None).expect("found")), 9);
    }
    let caches = fs::read_dir(directory.path()).expect("it is there");
    assert_eq!(caches.count(), 3);
}

#[test]
fn copies_go_when_there_are_too_many() {
    let shelf = Arc::new(Memory::default());
    let length = hill(10).len() as u64;
    let node = Node::new(&shelf, Duration::ZERO, 2 * length);
    let names = ["a", "b", "c", "d"];
    for (name, height) in names.iter().zip(10..) {
        node.keep(name, height).expect("kept");
    }
    assert_eq!(node.copies().len(), 2);
    for (name, expected) in names.iter().zip(10..) {
        assert_eq!(height(&node.find(name).expect("found")), expected);
        assert_eq!(node.copies().len(), 2);
    }
    // What has just been asked for stays, however many there are.
    let node = node.restarted(&shelf, AGES, length);
    for name in names {
        node.find(name).expect("found");
    }
    assert_eq!(node.copies().len(), 4);
}

/// What a newer version has written is neither understood nor taken for needless.
#[test]
fn nothing_is_swept_while_a_record_cannot_be_read() {
    let (shelf, a, b) = two();
    a.keep("hill", 1).expect("kept");
    a.keep("hill", 2).expect("kept");
    shelf.put(&mut "theirs".as_bytes()).expect("put");
    shelf.scribble("name.new", r#"{"sum": 7}"#);
    assert_eq!(b.sweep(), 0);
    assert_eq!(shelf.counts(), [3, 0]);
    assert_eq!(height(&b.find("hill").expect("found")), 2);
    shelf.scribble(
        "name.new",
        r#"{"sha256": "0", "uploaded_ms": 1, "owner": null}"#,
    );
    assert_eq!(b.sweep(), 1);
    assert_eq!(shelf.counts(), [1, 0]);
}
