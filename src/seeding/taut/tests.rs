//! Taut strings checked against lengths worked by hand and against finely sampled circles.

use super::*;
use crate::geometry::Rect;
use crate::seeding::{Outline, OutlineShape};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

fn disc(x: f64, y: f64, radius: f64) -> Outline {
    Outline {
        shape: OutlineShape::Disc(Point2::new(x, y)),
        radius,
        core: radius,
    }
}

fn ring(vertices: &[[f64; 2]], radius: f64) -> Outline {
    Outline {
        shape: OutlineShape::Ring(vertices.iter().map(|&v| Point2::from(v)).collect()),
        radius,
        core: 0.0,
    }
}

fn strings(outlines: &[Outline], ends: [[f64; 2]; 2], k: usize) -> Vec<TautString> {
    let scene = Obstacles::new(
        outlines.iter().cloned().map(Some),
        ends.map(Point2::from),
        None,
    );
    taut_strings(&scene, k).strings
}

fn lengths(outlines: &[Outline], ends: [[f64; 2]; 2], k: usize) -> Vec<f64> {
    let strings = strings(outlines, ends, k);
    for string in &strings {
        let sum: f64 = string.pieces.iter().map(Piece::length).sum();
        assert!(
            (sum - string.length).abs() < 1e-9 * (1.0 + sum),
            "{string:?}"
        );
    }
    strings.iter().map(|string| string.length).collect()
}

/// The outline around which a piece bends, if any.
fn rounded(piece: &Piece) -> Option<usize> {
    match piece {
        Piece::Arc { outline, .. } => Some(*outline),
        Piece::Straight { .. } => None,
    }
}

#[track_caller]
fn check(outlines: &[Outline], ends: [[f64; 2]; 2], expected: &[f64]) {
    let found = lengths(outlines, ends, expected.len().max(1));
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-7 * expected,
            "{found} {expected}"
        );
    }
}

/// Two tangents of sqrt(10^2 - 5^2) and an arc of 180 - 2 * 60 degrees.
fn round_a_disc() -> f64 {
    2.0 * 75.0_f64.sqrt() + 5.0 * PI / 3.0
}

#[test]
fn strings_around_discs_have_the_lengths_worked_by_hand() {
    let west_east = [[-10.0, 0.0], [10.0, 0.0]];
    check(&[], west_east, &[20.0]);
    check(&[disc(0.0, 20.0, 5.0)], west_east, &[20.0]);
    check(&[disc(0.0, 5.0, 5.0)], west_east, &[20.0]);
    check(&[disc(0.0, 0.0, 5.0)], west_east, &[round_a_disc(); 2]);
    // A duplicate of the disc adds no second way past it.
    check(
        &[disc(0.0, 0.0, 5.0), disc(0.0, 0.0, 5.0)],
        west_east,
        &[round_a_disc(); 2],
    );
    // One inside the other, touching it from within.
    check(
        &[disc(0.0, 0.0, 5.0), disc(0.0, 3.0, 2.0)],
        west_east,
        &[round_a_disc(); 2],
    );
    // Two discs side by side, with tangents along both.
    let side_by_side = 2.0 * 75.0_f64.sqrt() + 5.0 * PI / 3.0 + 8.0;
    check(
        &[disc(0.0, 0.0, 5.0), disc(8.0, 0.0, 5.0)],
        [[-10.0, 0.0], [18.0, 0.0]],
        &[side_by_side; 2],
    );
    // Above one disc and below the other: the inner tangent crosses at 30 degrees, cos 60 = 2 * 5 / 20.
    let slalom = 2.0 * (400.0_f64 - 25.0).sqrt() + 300.0_f64.sqrt();
    let s_shaped = strings(
        &[disc(0.0, 0.0, 5.0), disc(20.0, 0.0, 5.0)],
        [[-20.0, 0.0], [40.0, 0.0]],
        4,
    );
    let turn = |share: f64| libm::acos(share);
    let arcs = 2.0 * 5.0 * (PI - turn(0.25) - turn(0.5));
    assert!(
        (s_shaped[2].length - slalom - arcs).abs() < 1e-9,
        "{s_shaped:?}"
    );
    assert_eq!(s_shaped.len(), 4);
}

#[test]
fn strings_around_ring_corners_have_the_lengths_worked_by_hand() {
    let square = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]];
    let west_east = [[-10.0, 0.0], [10.0, 0.0]];
    check(
        &[ring(&square, 0.0)],
        west_east,
        &[2.0 * 50.0_f64.sqrt() + 10.0; 2],
    );
    // Widened by 1: the two corners share a quarter circle.
    let to_corner = (25.0_f64 + 25.0 - 1.0).sqrt();
    let slope = libm::atan2(5.0, 5.0) + libm::asin(1.0 / 50.0_f64.sqrt());
    check(
        &[ring(&square, 1.0)],
        west_east,
        &[2.0 * to_corner + 10.0 + 2.0 * slope; 2],
    );
    // Along the diagonal, through two of its corners.
    check(
        &[ring(&square, 0.0)],
        [[-10.0, -10.0], [10.0, 10.0]],
        &[2.0 * (25.0_f64 + 225.0).sqrt(); 2],
    );
    // Two squares with a common side, between which no way leads.
    let next = [[5.0, -5.0], [15.0, -5.0], [15.0, 5.0], [5.0, 5.0]];
    check(
        &[ring(&square, 0.0), ring(&next, 0.0)],
        [[-10.0, 0.0], [20.0, 0.0]],
        &[2.0 * 50.0_f64.sqrt() + 20.0; 2],
    );
}

#[test]
fn a_string_leaves_a_u_through_its_open_side() {
    let u = [
        [-20.0, -20.0],
        [20.0, -20.0],
        [20.0, 20.0],
        [18.0, 20.0],
        [18.0, -18.0],
        [-18.0, -18.0],
        [-18.0, 20.0],
        [-20.0, 20.0],
    ];
    // To the inner corner, over the wall, down its outside, and below it.
    let length = (18.0_f64 * 18.0 + 20.0 * 20.0).sqrt() + 2.0 + 40.0 + 800.0_f64.sqrt();
    check(&[ring(&u, 0.0)], [[0.0, 0.0], [0.0, -40.0]], &[length; 2]);
}

#[test]
fn strings_enter_a_ring_of_discs_only_through_its_gap() {
    let mut discs = Vec::new();
    for i in 1..24 {
        let angle = PI * f64::from(i) / 12.0;
        discs.push(disc(
            100.0 * libm::cos(angle),
            100.0 * libm::sin(angle),
            15.0,
        ));
    }
    let found = strings(&discs, [[-300.0, 0.0], [0.0, 0.0]], 4);
    assert!(found.len() >= 2, "{}", found.len());
    // The only way in is past (100, 0).
    for string in &found {
        let at_gap = (0..=2000)
            .map(|i| (string.at(f64::from(i) / 2000.0) - Point2::new(100.0, 0.0)).norm())
            .fold(f64::INFINITY, f64::min);
        assert!(at_gap < 15.0, "{at_gap}");
    }
    let mut closed = discs.clone();
    closed.push(disc(100.0, 0.0, 15.0));
    assert!(strings(&closed, [[-300.0, 0.0], [0.0, 0.0]], 4).is_empty());
}

#[test]
fn ends_on_or_inside_a_soft_zone_shrink_it() {
    let soft = Outline {
        core: 2.0,
        ..disc(0.0, 0.0, 5.0)
    };
    // From the circle's edge to the opposite point.
    check(
        std::slice::from_ref(&soft),
        [[-5.0, 0.0], [5.0, 0.0]],
        &[5.0 * PI; 2],
    );
    // The zone is shrunk to the distance of the nearer end.
    let tangent = 91.0_f64.sqrt();
    let arc = 3.0 * (PI - libm::acos(0.3));
    check(
        std::slice::from_ref(&soft),
        [[-3.0, 0.0], [10.0, 0.0]],
        &[tangent + arc; 2],
    );
    // Inside the core, the end is assumed to be above it.
    check(
        std::slice::from_ref(&soft),
        [[-1.0, 0.0], [10.0, 0.0]],
        &[11.0],
    );
    check(
        &[disc(0.0, 0.0, 5.0)],
        [[0.0, -5.0], [5.0, 0.0]],
        &[5.0 * FRAC_PI_2, 5.0 * 1.5 * PI],
    );
}

#[test]
fn strings_stay_within_the_area() {
    let area = Rect {
        min: Point2::new(-20.0, -3.0),
        max: Point2::new(20.0, 20.0),
    };
    let scene = Obstacles::new(
        [Some(disc(0.0, 0.0, 5.0))],
        [Point2::new(-10.0, 0.0), Point2::new(10.0, 0.0)],
        Some(area),
    );
    let found = taut_strings(&scene, 3).strings;
    assert_eq!(found.len(), 1);
    assert!(found[0].at(0.5).y > 4.9);
}

/// A small disc protrudes from a large one, and a string around both returns to the large one.
#[test]
fn a_string_can_return_to_the_same_circle() {
    let outlines = [
        disc(39.28, -4.78, 13.27),
        disc(40.49, 2.78, 5.73),
        disc(66.49, 9.89, 14.03),
    ];
    let ends = [[0.0, 0.0], [100.0, 0.0]];
    let alone = &strings(&outlines, ends, 1)[0];
    let rounded: Vec<usize> = alone.pieces.iter().filter_map(rounded).collect();
    assert_eq!(rounded, [0, 1, 0, 2]);
    for k in 2..=5 {
        let first = &strings(&outlines, ends, k)[0];
        assert!((first.length - alone.length).abs() < 1e-9);
    }
}

/// The shortest path among points sampled on the circles, by brute force; the samples lie slightly outside, so
/// that it is never shorter than the taut string.
fn sampled(discs: &[(f64, f64, f64)], ends: [[f64; 2]; 2]) -> f64 {
    const SAMPLES: i32 = 48;
    let step = PI / f64::from(SAMPLES);
    let mut points = ends.map(Point2::from).to_vec();
    for &(x, y, radius) in discs {
        for i in 0..SAMPLES {
            let (angle, away) = (2.0 * step * f64::from(i), radius / libm::cos(step));
            points.push(Point2::new(
                x + away * libm::cos(angle),
                y + away * libm::sin(angle),
            ));
        }
    }
    let free = |a: Point2, b: Point2| {
        discs.iter().all(|&(x, y, radius)| {
            super::super::arc::point_segment(Point2::new(x, y), a, b) >= radius - 1e-9
        })
    };
    let mut best = vec![f64::INFINITY; points.len()];
    let mut done = vec![false; points.len()];
    best[0] = 0.0;
    while let Some(at) = (0..points.len())
        .filter(|&i| !done[i] && best[i].is_finite())
        .min_by(|&i, &j| best[i].total_cmp(&best[j]))
    {
        done[at] = true;
        if at == 1 {
            break;
        }
        for to in 0..points.len() {
            let length = best[at] + (points[to] - points[at]).norm();
            if !done[to] && length < best[to] && free(points[at], points[to]) {
                best[to] = length;
            }
        }
    }
    best[1]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 4, ..ProptestConfig::default() })]

    #[test]
    fn the_first_string_is_as_short_as_by_brute_force(
        discs in prop::collection::vec((10.0..90.0f64, -40.0..40.0f64, 3.0..16.0f64), 1..7),
    ) {
        let ends = [[0.0, 0.0], [100.0, 0.0]];
        let free: Vec<_> = discs
            .iter()
            .filter(|(x, y, r)| (x * x + y * y).sqrt() > *r && ((100.0 - x) * (100.0 - x) + y * y).sqrt() > *r)
            .copied()
            .collect();
        let outlines: Vec<Outline> = free.iter().map(|&(x, y, r)| disc(x, y, r)).collect();
        let found = lengths(&outlines, ends, 1);
        let brute = sampled(&free, ends);
        if let Some(&found) = found.first() {
            prop_assert!(found <= brute + 1e-6, "{found} {brute}");
            // The sampled circles lie slightly outside the discs and close the narrowest gaps.
            let is_narrow = |(i, (x, y, r)): (usize, &(f64, f64, f64))| {
                free[..i].iter().any(|(u, v, s)| {
                    let gap = ((x - u) * (x - u) + (y - v) * (y - v)).sqrt() - r - s;
                    (0.0..0.2).contains(&gap)
                })
            };
            let closed = free.iter().enumerate().any(is_narrow);
            prop_assert!(
                brute - found < 0.02 * found || brute.is_infinite() || closed,
                "{found} {brute}"
            );
        } else {
            prop_assert!(brute.is_infinite(), "{brute}");
        }
        // Asking for more strings does not change the first, and lengths never decrease.
        let several = lengths(&outlines, ends, 5);
        if let Some(first) = found.first() {
            prop_assert!((several[0] - first).abs() < 1e-9);
            prop_assert!(several.windows(2).all(|pair| pair[0] <= pair[1]));
        }
    }
}
