//! A node's copies of files on the shelf.

use std::fs;
use std::io::Write as _;
use std::sync::Arc;
use std::time::Duration;

use super::{Node, height, hill, naming, sharing, two_with};
use crate::catalogue::directories::Uploads as _;
use crate::catalogue::shared::Shared;
use crate::catalogue::shared::memory::{Memory, Trouble};
use crate::catalogue::{CatalogueError, Declaration, Room};
use crate::telemetry::metrics::Queue;
use crate::terrain::DatasetError;

const AGES: Duration = Duration::from_secs(3600);

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
    // Also if it was damaged while the node was down.
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
    // The second of the three calls of a find is the fetch.
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

/// Two workers of the same machine and user.
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
    nodes[0]
        .keep(&checked, &naming("hill"), Room::ENDLESS)
        .expect("kept");
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
    // Recently used files are kept, however many there are.
    let node = node.restarted(&shelf, AGES, length);
    for name in names {
        node.find(name).expect("found");
    }
    assert_eq!(node.copies().len(), 4);
}
