//! The cost of leaving the soft zones that a route begins in, or, seen backwards, ends in. The argument is section 5 of
//! docs/BOUND.md.

use super::event::ramp;
use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::{Point2, ring};
use crate::seeding::arc::segment_segment;
use crate::seeding::outline::OutlineShape;

/// Number of parts over which the cost per metre outwards is summed.
const PARTS: u32 = 200;

/// Where a way begins or ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) at: Point2,
    /// It may be any point within this many metres instead.
    pub(super) spread: f64,
    /// Which end of the whole route it is, if it is one: 0 is the start.
    pub(super) end: Option<usize>,
}

/// An end of a route as the string sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Departure {
    /// On the outside of the widened wall that surrounds the end, if there is one; otherwise the end itself.
    pub(super) at: Point2,
    /// Lower bound of the cost of the way out of the soft zones, on top of the string from there.
    pub(super) toll: f64,
}

impl Departure {
    /// From `place`, round `walls` widened to `radii`, one of which may surround it, to the `other`. Soft zones that
    /// are `spent` are already counted for something else.
    pub(super) fn of(
        (walls, radii): (&[Wall], &[Option<f64>]),
        prices: &Prices,
        [place, other]: [Place; 2],
        spent: &[usize],
    ) -> Self {
        let (mut at, mut toll) = (place.at, 0.0);
        let between = (other.at - place.at).norm() - place.spread - other.spread;
        for (idx, wall) in walls.iter().enumerate() {
            let away = wall.distance(place.at) + place.spread;
            if away >= wall.influence {
                continue;
            }
            if wall.toll.is_some() && radii[idx].is_none() {
                // It may be passed, but not at once.
                let stay = place.end.map_or(0.0, |end| wall.stays[end].min(between));
                if !spent.contains(&idx) {
                    toll += prices.exposure * leaving(wall, (place.at, place.spread), stay);
                }
                continue;
            }
            let mut used = away;
            if let Some(radius) = radii[idx].filter(|radius| *radius > away) {
                at = wall.out(place.at, radius);
                let alone = alone((walls, radii), idx, other.at).max(away);
                toll += outwards(wall, prices, [away, radius], alone);
                used = radius;
            }
            if !spent.contains(&idx) {
                let farthest = wall.influence.min(wall.distance(other.at) - other.spread);
                toll += prices.exposure * depths(wall, [used, farthest]);
            }
        }
        Self { at, toll }
    }
}

/// The least that a route pays in the soft zones of those `walls` that it may pass, near the start and the target,
/// where it cannot pass them yet.
pub(super) fn early(walls: &[Wall], prices: &Prices) -> f64 {
    let passable = walls.iter().filter(|wall| wall.toll.is_some());
    let exposed = passable.flat_map(|wall| {
        let ends = prices.ends.iter().zip(wall.stays);
        ends.map(|(end, stay)| leaving(wall, (end.xy(), 0.0), stay))
    });
    prices.exposure * exposed.sum::<f64>()
}

/// Least exposure to `wall` on the first `metres` of a way that begins within `spread` of a place: no way leaves a zone
/// faster than straight outwards.
pub(super) fn leaving(wall: &Wall, (from, spread): (Point2, f64), metres: f64) -> f64 {
    let depth = wall.influence - wall.distance(from) - spread;
    ramp(depth, 1.0, metres.max(0.0))
}

/// Integral of the depth in the soft zone of `wall` from one distance to the next, neither of which is beyond it.
fn depths(wall: &Wall, [from, to]: [f64; 2]) -> f64 {
    (to - from).max(0.0) * (wall.influence - 0.5 * (from + to))
}

/// The cost of getting from one distance of `wall` to the next, to which it is widened, on top of going round it there.
/// Beyond `alone` metres other walls may be gone round.
fn outwards(wall: &Wall, prices: &Prices, [from, to]: [f64; 2], alone: f64) -> f64 {
    let part = (to - from) / f64::from(PARTS);
    let sum: f64 = (0..PARTS)
        .map(|idx| {
            let near = from + part * f64::from(idx);
            let far = near + part;
            let zone = prices.exposure * (wall.influence - far).max(0.0);
            let (all, round) = (prices.fuel + zone, prices.fuel * to / near);
            let outwards = (all * all - round * round).max(0.0).sqrt();
            if far > alone {
                outwards.min(zone)
            } else {
                outwards
            }
        })
        .sum();
    part * sum
}

/// Metres from wall number `idx` within which no route goes round another wall.
fn alone((walls, radii): (&[Wall], &[Option<f64>]), idx: usize, other: Point2) -> f64 {
    let wall = &walls[idx];
    let own = radii[idx].unwrap_or(0.0);
    let near = |(next, radius): (usize, f64)| {
        let neighbour = &walls[next];
        let apart = apart(wall, neighbour);
        if apart >= own + radius {
            f64::INFINITY
        } else if radius > neighbour.distance(other) {
            // It surrounds the other end: both would use the same fuel.
            0.0
        } else if let (OutlineShape::Disc(_), OutlineShape::Disc(_)) =
            (&wall.shape, &neighbour.shape)
        {
            // The sectors of the other disc that are not within this one begin where the circles cross.
            let cos = (apart * apart + radius * radius - own * own) / (2.0 * apart * radius);
            if !(-1.0..=1.0).contains(&cos) {
                0.0
            } else if cos > 0.0 {
                apart * (1.0 - cos * cos).sqrt() * (1.0 - 1e-9)
            } else {
                apart
            }
        } else {
            apart - radius
        }
    };
    (0..walls.len())
        .filter(|next| *next != idx)
        .filter_map(|next| Some((next, radii[next]?)))
        .map(near)
        .fold(f64::INFINITY, f64::min)
}

/// Metres between the shapes of two walls, 0 where one lies within the other.
fn apart(one: &Wall, other: &Wall) -> f64 {
    match (&one.shape, &other.shape) {
        (OutlineShape::Disc(center), _) => other.distance(*center),
        (_, OutlineShape::Disc(center)) => one.distance(*center),
        (OutlineShape::Ring(ring), OutlineShape::Ring(next)) => {
            if ring::contains(ring, next[0]) || ring::contains(next, ring[0]) {
                return 0.0;
            }
            let pairs = ring::edges(ring).flat_map(|edge| {
                ring::edges(next).map(move |facing| segment_segment(edge, facing))
            });
            pairs.fold(f64::INFINITY, f64::min)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::tests::{disc, scenario};
    use super::super::string::departures as ends_of;
    use super::super::widening::walls;
    use super::*;

    fn departures(threats: &str, examine: impl Fn(&Prices, [Departure; 2])) {
        let scenario = scenario(&format!(r#""threats": [{threats}]"#));
        let prices = Prices::of(&scenario);
        let walls = walls(&scenario, &prices);
        let radii: Vec<_> = walls.iter().map(|wall| Some(wall.wide)).collect();
        examine(&prices, ends_of((&walls, &radii), &prices, &[]));
    }

    /// Straight out of a zone on the far side of its core, in the direction of the way: the whole cost is
    /// counted, except for what a detour would save at the end.
    #[test]
    fn leaving_a_zone_straight_costs_nearly_the_whole_way_out() {
        // The target is (600, 700) away from the start.
        let along = crate::geometry::Vector2::new(600.0, 700.0).normalize();
        let center = Point2::new(200.0, 100.0) - along * 50.0;
        departures(
            &disc(center.x, center.y, 40.0, 80.0),
            |prices, [start, target]| {
                let out = 30.0;
                assert!((start.at - (prices.ends[0].xy() + along * out)).norm() < 1e-6);
                let cost = prices.fuel * out + prices.exposure * 0.5 * out * out;
                assert!(
                    start.toll < cost && start.toll > 0.96 * cost,
                    "{start:?} {cost}"
                );
                assert!(target.at == prices.ends[1].xy() && target.toll <= 0.0);
            },
        );
    }

    /// A start 20 m deep in the zone of a threat whose top is 30 m above it, with climbs of 45 degrees: no
    /// route is above the threat within 30 m. With the top 10 m above, half of the cost of leaving is still
    /// paid.
    #[test]
    fn no_route_is_above_a_threat_immediately() {
        for (top, paid) in [(30.0, 200.0), (10.0, 150.0)] {
            let scenario = scenario(&format!(
                r#""threats": [{{"kind": "cylinder", "center": {{"x": 200, "y": 0}}, "radius": 90, "influence": 120, "top": {top}}}]"#
            ));
            let prices = Prices::of(&scenario);
            let walls = walls(&scenario, &prices);
            let [start, target] = ends_of((&walls, &[None]), &prices, &[]);
            let paid = prices.exposure * paid;
            assert!((start.toll - paid).abs() < 1e-4 * paid, "{start:?} {paid}");
            assert!(target.toll <= 0.0 && start.at == prices.ends[0].xy());
            assert!((early(&walls, &prices) - start.toll).abs() < 1e-9);
            // Counted elsewhere, so not here.
            assert!(ends_of((&walls, &[None]), &prices, &[0])[0].toll <= 0.0);
        }
    }

    /// Of two zones, one is widened over the end and only the other counts for the way out; a zone that
    /// contains both ends counts for the difference in depth.
    #[test]
    fn only_one_of_overlapping_zones_counts_for_the_way_out() {
        departures(
            r#"{"kind": "cylinder", "center": {"x": 150, "y": 100}, "radius": 30, "influence": 100},
               {"kind": "cylinder", "center": {"x": 200, "y": 40}, "radius": 30, "influence": 70},
               {"kind": "cylinder", "center": {"x": 500, "y": 100}, "radius": 50, "influence": 800}"#,
            |prices, [start, target]| {
                assert!((start.at - prices.ends[0].xy()).norm() > 10.0);
                // The target is 763 m from the third centre, the start 300 m.
                let deeper = 0.5 * (500.0 * 500.0 - 37.0 * 37.0);
                let toll = start.toll - prices.exposure * (deeper + 50.0);
                let alone = prices.fuel * 50.0 + prices.exposure * 1250.0;
                assert!(toll > 0.6 * alone && toll < 1.01 * alone, "{toll} {alone}");
                assert!(target.toll <= 0.0);
            },
        );
    }
}
