//! Whether the best start pays so much for soft zones that a long detour may be cheaper.

use crate::cost::{Model, metre};
use crate::geometry::Point3;

/// A route pays much for soft zones if they cost this share of what its length costs.
const MUCH: f64 = 0.1;

/// Nets reach no farther than this multiple of the direct way: their steps would be too long.
const FARTHEST: f64 = 4.0;

/// How many times longer than the direct way a cheaper way than `route` may be, if it is worth a look: a way whose fuel
/// alone costs more is not cheaper.
pub(super) fn detour(model: &Model, route: &[Point3]) -> Option<f64> {
    let scenario = model.scenario;
    let figures = model.figures(route, scenario.planner.quadrature);
    let way = figures.fuel + figures.threat;
    let direct = scenario.direct() * metre(scenario);
    (figures.threat > MUCH * way).then(|| (way / direct).min(FARTHEST))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;
    use crate::scenario::Weights;

    /// Crossing the soft zones straight costs more than a detour of this much.
    #[test]
    fn detours_are_limited_to_what_may_pay_off() {
        let mut scenario = scenario();
        let straight = [scenario.start, scenario.target];
        let of = |scenario: &crate::scenario::Scenario| detour(&Model::new(scenario), &straight);
        let far = of(&scenario).expect("it crosses soft zones");
        assert!(far > 1.0 && far <= FARTHEST, "{far}");
        scenario.weights = Weights {
            threat: 1e6,
            ..scenario.weights
        };
        assert_eq!(of(&scenario), Some(FARTHEST));
        scenario.weights.threat = 0.0;
        assert_eq!(of(&scenario), None);
    }
}
