//! Whose turn it is: no owner waits behind another's crowd, no small plan behind large ones.

use std::collections::{BTreeSet, HashMap};

use super::lane::{Lane, Size, Version};
use crate::job::PlanId;

/// Plans by lane, each with its place in the queue.
pub(super) type Lanes = HashMap<Lane, BTreeSet<(u64, PlanId)>>;

/// The lane from which a worker of this version takes the next plan, in a system of `slots` slots: that of the owner
/// with the fewest plans running; between equals, that of the oldest plan. Large plans leave a quarter of the slots to
/// small ones. Lanes of newer versions are left to newer workers, and those in `passed` are passed over.
pub(super) fn next(
    queued: &Lanes,
    running: &Lanes,
    version: Version,
    slots: usize,
    passed: &[Lane],
) -> Option<Lane> {
    let mut shares: HashMap<&str, usize> = HashMap::new();
    let mut large = 0;
    for (lane, plans) in running {
        *shares.entry(&lane.owner).or_default() += plans.len();
        large += usize::from(lane.size == Size::Large) * plans.len();
    }
    let room_for_large = large < slots.saturating_sub(slots.div_ceil(4)).max(1);
    let open = queued.iter().filter(|(lane, _)| {
        lane.version <= version
            && (lane.size == Size::Small || room_for_large)
            && !passed.contains(lane)
    });
    open.min_by_key(|(lane, plans)| {
        let share = shares.get(lane.owner.as_str()).copied();
        (share.unwrap_or_default(), plans.first().copied())
    })
    .map(|(lane, _)| lane.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane(version: &str, size: Size, owner: &str) -> Lane {
        Lane {
            version: Version::read(version).expect("it is one"),
            size,
            owner: owner.to_owned(),
        }
    }

    fn small(owner: &str) -> Lane {
        lane("1.0.0", Size::Small, owner)
    }

    fn lanes(all: &[(Lane, &[u64])]) -> Lanes {
        let plans = |places: &[u64]| places.iter().map(|place| (*place, PlanId::nil())).collect();
        all.iter()
            .map(|(lane, places)| (lane.clone(), plans(places)))
            .collect()
    }

    fn turn(queued: &Lanes, running: &Lanes, slots: usize) -> Option<Lane> {
        let version = Version::read("1.0.0").expect("it is one");
        next(queued, running, version, slots, &[])
    }

    #[test]
    fn the_owner_with_the_fewest_runs_is_next_and_ties_go_to_the_oldest_plan() {
        let queued = lanes(&[(small("crowd"), &[1, 2, 3, 4]), (small("one"), &[5])]);
        let none = lanes(&[]);
        assert_eq!(turn(&queued, &none, 4), Some(small("crowd")));
        let running = lanes(&[(small("crowd"), &[0])]);
        assert_eq!(turn(&queued, &running, 4), Some(small("one")));
        let running = lanes(&[(small("crowd"), &[0]), (small("one"), &[9])]);
        assert_eq!(turn(&queued, &running, 4), Some(small("crowd")));
        assert_eq!(turn(&none, &running, 4), None);
    }

    #[test]
    fn large_plans_leave_a_quarter_of_the_slots_unless_there_is_only_one() {
        let large = lane("1.0.0", Size::Large, "a");
        let queued = lanes(&[(large.clone(), &[1, 2, 3])]);
        for (slots, room) in [(1, 1), (2, 1), (4, 3), (5, 3), (16, 12)] {
            let places: Vec<u64> = (10..10 + room).collect();
            let full = lanes(&[(large.clone(), &places)]);
            assert_eq!(turn(&queued, &full, slots), None, "{slots}");
            let less = lanes(&[(large.clone(), &places[1..])]);
            assert_eq!(turn(&queued, &less, slots), Some(large.clone()), "{slots}");
        }
        let both = lanes(&[(large.clone(), &[1]), (small("a"), &[2])]);
        let full = lanes(&[(large, &[7, 8, 9])]);
        assert_eq!(turn(&both, &full, 4), Some(small("a")));
    }

    #[test]
    fn a_lane_that_is_passed_over_leaves_the_turn_to_the_next() {
        let queued = lanes(&[
            (small("a"), &[1, 4]),
            (small("b"), &[2]),
            (small("c"), &[3]),
        ]);
        let version = Version::read("1.0.0").expect("it is one");
        let mut passed = Vec::new();
        for owner in ["a", "b", "c"] {
            let lane = next(&queued, &lanes(&[]), version, 4, &passed).expect("one is left");
            assert_eq!(lane, small(owner));
            passed.push(lane);
        }
        assert_eq!(next(&queued, &lanes(&[]), version, 4, &passed), None);
    }

    #[test]
    fn an_old_worker_never_takes_a_newer_plan() {
        let newer = lane("1.0.1", Size::Small, "a");
        let older = lane("0.9.9", Size::Small, "a");
        let queued = lanes(&[(newer.clone(), &[1])]);
        assert_eq!(turn(&queued, &lanes(&[]), 4), None);
        let queued = lanes(&[(newer, &[1]), (older.clone(), &[2])]);
        assert_eq!(turn(&queued, &lanes(&[]), 4), Some(older));
    }
}
