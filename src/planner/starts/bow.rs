//! Spare waypoints in one bow near the middle of the band: for ends so near to each other that the way is hardly longer
//! than its legs must be, where waypoints on the climb would cost much.

use super::{direction, steepest};
use crate::cost::Model;
use crate::geometry::{LEVEL, Point2, Point3, Vector2};
use crate::planner::price::search_tolerance;

/// Legs of the bow are longer than the shortest allowed by this share.
const LONGER: f64 = 1e-4;

/// `route` with `waypoints` free ones: those that lie together near the middle of the band, and all spare ones, make one
/// bow of short legs that turns as the route does there. `None` where none lies near the middle.
pub(super) fn bent(model: &Model, route: &[Point3], waypoints: usize) -> Option<Vec<Point3>> {
    let spare = (waypoints + 2).checked_sub(route.len())?;
    let leg = model.scenario.vehicle.min_leg * (1.0 + LONGER);
    let level = Level::of(model, route, leg * waypoints as f64)?;
    let (before, flown, after) = (
        &route[..level.first],
        &route[level.first..=level.last],
        &route[level.last + 1..],
    );
    let (heading, turn) = bend(&route[level.first - 1..=level.last + 1])?;
    let bow = bow(flown.len() + spare, leg, heading, turn);
    let bow: Vec<Point3> = moved(bow, flown)
        .into_iter()
        .map(|at| Point3::new(at.x, at.y, level.height))
        .collect();
    let bow = near_enough(model, bow, [before[before.len() - 1], after[0]]);
    Some([before, &bow, after].concat())
}

/// The part of a route near the middle of the band.
struct Level {
    first: usize,
    last: usize,
    /// Height of that waypoint in it which is nearest to the middle.
    height: f64,
}

impl Level {
    /// The most free waypoints in a row that are no farther from the middle of the band than `reach`, metres.
    fn of(model: &Model, route: &[Point3], reach: f64) -> Option<Self> {
        let tolerance = search_tolerance(model);
        let most = model.scenario.weights.altitude * reach;
        let mut longest: Option<Self> = None;
        let (mut first, mut nearest) = (1, (f64::INFINITY, 0.0));
        let free = route.iter().enumerate().skip(1).take(route.len() - 2);
        for (last, waypoint) in free {
            let (_, cost) = model.waypoint(*waypoint, tolerance);
            if cost > most {
                (first, nearest) = (last + 1, (f64::INFINITY, 0.0));
                continue;
            }
            if cost < nearest.0 {
                nearest = (cost, waypoint.z);
            }
            let is_longer = |longest: &Self| last - first > longest.last - longest.first;
            if longest.as_ref().is_none_or(is_longer) {
                longest = Some(Self {
                    first,
                    last,
                    height: nearest.1,
                });
            }
        }
        longest
    }
}

/// The heading of the first leg of `part`, and how far it turns until the last, radians; `None` where it goes straight up.
fn bend(part: &[Point3]) -> Option<(f64, f64)> {
    let legs = part.windows(2).map(|ends| (ends[1] - ends[0]).xy());
    let legs: Vec<Vector2> = legs.filter(|leg| leg.norm() > LEVEL).collect();
    let first = legs.first()?;
    let turns = legs
        .windows(2)
        .map(|legs| libm::atan2(legs[0].perp(&legs[1]), legs[0].dot(&legs[1])));
    Some((libm::atan2(first.y, first.x), turns.sum()))
}

/// `count` places in a row, every leg of the same length, that turn evenly.
fn bow(count: usize, leg: f64, heading: f64, turn: f64) -> Vec<Point2> {
    let mut at = Point2::origin();
    let mut bow = vec![at];
    for place in 1..count {
        at += direction(heading + turn * place as f64 / count as f64) * leg;
        bow.push(at);
    }
    bow
}

/// The bow about the middle of what it replaces.
fn moved(bow: Vec<Point2>, flown: &[Point3]) -> Vec<Point2> {
    let by = center(flown.iter().map(Point3::xy)) - center(bow.iter().copied());
    bow.into_iter().map(|at| at + by).collect()
}

/// The bow as near to its `neighbours` as climbs allow, within the area.
fn near_enough(model: &Model, bow: Vec<Point3>, neighbours: [Point3; 2]) -> Vec<Point3> {
    let away = center(bow.iter().map(Point3::xy)) - center(neighbours.iter().map(Point3::xy));
    let Some(away) = away.try_normalize(LEVEL) else {
        return bow;
    };
    let ends = [bow[0], bow[bow.len() - 1]].into_iter().zip(neighbours);
    let further = ends.filter_map(|(end, neighbour)| {
        let way = end - neighbour;
        let room = way.z.abs() / steepest(model.scenario);
        (room > 0.0).then(|| way_to(way.xy(), away, room))?
    });
    let by = away * further.reduce(f64::max).unwrap_or_default();
    let place = |at: Point3| {
        let place = model.scenario.area.nearest(at.xy() + by);
        Point3::new(place.x, place.y, at.z)
    };
    bow.into_iter().map(place).collect()
}

/// How far along `direction`, of length 1, it is from `place` to where the origin is `reach` away; `None` where that is
/// nowhere.
fn way_to(place: Vector2, direction: Vector2, reach: f64) -> Option<f64> {
    let along = place.dot(&direction);
    let squared = along * along + reach * reach - place.norm_squared();
    (squared >= 0.0).then(|| squared.sqrt() - along)
}

fn center(points: impl ExactSizeIterator<Item = Point2>) -> Point2 {
    let count = points.len() as f64;
    Point2::from(points.map(|point| point.coords).sum::<Vector2>() / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::price::price;
    use crate::planner::starts::spare;
    use crate::planner::tests::scenario;
    use crate::scenario::Scenario;

    /// Both ends on the ground, 30 m apart, and a way up to the middle of the band at 100 m and down again.
    fn near_ends() -> (Scenario, Vec<Point3>) {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.start = Point3::new(500.0, 500.0, 0.0);
        scenario.target = Point3::new(530.0, 500.0, 0.0);
        scenario.vehicle.min_leg = 0.05;
        let top = [[514.8, 601.0], [515.0, 601.1], [515.2, 601.0]];
        let top = top.map(|[x, y]| Point3::new(x, y, 100.0));
        let route = [&[scenario.start], &top[..], &[scenario.target]].concat();
        (scenario, route)
    }

    #[test]
    fn spare_waypoints_of_a_short_way_make_a_bow_at_the_middle_of_the_band() {
        let (scenario, few) = near_ends();
        let model = Model::new(&scenario);
        let many = bent(&model, &few, 60).expect("three lie at the middle");
        assert_eq!(many.len(), 62);
        let legs = many.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        assert!(legs.fold(f64::INFINITY, f64::min) >= scenario.vehicle.min_leg);
        let [few, many] = [&few, &many].map(|route| price(&model, route));
        assert!(many.is_feasible(), "{many:?}");
        // 59 legs of 5 cm, at 0.5 a metre.
        assert!(many.cost < few.cost + 1.5, "{few:?} {many:?}");
    }

    #[test]
    fn the_bow_is_what_a_short_way_is_filled_with() {
        let (scenario, few) = near_ends();
        let model = Model::new(&scenario);
        let filled = spare::fill(&model, few.clone(), 60, &|| false);
        assert_eq!(Some(filled), bent(&model, &few, 60));
    }

    /// The bow may be nearer to the ends than what it replaces, or must be farther away.
    #[test]
    fn the_bow_is_where_the_climbs_are_steepest() {
        for distance in [600.5, 620.0] {
            let (scenario, mut route) = near_ends();
            for point in &mut route[1..4] {
                point.y += distance - 601.0;
            }
            let model = Model::new(&scenario);
            let many = bent(&model, &route, 60).expect("three lie at the middle");
            let climb = |a: Point3, b: Point3| (a.z - b.z).abs() / (a - b).xy().norm();
            let climbs = [climb(many[0], many[1]), climb(many[60], many[61])];
            let steepest = climbs[0].max(climbs[1]);
            assert!((steepest - 1.0).abs() < 1e-6, "{climbs:?}");
        }
    }

    #[test]
    fn there_is_no_bow_without_a_waypoint_near_the_middle() {
        let (scenario, mut route) = near_ends();
        for point in &mut route[1..4] {
            point.z = 80.0;
        }
        let model = Model::new(&scenario);
        assert_eq!(bent(&model, &route, 60), None);
        assert_eq!(bent(&model, &[scenario.start, scenario.target], 60), None);
    }
}
