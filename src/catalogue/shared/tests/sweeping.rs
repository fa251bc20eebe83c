//! What is swept, and what is kept.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::time::Duration;

use super::{Node, height, naming, two, two_with};
use crate::catalogue::directories::Uploads as _;
use crate::catalogue::shared::memory::Trouble;
use crate::catalogue::{Kept, Shelf as _};

/// Another node sweeps without grace period at any step of an upload.
#[test]
fn a_sweep_amid_an_upload_takes_nothing_that_has_a_name() {
    for step in 0..12 {
        let (shelf, a, b) = two();
        a.keep("other", 1).expect("kept");
        a.keep("other", 2).expect("kept");
        // The first content has no name any more, and is about to be removed.
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

/// All nodes see the mark, and using the content removes it.
#[test]
fn what_was_asked_for_lately_on_any_node_is_kept() {
    let grace = Duration::from_millis(300);
    let (shelf, a, b) = two_with(grace);
    a.keep("hill", 1).expect("kept");
    let sha256 = b.find("hill").expect("found").sha256;
    b.shared.remove(&naming("hill")).expect("removed");
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

/// A record of a newer version is not understood, but not treated as absent.
#[test]
fn nothing_is_swept_while_a_record_cannot_be_read() {
    let (shelf, a, b) = two();
    a.keep("hill", 1).expect("kept");
    a.keep("hill", 2).expect("kept");
    shelf.put(&mut Cursor::new("theirs")).expect("put");
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
