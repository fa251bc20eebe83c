//! A scenario whose rings have fewer corners.
//!
//! The outlines of real airspace have corners by the hundred, far closer together than any waypoints. Where rings are
//! drawn a little larger, every route that keeps clear of them keeps clear of the true ones; where they are drawn a little
//! smaller, no route costs more than it does beside the true ones.

use crate::geometry::{Change, Point2, Side, simplified};
use crate::scenario::Scenario;
use crate::threat::{Polygon, Shape, Threat};

/// Rings with no more corners than this are left as they are.
const FEW: usize = 16;

/// It is not worth it where a greater share of all corners than this is left.
const LEFT: f64 = 2.0 / 3.0;

/// How far a simpler ring may be from the true one, as shares of the direct way from start to target.
struct Off {
    /// Always.
    fine: f64,
    /// While it has more than [`ENOUGH`] corners.
    coarse: f64,
}

/// A search ends beside the true rings, which are near then. What a bound loses it loses for good, but beside fewer
/// corners it proves more.
const AROUND: Off = Off {
    fine: 5e-4,
    coarse: 5e-2,
};
const WITHIN: Off = Off {
    fine: 1e-3,
    coarse: 5e-2,
};

/// Few rings need more corners to be gone round.
const ENOUGH: usize = 64;

/// Rings move by no more than this share of the distance from an end or another threat: no gap is closed, or opened.
const NARROWER: f64 = 0.1;

/// `scenario` with simpler rings on one `side` of its own; `None` where that spares too few corners to be worth it.
#[must_use]
pub fn simpler(scenario: &Scenario, side: Side) -> Option<Scenario> {
    let rings = |threats| <[Threat]>::iter(threats).filter_map(ring).map(<[_]>::len);
    if !rings(&scenario.threats).any(|corners| corners > FEW) {
        return None;
    }
    let simpler = |(idx, threat)| simpler_threat(scenario, idx, threat, side);
    let threats: Vec<Threat> = scenario.threats.iter().enumerate().map(simpler).collect();
    let [left, all] = [&threats, &scenario.threats].map(|threats| rings(threats).sum::<usize>());
    (left as f64 <= LEFT * all as f64).then(|| Scenario {
        threats,
        ..scenario.clone()
    })
}

/// The ring of a threat, unless it is a disc.
fn ring(threat: &Threat) -> Option<&[Point2]> {
    match &threat.shape {
        Shape::Cylinder(_) => None,
        Shape::Polygon(polygon) => Some(polygon.vertices()),
    }
}

/// `threat`, which has the index `idx`, with a simpler ring.
fn simpler_threat(scenario: &Scenario, idx: usize, threat: &Threat, side: Side) -> Threat {
    let Shape::Polygon(polygon) = &threat.shape else {
        return threat.clone();
    };
    if polygon.vertices().len() <= FEW {
        return threat.clone();
    }
    let off = match side {
        Side::Around => AROUND,
        Side::Within => WITHIN,
    };
    let ends = [scenario.start, scenario.target].map(|end| end.xy());
    let direct = scenario.direct();
    let reach = threat.extent().grown(off.coarse * direct / NARROWER);
    let others = scenario.threats.iter().enumerate();
    let near: Vec<&Threat> = others
        .filter(|(other, threat)| *other != idx && threat.extent().meets(&reach))
        .map(|(_, threat)| threat)
        .collect();
    let allows = |change: Change| {
        let most = if change.corners > ENOUGH {
            off.coarse
        } else {
            off.fine
        };
        let away = change.off_m / NARROWER;
        // The box tells of most threats that they are far enough.
        let is_clear = |other: &&Threat| {
            other.extent().excess(change.at) >= away || other.distance(change.at).abs() >= away
        };
        change.off_m <= most * direct
            && ends.iter().all(|end| (end - change.at).norm() >= away)
            && near.iter().all(is_clear)
    };
    let ring = simplified(polygon.vertices(), side, allows);
    Threat {
        shape: Shape::Polygon(Polygon::new(ring, polygon.margin())),
        ..threat.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::scenario;
    use super::*;
    use crate::geometry::ring as rings;

    /// A ring of 200 corners, as a member of `threats`.
    fn circle([x, y, radius]: [f64; 3]) -> String {
        let corner = |idx: i32| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU / 200.0 * f64::from(idx));
            format!(
                r#"{{"x": {}, "y": {}}}"#,
                x + radius * cos,
                y + radius * sin
            )
        };
        let corners: Vec<String> = (0..200).map(corner).collect();
        format!(
            r#"{{"kind": "polygon", "margin": 20, "vertices": [{}]}}"#,
            corners.join(", ")
        )
    }

    fn among(circles: &[[f64; 3]]) -> Scenario {
        let circles: Vec<String> = circles.iter().copied().map(circle).collect();
        scenario(&format!(r#""threats": [{}]"#, circles.join(", ")))
    }

    /// Two zones four metres apart, and a third that comes as near to the start.
    #[test]
    fn gaps_stay_open_and_keep_their_widths() {
        let true_ones = among(&[
            [400.0, 400.0, 100.0],
            [604.0, 400.0, 100.0],
            [200.0, 204.0, 100.0],
        ]);
        for side in [Side::Around, Side::Within] {
            let simple = simpler(&true_ones, side).expect("there are many corners");
            let corners: Vec<&[Point2]> = simple.threats.iter().filter_map(ring).collect();
            assert!(corners.iter().map(|ring| ring.len()).sum::<usize>() < 200);
            let apart = |one: &[Point2], other: &[Point2]| {
                let away = one.iter().map(|corner| rings::distance(other, *corner));
                away.fold(f64::INFINITY, f64::min)
            };
            let gap = apart(corners[0], corners[1]).min(apart(corners[1], corners[0]));
            assert!((3.2..4.8).contains(&gap), "{side:?} {gap}");
            let way_out = rings::distance(corners[2], simple.start.xy());
            assert!((3.5..4.5).contains(&way_out), "{side:?} {way_out}");
            for (simple, true_one) in simple.threats.iter().zip(&true_ones.threats) {
                let is_larger = simple.extent().max.x > true_one.extent().max.x;
                assert_eq!(is_larger, side == Side::Around);
                assert_eq!((simple.base, simple.top), (true_one.base, true_one.top));
            }
        }
    }

    #[test]
    fn few_corners_are_left_as_they_are() {
        let discs = super::super::tests::among([[500.0, 500.0, 50.0, 80.0]]);
        assert_eq!(simpler(&discs, Side::Around), None);
        let square = r#""threats": [{"kind": "polygon", "vertices":
            [{"x": 400, "y": 400}, {"x": 500, "y": 400}, {"x": 500, "y": 500}, {"x": 400, "y": 500}]}]"#;
        assert_eq!(simpler(&scenario(square), Side::Around), None);
    }
}
