//! The shortest way round the threats, among the starts that are refined.
//!
//! Drawn tightly round corners it crosses every soft zone on its way, and with few waypoints it cuts some corners: both
//! are gone once it is pulled into place, but until then sixteen detours of one kind may rank before it. Routes through a
//! thin wall rank before it as well, and do not get out of that wall again.

use super::{ROUGH_STEPS, STARTS, with_waypoints_until};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::planner::polish::Polish;
use crate::planner::price::Priced;
use crate::planner::{Stop, why_stop};

/// Where the start along the `shortest` shape is too far behind the best of the `ranked` ones to be refined, pull it into
/// place and rank it anew; the number of routes priced for it.
pub(super) fn pull_forward(
    model: &Model,
    shortest: Vec<Point3>,
    ranked: &mut Vec<Priced>,
    stop: &dyn Stop,
) -> u64 {
    let behind = ranked.get(STARTS..).unwrap_or_default();
    let Some((_, any)) = behind.first() else {
        return 0;
    };
    let waypoints = any.len() - 2;
    let is_over = || why_stop(model.scenario, stop).is_some();
    let shortest = with_waypoints_until(model, shortest, waypoints, &is_over);
    let Some(idx) = behind.iter().position(|(_, route)| *route == shortest) else {
        return 0;
    };
    let (_, mut route) = ranked.remove(STARTS + idx);
    let mut polish = Polish::new(model, stop);
    let fitness = polish.descend(&mut route, ROUGH_STEPS);
    let rank = ranked.partition_point(|(other, _)| other.rank(&fitness).is_le());
    ranked.insert(rank, (fitness, route));
    polish.evaluations(waypoints)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point2, Rect};
    use crate::planner::price::price;
    use crate::planner::tests::{outlined, scenario, search_briefly, straight};
    use crate::planner::{Nobody, plan};
    use crate::scenario::Scenario;

    /// Three thin walls with one gap each, the first of them full of soft zones, and room to fly round all of them.
    fn walls() -> Scenario {
        let mut scenario = scenario();
        [scenario.start, scenario.target] =
            [[122.9, 151.3, 0.0], [934.0, 867.9, 150.0]].map(Point3::from);
        scenario.area = Rect {
            min: Point2::new(-100.0, -100.0),
            max: Point2::new(1100.0, 1100.0),
        };
        scenario.altitude.max = 100.0;
        let wall = |[west, south_east, north_east, north_west]: [f64; 4],
                    [south, north]: [f64; 2],
                    margin| {
            let corners = [
                (west, south),
                (south_east, south),
                (north_east, north),
                (north_west, north),
            ];
            outlined(corners.map(|(x, y)| Point2::new(x, y)).to_vec(), margin)
        };
        scenario.threats = vec![
            wall([250.0, 271.5, 260.0, 250.0], [-50.0, 591.3], 30.0),
            wall([250.0, 258.6, 260.0, 250.0], [630.6, 1050.0], 10.0),
            wall([400.0, 419.4, 410.0, 400.0], [-50.0, 700.6], 0.0),
            wall([400.0, 418.3, 410.0, 400.0], [713.1, 1050.0], 10.0),
            wall([550.0, 559.1, 560.0, 550.0], [-50.0, 824.3], 0.0),
            wall([550.0, 569.3, 560.0, 550.0], [852.1, 1050.0], 0.0),
        ];
        scenario.vehicle.min_leg = 4.0;
        scenario.planner.waypoints = 30;
        search_briefly(&mut scenario);
        scenario
    }

    /// Round the walls' ends it costs 801.
    #[test]
    fn gaps_are_flown_through_where_many_ways_lead_round_the_walls() {
        let outcome = plan(&walls(), &mut Nobody, &Nobody);
        assert!(
            outcome.feasible && outcome.cost.total < 700.0,
            "{}",
            outcome.cost.total
        );
    }

    #[test]
    fn only_a_start_that_would_not_be_refined_is_pulled_forward() {
        let mut scenario = scenario();
        scenario.threats.truncate(1);
        let model = Model::new(&scenario);
        // Ever farther round the only threat; the straight one leads through its soft zone.
        let shifted = |idx: u32| {
            let mut route = straight(&scenario);
            for point in &mut route[1..11] {
                point.x += 10.0 * f64::from(idx);
            }
            (price(&model, &route), route)
        };
        let ranked: Vec<Priced> = (1..=20).chain([0]).map(shifted).collect();
        let mut pulled = ranked.clone();
        let [ahead, behind] = [0, 20].map(|idx| ranked[idx].1.clone());
        assert_eq!(pull_forward(&model, ahead, &mut pulled, &Nobody), 0);
        assert!(pulled == ranked);
        assert!(pull_forward(&model, behind.clone(), &mut pulled, &Nobody) > 0);
        assert_eq!(pulled.len(), ranked.len());
        assert!(!pulled.iter().any(|(_, route)| *route == behind));
        let is_new = |(_, route): &&Priced| !ranked.iter().any(|(_, other)| other == route);
        let (fitness, _) = pulled[..STARTS]
            .iter()
            .find(is_new)
            .expect("among the first");
        assert!(fitness.beats(&ranked[20].0));
    }
}
