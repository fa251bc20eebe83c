mod scenes;

pub(super) use self::scenes::{
    airspace, descent, disc, hilly_scenario, lobed, mountain, outlined, peaks, radar, route,
    scenario, search_briefly, slalom, soft_wall, straight, wall,
};
use super::newton::Newton;
use super::*;
use crate::cost::Model;
use crate::geometry::Point2;
use crate::scenario::{AltitudeBand, Seeding, WarmStart};
use crate::threat::{Cylinder, Shape, Threat};

/// All that a run reports.
#[derive(Default)]
pub(super) struct Diary {
    pub(super) points: Vec<ConvergencePoint>,
    pub(super) incumbents: Vec<Incumbent>,
}

impl Observer for Diary {
    fn iteration(&mut self, point: &ConvergencePoint) {
        self.points.push(*point);
    }
    fn incumbent(&mut self, incumbent: &Incumbent) {
        self.incumbents.push(incumbent.clone());
    }
}

/// A clock that advances only when it is read, and a stop after a number of reads.
pub(super) struct Looks {
    pub(super) count: std::cell::Cell<u32>,
    stop_after: u32,
}

impl Looks {
    pub(super) fn until(stop_after: u32) -> Self {
        Self {
            count: std::cell::Cell::new(0),
            stop_after,
        }
    }
}

impl Stop for Looks {
    fn requested(&self) -> bool {
        self.count.set(self.count.get() + 1);
        self.count.get() > self.stop_after
    }
    fn elapsed_ms(&self) -> f64 {
        f64::from(self.count.get())
    }
}

#[test]
fn a_run_delivers_a_feasible_route_and_reports_its_progress() {
    let mut diary = Diary::default();
    let outcome = plan(&scenario(), &mut diary, &Looks::until(u32::MAX));
    assert!(outcome.feasible && outcome.violations.is_empty());
    assert_eq!(outcome.stop_reason, StopReason::Iterations);
    assert_eq!(outcome.convergence, diary.points);
    assert_eq!(outcome.convergence.len(), 61);
    let last = diary
        .incumbents
        .last()
        .expect("the first evaluation is an incumbent");
    assert_eq!(last.waypoints, outcome.waypoints);
    assert_eq!(last.cost.to_bits(), outcome.cost.total.to_bits());
    let mut before = f64::INFINITY;
    for point in &outcome.convergence {
        assert!(point.best_cost.unwrap_or(f64::INFINITY) <= before);
        before = point.best_cost.unwrap_or(f64::INFINITY);
    }
    assert!(outcome.bound.lower <= outcome.cost.total);
    let path = outcome.path.expect("a feasible route has a path");
    let checks = outcome.path_checks.expect("and the path its certificate");
    assert!(
        checks
            .clearance
            .iter()
            .all(|clearance| clearance.distance.expect("unbounded threats") >= -1e-6)
    );
    assert!(path.points.len() > 100);
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let run = |seed| {
        let mut scenario = scenario();
        scenario.planner.seed = seed;
        plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).waypoints, run(2).waypoints);
}

/// A radar appears beside the route: starting from the known route, a tenth of the evaluations give as good a result.
#[test]
fn a_warm_start_needs_a_tenth_of_the_evaluations() {
    let mut scenario = scenario();
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    scenario.planner.population = 200;
    scenario.planner.iterations = 200;
    let never = Looks::until(u32::MAX);
    let before = plan(&scenario, &mut Diary::default(), &never);
    let middle = before.waypoints[6];
    let mut popped_up = scenario.threats[0].clone();
    popped_up.shape = Shape::Cylinder(Cylinder {
        center: Point2::new(middle.x + 10.0, middle.y - 10.0),
        radius: 15.0,
        influence: 30.0,
    });
    scenario.threats.push(popped_up);
    let cold = plan(&scenario, &mut Diary::default(), &never);
    scenario.planner.population = 10;
    scenario.planner.iterations = 20;
    scenario.planner.warm_start = Some(WarmStart::Waypoints(before.waypoints));
    let warm = plan(&scenario, &mut Diary::default(), &never);
    assert!(cold.feasible && warm.feasible);
    assert!(
        warm.cost.total <= 1.002 * cold.cost.total,
        "{:?} {:?}",
        warm.cost,
        cold.cost
    );
    assert!(
        warm.evaluations * 10 <= cold.evaluations,
        "{} {}",
        warm.evaluations,
        cold.evaluations
    );
}

#[test]
fn a_stop_keeps_the_best_so_far() {
    let outcome = plan(&scenario(), &mut Diary::default(), &Looks::until(5));
    assert_eq!(outcome.stop_reason, StopReason::Cancelled);
    assert_eq!(outcome.convergence.len(), 6);
    let longer = plan(&scenario(), &mut Diary::default(), &Looks::until(u32::MAX));
    assert_eq!(outcome.convergence[..], longer.convergence[..6]);
}

/// A run that was cut short in what follows its last iteration, the polish and the bound, says so.
#[test]
fn a_stop_after_the_last_iteration_is_told() {
    let mut scenario = scenario();
    (scenario.planner.population, scenario.planner.iterations) = (10, 3);
    (scenario.planner.seeding, scenario.planner.polish) = (Seeding::Tangent, true);
    scenario.planner.gap = 1e-9;
    let all = Looks::until(u32::MAX);
    let whole = plan(&scenario, &mut Diary::default(), &all);
    assert_eq!(whole.stop_reason, StopReason::Iterations);
    let mut cut_short = 0;
    // Nearly all checks are the bound's, which comes first here.
    for stop_after in (all.count.get() - 120..all.count.get()).step_by(2) {
        let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(stop_after));
        assert_eq!(outcome.stop_reason, StopReason::Cancelled, "{stop_after}");
        let has_iterated = outcome.convergence.len() == whole.convergence.len();
        cut_short += u32::from(has_iterated && outcome.evaluations < whole.evaluations);
    }
    assert!(cut_short > 0, "no stop came during the polish");
    let whole_again = plan(
        &scenario,
        &mut Diary::default(),
        &Looks::until(all.count.get()),
    );
    assert_eq!(whole_again.stop_reason, StopReason::Iterations);
    assert_eq!(whole_again.waypoints, whole.waypoints);
}

/// A route of one's own: two waypoints have a straight path, and what is no number is not feasible.
#[test]
fn routes_from_elsewhere_are_certified() {
    let mut scenario = scenario();
    scenario.threats.clear();
    let straight = so_far(&scenario, route(&[]), 0.0);
    let path = straight.path.expect("nothing is in its way");
    assert_eq!(path.degree, 1);
    assert!((path.length - straight.legs[0].length).abs() < 1e-9);
    let unknown = so_far(&scenario, route(&[[500.0, f64::NAN, 100.0]]), 0.0);
    assert!(!unknown.feasible && unknown.path.is_none());
}

#[test]
fn a_time_limit_stops_the_run() {
    let mut scenario = scenario();
    scenario.planner.time_limit_ms = Some(10);
    let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
    assert_eq!(outcome.stop_reason, StopReason::TimeLimit);
    assert_eq!(outcome.convergence.len(), 10);
}

/// Each route takes long to price: a stop does not wait for the whole population.
#[test]
fn a_stop_within_an_iteration_is_noticed() {
    let mut scenario = scenario();
    let far = scenario.threats[0].clone();
    // So many that no more than a block of routes may pass between two checks.
    scenario.threats.extend((0..12_000).map(|_| far.clone()));
    // The stop is checked once per block of routes: a population has eight, and an iteration one more check.
    let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(5));
    assert_eq!(outcome.stop_reason, StopReason::Cancelled);
    assert_eq!(outcome.convergence.len(), 1);
    assert!(
        (1..60).contains(&outcome.evaluations),
        "{}",
        outcome.evaluations
    );
    assert!(outcome.convergence[0].mean_cost.is_finite());
    let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(20));
    assert_eq!(outcome.convergence.len(), 2);
    assert_eq!(outcome.evaluations, outcome.convergence[1].evaluations);
    assert!(
        outcome
            .convergence
            .iter()
            .all(|point| point.mean_cost.is_finite())
    );
}

/// Over one disc and around another: only the waypoints over the first are high. With all of them high, the
/// route costs 901.
#[test]
fn a_threat_is_flown_over_by_no_more_waypoints_than_necessary() {
    let mut scenario = scenario();
    scenario.start = Point3::new(125.0, 524.0, 88.0);
    scenario.target = Point3::new(856.0, 323.0, 93.0);
    scenario.altitude = AltitudeBand {
        min: 20.0,
        max: 120.0,
    };
    scenario.weights.fuel = 1.0;
    scenario.threats = vec![radar(577.0, 360.0, 129.0), radar(637.0, 514.0, 180.0)];
    scenario.threats[0].top = Some(83.0);
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
    assert!(outcome.feasible);
    assert!(outcome.cost.total < 812.0, "{}", outcome.cost.total);
}

/// Where spare waypoints are expensive, coarse routes that stay low look cheap: a start of the search may be
/// better than anything its bats find, and must not be lost.
#[test]
fn a_longer_run_is_no_more_expensive_than_its_starts() {
    let mut scenario = scenario();
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    scenario.start = Point3::new(485.0, 500.0, 0.0);
    scenario.target = Point3::new(515.0, 500.0, 0.0);
    scenario.altitude.max = 400.0;
    scenario.vehicle.max_climb_deg = 8.0;
    scenario.vehicle.min_leg = 30.0 / 210.0;
    scenario.threats = vec![
        radar(126.0, 705.0, 19.0),
        radar(247.0, 999.0, 24.0),
        radar(642.0, 459.0, 35.0),
        radar(495.0, 192.0, 52.0),
        radar(90.0, 234.0, 16.0),
        radar(267.0, 408.0, 56.0),
    ];
    scenario.planner.waypoints = 20;
    scenario.planner.seed = 1;
    let cost = |iterations: usize| {
        let mut scenario = scenario.clone();
        scenario.planner.iterations = iterations;
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        assert!(outcome.feasible);
        outcome.cost.total
    };
    let (starts, longer) = (cost(1), cost(60));
    assert!(longer < 1.001 * starts, "{longer} {starts}");
}

/// Where waypoints cost only the climb over hills, moving them one by one leaves some of that cost.
#[test]
fn many_waypoints_over_hills_are_moved_together() {
    let mut scenario = scenario();
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    scenario.start = Point3::new(277.9, 144.1, 32.4);
    scenario.target = Point3::new(819.0, 858.1, 86.5);
    scenario.threats.clear();
    scenario.terrain = peaks(
        0.0,
        &[
            [529.0, 788.0, 293.0, 129.0, 141.0],
            [536.0, 458.0, 241.0, 87.0, 97.0],
            [522.0, 341.0, 289.0, 149.0, 126.0],
        ],
    );
    scenario.altitude = AltitudeBand {
        min: 60.0,
        max: 260.0,
    };
    scenario.vehicle.min_leg = 3.6;
    scenario.planner.waypoints = 24;
    scenario.planner.seed = 1;
    (scenario.planner.population, scenario.planner.iterations) = (40, 40);
    let outcome = plan(&scenario, &mut Nobody, &Nobody);
    let model = Model::new(&scenario);
    let mut route = outcome.waypoints.clone();
    let better = Newton::new(&model, &Nobody).improve(&mut route, &[]);
    let gain = 1.0 - better.cost / outcome.cost.total;
    assert!(outcome.feasible && gain < 1e-4, "{gain}");
}

/// Steps are shares of the way from start to target, but a route may begin much farther out.
#[test]
fn a_route_far_from_ends_that_are_near_comes_home_in_few_sweeps() {
    let mut scenario = scenario();
    scenario.threats.clear();
    scenario.start = Point3::new(500.0, 500.0, 100.0);
    scenario.target = Point3::new(502.0, 500.0, 100.0);
    (scenario.vehicle.min_leg, scenario.vehicle.max_turn_deg) = (0.0, 180.0);
    let model = Model::new(&scenario);
    let far = Point3::new(501.0, 900.0, 100.0);
    let mut route = vec![scenario.start, far, scenario.target];
    let steps = polish::Steps {
        from: 0.01,
        to: 1e-4,
        gain: 1e-6,
        violation_m: 0.0,
    };
    let mut polish = polish::Polish::new(&model, &Nobody);
    let best = polish.descend(&mut route, steps);
    assert!(best.is_feasible() && best.cost < 1.01, "{best:?}");
    // A sweep prices some eighteen routes; 400 m are 20,000 steps.
    let priced = polish.evaluations(1);
    assert!(priced < 20_000, "{priced}");
}

/// From one side of the area to the other.
fn wall_across() -> Threat {
    wall([-100.0, 1100.0], [400.0, 450.0])
}

#[test]
fn an_impossible_scenario_ends_with_its_violations() {
    let mut scenario = scenario();
    scenario.threats[1] = wall_across();
    let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
    assert!(!outcome.feasible && outcome.path.is_none() && outcome.path_checks.is_none());
    let of_threats = outcome.violations.iter();
    let of_threats: Vec<_> = of_threats.filter(|one| one.kind == "threat").collect();
    assert!(!of_threats.is_empty());
    for violation in of_threats {
        let message = &violation.message;
        assert!(message.contains("they leave no way"), "{message}");
    }
    assert_eq!(outcome.bound.gap, None);
    let last = outcome.convergence.last().expect("there is a curve");
    let amounts = outcome.violations.iter().map(|violation| violation.amount);
    assert_eq!(last.best_cost, None);
    let sum: f64 = amounts.sum();
    assert_eq!(last.best_violation.to_bits(), sum.to_bits());
}

/// What is tried after the last iteration, however often, is one more point of the curve.
#[test]
fn the_curve_of_an_impossible_scenario_repeats_no_iteration_but_the_last() {
    let mut scenario = scenario();
    // There is a way round this one, and the vehicle cannot turn into it.
    scenario.threats = vec![wall([-100.0, 900.0], [400.0, 450.0])];
    scenario.vehicle.max_turn_deg = 2.0;
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    (scenario.planner.waypoints, scenario.planner.iterations) = (4, 8);
    let mut diary = Diary::default();
    let outcome = plan(&scenario, &mut diary, &Nobody);
    assert!(!outcome.feasible);
    let mut messages = outcome
        .violations
        .iter()
        .map(|violation| &violation.message);
    assert!(!messages.any(|message| message.contains("no way")));
    let iterations = |points: &[ConvergencePoint]| -> Vec<usize> {
        points.iter().map(|point| point.iteration).collect()
    };
    let expected: Vec<usize> = (0..=8).chain([8]).collect();
    assert_eq!(iterations(&outcome.convergence), expected);
    assert_eq!(iterations(&diary.points), expected);
    let last = outcome.convergence.last().expect("there is a curve");
    assert_eq!(last.evaluations, outcome.evaluations);
}

/// That there is no way shows after one search, and no other looks for it.
#[test]
fn where_there_is_no_way_the_search_is_not_repeated() {
    let mut scenario = scenario();
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    search_briefly(&mut scenario);
    let mut searched = |threats: &[Threat], turn: f64| {
        scenario.threats = threats.to_vec();
        scenario.vehicle.max_turn_deg = turn;
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        assert!(!outcome.feasible);
        outcome.evaluations
    };
    let closed = searched(&[wall_across()], 2.0);
    let open = searched(&[wall([-100.0, 900.0], [400.0, 450.0])], 2.0);
    assert!(2 * closed < open, "{closed} {open}");
}

#[test]
fn the_papers_quadrature_reports_both_figures() {
    let mut scenario = scenario();
    scenario.planner.quadrature = Quadrature::Paper;
    let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
    let exact = outcome
        .cost_integral
        .expect("the integral is reported beside the samples");
    assert_eq!(exact.fuel.to_bits(), outcome.cost.fuel.to_bits());
    let last = outcome.convergence.last().expect("there is a curve");
    assert_eq!(last.best_cost, Some(outcome.cost.total));
}
