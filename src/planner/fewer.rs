//! Removes waypoints from a route, one after the other, so that what is left keeps every limit.

use std::ops::Range;

use super::finish::{polish, refine};
use super::log::Log;
use super::newton::Newton;
use super::polish::Steps;
use super::price::{Priced, change, price};
use super::search::COARSE_STEPS;
use super::{StopReason, same, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;

/// Waypoints whose removal from a route is tried at each step, and pairs that become one.
const TRIES: usize = 3;

/// So many of the last waypoints are removed again, more carefully, where no route is left that keeps every limit.
const AGAIN: usize = 5;

/// Legs may become longer by this many times their length where two waypoints become one.
const MOST_LONGER: f64 = 2.0;

/// Polish of the rest of a route after a waypoint has been removed.
const STEPS: Steps = Steps {
    from: 0.05,
    ..COARSE_STEPS
};

/// Remove one waypoint after another, always the one without which the rest is best once pulled into place. Where that
/// ends beyond the limits, go back a few waypoints and keep several routes from there on.
///
/// # Errors
/// Why the run must stop.
pub(super) fn leave_out(
    model: &Model,
    route: Vec<Point3>,
    log: &mut Log,
) -> Result<Priced, StopReason> {
    let all = model.scenario.planner.waypoints;
    let first = (price(model, &route), route);
    let before = fewer(model, vec![first], all + AGAIN, Choice::GREEDY, log)?;
    let mut left = fewer(model, before.clone(), all, Choice::GREEDY, log)?;
    if !left[0].0.is_feasible() {
        left = fewer(model, before, all, Choice::BROAD, log)?;
    }
    let (mut fitness, mut route) = left.swap_remove(0);
    if !fitness.is_feasible() {
        fitness = refine(model, &mut route, &[], log);
    }
    Ok((fitness, route))
}

/// As [`leave_out`], in less time: whatever comes of it, nothing is done again.
///
/// # Errors
/// Why the run must stop.
pub(super) fn leave_out_quickly(
    model: &Model,
    route: Vec<Point3>,
    log: &mut Log,
) -> Result<Vec<Point3>, StopReason> {
    let all = model.scenario.planner.waypoints;
    let first = (price(model, &route), route);
    let mut left = fewer(model, vec![first], all, Choice::QUICK, log)?;
    Ok(left.swap_remove(0).1)
}

/// How routes with a waypoint less are chosen.
#[derive(Clone, Copy)]
struct Choice {
    /// Whether two waypoints may become one, too.
    merges: bool,
    /// How many routes are kept.
    kept: usize,
    /// Whether Newton's method makes each of those tried as good as it gets; otherwise it only brings as many within the
    /// limits as are kept, which takes less time.
    is_thorough: bool,
}

impl Choice {
    const GREEDY: Self = Self {
        merges: false,
        kept: 1,
        is_thorough: true,
    };
    const QUICK: Self = Self {
        is_thorough: false,
        ..Self::GREEDY
    };
    const BROAD: Self = Self {
        merges: true,
        kept: 6,
        is_thorough: false,
    };
}

/// The `routes` with `waypoints` each or fewer, best first.
///
/// # Errors
/// Why the run must stop.
fn fewer(
    model: &Model,
    mut routes: Vec<Priced>,
    waypoints: usize,
    choice: Choice,
    log: &mut Log,
) -> Result<Vec<Priced>, StopReason> {
    while routes[0].1.len() - 2 > waypoints {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return Err(reason);
        }
        let mut lessened = Vec::new();
        for (_, route) in &routes {
            let last = route.len() - 1;
            let omissions = (1..last).map(Loss::of).collect();
            lessened.extend(best_few(model, route, omissions, log));
            if choice.merges {
                let merges = (1..last - 1).flat_map(|idx| Loss::merging(route, idx));
                lessened.extend(best_few(model, route, merges.collect(), log));
            }
        }
        let is_last = routes[0].1.len() - 3 == waypoints;
        let kept = if is_last { 1 } else { choice.kept };
        routes = into_place(model, lessened, Choice { kept, ..choice }, log);
    }
    Ok(routes)
}

/// What becomes of `route` by the best few of these `losses`.
fn best_few(model: &Model, route: &[Point3], losses: Vec<Loss>, log: &mut Log) -> Vec<Vec<Point3>> {
    let legs = losses.len() * Loss::LEGS;
    log.evaluations += (legs / (route.len() - 1)) as u64;
    let mut priced: Vec<(Fitness, Loss)> = losses
        .into_iter()
        .map(|loss| (loss.change(model, route), loss))
        .collect();
    priced.sort_by(|one, other| one.0.rank(&other.0));
    priced.truncate(TRIES);
    priced
        .iter()
        .map(|(_, loss)| loss.of_route(route))
        .collect()
}

/// The best of these `routes`, pulled into place; as many as the `choice` keeps.
fn into_place(
    model: &Model,
    routes: Vec<Vec<Point3>>,
    choice: Choice,
    log: &mut Log,
) -> Vec<Priced> {
    let polished = routes.into_iter().map(|mut route| {
        let fitness = polish(model, &mut route, STEPS, log);
        (fitness, route)
    });
    let mut placed = different(model, polished.collect());
    let is_within = |(fitness, _): &&Priced| fitness.is_feasible();
    let mut within = placed.iter().filter(is_within).count();
    for (fitness, route) in &mut placed {
        if fitness.is_feasible() {
            continue;
        }
        let mut newton = Newton::new(model, log.stop);
        if choice.is_thorough {
            *fitness = newton.improve(route, &[]);
        } else if within < choice.kept {
            *fitness = newton.reach(route);
            within += usize::from(fitness.is_feasible());
        }
        log.evaluations += newton.evaluations;
    }
    let mut placed = different(model, placed);
    placed.truncate(choice.kept);
    placed
}

/// Best first, and none twice.
fn different(model: &Model, mut routes: Vec<Priced>) -> Vec<Priced> {
    routes.sort_by(|one, other| one.0.rank(&other.0));
    let mut known: Vec<Priced> = Vec::new();
    for (fitness, route) in routes {
        let is_known = |(_, other): &Priced| same(model.scenario, other, &route);
        if !known.iter().any(is_known) {
            known.push((fitness, route));
        }
    }
    known
}

/// One waypoint less.
struct Loss {
    /// The waypoint left out, or the two that become one.
    of: Range<usize>,
    /// This one.
    instead: Option<Point3>,
}

impl Loss {
    /// Waypoints before and after on which the change in price depends: their turns, and where these come from.
    const SEEN: usize = 2;

    /// About so many legs are priced for a change.
    const LEGS: usize = 2 * Self::SEEN + 3;

    fn of(idx: usize) -> Self {
        Self {
            of: idx..idx + 1,
            instead: None,
        }
    }

    /// Waypoint `idx` and the next one made one: halfway between them, and where the legs before and after would meet.
    fn merging(route: &[Point3], idx: usize) -> Vec<Self> {
        let [before, one, other, after] = [idx - 1, idx, idx + 1, idx + 2].map(|idx| route[idx]);
        let (to, back) = (one - before, other - after);
        let across = to.xy().perp(&back.xy());
        let between = (other - one).xy();
        // How much longer the legs become.
        let (further, earlier) = (
            between.perp(&back.xy()) / across,
            between.perp(&to.xy()) / across,
        );
        let meets = [further, earlier]
            .iter()
            .all(|share| (0.0..MOST_LONGER).contains(share));
        let corner =
            meets.then(|| nalgebra::center(&(one + to * further), &(other + back * earlier)));
        let at = |place| Self {
            of: idx..idx + 2,
            instead: Some(place),
        };
        std::iter::once(nalgebra::center(&one, &other))
            .chain(corner)
            .map(at)
            .collect()
    }

    /// The part of `route` within `part` after it.
    fn within(&self, route: &[Point3], part: &Range<usize>) -> Vec<Point3> {
        let before = route[part.start..self.of.start].iter();
        let after = route[self.of.end..part.end].iter();
        before.chain(&self.instead).chain(after).copied().collect()
    }

    fn of_route(&self, route: &[Point3]) -> Vec<Point3> {
        self.within(route, &(0..route.len()))
    }

    fn change(&self, model: &Model, route: &[Point3]) -> Fitness {
        let first = self.of.start.saturating_sub(Self::SEEN);
        let part = first..(self.of.end + Self::SEEN).min(route.len());
        let new = self.within(route, &part);
        change(model, &route[part], &new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::Nobody;
    use crate::planner::tests::{peaks, scenario, slalom};
    use crate::scenario::AltitudeBand;

    #[test]
    fn the_waypoints_left_out_are_those_missed_least() {
        let mut scenario = slalom();
        scenario.threats.truncate(1);
        scenario.planner.waypoints = 3;
        let model = Model::new(&scenario);
        let corners = [
            (250.0, 860.0),
            (290.0, 870.0),
            (320.0, 870.0),
            (500.0, 740.0),
            (800.0, 560.0),
        ];
        let free = corners.map(|(x, y)| Point3::new(x, y, 100.0));
        let whole = [&[scenario.start], &free[..], &[scenario.target]].concat();
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        let left = leave_out(&model, whole.clone(), &mut log);
        let (fitness, route) = left.expect("nobody stops it");
        assert!(fitness.is_feasible() && route.len() == 5, "{fitness:?}");
        assert!(log.evaluations > 0);
        // Leaving out any two others, and moving nothing, gives no better route.
        for first in 1..6 {
            for second in first..5 {
                let mut rest = whole.clone();
                rest.remove(first);
                rest.remove(second);
                assert!(!price(&model, &rest).beats(&fitness), "{rest:?}");
            }
        }
    }

    /// From one summit to another with fewer legs than the way has bends: the cheapest choice of waypoints ends in legs
    /// that are too steep.
    #[test]
    fn several_routes_are_kept_where_the_cheapest_choice_ends_beyond_the_limits() {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.terrain = peaks(
            0.0,
            &[
                [229.604, 426.489, 414.948, 101.287, 101.287],
                [835.276, 431.360, 254.213, 140.925, 140.925],
                [346.145, 612.863, 159.669, 107.499, 107.499],
                [312.982, 183.781, 64.867, 61.341, 61.341],
                [405.124, 803.586, 255.851, 42.756, 42.756],
                [307.390, 363.458, 233.842, 99.227, 99.227],
            ],
        );
        scenario.altitude = AltitudeBand {
            min: 10.0,
            max: 80.0,
        };
        scenario.weights.altitude = 0.1;
        scenario.vehicle.max_turn_deg = 60.0;
        scenario.vehicle.max_climb_deg = 45.0;
        scenario.planner.waypoints = 6;
        let whole = [
            [229.604, 426.489, 501.877],
            [197.238, 415.568, 467.717],
            [191.868, 388.829, 440.444],
            [272.569, 317.794, 332.933],
            [364.049, 328.110, 240.873],
            [410.358, 407.810, 148.696],
            [468.971, 407.649, 90.082],
            [551.016, 413.006, 79.095],
            [624.242, 417.726, 103.528],
            [813.231, 429.989, 259.660],
            [835.276, 431.360, 254.214],
        ];
        let whole = whole.map(|[x, y, z]| Point3::new(x, y, z)).to_vec();
        [scenario.start, scenario.target] = [whole[0], whole[10]];
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        let first = (price(&model, &whole), whole.clone());
        let greedy = fewer(&model, vec![first], 6, Choice::GREEDY, &mut log);
        assert!(!greedy.expect("nobody stops it")[0].0.is_feasible());
        let left = leave_out(&model, whole, &mut log);
        let (fitness, route) = left.expect("nobody stops it");
        assert!(fitness.is_feasible() && route.len() == 8, "{fitness:?}");
    }

    #[test]
    fn two_waypoints_that_cut_a_corner_become_the_corner() {
        let route = [[0.0, 0.0], [80.0, 0.0], [100.0, 20.0], [100.0, 100.0]];
        let route = route.map(|[x, y]| Point3::new(x, y, 50.0));
        let corner = |x, y| vec![route[0], Point3::new(x, y, 50.0), route[3]];
        let merges = Loss::merging(&route, 1);
        let merged: Vec<_> = merges.iter().map(|loss| loss.of_route(&route)).collect();
        assert_eq!(merged, [corner(90.0, 10.0), corner(100.0, 0.0)]);
        // Legs that lead away from each other meet nowhere ahead.
        let mut away = route;
        away.swap(1, 2);
        assert_eq!(Loss::merging(&away, 1).len(), 1);
    }

    /// What is seen of it says all of the price, turns included.
    #[test]
    fn what_a_loss_changes_is_told_from_the_waypoints_beside_it() {
        let mut scenario = slalom();
        scenario.vehicle.max_turn_deg = 20.0;
        let model = Model::new(&scenario);
        let free = [
            [150.0, 860.0, 90.0],
            [290.0, 700.0, 120.0],
            [320.0, 500.0, 100.0],
            [500.0, 740.0, 60.0],
            [700.0, 560.0, 100.0],
        ]
        .map(Point3::from);
        let route = [&[scenario.start], &free[..], &[scenario.target]].concat();
        let whole = price(&model, &route);
        let merges = (1..5).flat_map(|idx| Loss::merging(&route, idx));
        for loss in (1..6).map(Loss::of).chain(merges) {
            let change = loss.change(&model, &route);
            let after = price(&model, &loss.of_route(&route));
            assert!((after.cost - whole.cost - change.cost).abs() < 1e-9);
            assert!((after.violation - whole.violation - change.violation).abs() < 1e-9);
        }
    }
}
