//! Where spare waypoints of a route go: along its legs, off one of them to the middle of the band, or in a bow up there.

use super::bow::bent;
use super::{lifted, steepest};
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::{change, price, search_tolerance};

/// Waypoints are placed no nearer to each other than this share of the way, if the legs allow it.
const APART: f64 = 1e-4;

/// A waypoint that costs more than this share of the direct way's fuel is put on its leg only if there is no other
/// place.
const DEAR: f64 = 1e-3;

/// A bow is looked at where the spare waypoints are more than this share of the cost.
const MUCH: f64 = 0.05;

/// Up to this many spare waypoints may share one way to the middle of the band; over hills it leads up and down anyway.
const SEVERAL: usize = 2;

/// Ways off a leg to the middle of the band and back: shares of it, and whether the way is up there or on the leg, as it
/// must be under a threat.
const RISES: [&[(f64, bool)]; 5] = [
    &[(0.5, true)],
    &[(0.25, true), (0.5, false)],
    &[(0.5, true), (0.75, false)],
    &[(0.25, false), (0.5, true)],
    &[(0.5, false), (0.75, true)],
];

/// Costs nearer than this count as equal.
pub(super) const NOTHING: f64 = 1e-9;

/// `route` with spare waypoints added up to `waypoints`, each where it costs least; once `is_over`, without a look at
/// prices.
pub(super) fn fill(
    model: &Model,
    route: Vec<Point3>,
    waypoints: usize,
    is_over: &dyn Fn() -> bool,
) -> Vec<Point3> {
    let spare = waypoints + 2 - route.len();
    if spare < SEVERAL || !model.scenario.terrain.is_flat() {
        return one_by_one(model, route, waypoints, is_over).0;
    }
    let (filled, added) = one_by_one(model, route.clone(), waypoints, is_over);
    if added <= dear(model) || is_over() {
        return filled;
    }
    let bent = (added > MUCH * price(model, &filled).cost)
        .then(|| bent(model, &route, waypoints))
        .flatten();
    // A waypoint that leaves its leg for the middle of the band is expensive by itself, but may make room for all
    // others.
    let raised = with_one_raised(model, route, waypoints, is_over);
    let better = |one: Vec<Point3>, other: Vec<Point3>| {
        if price(model, &other).beats(&price(model, &one)) {
            other
        } else {
            one
        }
    };
    std::iter::once(raised).chain(bent).fold(filled, better)
}

/// Adds each where it costs least given the route so far; returns what they add.
fn one_by_one(
    model: &Model,
    mut route: Vec<Point3>,
    waypoints: usize,
    is_over: &dyn Fn() -> bool,
) -> (Vec<Point3>, f64) {
    let split = |a: Point3, b: Point3| {
        if is_over() {
            Split::halved(a, b)
        } else {
            Split::of(model, a, b)
        }
    };
    let legs = route.windows(2);
    let mut splits: Vec<Split> = legs.map(|ends| split(ends[0], ends[1])).collect();
    let mut added = 0.0;
    while route.len() < waypoints + 2 {
        let best = (0..splits.len())
            .min_by(|&a, &b| splits[a].rank(&splits[b]).then(a.cmp(&b)))
            .expect("a route has a leg");
        added += splits[best].added.cost;
        route.insert(best + 1, splits[best].at);
        let (before, at, after) = (route[best], route[best + 1], route[best + 2]);
        splits.splice(best..=best, [split(before, at), split(at, after)]);
    }
    (route, added)
}

/// As [`one_by_one`], except that the first leaves its leg for the middle of the band, where this costs least.
fn with_one_raised(
    model: &Model,
    mut route: Vec<Point3>,
    waypoints: usize,
    is_over: &dyn Fn() -> bool,
) -> Vec<Point3> {
    let room = waypoints + 2 - route.len();
    let ways = route.windows(2).enumerate().flat_map(|(leg, ends)| {
        let ways = RISES.iter().filter(move |way| way.len() < room);
        let ways = ways.take_while(|_| !is_over());
        ways.map(move |way| (leg, raised(model, (ends[0], ends[1]), way)))
    });
    let cheapest = ways.min_by(|(_, (one, _)), (_, (other, _))| one.rank(other));
    if let Some((leg, (_, points))) = cheapest {
        let onward = route.split_off(leg + 1);
        route.extend(points.into_iter().chain(onward));
    }
    one_by_one(model, route, waypoints, is_over).0
}

/// The leg between `ends` by `way`: the change in fitness, and the points on it.
fn raised(model: &Model, (a, b): (Point3, Point3), way: &[(f64, bool)]) -> (Fitness, Vec<Point3>) {
    let point = |&(share, is_raised): &(f64, bool)| {
        let at = a + (b - a) * share;
        if is_raised {
            lifted(model.scenario, at.xy(), 0.5)
        } else {
            at
        }
    };
    let points: Vec<Point3> = way.iter().map(point).collect();
    let whole: Vec<Point3> = std::iter::once(a)
        .chain(points.iter().copied())
        .chain([b])
        .collect();
    (change(model, &[a, b], &whole), points)
}

/// Maximum cost of a waypoint that is put on its leg without looking further.
fn dear(model: &Model) -> f64 {
    let way = model.scenario.direct();
    DEAR * way * metre(model.scenario)
}

/// The best place to split a leg.
struct Split {
    at: Point3,
    /// The added fitness.
    added: Fitness,
    /// Length of the leg.
    length: f64,
}

impl Split {
    fn of(model: &Model, a: Point3, b: Point3) -> Self {
        let tolerance = search_tolerance(model);
        let length = (b - a).norm();
        let way = model.scenario.direct();
        let apart = model.scenario.vehicle.min_leg.max(APART * way);
        let least = (apart / length * (1.0 + 1e-6)).min(0.5);
        let at = |share: f64| {
            let at = a + (b - a) * share;
            let own = model.waypoint(at, tolerance);
            let short = |share: f64| (model.scenario.vehicle.min_leg - share * length).max(0.0);
            let violation = own.0 + short(share) + short(1.0 - share);
            Self {
                at,
                added: Fitness {
                    violation,
                    cost: own.1,
                },
                length,
            }
        };
        // The middle, unless an end is nearer to the middle of the band.
        let on_leg = [0.5, least, 1.0 - least]
            .map(at)
            .into_iter()
            .reduce(Self::cheaper)
            .expect("three places");
        if on_leg.added.cost > dear(model) {
            on_leg.cheaper(Self::off_leg(model, a, b))
        } else {
            on_leg
        }
    }

    /// In the middle, as if this cost nothing.
    fn halved(a: Point3, b: Point3) -> Self {
        Self {
            at: nalgebra::center(&a, &b),
            added: Fitness::ZERO,
            length: (b - a).norm(),
        }
    }

    /// As near to the middle of the band as the vehicle can climb to and back: for a leg that is high or low from end
    /// to end, as between one threat that is flown over and the next.
    fn off_leg(model: &Model, a: Point3, b: Point3) -> Self {
        let scenario = model.scenario;
        let tolerance = search_tolerance(model);
        let middle = lifted(scenario, nalgebra::center(&a, &b).xy(), 0.5);
        let climb = 0.5 * (b.xy() - a.xy()).norm() * steepest(scenario);
        let (lowest, highest) = (a.z.max(b.z) - climb, a.z.min(b.z) + climb);
        let at = Point3::new(middle.x, middle.y, middle.z.min(highest).max(lowest));
        let leg = |a: Point3, b: Point3| model.leg(a, b, scenario.planner.quadrature, tolerance);
        let (own, without) = (model.waypoint(at, tolerance), leg(a, b));
        let with = [leg(a, at), leg(at, b)];
        Self {
            at,
            added: Fitness {
                violation: own.0 + with[0].0 + with[1].0 - without.0,
                cost: own.1 + with[0].1 + with[1].1 - without.1,
            },
            length: (b - a).norm(),
        }
    }

    /// This one, unless `other` costs less and breaks no more.
    fn cheaper(self, other: Self) -> Self {
        let (own, its) = (self.added, other.added);
        if its.cost < own.cost - NOTHING && its.violation <= own.violation {
            other
        } else {
            self
        }
    }

    fn rank(&self, other: &Self) -> std::cmp::Ordering {
        let cost = |split: &Self| (split.added.cost / NOTHING).round();
        self.added
            .violation
            .total_cmp(&other.added.violation)
            .then(cost(self).total_cmp(&cost(other)))
            .then(other.length.total_cmp(&self.length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;

    #[test]
    fn spare_waypoints_cost_nothing_and_break_nothing() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let few = vec![
            scenario.start,
            Point3::new(150.0, 400.0, 100.0),
            Point3::new(300.0, 900.0, 100.0),
            scenario.target,
        ];
        let before = price(&model, &few);
        for waypoints in [3, 10, 30] {
            let many = fill(&model, few.clone(), waypoints, &|| false);
            assert_eq!(many.len(), waypoints + 2);
            let after = price(&model, &many);
            assert!(
                (after.cost - before.cost).abs() < 1e-6,
                "{before:?} {after:?}"
            );
            assert!(after.violation <= before.violation + 1e-9);
            let shortest = many.windows(2).map(|ends| (ends[1] - ends[0]).norm());
            assert!(shortest.fold(f64::INFINITY, f64::min) >= scenario.vehicle.min_leg);
        }
    }

    /// Where even that takes long.
    #[test]
    fn where_time_is_over_spare_waypoints_halve_the_longest_legs() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let bend = Point3::new(150.0, 400.0, 100.0);
        let few = vec![scenario.start, bend, scenario.target];
        let filled = fill(&model, few, 3, &|| true);
        let half = nalgebra::center(&bend, &scenario.target);
        let quarter = nalgebra::center(&bend, &half);
        assert_eq!(
            filled,
            [scenario.start, bend, quarter, half, scenario.target]
        );
    }

    /// Where a leg is above the middle of the band throughout, spare waypoints go down to the middle.
    #[test]
    fn spare_waypoints_leave_a_high_leg() {
        let mut scenario = scenario();
        scenario.start.z = 130.0;
        scenario.threats.clear();
        let model = Model::new(&scenario);
        let high = vec![scenario.start, scenario.target];
        let many = fill(&model, high.clone(), 10, &|| false);
        let [few, many] = [high, many].map(|route| price(&model, &route));
        assert!(many.violation <= 0.0);
        // Each would cost at least 30 on the leg.
        assert!(many.cost < few.cost + 3.0, "{few:?} {many:?}");
    }

    /// A waypoint raised to the middle of the band costs more than one on the leg, but all others then fit
    /// beside it.
    #[test]
    fn spare_waypoints_share_one_way_up() {
        let mut scenario = scenario();
        (scenario.start.z, scenario.target.z) = (30.0, 80.0);
        scenario.weights.altitude = 0.1;
        scenario.threats.clear();
        let model = Model::new(&scenario);
        let few = vec![scenario.start, scenario.target];
        let (each_alone, added) = one_by_one(&model, few.clone(), 10, &|| false);
        assert!(added > 15.0, "{added}");
        let many = fill(&model, few.clone(), 10, &|| false);
        let [few, each_alone, many] = [few, each_alone, many].map(|route| price(&model, &route));
        assert!(
            many.violation <= 0.0 && many.cost < few.cost + 6.0,
            "{few:?} {many:?}"
        );
        assert!(each_alone.cost > many.cost + 10.0);
    }
}
