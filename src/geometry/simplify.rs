//! A ring with fewer corners that lies around another, or within it.
//!
//! Triangles are added to the ring, or taken from it, the flattest first: at a corner that turns the other way (which
//! leaves the corner out), or at an edge whose neighbours are drawn out until they meet (which leaves an edge out). A
//! triangle that any other part of the ring reaches into is left alone. So each ring holds the one before, or is held by
//! it, and stays simple.

mod outline;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{Point2, ring};
use outline::{Outline, Step};

/// On which side of a ring the simpler one lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// No point of the ring lies outside it.
    Around,
    /// No point of it lies outside the ring.
    Within,
}

/// Fewer corners than this are not left over.
const FEWEST: usize = 4;

/// What leaving out a corner would do.
#[derive(Debug, Clone, Copy)]
pub struct Change {
    /// How far the ring would be from the original one there at most, metres.
    pub off_m: f64,
    /// Where.
    pub at: Point2,
    /// How many corners there are so far.
    pub corners: usize,
}

/// The simple `ring` with fewer corners, on one `side` of it, rounding aside. Corners are left out by how far they are
/// off, as long as `allows` lets them; what it does not allow, it never allows later.
#[must_use]
pub fn simplified(ring: &[Point2], side: Side, allows: impl Fn(Change) -> bool) -> Vec<Point2> {
    let corners = ring::distinct(ring.to_vec());
    if corners.len() <= FEWEST {
        return corners;
    }
    let mut outline = Outline::new(corners, side);
    let mut steps = BinaryHeap::new();
    let push = |outline: &Outline, corner: usize, steps: &mut BinaryHeap<_>| {
        let version = outline.version(corner);
        for step in outline.steps(corner).into_iter().flatten() {
            // By height; numbers that are not negative are in the order of their bits.
            steps.push(Reverse((
                step.height.to_bits(),
                corner,
                version,
                step.is_drawn_out,
            )));
        }
    };
    for corner in 0..outline.len() {
        push(&outline, corner, &mut steps);
    }
    while let Some(Reverse((_, corner, version, is_drawn_out))) = steps.pop() {
        if outline.count == FEWEST {
            break;
        }
        let is_current = outline.version(corner) == version;
        let of_kind = |step: &Step| is_current && step.is_drawn_out == is_drawn_out;
        let step = outline.steps(corner).into_iter().flatten().find(of_kind);
        let is_allowed = |step: &Step| {
            allows(Change {
                off_m: step.height,
                at: step.at,
                corners: outline.count,
            })
        };
        if let Some(step) = step.filter(|step| is_allowed(step) && outline.is_free(step)) {
            for changed in outline.take(&step) {
                push(&outline, changed, &mut steps);
            }
        }
    }
    outline.ring()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::outline::meet;
    use super::*;

    /// Corners evenly round the origin, this far from it.
    fn round(away: &[f64]) -> Vec<Point2> {
        let step = std::f64::consts::TAU / away.len() as f64;
        let corner = |(idx, away): (usize, &f64)| {
            let (sin, cos) = libm::sincos(step * idx as f64);
            Point2::new(away * cos, away * sin)
        };
        away.iter().enumerate().map(corner).collect()
    }

    fn within(most_m: f64) -> impl Fn(Change) -> bool {
        move |change| change.off_m <= most_m
    }

    fn ring_of(corners: &[[f64; 2]]) -> Vec<Point2> {
        corners.iter().copied().map(Point2::from).collect()
    }

    #[test]
    fn a_circle_of_many_corners_needs_few() {
        let circle = round(&[1000.0; 360]);
        for side in [Side::Around, Side::Within] {
            let simple = simplified(&circle, side, within(5.0));
            // The sides of a regular ring of 32 are 4.8 m off; what is left out step by step is added up.
            assert!(
                (24..=64).contains(&simple.len()),
                "{side:?} {}",
                simple.len()
            );
            let away: Vec<f64> = simple.iter().map(|corner| corner.coords.norm()).collect();
            let expected = match side {
                Side::Around => 999.9..1010.0,
                Side::Within => 995.0..1000.001,
            };
            assert!(away.iter().all(|away| expected.contains(away)), "{away:?}");
        }
    }

    #[test]
    fn a_dent_is_filled_from_without_and_a_bump_is_cut_from_within() {
        let square = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]];
        let [dent, bump] = [[50.0, 2.0], [50.0, -2.0]].map(|corner| {
            let mut corners = square.to_vec();
            corners.insert(1, corner);
            ring_of(&corners)
        });
        let square = ring_of(&square);
        let check = |ring: &Vec<Point2>, side, most_m, expected: &Vec<Point2>| {
            for is_reversed in [false, true] {
                let (mut ring, mut expected) = (ring.clone(), expected.clone());
                if is_reversed {
                    ring.reverse();
                    expected.reverse();
                }
                let simple = simplified(&ring, side, within(most_m));
                assert_eq!(simple, expected, "{side:?} {most_m} {is_reversed}");
            }
        };
        check(&dent, Side::Around, 2.1, &square);
        check(&dent, Side::Around, 1.9, &dent);
        check(&bump, Side::Within, 2.1, &square);
        check(&bump, Side::Within, 1.9, &bump);
    }

    #[test]
    fn corners_on_a_straight_line_and_repeated_ones_cost_nothing() {
        let ring = ring_of(&[
            [0.0, 0.0],
            [30.0, 0.0],
            [30.0, 0.0],
            [70.0, 0.0],
            [100.0, 0.0],
            [100.0, 100.0],
            [0.0, 100.0],
            [0.0, 0.0],
        ]);
        for side in [Side::Around, Side::Within] {
            let simple = simplified(&ring, side, within(0.0));
            assert_eq!(simple.len(), 4, "{side:?} {simple:?}");
        }
    }

    /// The tip of a spike lies in a dent of the ring's other arm, or before it.
    #[test]
    fn a_dent_into_which_another_part_reaches_stays() {
        let with_tip = |height: f64| {
            ring_of(&[
                [0.0, 0.0],
                [100.0, 0.0],
                [100.0, 20.0],
                [50.0, 15.0],
                [20.0, 20.0],
                [20.0, 60.0],
                [49.0, 60.0],
                [50.0, height],
                [51.0, 60.0],
                [100.0, 60.0],
                [100.0, 80.0],
                [0.0, 80.0],
            ])
        };
        let check = |height, expected: usize| {
            let ring = with_tip(height);
            let simple = simplified(&ring, Side::Around, within(6.0));
            assert_eq!(simple.len(), expected, "{height} {simple:?}");
        };
        check(17.0, 12);
        check(30.0, 11);
    }

    #[test]
    fn what_is_asked_for_each_change_is_where_and_how_far_and_how_many_are_left() {
        let circle = round(&[1000.0; 90]);
        let is_east = |change: &Change| change.at.x > 0.0;
        let simple = simplified(&circle, Side::Within, |change| {
            is_east(&change) && change.corners > 60
        });
        assert_eq!(simple.len(), 60);
        assert_eq!(simple.iter().filter(|corner| corner.x < 0.0).count(), 45);
    }

    /// Points along the edges of `ring`, its corners among them.
    fn along(ring: &[Point2]) -> impl Iterator<Item = Point2> {
        let parts = |(a, b): (Point2, Point2)| {
            (0..7).map(move |part| a + (b - a) * (f64::from(part) / 7.0))
        };
        ring::edges(ring).flat_map(parts)
    }

    fn is_simple(ring: &[Point2]) -> bool {
        let edges: Vec<_> = ring::edges(ring).collect();
        let count = edges.len();
        (0..count).all(|one| {
            (one + 2..count)
                .filter(|other| (other + 1) % count != one)
                .all(|other| !meet(edges[one], edges[other]))
        })
    }

    proptest! {
        #[test]
        fn a_simpler_ring_is_simple_on_its_side_and_near(
            away in prop::collection::vec(300.0..400.0f64, 5..120),
            flat in prop_oneof![Just(1.0), Just(0.1), Just(0.0)],
            most in prop_oneof![0.5..5.0f64, 5.0..80.0f64],
            is_around in any::<bool>(),
            is_clockwise in any::<bool>(),
        ) {
            let away: Vec<f64> = away.iter().map(|away| 350.0 + flat * (away - 350.0)).collect();
            let mut ring = round(&away);
            if is_clockwise {
                ring.reverse();
            }
            let side = if is_around { Side::Around } else { Side::Within };
            let simple = simplified(&ring, side, within(most));
            prop_assert!(simple.len() <= ring.len() && is_simple(&simple));
            let [outer, inner] = if is_around { [&simple, &ring] } else { [&ring, &simple] };
            for point in along(inner) {
                let is_inside = ring::contains(outer, point) || ring::distance(outer, point) < 1e-9;
                prop_assert!(is_inside, "{point} is outside {outer:?}");
                prop_assert!(ring::distance(outer, point) <= most + 1e-9);
            }
            for point in along(outer) {
                prop_assert!(ring::distance(inner, point) <= most + 1e-9, "{point} is far from {inner:?}");
            }
        }
    }
}
