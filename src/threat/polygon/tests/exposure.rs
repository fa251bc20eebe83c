//! Exposure outside rings: each point of a leg belongs to one edge or corner.

use super::*;

/// The zones of a side and of the corner at its end meet on a line at right angles to it: the next side's, where the ring
/// has a right angle.
#[test]
fn a_leg_in_line_with_a_side_is_exposed_once() {
    for (a, b) in [
        ([-20.0, 0.0, 0.0], [-5.0, 0.0, 0.0]),
        ([30.0, 0.0, 0.0], [15.0, 0.0, 0.0]),
        ([-5.0, 10.0, 0.0], [-20.0, 10.0, 0.0]),
        ([0.0, 15.0, 0.0], [0.0, 40.0, 0.0]),
        ([10.0, -5.0, 0.0], [10.0, -50.0, 0.0]),
    ] {
        // The depth goes from 5 m to 0 over 5 m.
        let exposure = square(10.0).exposure(&leg(a, b), (0.0, 1.0));
        assert!((exposure - 12.5).abs() < 1e-9, "{exposure} from {a:?}");
    }
}

/// Beyond a corner and on along the side, exactly in line or a rounding error off.
#[test]
fn a_leg_along_a_side_pays_before_its_corners_too() {
    for (a, b, expected) in [
        ([-20.0, 10.0], [30.0, 10.0], 200.0),
        ([30.0, 0.0], [-20.0, 0.0], 200.0),
        ([5.0, 10.0], [30.0, 10.0], 100.0),
        ([10.0, 30.0], [10.0, 5.0], 100.0),
        ([10.0, 30.0], [10.0, -5.0], 187.5),
        ([0.0, -30.0], [0.0, 2.0], 70.0),
    ] {
        for (off, on) in [(0.0, 0.0), (1e-13, 0.0), (-1e-13, 0.0), (1e-13, -1e-13)] {
            let (a, b) = (a.map(|at| at + off), b.map(|at| at + on));
            let leg = leg([a[0], a[1], 0.0], [b[0], b[1], 0.0]);
            let exposure = square(10.0).exposure(&leg, (0.0, 1.0));
            assert!(
                (exposure - expected).abs() < 1e-9,
                "{exposure} from {a:?} to {b:?}, {off} off"
            );
        }
    }
}

/// At a vertex where two sides are in line, only one of them is beside the leg.
#[test]
fn a_leg_at_right_angles_to_a_straight_vertex_is_exposed_once() {
    let ring = ring(
        &[
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 5.0],
            [10.0, 10.0],
            [0.0, 10.0],
        ],
        10.0,
    );
    for off in [0.0, 1e-10, -1e-10] {
        let leg = leg([30.0, 5.0 + off, 0.0], [12.0, 5.0 + off, 0.0]);
        let exposure = ring.exposure(&leg, (0.0, 1.0));
        assert!((exposure - 32.0).abs() < 1e-9, "{exposure} {off}");
    }
}

/// The same where rounding makes a dent or a bump of the vertex, in a ring that points inwards elsewhere; and where a leg
/// leaves a corner that is doubled within rounding.
#[test]
fn vertices_that_are_nearly_straight_or_doubled_are_exposed_once() {
    for dent in [
        0.0, 1e-15, -1e-15, 1e-13, -1e-13, 1e-11, -1e-11, 1e-9, -1e-9,
    ] {
        let notched = ring(
            &[
                [-10.0, 0.0],
                [0.0, dent],
                [10.0, 0.0],
                [10.0, 10.0],
                [0.0, 5.0],
                [-10.0, 10.0],
            ],
            60.0,
        );
        let down = leg([0.0, -1.0, 0.0], [0.0, -50.0, 0.0]);
        let exposure = notched.exposure(&down, (0.0, 1.0));
        assert!((exposure - 1690.5).abs() < 1e-6, "{exposure} {dent}");
    }
    let subdivided = ring(
        &[
            [0.0, 0.0],
            [0.1, 0.300_000_000_000_000_04],
            [0.300_000_000_000_000_04, 0.9],
            [-2.7, 1.9],
            [-0.500_000_000_000_000_1, 0.5],
            [-3.0, 1.0],
        ],
        20.0,
    );
    let away = leg([1.6, -0.2, 0.0], [9.1, -2.7, 0.0]);
    let exposure = subdivided.exposure(&away, (0.0, 1.0));
    let sum = exposure_of_parts(&subdivided, &away, (0.0, 1.0));
    assert!((exposure - sum).abs() < 1e-8, "{exposure} {sum}");
    for gap in [1e-13, 5e-13, 5e-12, 5e-11, 5e-10, 5e-9, 1e-7] {
        let doubled = ring(
            &[
                [0.0, 0.0],
                [10.0, 0.0],
                [10.0, gap],
                [10.0, 10.0],
                [5.0, 4.0],
                [0.0, 10.0],
            ],
            20.0,
        );
        let away = leg([11.0, -1.0, 0.0], [20.0, -10.0, 0.0]);
        let exposure = doubled.exposure(&away, (0.0, 1.0));
        assert!((exposure - 155.558).abs() < 1e-3, "{exposure} {gap}");
    }
}

/// The leg is halved where the nearest feature changes, and each half of the first half again.
#[test]
fn features_may_change_exactly_in_the_middle() {
    let ring = ring(
        &[
            [250.0, 250.0],
            [400.0, 250.0],
            [400.0, 325.0],
            [325.0, 325.0],
            [325.0, 400.0],
            [250.0, 400.0],
        ],
        100.0,
    );
    for end in [[99.7, 399.933], [99.7, 399.933_000_000_1]] {
        let leg = leg([400.0, 467.0, 0.0], [end[0], end[1], 0.0]);
        let exposure = ring.exposure(&leg, (0.0, 1.0));
        let n = 200_000;
        let sum: f64 = (0..n)
            .map(|idx| ring.intensity(leg.at((f64::from(idx) + 0.5) / f64::from(n)).xy()))
            .sum();
        let expected = sum * leg.length() / f64::from(n);
        assert!((exposure - expected).abs() < 1e-3, "{exposure} {expected}");
    }
}

/// Both walls of a bay are equally near all along its middle: each point belongs to one of them.
#[test]
fn the_middle_of_a_bay_is_exposed_once() {
    for (margin, to, expected) in [
        // 2 m of T down to where the end of the bay is as near, and up to 5 m more beyond.
        (7.0, 5.0, 2.0 * 15.0),
        (7.0, 2.0, 2.0 * 15.0 + 3.0 * 3.5),
        (5.0, 2.0, 3.0 * 1.5),
    ] {
        for off in [0.0, 1e-13, -1e-13] {
            let down = leg([off, 20.0, 0.0], [off, to, 0.0]);
            let exposure = bay(margin).exposure(&down, (0.0, 1.0));
            assert!((exposure - expected).abs() < 1e-9, "{exposure} {expected}");
        }
    }
}

/// Across the square at mid-height: two ramps of the margin outside and 10 m inside.
#[test]
fn exposure_across() {
    let exposure = square(2.0).exposure(&leg([-20.0, 5.0, 0.0], [30.0, 5.0, 0.0]), (0.0, 1.0));
    assert!((exposure - (2.0 + 2.0 + 20.0)).abs() < 1e-9, "{exposure}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 4, ..ProptestConfig::default() })]

    /// Rings of many corners, whose cells cut off each other: few and many of them within the margin.
    #[test]
    fn exposure_to_a_jagged_ring_is_that_of_all_pieces(
        corners in prop::collection::vec(0.0..1.0f64, 40..200), jagged in 0.0..0.3f64, margin in 0.5..40.0f64,
        a in prop::array::uniform3(-90.0..90.0f64), b in prop::array::uniform3(-90.0..90.0f64),
    ) {
        let count = corners.len() as f64;
        let corner = |(idx, away): (usize, &f64)| {
            let angle = std::f64::consts::TAU * idx as f64 / count;
            let (sin, cos) = libm::sincos(angle);
            let wave = 1.0 + 0.2 * libm::sin(3.0 * angle) + jagged * away;
            Point2::new(50.0 * wave * cos, 50.0 * wave * sin)
        };
        let ring = Polygon::new(corners.iter().enumerate().map(corner).collect(), margin);
        let leg = leg(a, b);
        let sum = exposure_of_parts(&ring, &leg, (0.0, 1.0));
        let exposure = ring.exposure(&leg, (0.0, 1.0));
        prop_assert!((exposure - sum).abs() <= 1e-8 * (1.0 + sum), "{exposure} {sum}");
    }
}
