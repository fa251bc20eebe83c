//! Distances and integrals computed by hand, and compared with fine sums.

mod exposure;

use super::*;
use crate::geometry::Point3;
use proptest::prelude::*;

fn square(margin: f64) -> Polygon {
    ring(
        &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]],
        margin,
    )
}

fn ring(vertices: &[[f64; 2]], margin: f64) -> Polygon {
    Polygon::new(vertices.iter().map(|&v| Point2::from(v)).collect(), margin)
}

fn leg(a: [f64; 3], b: [f64; 3]) -> Segment {
    Segment {
        a: Point3::from(a),
        b: Point3::from(b),
    }
}

/// A ring round three sides of a bay 10 m wide and 20 m long.
fn bay(margin: f64) -> Polygon {
    ring(
        &[
            [-10.0, -5.0],
            [10.0, -5.0],
            [10.0, 20.0],
            [5.0, 20.0],
            [5.0, 0.0],
            [-5.0, 0.0],
            [-5.0, 20.0],
            [-10.0, 20.0],
        ],
        margin,
    )
}

/// A part of a leg with one nearest feature, all inside the ring or all outside.
struct Part {
    piece: Piece,
    inside: bool,
}

/// The part `window` of `leg`, cut in order where the nearest feature of the ring changes and where the leg crosses the
/// ring.
fn parts(ring: &Polygon, leg: &Segment, window: (f64, f64)) -> Vec<Part> {
    let features = ring.features(leg, window);
    let crossings = nearest::crossings(&features, window);
    let (length, mut parts) = (leg.horizontal_length(), Vec::new());
    cut(&features, window, length, &|_| true, &mut |piece| {
        let crossings = crossings.iter().map(|crossing| crossing.t);
        let within = crossings.filter(|&t| piece.t0 < t && t < piece.t1);
        let ends = [&[piece.t0][..], &within.collect::<Vec<_>>(), &[piece.t1]].concat();
        for ends in ends.windows(2) {
            let [t0, t1] = [ends[0], ends[1]];
            let inside = ring.contains(leg.at(0.5 * (t0 + t1)).xy());
            let piece = Piece { t0, t1, ..piece };
            parts.push(Part { piece, inside });
        }
    });
    parts
}

/// Exposure of a leg as the sum over its parts, without cells.
fn exposure_of_parts(ring: &Polygon, leg: &Segment, window: (f64, f64)) -> f64 {
    let of = |part: &Part| {
        if part.inside {
            ring.margin * (part.piece.t1 - part.piece.t0) * leg.length()
        } else {
            ring.piece_exposure(leg, &part.piece)
        }
    };
    parts(ring, leg, window).iter().map(of).sum()
}

#[test]
fn clearance_is_exact_and_signed() {
    let check = |a, b, expected: f64| {
        let clearance = square(0.0).clearance(&leg(a, b), (0.0, 1.0));
        assert!(
            (clearance - expected).abs() < 1e-9,
            "{clearance} {expected}"
        );
    };
    check([-5.0, 13.0, 0.0], [15.0, 13.0, 0.0], 3.0);
    check([-5.0, 5.0, 0.0], [15.0, 5.0, 0.0], -5.0);
    check([-5.0, 9.0, 0.0], [15.0, 9.0, 0.0], -1.0);
    check([13.0, 14.0, 0.0], [20.0, 30.0, 0.0], 5.0);
    // Along an edge and through a corner: touching is not entering.
    check([-5.0, 10.0, 0.0], [15.0, 10.0, 0.0], 0.0);
    check([-5.0, 5.0, 0.0], [5.0, -5.0, 0.0], 0.0);
    check([4.0, 4.0, 0.0], [4.0, 4.0, 9.0], -4.0);
}

#[test]
fn the_span_of_a_leg_covers_all_of_it_that_is_inside() {
    let check = |ring: &Polygon, [from_x, to_x]: [f64; 2], y: f64, expected: Option<[f64; 2]>| {
        let span = ring.span(&leg([from_x, y, 50.0], [to_x, y, 80.0]));
        let places =
            span.map(|(from, to)| [from, to].map(|share| from_x + share * (to_x - from_x)));
        match (places, expected) {
            (Some(found), Some(expected)) => {
                let off = [found[0] - expected[0], found[1] - expected[1]];
                assert!(off.iter().all(|off| off.abs() < 1e-9), "{found:?}");
            }
            (found, expected) => assert_eq!(found, expected),
        }
    };
    let square = square(10.0);
    check(&square, [-10.0, 20.0], 5.0, Some([0.0, 10.0]));
    check(&square, [5.0, 25.0], 5.0, Some([5.0, 10.0]));
    check(&square, [-10.0, 5.0], 5.0, Some([0.0, 5.0]));
    check(&square, [2.0, 8.0], 5.0, Some([2.0, 8.0]));
    check(&square, [10.0, 20.0], 5.0, Some([10.0, 10.0]));
    check(&square, [0.0, 5.0], 5.0, Some([0.0, 5.0]));
    check(&square, [-10.0, 20.0], 11.0, None);
    // What lies between the arms of a bay is covered too.
    check(&bay(0.0), [-20.0, 20.0], 10.0, Some([-10.0, 10.0]));
}

/// A leg that rises just to the base of a threat still enters it.
#[test]
fn a_single_point_may_lie_inside() {
    let check = |at: f64, expected: f64| {
        let clearance = square(0.0).clearance(&leg([-5.0, 7.0, 0.0], [5.0, 7.0, 9.0]), (at, at));
        assert!((clearance - expected).abs() < 1e-9, "{clearance}");
    };
    check(1.0, -3.0);
    check(0.7, -2.0);
    check(0.2, 3.0);
}

/// The deepest point of a leg is where two edges are equally near, found after visiting a third.
#[test]
fn a_triangle_is_entered_as_deep_as_it_is() {
    let corners = [0.0, 120.0, 240.0_f64].map(|degrees| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        [40.0 * cos, 40.0 * sin]
    });
    let triangle = ring(&corners, 0.0);
    let leg = leg([11.5, -5.7, 0.0], [-48.2, 41.9, 0.0]);
    let sampled = (0..=20_000)
        .map(|step| -triangle.distance(leg.at(f64::from(step) / 20_000.0).xy()))
        .fold(0.0, f64::max);
    let (depth, _) = triangle.encounter(&leg, (0.0, 1.0));
    assert!((depth - sampled).abs() < 0.01, "{depth} {sampled}");
}

/// The middle of the leg is equally far from both walls of a bay; beyond it the other wall is nearer.
#[test]
fn a_tie_at_the_middle_is_seen() {
    let bay = bay(5.0);
    let across = leg([-4.0, 10.0, 0.0], [4.0, 10.0, 0.0]);
    let clearance = bay.clearance(&across, (0.0, 1.0));
    assert!((clearance - 1.0).abs() < 1e-9, "{clearance}");
    let (depth, exposure) = bay.encounter(&across, (0.0, 1.0));
    assert!(depth <= 0.0, "{depth}");
    // T falls from 4 m to 0 at the middle and rises again.
    assert!((exposure - 16.0).abs() < 1e-9, "{exposure}");
}

/// A box in degrees with vertices in the middle of its sides, mapped to the plane: nearly straight there. A leg that
/// enters and leaves beside a vertex is detected in any position.
#[test]
fn sides_that_are_nearly_straight_are_not_entered_unseen() {
    const CORNERS: [[f64; 2]; 7] = [
        [-16.237_316_54, -2.609_682_7],
        [-15.769_521_52, -2.609_683_97],
        [-15.301_726_49, -2.609_685_21],
        [-15.301_725_28, -2.143_330_36],
        [-15.301_724_06, -1.676_975_51],
        [-16.237_313_97, -1.676_973],
        [-16.237_315_26, -2.143_327_85],
    ];
    let mut state = 7_u64;
    let mut draw = |from: f64, to: f64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        from + (to - from) * f64::from((state >> 33) as u32) / 2_147_483_648.0
    };
    for step in 0..6000 {
        let corners = CORNERS.map(|[x, y]| [x + draw(-2e-9, 2e-9), y + draw(-2e-9, 2e-9)]);
        let box_in_degrees = ring(&corners, 0.9);
        let [x, y] = corners[step % corners.len()];
        let beside = libm::pow(10.0, draw(-12.0, -2.0));
        let (x, y) = match step % 4 {
            0 => (x, y + beside),
            1 => (x + beside, y),
            2 => (x, y - beside),
            _ => (x - beside, y + beside),
        };
        let (sin, cos) = libm::sincos(draw(0.0, std::f64::consts::TAU));
        let (before, after) = (draw(1.0, 30.0), draw(1.0, 30.0));
        let leg = leg(
            [x - before * cos, y - before * sin, 0.0],
            [x + after * cos, y + after * sin, 0.0],
        );
        let whole = leg.horizontal_length();
        let deepest = (-100..=100)
            .map(|look| (before + 0.01 * f64::from(look)) / whole)
            .map(|t| -box_in_degrees.distance(leg.at(t).xy()))
            .fold(0.0, f64::max);
        let window = (0.0, 1.0);
        let (depth, _) = box_in_degrees.encounter(&leg, window);
        for depth in [-box_in_degrees.clearance(&leg, window), depth] {
            assert!(
                depth.max(0.0) >= deepest - 1e-6,
                "step {step}: {depth} of {deepest}, {leg:?}"
            );
        }
    }
}

fn star() -> Polygon {
    ring(
        &[
            [0.0, 20.0],
            [4.0, 5.0],
            [20.0, 4.0],
            [6.0, -4.0],
            [10.0, -20.0],
            [-2.0, -6.0],
            [-18.0, -9.0],
            [-6.0, 3.0],
        ],
        7.0,
    )
}

/// 100 km along an edge, half a millimetre inside and outside.
#[test]
fn a_long_leg_is_measured_as_exactly_as_a_short_one() {
    let strip = ring(&[[-1e5, 0.0], [2e5, 0.0], [2e5, 1e4], [-1e5, 1e4]], 0.0);
    for away in [-5e-4, 5e-4, 1e-6, -1e-6] {
        let (sin, cos) = (0.5 * away, away);
        let clearance = strip.clearance(&leg([0.0, -sin, 0.0], [1e5, -cos, 0.0]), (0.0, 1.0));
        let expected = if away < 0.0 { away } else { sin };
        assert!(
            (clearance - expected).abs() < 1e-9,
            "{clearance} {expected}"
        );
    }
    let corner = ring(&[[5e4, 0.0], [6e4, 1e4], [4e4, 1e4]], 0.0);
    let clearance = corner.clearance(&leg([0.0, -1e-4, 0.0], [1e5, -1e-4, 0.0]), (0.0, 1.0));
    assert!((clearance - 1e-4).abs() < 1e-9, "{clearance}");
}

/// A ring of 20 000 vertices along a leg once took minutes.
#[test]
fn a_ring_of_many_vertices_agrees_with_sums() {
    let vertices = (0..20_000).map(|corner| {
        let angle = std::f64::consts::TAU * f64::from(corner) / 20_000.0;
        let away = if corner % 2 == 0 { 1000.0 } else { 900.0 };
        Point2::new(away * libm::cos(angle), away * libm::sin(angle))
    });
    let flower = Polygon::new(vertices.collect(), 200.0);
    for (a, b) in [
        ([-2000.0, 1100.0, 0.0], [2000.0, 900.0, 0.0]),
        ([-2000.0, 10.0, 0.0], [1500.0, 300.0, 0.0]),
    ] {
        let leg = leg(a, b);
        let clearance = flower.clearance(&leg, (0.0, 1.0));
        let (depth, exposure) = flower.encounter(&leg, (0.0, 1.0));
        assert!(
            (depth + clearance.min(0.0)).abs() < 1e-7,
            "{depth} {clearance}"
        );
        let steps = 100;
        let points = (0..steps).map(|i| leg.at((f64::from(i) + 0.5) / f64::from(steps)).xy());
        let (mut sum, mut signed) = (0.0, f64::INFINITY);
        for point in points {
            sum += flower.intensity(point) * leg.length() / f64::from(steps);
            signed = signed.min(flower.distance(point));
        }
        assert!(
            (exposure - sum).abs() < 0.01 * (1.0 + sum),
            "{exposure} {sum}"
        );
        assert!((clearance - signed).abs() < 10.0, "{clearance} {signed}");
    }
}

/// A leg enters and leaves each tooth, without visiting all edges each time.
#[test]
fn a_leg_through_five_thousand_teeth_is_quick() {
    let teeth = 5_000;
    let mut corners = Vec::new();
    for tooth in 0..teeth {
        let y = 2.0 * f64::from(tooth);
        corners.extend([[0.0, y], [10.0, y], [10.0, y + 1.0], [0.0, y + 1.0]]);
    }
    let last = 2.0 * f64::from(teeth) - 1.0;
    corners.extend([[-5.0, last], [-5.0, 0.0]]);
    let comb = ring(&corners, 1.0);
    let leg = leg([5.0, -2.0, 0.0], [5.0, last + 2.0, 0.0]);
    let (depth, exposure) = comb.encounter(&leg, (0.0, 1.0));
    let clearance = comb.clearance(&leg, (0.0, 1.0));
    assert!((depth - 0.5).abs() < 1e-6, "{depth}");
    assert!((clearance + 0.5).abs() < 1e-6, "{clearance}");
    // 1 m in each tooth, 0.75 m in each gap, 0.5 m at either end.
    let expected = f64::from(teeth) + 0.75 * f64::from(teeth - 1) + 1.0;
    assert!(
        (exposure - expected).abs() < 1e-6 * expected,
        "{exposure} {expected}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 4, ..ProptestConfig::default() })]

    #[test]
    fn a_concave_ring_agrees_with_sums(
        a in prop::array::uniform3(-30.0..30.0f64), b in prop::array::uniform3(-30.0..30.0f64),
        t0 in 0.0..0.4f64, t1 in 0.6..1.0f64,
    ) {
        let (star, leg) = (star(), leg(a, b));
        let steps = 20_000;
        let points = (0..steps).map(|i| leg.at(t0 + (t1 - t0) * (f64::from(i) + 0.5) / f64::from(steps)).xy());
        let (mut sum, mut signed) = (0.0, f64::INFINITY);
        for point in points {
            // What `intensity` is made of, with the distance asked for once.
            let distance = star.distance(point);
            sum += intensity(star.margin, distance.max(0.0));
            signed = signed.min(distance);
        }
        sum *= leg.length() * (t1 - t0) / f64::from(steps);
        let exposure = star.exposure(&leg, (t0, t1));
        prop_assert!((exposure - sum).abs() <= 2e-4 * (1.0 + sum), "{exposure} {sum}");
        let clearance = star.clearance(&leg, (t0, t1));
        prop_assert!((clearance - signed).abs() <= leg.length() / f64::from(steps), "{clearance} {signed}");
        if !star.may_reach(&leg) {
            prop_assert!(exposure.abs() < 1e-12);
        }
    }

    /// A leg that cuts micrometres off a corner has that depth, however long it is.
    #[test]
    fn a_corner_that_is_only_just_cut_off_is_cut_as_deep_as_it_is(
        depth in 1e-6..1e-3f64, turn in 0.0..std::f64::consts::TAU, reach in 1e3..1e4f64,
    ) {
        let (sin, cos) = libm::sincos(turn);
        let turned = |[x, y]: [f64; 2]| Point2::new(5e3 + x * cos - y * sin, 5e3 + x * sin + y * cos);
        let corners = [[0.0, 0.0], [-300.0, -400.0], [300.0, -400.0]];
        let ring = Polygon::new(corners.map(turned).to_vec(), 0.0);
        let [from, to] = [[-reach, -depth], [0.3 * reach, -depth]].map(turned);
        let leg = leg([from.x, from.y, 0.0], [to.x, to.y, 0.0]);
        // In the middle of the cut, measured from either edge of the corner, whose sides are in the ratio 3 to 4.
        let clearance = ring.clearance(&leg, (0.0, 1.0));
        prop_assert!((clearance + 0.6 * depth).abs() < 1e-9, "{clearance} {depth}");
    }

    /// Skipping far features does not change the result: compared with all pieces of the leg, for convex and
    /// non-convex rings, and legs inside, beside, through and along the edges of the ring.
    #[test]
    fn an_encounter_is_that_of_all_pieces(
        corners in prop::collection::vec(0.4..1.0f64, 3..30), round in 0..2_usize, margin in 0.0..40.0f64,
        a in prop::array::uniform3(-60.0..60.0f64), b in prop::array::uniform3(-60.0..60.0f64),
        t0 in 0.0..0.4f64, t1 in 0.6..1.0f64, beside in 0..30_usize,
    ) {
        let count = corners.len() as f64;
        let corner = |(idx, away): (usize, &f64)| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * idx as f64 / count);
            Point2::new(cos, sin) * if round == 0 { 40.0 } else { 40.0 * away }
        };
        let vertices: Vec<_> = corners.iter().enumerate().map(corner).collect();
        let ring = Polygon::new(vertices.clone(), margin);
        prop_assert!(round == 1 || ring.is_convex);
        let mut leg = leg(a, b);
        if let Some(edge) = vertices.get(beside..beside + 2) {
            let [height, rise] = [leg.a.z, leg.b.z];
            leg = Segment {
                a: edge[0].coords.push(height).into(),
                b: edge[1].coords.push(rise).into(),
            };
        }
        for window in [(t0, t1), (0.0, 1.0), (t0, t0)] {
            let (depth, exposure) = ring.encounter(&leg, window);
            let parts = parts(&ring, &leg, window);
            let within = || parts.iter().filter(|part| part.inside).map(|part| part.piece);
            // Inside, distance is convex on each piece, so its maximum is at an end; for a leg from edge to edge of a
            // ring so sharp or so small that no piece ends between, it is at the middle.
            let at_ends = within().map(|piece| piece.end_distances(&leg));
            let mut deepest = at_ends.fold(0.0, |depth: f64, (d0, d1)| depth.max(d0).max(d1));
            if deepest <= 0.0 {
                let middles = within().map(|piece| leg.at(0.5 * (piece.t0 + piece.t1)).xy());
                deepest = middles.map(|point| ring.ring_distance(point)).fold(0.0, f64::max);
            }
            let sum = exposure_of_parts(&ring, &leg, window);
            // Along an edge, pieces tell the sides apart to a fraction of the leg.
            prop_assert!((depth - deepest).abs() < 1e-6, "{depth} {deepest}");
            prop_assert!((exposure - sum).abs() <= 1e-8 * (1.0 + sum), "{exposure} {sum}");
        }
    }

    /// On which side of the ring a leg is after it has crossed, touched or followed edges is what the whole ring says: a
    /// saw on a lattice.
    #[test]
    fn sides_are_told_apart_at_corners_and_along_edges(
        heights in prop::collection::vec(1..6_i32, 8..90), turn in prop_oneof![Just(0.0), Just(0.4)],
        from in (-4..94_i32, -4..9_i32), way in (-60..60_i32, -6..6_i32),
    ) {
        let (sin, cos) = libm::sincos(turn);
        let at = |x: i32, y: i32| {
            let (x, y) = (f64::from(x), f64::from(y));
            Point2::new(x * cos - y * sin, x * sin + y * cos)
        };
        let teeth = heights.iter().zip(0..).map(|(height, idx)| at(idx, *height));
        let count = i32::try_from(heights.len()).expect("few teeth");
        let saw = Polygon::new(teeth.chain([at(count - 1, -2), at(0, -2)]).collect(), 1.0);
        let [a, b] = [at(from.0, from.1), at(from.0 + way.0, from.1 + way.1)];
        let leg = leg([a.x, a.y, 0.0], [b.x, b.y, 3.0]);
        let sides = saw.sides(&leg, &saw.features(&leg, (0.0, 1.0)), (0.0, 1.0));
        prop_assert!(sides[0].0.0 <= 0.0 && sides[sides.len() - 1].0.1 >= 1.0);
        for pair in sides.windows(2) {
            prop_assert!((pair[0].0.1 - pair[1].0.0).abs() <= 0.0);
        }
        for ((from, to), is_inside) in sides {
            let middle = leg.at(0.5 * (from + to)).xy();
            if to - from > 1e-6 && saw.ring_distance(middle) > 1e-6 {
                prop_assert_eq!(is_inside, saw.contains(middle), "{}", middle);
            }
        }
    }

    #[test]
    fn pieces_cover_the_window_in_order(
        a in prop::array::uniform3(-30.0..30.0f64), b in prop::array::uniform3(-30.0..30.0f64),
    ) {
        let parts = parts(&star(), &leg(a, b), (0.1, 0.9));
        let pieces: Vec<Piece> = parts.into_iter().map(|part| part.piece).collect();
        prop_assert!((pieces[0].t0 - 0.1).abs() < 1e-9);
        prop_assert!((pieces[pieces.len() - 1].t1 - 0.9).abs() < 1e-9);
        for pair in pieces.windows(2) {
            prop_assert!((pair[0].t1 - pair[1].t0).abs() < 1e-9);
        }
    }
}
