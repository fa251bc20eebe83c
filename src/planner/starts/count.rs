//! Routes of as many waypoints as asked for: spare ones are spread along the legs, surplus ones
//! left out.

use super::{lifted, steepest};
use crate::cost::{Model, metre};
use crate::geometry::{LEVEL, Point3};
use crate::optimizer::Fitness;
use crate::planner::price::price;

/// Waypoints are put no nearer to each other than this share of the way, if the legs allow it.
const APART: f64 = 1e-4;

/// Waypoints nearer than this, metres, are one.
const ONE_PLACE: f64 = 1e-6;

/// So far apart, metres, are those put that every farther place makes dearer.
const HAIR: f64 = 1e-3;

/// A waypoint tells a direction from here on, metres.
const FAR: f64 = 1.0;

/// A waypoint that costs more than this share of the direct way's fuel is not put on its leg unless there is no other place.
const DEAR: f64 = 1e-3;

/// So many spare waypoints may share one way to the middle of the band; over hills it leads up and down anyway.
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

/// Costs nearer than this are the same.
const NOTHING: f64 = 1e-9;

/// `route` with exactly `waypoints` free waypoints.
pub(in crate::planner) fn with_waypoints(
    model: &Model,
    mut route: Vec<Point3>,
    waypoints: usize,
) -> Vec<Point3> {
    leave_out(model, &mut route, waypoints + 2);
    let few = waypoints + 2 - route.len() < SEVERAL;
    let (filled, added) = filled(model, route.clone(), waypoints);
    if few || added <= dear(model) || !model.scenario.terrain.is_flat() {
        return filled;
    }
    // One that leaves its leg for the middle of the band is dear by itself, and may make room for all others.
    let raised = with_one_raised(model, route, waypoints);
    if price(model, &raised).beats(&price(model, &filled)) {
        raised
    } else {
        filled
    }
}

/// `route` with spare waypoints, each where it costs the least as the route is by then, and what they add.
fn filled(model: &Model, mut route: Vec<Point3>, waypoints: usize) -> (Vec<Point3>, f64) {
    let mut splits: Vec<Split> = route
        .windows(2)
        .map(|ends| Split::of(model, ends[0], ends[1]))
        .collect();
    let mut added = 0.0;
    while route.len() < waypoints + 2 {
        let best = (0..splits.len())
            .min_by(|&a, &b| splits[a].rank(&splits[b]).then(a.cmp(&b)))
            .expect("a route has a leg");
        added += splits[best].added.cost;
        route.insert(best + 1, splits[best].at);
        let (before, at, after) = (route[best], route[best + 1], route[best + 2]);
        splits.splice(
            best..=best,
            [Split::of(model, before, at), Split::of(model, at, after)],
        );
    }
    (route, added)
}

/// As [`filled`], but that the first leaves its leg for the middle of the band, where this costs the least.
fn with_one_raised(model: &Model, mut route: Vec<Point3>, waypoints: usize) -> Vec<Point3> {
    let room = waypoints + 2 - route.len();
    let ways = route.windows(2).enumerate().flat_map(|(leg, ends)| {
        let ways = RISES.iter().filter(move |way| way.len() < room);
        ways.map(move |way| (leg, raised(model, (ends[0], ends[1]), way)))
    });
    let cheapest = ways.min_by(|(_, (one, _)), (_, (other, _))| one.rank(other));
    if let Some((leg, (_, points))) = cheapest {
        let onward = route.split_off(leg + 1);
        route.extend(points.into_iter().chain(onward));
    }
    filled(model, route, waypoints).0
}

/// The leg between `ends` by `way`: what it changes, and the points on it.
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

/// More than this a waypoint must not cost to be put on its leg as a matter of course.
fn dear(model: &Model) -> f64 {
    let way = (model.scenario.target - model.scenario.start).norm();
    DEAR * way * metre(model.scenario)
}

/// `route` with waypoints that lie on one place spread along its legs, or a hair apart where that is dearer; as it is,
/// where it breaks more.
pub(in crate::planner) fn spread(model: &Model, route: Vec<Point3>) -> Vec<Point3> {
    let mut apart = route.clone();
    apart.dedup_by(|next, before| (*next - *before).norm() < ONE_PLACE);
    if apart.len() == route.len() || apart[apart.len() - 1] != route[route.len() - 1] {
        return route;
    }
    let apart = with_waypoints(model, apart, route.len() - 2);
    let (old, new) = (price(model, &route), price(model, &apart));
    let dearer = new.cost > old.cost + NOTHING * (1.0 + old.cost);
    if new.violation <= old.violation && !dearer {
        return apart;
    }
    let apart = a_hair_apart(&route);
    if price(model, &apart).violation > old.violation {
        return route;
    }
    apart
}

/// Those that lie on one place, one after the other along the leg that leads away, or along the one that leads to it at
/// the end.
fn a_hair_apart(route: &[Point3]) -> Vec<Point3> {
    let mut apart = route.to_vec();
    let last = route.len() - 1;
    let far = |from: usize| move |to: &&Point3| (*to - route[from]).norm() >= FAR;
    let at_one = |one: usize, other: usize| (route[one] - route[other]).norm() < ONE_PLACE;
    let towards = |from: Point3, to: &Point3| from + (to - from).normalize() * HAIR;
    for idx in 1..last {
        if let Some(next) = route[idx..].iter().find(far(idx))
            && at_one(idx - 1, idx)
        {
            apart[idx] = towards(apart[idx - 1], next);
        }
    }
    for idx in (1..last).rev() {
        if let Some(before) = route[..idx].iter().rfind(far(idx))
            && at_one(idx, idx + 1)
            && at_one(idx, last)
        {
            apart[idx] = towards(apart[idx + 1], before);
        }
    }
    apart
}

/// Where a leg is best split.
struct Split {
    at: Point3,
    /// What it adds.
    added: Fitness,
    /// Of the leg.
    length: f64,
}

impl Split {
    fn of(model: &Model, a: Point3, b: Point3) -> Self {
        let tolerance = model.tolerance.scaled(0.5);
        let length = (b - a).norm();
        let way = (model.scenario.target - model.scenario.start).norm();
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

    /// As near to the middle of the band as the vehicle can climb to and back: where a leg is high or low from end to end,
    /// as between one threat that is flown over and the next.
    fn off_leg(model: &Model, a: Point3, b: Point3) -> Self {
        let scenario = model.scenario;
        let tolerance = model.tolerance.scaled(0.5);
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

/// Leave out the waypoint that is missed least, or put one in place of two, until `points` are left.
fn leave_out(model: &Model, route: &mut Vec<Point3>, points: usize) {
    if route.len() <= points {
        return;
    }
    let mut omissions: Vec<Omission> = (1..route.len() - 1)
        .map(|idx| Omission::of(model, route, idx))
        .collect();
    while route.len() > points {
        let least = (1..omissions.len()).fold(0, |least, next| {
            if omissions[next].change.beats(&omissions[least].change) {
                next
            } else {
                least
            }
        });
        let (idx, omission) = (least + 1, omissions.remove(least));
        route.remove(idx);
        if let Some(corner) = omission.instead {
            route[idx] = corner;
        }
        // Of the others, only those that see what has changed.
        let sees = idx.saturating_sub(Omission::AFTER).max(1)..idx + Omission::BEFORE + 1;
        for near in sees.start..sees.end.min(route.len() - 1) {
            omissions[near - 1] = Omission::of(model, route, near);
        }
    }
}

/// How a waypoint is best left out.
struct Omission {
    change: Fitness,
    /// In place of it and the next.
    instead: Option<Point3>,
}

impl Omission {
    /// Points looked at before the waypoint.
    const BEFORE: usize = 2;
    /// And after it, at most.
    const AFTER: usize = 3;

    fn of(model: &Model, route: &[Point3], idx: usize) -> Self {
        let count = route.len();
        let before = idx.saturating_sub(Self::BEFORE);
        let after = (idx + Self::AFTER).min(count);
        let without: Vec<Point3> = (before..after)
            .filter(|&other| other != idx)
            .map(|other| route[other])
            .collect();
        let plainly = Self {
            change: change(model, &route[before..after], &without),
            instead: None,
        };
        let corner = (idx + 2 < count)
            .then(|| crossing(route[idx - 1], route[idx], route[idx + 1], route[idx + 2]))
            .flatten();
        let Some(corner) = corner else {
            return plainly;
        };
        let after = (idx + Self::AFTER + 1).min(count);
        let with: Vec<Point3> = (before..after)
            .filter(|&other| other != idx + 1)
            .map(|other| if other == idx { corner } else { route[other] })
            .collect();
        let change = change(model, &route[before..after], &with);
        if change.beats(&plainly.change) {
            Self {
                change,
                instead: Some(corner),
            }
        } else {
            plainly
        }
    }
}

/// What it changes to fly `new` in place of `old`.
fn change(model: &Model, old: &[Point3], new: &[Point3]) -> Fitness {
    let (old, new) = (price(model, old), price(model, new));
    Fitness {
        violation: new.violation - old.violation,
        cost: new.cost - old.cost,
    }
}

/// Where the leg from `a` to `b`, flown on, meets that from `c` to `d`, flown back.
fn crossing(a: Point3, b: Point3, c: Point3, d: Point3) -> Option<Point3> {
    let (ahead, back, gap) = (b.xy() - a.xy(), c.xy() - d.xy(), c.xy() - b.xy());
    let area = ahead.perp(&back);
    // Legs without extent have no direction either.
    if area.abs() <= LEVEL * (ahead.norm() + back.norm()) {
        return None;
    }
    // b + ahead s = c + back t
    let (s, t) = (gap.perp(&back) / area, gap.perp(&ahead) / area);
    if s < 0.0 || t < 0.0 || s * ahead.norm() > 10.0 * gap.norm() {
        return None;
    }
    let at = b.xy() + ahead * s;
    Some(Point3::new(at.x, at.y, 0.5 * (b.z + c.z)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;

    fn points(route: &[[f64; 3]]) -> Vec<Point3> {
        route.iter().map(|&point| Point3::from(point)).collect()
    }

    /// Start, free waypoints, target of the three radars; those between are given.
    fn route(free: &[[f64; 3]]) -> Vec<Point3> {
        let scenario = scenario();
        let mut route = vec![scenario.start];
        route.extend(points(free));
        route.push(scenario.target);
        route
    }

    #[test]
    fn spare_waypoints_cost_nothing_and_break_nothing() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let few = route(&[[150.0, 400.0, 100.0], [300.0, 900.0, 100.0]]);
        let before = price(&model, &few);
        for waypoints in [3, 10, 30] {
            let many = with_waypoints(&model, few.clone(), waypoints);
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

    /// Where a leg is above the middle of the band from end to end, spare waypoints go down to it.
    #[test]
    fn spare_waypoints_leave_a_high_leg() {
        let mut scenario = scenario();
        scenario.start.z = 130.0;
        scenario.threats.clear();
        let model = Model::new(&scenario);
        let high = vec![scenario.start, scenario.target];
        let many = with_waypoints(&model, high.clone(), 10);
        let [few, many] = [high, many].map(|route| price(&model, &route));
        assert!(many.violation <= 0.0);
        // Each would cost 30 or more on the leg.
        assert!(many.cost < few.cost + 3.0, "{few:?} {many:?}");
    }

    /// One that goes up to the middle of the band costs more than one on the leg, and makes room there for all others.
    #[test]
    fn spare_waypoints_share_one_way_up() {
        let mut scenario = scenario();
        (scenario.start.z, scenario.target.z) = (30.0, 80.0);
        scenario.weights.altitude = 0.1;
        scenario.threats.clear();
        let model = Model::new(&scenario);
        let few = vec![scenario.start, scenario.target];
        let (one_by_one, added) = filled(&model, few.clone(), 10);
        assert!(added > 15.0, "{added}");
        let many = with_waypoints(&model, few.clone(), 10);
        let [few, one_by_one, many] = [few, one_by_one, many].map(|route| price(&model, &route));
        assert!(
            many.violation <= 0.0 && many.cost < few.cost + 6.0,
            "{few:?} {many:?}"
        );
        assert!(one_by_one.cost > many.cost + 10.0);
    }

    #[test]
    fn the_waypoint_that_is_missed_least_is_left_out() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let many = route(&[
            [150.0, 400.0, 100.0],
            [225.0, 650.0, 100.0],
            [300.0, 900.0, 100.0],
        ]);
        let few = with_waypoints(&model, many.clone(), 2);
        let without_the_middle = [many[0], many[1], many[3], many[4]];
        assert!(!price(&model, &without_the_middle).beats(&price(&model, &few)));
    }

    /// Each of the single steps looks at every waypoint anew.
    #[test]
    fn many_are_left_out_as_one_by_one() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let free: Vec<[f64; 3]> = (0..60_u32)
            .map(|i| {
                let (t, wave) = (f64::from(i) / 60.0, f64::from(i * 7 % 11));
                [
                    150.0 + 600.0 * t - 9.0 * wave,
                    100.0 + 700.0 * t + 6.0 * wave,
                    90.0 + wave,
                ]
            })
            .collect();
        let mut one_by_one = route(&free);
        while one_by_one.len() > 5 {
            let waypoints = one_by_one.len() - 3;
            one_by_one = with_waypoints(&model, one_by_one, waypoints);
            assert_eq!(one_by_one, with_waypoints(&model, route(&free), waypoints));
        }
    }

    #[test]
    fn waypoints_on_one_place_are_spread() {
        let mut scenario = scenario();
        scenario.vehicle.min_leg = 0.0;
        let model = Model::new(&scenario);
        let [a, b] = [[150.0, 400.0, 100.0], [300.0, 900.0, 100.0]];
        let heap = route(&[a, a, a, b, b]);
        let apart = spread(&model, heap.clone());
        assert_eq!(apart.len(), heap.len());
        let shortest = apart.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        assert!(shortest.fold(f64::INFINITY, f64::min) > 1.0);
        assert!((price(&model, &apart).cost - price(&model, &heap).cost).abs() < 1e-6);
    }

    /// Where one place alone is in the middle of the band, those that crowd there part by a hair.
    #[test]
    fn waypoints_on_the_best_place_are_put_a_hair_apart() {
        let mut scenario = scenario();
        scenario.vehicle.min_leg = 0.0;
        scenario.start.z = 0.0;
        scenario.target.z = 0.0;
        let model = Model::new(&scenario);
        let best = [500.0, 480.0, 100.0];
        let heap = route(&[best; 6]);
        let apart = spread(&model, heap.clone());
        let shortest = apart.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        let shortest = shortest.fold(f64::INFINITY, f64::min);
        assert!((0.9 * HAIR..2.0 * HAIR).contains(&shortest), "{shortest}");
        let (old, new) = (price(&model, &heap), price(&model, &apart));
        assert!(new.violation <= old.violation && new.cost < old.cost + 0.05);
    }

    #[test]
    fn waypoints_on_one_place_are_finite_when_left_out() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let many = route(&[[500.0, 480.0, 100.0]; 6]);
        let few = with_waypoints(&model, many, 1);
        assert!(
            few.iter()
                .all(|point| point.coords.iter().all(|x| x.is_finite()))
        );
    }
}
