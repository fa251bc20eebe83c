//! Chains of a net ignore turns: where one is too sharp, it is split into several.

use super::direction;
use crate::geometry::{LEVEL, Point3};
use crate::scenario::Scenario;

/// Legs between the parts of a split turn are this share of the direct way, or the shortest allowed.
const SHORT: f64 = 0.004;

/// `chain` with waypoints added after those where it turns more than the vehicle can, if it then has no more than
/// allowed.
pub(super) fn rounded(scenario: &Scenario, chain: &[Point3]) -> Option<Vec<Point3>> {
    let most = scenario.vehicle.max_turn() * (1.0 - 1e-6);
    let short = (SHORT * scenario.direct()).max(scenario.vehicle.min_leg * (1.0 + 1e-6));
    let mut route = vec![chain[0]];
    for corner in chain.windows(3) {
        route.push(corner[1]);
        let [before, after] = [corner[1] - corner[0], corner[2] - corner[1]].map(|leg| leg.xy());
        if before.norm() < LEVEL || after.norm() <= short {
            continue;
        }
        let turn = libm::atan2(before.perp(&after), before.dot(&after));
        if turn.abs() <= most {
            continue;
        }
        // Slightly smaller turns each, because flying them one after the other shifts them.
        let count = (turn.abs() / most * 1.05).ceil();
        if count > scenario.planner.waypoints as f64 {
            return None;
        }
        let height = scenario.terrain.height_of(corner[1]);
        let heading = libm::atan2(before.y, before.x);
        let mut at = corner[1].xy();
        let mut turned = 1.0;
        while turned < count {
            let heading = heading + turn * turned / count;
            at = scenario.area.nearest(at + direction(heading) * short);
            route.push(Point3::new(
                at.x,
                at.y,
                scenario.terrain.elevation(at) + height,
            ));
            turned += 1.0;
        }
    }
    route.push(chain[chain.len() - 1]);
    let count = route.len();
    (count > chain.len() && count - 2 <= scenario.planner.waypoints).then_some(route)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Model;
    use crate::planner::price::price;
    use crate::planner::tests::scenario;

    #[test]
    fn a_sharp_turn_is_split_into_several() {
        let mut scenario = scenario();
        scenario.threats.clear();
        // Up to the middle of the band, then a turn of 83 degrees towards the target.
        let chain = [
            scenario.start,
            Point3::new(330.0, 40.0, 100.0),
            scenario.target,
        ];
        let model = Model::new(&scenario);
        assert!(price(&model, &chain).violation > 20.0);
        let route = rounded(&scenario, &chain).expect("it turns too much");
        assert_eq!(route.len(), 4);
        let [sharp, soft] = [price(&model, &chain), price(&model, &route)];
        assert!(soft.is_feasible(), "{soft:?}");
        assert!(soft.cost < 1.01 * sharp.cost, "{sharp:?} {soft:?}");

        scenario.planner.waypoints = 1;
        assert_eq!(rounded(&scenario, &chain), None);
        assert_eq!(rounded(&scenario, &route), None);
    }
}
