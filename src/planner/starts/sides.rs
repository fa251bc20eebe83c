//! On which side of each threat a route passes.

use crate::cost::Model;
use crate::geometry::{Point3, Vector2};

/// For each threat, how many times more often a route passes its middle on the left than comes back there, facing from
/// the start to the target: of two routes with the same figures, one can be bent into the other across no threat.
pub(super) fn sides(model: &Model, route: &[Point3]) -> Vec<i32> {
    let scenario = model.scenario;
    let ahead: Vector2 = scenario.target.xy() - scenario.start.xy();
    let middles = scenario.threats.iter().map(|threat| {
        let extent = threat.extent();
        nalgebra::center(&extent.min, &extent.max)
    });
    let left_of = |middle| {
        let passes = route.windows(2).map(|ends| {
            let (from, to) = (ends[0].xy() - middle, ends[1].xy() - middle);
            let is_before = |seen: Vector2| seen.dot(&ahead) < 0.0;
            match (is_before(from), is_before(to)) {
                (true, false) if from.perp(&to) < 0.0 => 1,
                (false, true) if from.perp(&to) > 0.0 => -1,
                _ => 0,
            }
        });
        passes.sum()
    };
    middles.map(left_of).collect()
}

/// `routes` in their order, except that over level ground those come first that pass the threats as neither the `known`
/// one nor any before them does. (Hills make ways differ as well.)
pub(in crate::planner) fn different_first(
    model: &Model,
    known: &[Point3],
    routes: Vec<Vec<Point3>>,
) -> Vec<Vec<Point3>> {
    if !model.scenario.terrain.is_flat() {
        return routes;
    }
    let mut met = vec![sides(model, known)];
    let (mut first, alike): (Vec<_>, Vec<_>) = routes.into_iter().partition(|route| {
        let sides = sides(model, route);
        let is_new = !met.contains(&sides);
        if is_new {
            met.push(sides);
        }
        is_new
    });
    first.extend(alike);
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::{radar, route, scenario};

    /// Two threats on the way, and routes that pass both on the left, the first on the right, and once round it.
    #[test]
    fn routes_that_pass_threats_elsewhere_come_first() {
        let mut scenario = scenario();
        scenario.threats = vec![radar(400.0, 500.0, 50.0), radar(700.0, 500.0, 50.0)];
        let model = Model::new(&scenario);
        let [left, again, right, round] = [
            &[[400.0, 600.0, 100.0], [700.0, 600.0, 100.0]][..],
            &[[400.0, 700.0, 100.0], [700.0, 700.0, 100.0]],
            &[
                [400.0, 400.0, 100.0],
                [550.0, 500.0, 100.0],
                [700.0, 600.0, 100.0],
            ],
            &[
                [400.0, 600.0, 100.0],
                [460.0, 500.0, 100.0],
                [400.0, 400.0, 100.0],
                [340.0, 500.0, 100.0],
                [400.0, 600.0, 100.0],
                [700.0, 600.0, 100.0],
            ],
        ]
        .map(route);
        let figures = [&left, &again, &right, &round].map(|route| sides(&model, route));
        assert_eq!(figures, [[1, 1], [1, 1], [0, 1], [2, 1]]);
        let ordered = different_first(
            &model,
            &left,
            vec![again.clone(), right.clone(), right.clone(), round.clone()],
        );
        assert_eq!(ordered, [right.clone(), round, again, right]);
    }
}
