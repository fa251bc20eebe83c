//! Two nodes over one shelf that sometimes fails, compared with two maps.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;

use super::memory::{Memory, Trouble};
use super::tests::{Node, height, naming};
use crate::catalogue::CatalogueError;
use crate::catalogue::directories::Uploads as _;

#[derive(Debug, Clone)]
enum Step {
    Keep {
        name: usize,
        height: u32,
    },
    Remove {
        name: usize,
    },
    Find {
        name: usize,
    },
    /// A plan is accepted over the content of a name.
    Use {
        name: usize,
    },
    /// All plans are removed.
    Forget,
    Sweep,
    Restart,
    Damage {
        copy: usize,
    },
}

const NAMES: [&str; 3] = ["a", "b", "c"];

fn step() -> impl Strategy<Value = Step> {
    let name = 0..NAMES.len();
    prop_oneof![
        4 => (name.clone(), 1..5_u32).prop_map(|(name, height)| Step::Keep { name, height }),
        2 => name.clone().prop_map(|name| Step::Remove { name }),
        2 => name.clone().prop_map(|name| Step::Find { name }),
        1 => name.prop_map(|name| Step::Use { name }),
        1 => Just(Step::Forget),
        2 => Just(Step::Sweep),
        1 => Just(Step::Restart),
        1 => (0..4_usize).prop_map(|copy| Step::Damage { copy }),
    ]
}

/// The call that fails, and whether before or after its effect.
type Failing = Option<(usize, bool)>;

/// The node, its step, and the failure.
fn steps() -> impl Strategy<Value = Vec<(usize, Step, Failing)>> {
    let trouble = prop::option::weighted(0.3, (0..6_usize, any::<bool>()));
    prop::collection::vec((0..2_usize, step(), trouble), 1..30)
}

const CACHE_BYTES: u64 = 200;

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 4, ..ProptestConfig::default() })]

    #[test]
    fn names_and_contents_are_as_if_there_were_one_node(steps in steps()) {
        let shelf = Arc::new(Memory::default());
        let node = || Some(Node::new(&shelf, Duration::ZERO, CACHE_BYTES));
        let mut nodes = [node(), node()];
        let mut names: BTreeMap<&str, u32> = BTreeMap::new();
        let mut used: BTreeMap<String, u32> = BTreeMap::new();
        for (at, step, trouble) in steps {
            if let Some((calls, before)) = trouble {
                let trouble = if before { Trouble::FailsBefore } else { Trouble::FailsAfter };
                shelf.trouble_in(calls, trouble);
            }
            let here = nodes[at].as_ref().expect("it runs");
            // What a name may refer to afterwards.
            let mut either: Option<(&str, [Option<u32>; 2])> = None;
            match step {
                Step::Keep { name, height } => {
                    let name = NAMES[name];
                    let before = names.get(name).copied();
                    match here.keep(name, height) {
                        Ok(_) => { names.insert(name, height); }
                        Err(error) => {
                            let away = matches!(error, CatalogueError::Unavailable { .. });
                            prop_assert!(away, "{error}");
                            prop_assert!(!shelf.calm(), "{error}");
                            either = Some((name, [before, Some(height)]));
                        }
                    }
                }
                Step::Remove { name } => {
                    let name = NAMES[name];
                    let before = names.get(name).copied();
                    match here.shared.remove(&naming(name)) {
                        Ok(()) => { prop_assert!(names.remove(name).is_some()); }
                        Err(CatalogueError::Unknown { .. }) => prop_assert_eq!(before, None),
                        Err(error) => {
                            prop_assert!(!shelf.calm(), "{error}");
                            either = Some((name, [before, None]));
                        }
                    }
                }
                Step::Find { name } => match here.shared.find(NAMES[name], None) {
                    Ok(found) => prop_assert_eq!(Some(&height(&found)), names.get(NAMES[name])),
                    Err(_) if names.contains_key(NAMES[name]) => prop_assert!(!shelf.calm()),
                    Err(_) => {}
                },
                Step::Use { name } => if let Ok(found) = here.shared.find(NAMES[name], None) {
                    let height = height(&found);
                    used.insert(found.sha256, height);
                },
                Step::Forget => used.clear(),
                Step::Sweep => {
                    let used = used.keys().cloned().collect();
                    if here.shared.sweep(&used).is_err() {
                        prop_assert!(!shelf.calm());
                    }
                }
                Step::Restart => {
                    let stopped = nodes[at].take().expect("it runs");
                    nodes[at] = Some(stopped.restarted(&shelf, Duration::ZERO, CACHE_BYTES));
                }
                Step::Damage { copy } => {
                    if let Some(copy) = here.copies().get(copy) {
                        fs::write(copy, "damaged").expect("written");
                    }
                }
            }
            shelf.calm();
            let now = |name: &str| {
                let found = nodes[0].as_ref().expect("it runs").shared.find(name, None);
                found.ok().map(|found| height(&found))
            };
            if let Some((name, allowed)) = either {
                let now = now(name);
                prop_assert!(allowed.contains(&now), "{now:?} is none of {allowed:?}");
                names.remove(name);
                names.extend(now.map(|now| (name, now)));
            }
            for node in nodes.iter().flatten() {
                for name in NAMES {
                    let found = node.shared.find(name, None);
                    prop_assert_eq!(
                        found.as_ref().ok().map(height),
                        names.get(name).copied(),
                        "{}: {:?}", name, found
                    );
                }
                for (sha256, expected) in &used {
                    let found = node.shared.find("a", Some(sha256)).expect("it is used");
                    prop_assert_eq!(height(&found), *expected);
                }
                let listed = node.shared.entries().expect("it is there");
                let listed: Vec<String> = listed.into_iter().map(|entry| entry.name).collect();
                prop_assert_eq!(listed, names.keys().copied().collect::<Vec<_>>());
            }
        }
        for node in nodes.iter().flatten() {
            node.shared.sweep(&BTreeSet::new()).expect("swept");
        }
        let contents: BTreeSet<&u32> = names.values().collect();
        prop_assert_eq!(shelf.counts(), [contents.len(), 0], "nothing is left over");
    }
}
