//! Keeping files under names, with concurrent nodes and failures.

use std::collections::BTreeSet;
use std::sync::mpsc;

use super::{Node, height, naming, two};
use crate::catalogue::directories::Uploads as _;
use crate::catalogue::shared::memory::Trouble;
use crate::catalogue::{CatalogueError, Claim, Expected, Kept, Naming, Room};
use crate::terrain::DatasetError;

#[test]
fn nodes_share_the_room_for_all_files() {
    let (_, a, b) = two();
    let (first, second) = (a.checked(100), b.checked(250));
    let bytes = first.staged.bytes() + second.staged.bytes() - 1;
    let room = Room {
        bytes,
        ..Room::ENDLESS
    };
    a.shared
        .keep(&first, &naming("hill"), room)
        .expect("room for one");
    let kept = b.shared.keep(&second, &naming("other"), room);
    assert!(matches!(kept, Err(CatalogueError::Full { room }) if room == bytes));
    assert_eq!(a.shared.tally().datasets, 1);
    let kept = b.shared.keep(&b.checked(100), &naming("other"), room);
    assert_eq!(kept.expect("the content is there").0, Kept::Created);
    let kept = b.shared.keep(&second, &naming("other"), Room::ENDLESS);
    assert_eq!(kept.expect("room for both").0, Kept::Replaced);
}

#[test]
fn nodes_share_the_number_of_names() {
    let (_, a, b) = two();
    let room = Room {
        datasets: 1,
        ..Room::ENDLESS
    };
    let keep = |node: &Node, name, height| {
        let kept = node.shared.keep(&node.checked(height), &naming(name), room);
        kept.map(|(kept, _)| kept)
    };
    assert_eq!(keep(&a, "hill", 100).expect("room for one"), Kept::Created);
    for height in [100, 250] {
        let kept = keep(&b, "other", height);
        assert!(matches!(kept, Err(CatalogueError::TooMany { most: 1 })));
    }
    assert_eq!(keep(&b, "hill", 300).expect("it is there"), Kept::Replaced);
    assert_eq!(a.shared.tally().datasets, 1);
    // Nothing was sent in vain, and there may be as many more files.
    assert_eq!(a.shared.view().expect("it is read").contents.len(), 2);
    let kept = keep(&a, "hill", 50);
    assert!(matches!(kept, Err(CatalogueError::TooMany { most: 1 })));
}

#[test]
fn what_one_node_keeps_every_node_finds() {
    let (_, a, b) = two();
    assert!(b.shared.entries().expect("it is there").is_empty());
    assert_eq!(a.keep("hill", 100).expect("kept"), Kept::Created);
    let found = b.find("hill").expect("found");
    assert_eq!(height(&found), 100);
    assert_eq!(b.keep("hill", 50).expect("kept"), Kept::Replaced);
    assert_eq!(height(&a.find("hill").expect("found")), 50);
    // An accepted plan keeps the ground that it was accepted with.
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
    a.shared.remove(&naming("hill")).expect("removed");
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
        node.shared
            .keep(&checked, naming, Room::ENDLESS)
            .map(|_| sha256)
    };
    let first = keep(&a, 1, &naming("ada", Expected::Nothing)).expect("it is new");
    let refused = |error: CatalogueError, expected: &str| {
        assert!(format!("{error:?}").starts_with(expected), "{error:?}");
    };
    let error = keep(&b, 2, &naming("ada", Expected::Nothing)).expect_err("it is not new");
    refused(error, "Exists");
    let error = keep(&b, 2, &naming("bob", Expected::Anything)).expect_err("it is ada's");
    refused(error, "Owned");
    let other = naming("ada", Expected::OneOf(vec!["0".repeat(64)]));
    let error = keep(&b, 2, &other).expect_err("it is another");
    refused(error, "Changed");
    for (naming, expected) in [
        (naming("bob", Expected::Anything), "Owned"),
        (other, "Changed"),
    ] {
        let kept = b.shared.removable(&naming).expect_err("it is not to go");
        refused(kept, expected);
        let kept = b.shared.remove(&naming).expect_err("it is not to go");
        refused(kept, expected);
    }
    keep(&b, 2, &naming("ada", Expected::OneOf(vec![first]))).expect("as expected");
    assert_eq!(height(&a.find("hill").expect("found")), 2);
}

/// If two nodes expect the present content, one is refused, at whatever step the other interferes.
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
            let kept = b.shared.keep(&b.checked(2), &theirs, Room::ENDLESS);
            tell.send(kept).expect("somebody listens");
        };
        shelf.trouble_in(step, Trouble::Interrupted(Box::new(meanwhile)));
        let ours = a.shared.keep(&a.checked(3), &naming, Room::ENDLESS);
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
            // A second attempt succeeds.
            a.keep("hill", 2).expect("kept");
            assert_eq!(height(&b.find("hill").expect("found")), 2);
        }
    }
}
