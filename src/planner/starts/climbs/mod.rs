//! Longer ways for cases where the direct one is too short to climb: out and back, round about, to and fro.
//!
//! A vehicle with a limited climb angle needs a certain length of way to reach the middle of the altitude band, or even
//! the target. Where start and target are nearer to each other than that, the cheapest chains of legs through a few
//! places are found along which it gets there, from the cost of each leg and of how far the bends at its end are from
//! that height. One search begins at the start and one at the target; they meet where both have climbed.

mod helix;
mod places;
mod ways;

use super::net::Found;
use super::steepest;
use crate::cost::Model;
use crate::scenario::Scenario;
use ways::Ways;

/// How far to climb, as shares of the distance between the middle of the band and the nearer end of the route; the
/// first share for which the searches meet is used.
const SHARES: [f64; 4] = [1.0, 0.75, 0.5, 0.25];

/// Only as far as from one end to the other.
const BETWEEN: f64 = 0.0;

/// How long ways are, as a share of what the climb takes, and how much room there is at the area's edge, as a
/// multiple of the radius of a bend: ways that can be flown as they are, and tighter ones for the polish to stretch.
const TRIES: [(f64, f64); 2] = [(1.0, 2.0), (0.97, 1.0)];

/// Share of the waypoints for which there must be room at the height.
const LEVEL_SHARE: f64 = 0.7;

/// Ways are longer than necessary by this share, and turns gentler.
const SLACK: f64 = 1e-6;

/// The goal of a climb.
#[derive(Clone, Copy)]
struct Climb {
    /// Height above ground, metres.
    height: f64,
    /// Length along the ground from start to target just for the climb, metres.
    least: f64,
    /// Lengths along the ground from start and from target to that height, with room for the waypoints that stay there.
    needed: [f64; 2],
    /// Extra length because the target is higher or lower than the start.
    more: f64,
}

/// Routes long enough to climb, with no more waypoints than `model` asks for; none where the direct way is long enough.
/// Once `is_over`, those found so far.
pub(super) fn routes(model: &Model, is_over: &dyn Fn() -> bool) -> Found {
    if is_over() {
        return Found::default();
    }
    let mut found = helix::routes(model);
    found.add(ways(model, BETWEEN));
    if model.scenario.weights.altitude > 0.0 {
        for share in SHARES {
            if is_over() {
                break;
            }
            let higher = ways(model, share);
            found.legs_priced += higher.legs_priced;
            if !higher.routes.is_empty() {
                found.routes.extend(higher.routes);
                break;
            }
        }
    }
    found
}

/// The routes for one climb.
fn ways(model: &Model, share: f64) -> Found {
    let mut found = Found::default();
    let climb = Climb::by(model.scenario, share);
    if climb.least > (model.scenario.target - model.scenario.start).xy().norm() {
        for (near, room) in TRIES {
            let ways = Ways::new(model, climb, room);
            found.routes.extend(ways.routes(near));
            found.legs_priced += ways.legs_priced();
        }
    }
    found
}

impl Climb {
    fn by(scenario: &Scenario, share: f64) -> Self {
        let middle = scenario.altitude.middle();
        let own = [scenario.start, scenario.target].map(|end| scenario.terrain.height_of(end));
        let nearer = own
            .into_iter()
            .min_by(|one, other| (one - middle).abs().total_cmp(&(other - middle).abs()))
            .expect("two ends");
        let height = nearer + share * (middle - nearer);
        // Waypoints at that height keep their distance from each other.
        let level = LEVEL_SHARE * scenario.planner.waypoints as f64 * scenario.vehicle.min_leg;
        let climb = |rise: f64| rise.abs() / steepest(scenario) * (1.0 + SLACK);
        let climbs = own.map(|own| climb(own - height));
        let direct = climb(scenario.target.z - scenario.start.z);
        let least = direct.max(climbs[0] + climbs[1]);
        Self {
            height,
            least,
            needed: climbs.map(|climb| climb + 0.5 * level),
            more: (direct - climbs[0] - climbs[1] - level).max(0.0),
        }
    }

    /// Length from start to target, along the ground.
    fn length(&self) -> f64 {
        self.needed[0] + self.needed[1] + self.more
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point2, Point3, Rect};
    use crate::planner::price::price;
    use crate::planner::tests::scenario;
    use crate::planner::{Nobody, plan};
    use crate::scenario::Seeding;

    /// Over level ground in a band of 400 m, with the given distance from start to target, rise, maximum climb
    /// angle and maximum turn angle.
    fn steep([distance, rise, climb, turn]: [f64; 4], waypoints: usize) -> Scenario {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.start = Point3::new(0.0, 0.0, 0.0);
        scenario.target = Point3::new(distance, 0.0, rise);
        scenario.area = Rect {
            min: Point2::new(-100.0, -100.0),
            max: Point2::new(distance + 100.0, 100.0),
        };
        scenario.altitude.max = 400.0;
        scenario.vehicle.max_climb_deg = climb;
        scenario.vehicle.max_turn_deg = turn;
        scenario.vehicle.min_leg = libm::hypot(distance, rise) / (10.0 * (waypoints + 1) as f64);
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        scenario.planner.waypoints = waypoints;
        scenario.planner.iterations = 20;
        scenario.planner.population = 20;
        scenario
    }

    #[test]
    fn no_climb_is_added_where_the_direct_way_is_long_enough() {
        for shape in [[900.0, 0.0, 45.0, 60.0], [400.0, 200.0, 45.0, 60.0]] {
            assert!(
                routes(&Model::new(&steep(shape, 10)), &|| false)
                    .routes
                    .is_empty()
            );
        }
    }

    /// For four geometries of start and target, some start is feasible without a search.
    #[test]
    fn steep_climbs_get_a_feasible_start() {
        for (shape, waypoints) in [
            ([30.0, 0.0, 45.0, 60.0], 10),
            ([100.0, 300.0, 45.0, 60.0], 12),
            ([500.0, 200.0, 15.0, 60.0], 10),
            ([30.0, 200.0, 20.0, 45.0], 20),
        ] {
            let scenario = steep(shape, waypoints);
            let model = Model::new(&scenario);
            let routes = routes(&model, &|| false).routes;
            let flown = |route: &&Vec<Point3>| price(&model, route).is_feasible();
            assert!(routes.iter().any(|route| flown(&route)), "{shape:?}");
            for route in &routes {
                assert!(route.len() <= waypoints + 2, "{shape:?}");
                let ends = (route[0], route[route.len() - 1]);
                assert_eq!(ends, (scenario.start, scenario.target));
            }
        }
    }

    /// A way may end with a place right above or below the target, where rounding leaves less than nothing of it.
    #[test]
    fn a_climb_may_end_above_the_target() {
        let mut scenario = steep([100.0, 0.0, 45.0, 60.0], 10);
        scenario.start = Point3::new(60.0, 50.0, 0.0);
        scenario.target = Point3::new(50.0, 50.0, 100.0);
        scenario.area = Rect {
            min: Point2::new(0.0, 0.0),
            max: Point2::new(100.0, 100.0),
        };
        (scenario.altitude.min, scenario.altitude.max) = (80.0, 120.0);
        scenario.vehicle.min_leg = 0.0;
        let routes = routes(&Model::new(&scenario), &|| false).routes;
        assert!(!routes.is_empty());
        let heights = routes.iter().flatten().map(|place| place.z);
        assert!(heights.into_iter().all(f64::is_finite));
    }

    /// Complete plans, not only their starts, with an upper bound for each cost.
    #[test]
    fn steep_climbs_are_planned_at_low_cost() {
        for (shape, waypoints, most) in [
            ([30.0, 0.0, 45.0, 60.0], 10, 600.0),
            ([100.0, 300.0, 30.0, 60.0], 10, 550.0),
            ([500.0, 200.0, 15.0, 60.0], 10, 540.0),
            ([500.0, 200.0, 15.0, 60.0], 30, 610.0),
            ([30.0, 200.0, 20.0, 45.0], 20, 1150.0),
        ] {
            let scenario = steep(shape, waypoints);
            let outcome = plan(&scenario, &mut Nobody, &Nobody);
            assert!(outcome.feasible, "{shape:?}");
            let total = outcome.cost.total;
            assert!(total < most, "{shape:?}, {waypoints}: {total}");
        }
    }
}
