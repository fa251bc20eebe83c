//! The derivatives match the merit, and the improved route is better and keeps the limits.

use super::equations::advance;
use super::*;
use crate::optimizer::Random;
use crate::planner::Nobody;
use crate::planner::polish::{Polish, Steps};
use crate::planner::tests::{Looks, disc, hilly_scenario, radar, scenario};
use crate::scenario::{Scenario, Seeding};

/// A vehicle whose turn limit is so tight that hardly anything else shapes its routes.
fn stiff() -> Scenario {
    let mut scenario = scenario();
    scenario.vehicle.max_turn_deg = 16.0;
    scenario.vehicle.min_leg = 25.0;
    scenario.planner.waypoints = 8;
    (scenario.planner.population, scenario.planner.iterations) = (200, 200);
    (scenario.start.z, scenario.target.z) = (100.0, 100.0);
    // The first radar is in the way immediately.
    scenario.threats = vec![radar(270.0, 180.0, 75.0), radar(560.0, 520.0, 110.0)];
    scenario
}

/// From start to target in an arc around a height of 100 m above ground, every coordinate off by up to `off` metres.
fn arc(scenario: &Scenario, free: usize, bulge: f64, off: f64, random: &mut Random) -> Vec<Point3> {
    let way = scenario.target - scenario.start;
    let mut route = vec![scenario.start];
    for idx in 1..=free {
        let share = idx as f64 / (free + 1) as f64;
        let mut at = scenario.start + way * share;
        let aside = bulge * libm::sin(std::f64::consts::PI * share);
        at.x -= aside * way.y / way.norm() + random.between(-off, off);
        at.y += aside * way.x / way.norm() + random.between(-off, off);
        let height = 100.0 + random.between(-off, off);
        at.z = scenario.terrain.elevation(at.xy()) + height;
        route.push(at);
    }
    route.push(scenario.target);
    route
}

/// Compares the equations with central differences along random directions.
#[test]
fn derivatives_match_the_merit() {
    let mut random = Random::new(11);
    let mut free = stiff();
    free.threats.clear();
    for (scenario, accuracy) in [(free, 1e-2), (stiff(), 1e-2), (hilly_scenario(), 0.15)] {
        let model = Model::new(&scenario);
        let mut newton = Newton::new(&model, &Nobody);
        for _ in 0..20 {
            let route = arc(&scenario, 6, 300.0, 25.0, &mut random);
            let limits = Limits::of(&model, 6);
            let mut prices = Prices::new(route.len(), 0.05);
            for multiplier in &mut prices.multipliers {
                *multiplier = random.between(0.0, 0.3);
            }
            for lift in &mut prices.lifts {
                *lift = random.between(-1.0, 1.0);
            }
            let mut places = newton.places(&route);
            let equations = newton.equations(&mut places, &limits, &prices);
            let direction: Vec<f64> = (0..18).map(|_| random.between(-1.0, 1.0)).collect();
            let mut merit = |size: f64| {
                let mut moved = places.clone();
                let step: Vec<f64> = direction.iter().map(|part| part * size).collect();
                advance(&mut moved, &step);
                newton.merit(&moved, &limits, &prices).value
            };
            let size = 1e-3;
            let [back, own, on] = [-size, 0.0, size].map(&mut merit);
            let slope = (on - back) / (2.0 * size);
            let down: f64 = equations
                .down
                .iter()
                .zip(&direction)
                .map(|(down, part)| down * part)
                .sum();
            assert!(
                (slope + down).abs() < 1e-4 * (1.0 + slope.abs()),
                "{slope} {down}"
            );
            let bend = (on - 2.0 * own + back) / (size * size);
            let product = equations.matrix.times(&direction);
            let expected: f64 = product
                .iter()
                .zip(&direction)
                .map(|(one, other)| one * other)
                .sum();
            let scale = 1.0 + bend.abs().max(expected.abs());
            assert!(bend - expected < accuracy * scale, "{bend} {expected}");
            // Negative curvature in soft zones and over hills is left out of the matrix.
            if scenario.threats.is_empty() && scenario.terrain.is_flat() {
                assert!(expected - bend < accuracy * scale, "{bend} {expected}");
            }
        }
    }
}

/// Whatever the initial route looks like, it ends at the best one nearby, within the limits.
#[test]
fn perturbed_routes_on_the_same_side_converge_to_one_cost() {
    let scenario = stiff();
    let model = Model::new(&scenario);
    let mut random = Random::new(5);
    let mut costs = Vec::new();
    for _ in 0..6 {
        let mut route = arc(&scenario, 8, -230.0, 8.0, &mut random);
        let fitness = Newton::new(&model, &Nobody).improve(&mut route, &[]);
        assert!(fitness.is_feasible(), "{fitness:?}");
        assert_eq!(fitness.cost.to_bits(), price(&model, &route).cost.to_bits());
        costs.push(fitness.cost);
    }
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(costs.iter().all(|cost| *cost < 1.01 * least), "{costs:?}");
}

/// For a route whose turns are at their limit, the lattice's result is far from the best.
#[test]
fn a_bend_is_moved_as_a_whole() {
    let scenario = stiff();
    let model = Model::new(&scenario);
    let mut route = arc(&scenario, 8, -230.0, 12.0, &mut Random::new(2));
    let steps = Steps {
        from: 0.01,
        to: 5e-5,
        gain: 5e-6,
        violation_m: f64::INFINITY,
    };
    let polished = Polish::new(&model, &Nobody).descend(&mut route, steps);
    let mut newton = Newton::new(&model, &Nobody);
    assert!(is_felt(&model, &route));
    let brought = newton.improve(&mut route, &[]);
    assert!(brought.is_feasible());
    assert!(
        brought.cost < 0.98 * polished.cost,
        "{brought:?} {polished:?}"
    );
    assert!(newton.evaluations > 0);
}

/// Another route replaces the first only if it leads to a better result.
#[test]
fn other_routes_never_worsen_the_result() {
    let scenario = stiff();
    let model = Model::new(&scenario);
    let mut random = Random::new(9);
    let (left, right) = (
        arc(&scenario, 8, 240.0, 0.0, &mut random),
        arc(&scenario, 8, -240.0, 0.0, &mut random),
    );
    let improved = |first: &[Point3], others: &[Vec<Point3>]| {
        let mut route = first.to_vec();
        Newton::new(&model, &Nobody).improve(&mut route, others)
    };
    let alone = [improved(&left, &[]), improved(&right, &[])];
    let both = [
        improved(&left, std::slice::from_ref(&right)),
        improved(&right, std::slice::from_ref(&left)),
    ];
    for (alone, both) in alone.iter().zip(&both) {
        assert!(!alone.beats(both), "{alone:?} {both:?}");
    }
}

/// A route on the long way round a threat gains by one on the short way.
#[test]
fn another_route_is_taken_if_it_leads_to_a_better_result() {
    let mut scenario = stiff();
    // To the left of the straight line.
    scenario.threats = vec![radar(454.0, 489.0, 110.0)];
    let model = Model::new(&scenario);
    let mut random = Random::new(9);
    let (left, right) = (
        arc(&scenario, 8, 240.0, 0.0, &mut random),
        arc(&scenario, 8, -120.0, 0.0, &mut random),
    );
    let improved =
        |others: &[Vec<Point3>]| Newton::new(&model, &Nobody).improve(&mut left.clone(), others);
    let (alone, both) = (improved(&[]), improved(&[right]));
    assert!(both.beats(&alone), "{alone:?} {both:?}");
}

/// Neither the searches that are under way nor those that would follow go on.
#[test]
fn a_stop_is_heard_between_two_steps() {
    let scenario = stiff();
    let model = Model::new(&scenario);
    let mut random = Random::new(3);
    let routes: Vec<_> = (0..5)
        .map(|_| arc(&scenario, 8, 250.0, 20.0, &mut random))
        .collect();
    let priced = |looks: &Looks| {
        let mut newton = Newton::new(&model, looks);
        newton.improve(&mut routes[0].clone(), &routes[1..]);
        newton.evaluations
    };
    let looks = Looks::until(u32::MAX);
    let all = priced(&looks);
    let half = priced(&Looks::until(looks.count.get() / 2));
    assert!(half > all / 5 && half < all - all / 5, "{half} of {all}");
    let none = priced(&Looks::until(0));
    assert!(none < 10, "{none} of {all}");
}

#[test]
fn distant_limits_are_inactive() {
    let mut scenario = scenario();
    scenario.threats.clear();
    scenario.start.z = 100.0;
    scenario.target.z = 100.0;
    let model = Model::new(&scenario);
    let route = [
        scenario.start,
        nalgebra::center(&scenario.start, &scenario.target),
        scenario.target,
    ];
    assert!(!is_felt(&model, &route));
}

/// Zero weights and coinciding waypoints give a route at least as good as before.
#[test]
fn zero_weights_never_worsen_a_route() {
    let mut random = Random::new(4);
    for (fuel, threat, altitude) in [
        (0.0, 1.0, 1.0),
        (0.0, 0.0, 1.0),
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
    ] {
        let mut scenario = stiff();
        scenario.weights.fuel = fuel;
        scenario.weights.threat = threat;
        scenario.weights.altitude = altitude;
        for free in [1, 2, 9] {
            scenario.planner.waypoints = free;
            let model = Model::new(&scenario);
            let mut routes = vec![arc(&scenario, free, 200.0, 30.0, &mut random)];
            // All waypoints in the same place.
            routes.push(routes[0].clone());
            let at = routes[1][1];
            routes[1][1..=free].fill(at);
            for mut route in routes {
                let before = price(&model, &route);
                let after = Newton::new(&model, &Nobody).improve(&mut route, &[]);
                assert!(!before.beats(&after), "{before:?} {after:?}");
                assert_eq!(route.len(), free + 2);
                assert!(
                    route
                        .iter()
                        .flat_map(|point| point.iter())
                        .all(|value| value.is_finite())
                );
            }
        }
    }
}

/// Discs right before the start and the target take fourteen of the sharpest turns. Bats do not share out the waypoints
/// so; with one waypoint redistributed at a time to four legs, these routes cost 546 to 555.
#[test]
fn waypoints_are_dealt_to_the_bends_that_need_them() {
    let mut scenario = stiff();
    (scenario.vehicle.max_turn_deg, scenario.vehicle.min_leg) = (12.0, 5.0);
    (scenario.planner.seeding, scenario.planner.polish) = (Seeding::Tangent, true);
    scenario.planner.waypoints = 15;
    scenario.start = Point3::new(230.1, 224.3, 0.0);
    scenario.target = Point3::new(789.3, 234.3, 0.0);
    scenario.threats = [
        [311.4, 238.7, 69.7, 99.7],
        [707.8, 243.4, 44.4, 54.4],
        [332.1, 123.0, 73.9, 133.9],
    ]
    .map(disc)
    .to_vec();
    for seed in [7, 1, 2] {
        scenario.planner.seed = seed;
        let outcome = crate::planner::plan(&scenario, &mut Nobody, &Nobody);
        assert!(outcome.feasible, "{seed}");
        assert!(outcome.cost.total < 530.0, "{seed}: {}", outcome.cost.total);
    }
}
