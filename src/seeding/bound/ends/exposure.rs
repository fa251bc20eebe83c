//! The least exposure of legs that begin in one place, in a sector of headings.

use super::super::event::ramp;
use super::super::wall::Wall;
use crate::geometry::{Point2, Point3, Segment};
use crate::seeding::outline::OutlineShape;
use crate::threat::{Cylinder, Shape, Threat};

/// Number of pieces of a leg beside a ring over which the exposure is summed.
const PIECES: u32 = 24;

/// Least exposure to `wall` of all legs as long as that from `from` to `at`, within `half` radians of its heading.
pub(super) fn least(wall: &Wall, (from, at): (Point2, Point2), half: f64) -> f64 {
    if wall.influence <= 0.0 {
        // A side of the area's border, or a polygon without a margin.
        return 0.0;
    }
    let (center, radius) = wall.circle();
    let (way, between) = (at - from, center - from);
    let length = way.norm();
    if length <= 0.0 || between.norm() >= length + radius + wall.influence {
        return 0.0;
    }
    match wall.shape {
        OutlineShape::Disc(_) => {
            // At every point of a leg, the farther the leg leads past the centre, the farther the centre is.
            let off = libm::atan2(way.perp(&between).abs(), way.dot(&between));
            let most = (off + half).min(std::f64::consts::PI);
            past(wall.influence, length, (between.norm(), most))
        }
        OutlineShape::Ring(_) => beside(wall, (from, at), length * half),
    }
}

/// Least exposure to `wall` between two places on the way of all legs that begin in `from` and lead within `half`
/// radians of their heading.
pub(super) fn between(wall: &Wall, from: Point2, [near, far]: [Point2; 2], half: f64) -> f64 {
    let to = |at: Point2| least(wall, (from, at), half);
    if near == from {
        return to(far);
    }
    match wall.shape {
        // It is that of one leg, point by point.
        OutlineShape::Disc(_) => (to(far) - to(near)).max(0.0),
        OutlineShape::Ring(_) => 0.0,
    }
}

/// Exposure to a disc of a leg of `length` that begins `away` from its centre and heads `off` radians past it.
fn past(influence: f64, length: f64, (away, off): (f64, f64)) -> f64 {
    let leg = Segment {
        a: Point3::origin(),
        b: Point3::new(length, 0.0, 0.0),
    };
    let disc = Threat {
        name: None,
        shape: Shape::Cylinder(Cylinder {
            center: Point2::new(away * libm::cos(off), away * libm::sin(off)),
            radius: 0.0,
            influence,
        }),
        base: None,
        top: None,
    };
    disc.encounter(&leg).exposure
}

/// Least exposure to a ring of all legs that are nowhere farther than `spread` from the one from `a` to `b`.
fn beside(wall: &Wall, (a, b): (Point2, Point2), spread: f64) -> f64 {
    let (center, radius) = wall.circle();
    let (way, reach) = (b - a, radius + wall.influence);
    let length = way.norm();
    // The part of the leg that may be in the zone.
    let foot = (center - a).dot(&way) / length;
    let [from, to] = [foot - reach, foot + reach].map(|at| at.clamp(0.0, length));
    let piece = (to - from) / f64::from(PIECES);
    let depth = |idx: u32| {
        let at = a + way * ((from + piece * f64::from(idx)) / length);
        wall.influence - wall.distance(at) - spread
    };
    let is_convex = wall.is_convex();
    let mut sum = 0.0;
    let mut before = depth(0);
    for idx in 1..=PIECES {
        let after = depth(idx);
        // The depth beside a convex ring is concave; beside any ring it changes by at most a metre per metre.
        sum += if is_convex && before > 0.0 && after > 0.0 {
            0.5 * piece * (before + after)
        } else {
            ramp(before, 1.0, 0.5 * piece) + ramp(after, 1.0, 0.5 * piece)
        };
        before = after;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::super::super::tests::scenario;
    use super::super::super::prices::Prices;
    use super::super::super::widening::walls;
    use super::*;

    /// No leg in the sector has less exposure than stated, by fine summation; for a slim sector the stated value is
    /// close.
    #[test]
    fn no_leg_in_a_sector_has_less_exposure_than_stated() {
        let scenario = scenario(
            r#""threats": [
                {"kind": "cylinder", "center": {"x": 300, "y": 160}, "radius": 40, "influence": 100},
                {"kind": "polygon", "margin": 60, "vertices": [{"x": 210, "y": 220}, {"x": 290, "y": 240}, {"x": 250, "y": 300}]},
                {"kind": "polygon", "margin": 50, "vertices": [{"x": 80, "y": 100}, {"x": 160, "y": 60}, {"x": 120, "y": 100}, {"x": 160, "y": 140}]}
            ]"#,
        );
        let walls = walls(&scenario, &Prices::of(&scenario));
        assert_eq!(walls.len(), 3);
        let from = scenario.start.xy();
        let (mut exposed, mut tight) = (0, 0);
        for (idx, half) in (0_u32..240).zip([0.2, 0.05, 1e-3].into_iter().cycle()) {
            let (heading, length) = (f64::from(idx) * 0.37, 20.0 + f64::from(idx * 17 % 180));
            let to = |off: f64| {
                let angle = heading + off * half;
                let way = crate::geometry::Vector2::new(libm::cos(angle), libm::sin(angle));
                from + way * length
            };
            for wall in &walls {
                let least = least(wall, (from, to(0.0)), half);
                for off in [-1.0, -0.4, 0.0, 0.7, 1.0] {
                    let way = to(off) - from;
                    let depths = (0..2000).map(|part| {
                        let at = from + way * ((f64::from(part) + 0.5) / 2000.0);
                        (wall.influence - wall.distance(at)).max(0.0)
                    });
                    let sum = depths.sum::<f64>() * length / 2000.0;
                    assert!(least <= sum + 0.02, "{least} {sum}");
                    exposed += i32::from(least > 1.0);
                    tight += i32::from(half < 0.01 && sum > 1.0 && least > 0.98 * sum);
                }
            }
        }
        assert!(exposed > 300 && tight > 100, "{exposed} {tight}");
    }
}
