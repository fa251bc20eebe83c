//! Beside rings of many corners, the search prices routes beside simpler ones, which are drawn a little larger. What it
//! ends with keeps clear of the true ones too, and is then brought to where they are.

use super::aside::aside;
use super::finish::bring_back;
use super::log::Log;
use super::{
    ConvergencePoint, Incumbent, Observer, StopReason, is_hopeless, search_on, starts, why_stop,
};
use crate::cost::Model;
use crate::geometry::{Point3, Side};
use crate::scenario::{Scenario, Seeding};
use crate::seeding;

/// `scenario` with simpler rings, where that makes a search shorter.
pub(super) fn scene(scenario: &Scenario) -> Option<Scenario> {
    let settings = &scenario.planner;
    (settings.polish && settings.seeding == Seeding::Tangent)
        .then(|| seeding::simpler(scenario, Side::Around))
        .flatten()
}

/// Search routes of `scene`, and bring the best to `model`, whose run it is: why that ended, and the bound of `model`.
pub(super) fn searched(model: &Model, scene: &Scenario, log: &mut Log) -> (StopReason, f64) {
    if let Some(known) = starts::given(model) {
        // It may be within the simpler rings.
        let waypoints = model.scenario.planner.waypoints;
        log.offer_unpriced(&starts::with_waypoints(model, known, waypoints));
    }
    let (reason, lower, route) = beside_simpler_rings(model, scene, log);
    log.offer_unpriced(&route);
    if reason == StopReason::Iterations {
        bring_back(model, log.route.clone(), log);
    }
    let is_over = reason != StopReason::Iterations || why_stop(model.scenario, log.stop).is_some();
    if is_over || log.best.is_feasible() || is_hopeless(model, log) {
        return (reason, lower);
    }
    (beside_true_rings(model, lower, log), lower)
}

/// Why the search of `scene` ended, the bound of `model`, and the best route.
fn beside_simpler_rings(
    model: &Model,
    scene: &Scenario,
    log: &mut Log,
) -> (StopReason, f64, Vec<Point3>) {
    let simple = Model::new(scene);
    let stop = log.stop;
    let mut relay = Relay {
        priced: log.evaluations,
        log,
    };
    let mut own = Log::new(&simple, &mut relay, stop);
    let (reason, lower) = super::searched(&simple, model.scenario, &mut own);
    let (route, evaluations) = (own.route, own.evaluations);
    let (is_polished, known) = (own.is_polished, own.lower);
    let Relay { log, priced } = relay;
    log.evaluations = evaluations + priced;
    (log.is_polished, log.lower) = (is_polished, known);
    (reason, lower, route)
}

/// Where simpler rings leave no way, the true ones may: search there too; returns why that ended.
fn beside_true_rings(model: &Model, lower: f64, log: &mut Log) -> StopReason {
    let starts = starts::routes(model, log.stop);
    if let Some((reason, fitness, route)) = aside(model, starts, log.lower, log) {
        log.offer(&route, fitness);
        if reason != StopReason::Iterations {
            return reason;
        }
    }
    search_on(model, lower, log)
}

/// Tells a run of what a search beside simpler rings finds, at the prices of the run.
struct Relay<'l, 'o> {
    log: &'l mut Log<'o>,
    /// Routes priced for it alone.
    priced: u64,
}

impl Observer for Relay<'_, '_> {
    fn iteration(&mut self, point: &ConvergencePoint) {
        self.log.evaluations = point.evaluations + self.priced;
        self.log
            .record(point.iteration, point.mean_cost, point.feasible_fraction);
    }

    fn incumbent(&mut self, incumbent: &Incumbent) {
        self.priced += 1;
        if self.log.offer_unpriced(&incumbent.waypoints) {
            self.log.show(incumbent.iteration, incumbent.elapsed_ms);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::price::price;
    use crate::planner::tests::{Diary, airspace, lobed, wall};
    use crate::planner::{Nobody, plan};
    use crate::scenario::WarmStart;

    /// Searches beside the true ring, with seven times as many bats and iterations, end at 506.996 and more.
    #[test]
    fn a_route_found_beside_a_simpler_ring_is_as_good_beside_the_true_one() {
        let scenario = airspace();
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        let (found, lower) = (outcome.cost.total, outcome.bound.lower);
        assert!(outcome.feasible && found < 507.1, "{found}");
        assert!(lower < found && found < 1.002 * lower, "{lower} {found}");
    }

    /// Of a run, one hears the costs of its own scenario, whatever it is searched in.
    #[test]
    fn whoever_follows_the_search_hears_of_the_true_costs() {
        let scenario = airspace();
        let model = Model::new(&scenario);
        let mut diary = Diary::default();
        let outcome = plan(&scenario, &mut diary, &Nobody);
        assert!(diary.incumbents.len() > 1);
        for incumbent in &diary.incumbents {
            let fitness = price(&model, &incumbent.waypoints);
            assert_eq!(incumbent.cost.to_bits(), fitness.cost.to_bits());
            assert_eq!(incumbent.feasible, fitness.is_feasible());
        }
        let last = diary.incumbents.last().expect("there are some");
        assert_eq!(last.waypoints, outcome.waypoints);
        let iterations: Vec<usize> = diary.points.iter().map(|point| point.iteration).collect();
        let expected: Vec<usize> = (0..=30).chain([30]).collect();
        assert_eq!(iterations, expected);
        let evaluations = diary.points.iter().map(|point| point.evaluations);
        assert!(evaluations.is_sorted());
        assert_eq!(diary.points, outcome.convergence);
    }

    /// The best route there is touches the true ring.
    #[test]
    fn a_known_route_becomes_no_worse() {
        let mut scenario = airspace();
        let known = plan(&scenario, &mut Nobody, &Nobody);
        let free = known.waypoints[1..known.waypoints.len() - 1].to_vec();
        scenario.planner.warm_start = Some(WarmStart::Waypoints(free));
        (scenario.planner.population, scenario.planner.iterations) = (4, 1);
        let again = plan(&scenario, &mut Nobody, &Nobody);
        assert!(again.feasible && again.cost.total <= known.cost.total);
        assert!(again.evaluations < known.evaluations / 2);
    }

    /// Where the simpler rings leave no way, the true ones do.
    #[test]
    fn where_no_route_is_found_the_true_rings_are_searched() {
        let mut scenario = airspace();
        scenario.planner.waypoints = 5;
        (scenario.planner.population, scenario.planner.iterations) = (10, 10);
        let mut closed = scenario.clone();
        closed.threats.push(wall([0.0, 1000.0], [500.0, 520.0]));
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        let (reason, lower) = searched(&model, &closed, &mut log);
        assert_eq!(reason, StopReason::Iterations);
        assert!(log.best.is_feasible() && log.best.cost < 1.01 * lower);
    }

    #[test]
    fn few_corners_and_the_plain_algorithm_are_searched_as_they_are() {
        let scenario = airspace();
        assert!(scene(&scenario).is_some());
        let check = |change: &dyn Fn(&mut Scenario)| {
            let mut other = scenario.clone();
            change(&mut other);
            assert!(scene(&other).is_none());
        };
        check(&|other| other.threats = vec![lobed([500.0, 500.0, 100.0], 14)]);
        check(&|other| other.threats.clear());
        check(&|other| other.planner.seeding = Seeding::Random);
        check(&|other| other.planner.polish = false);
    }
}
