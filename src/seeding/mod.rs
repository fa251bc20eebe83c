//! What can be computed from a scenario's geometry before any search: the taut strings round its obstacles, and a cost
//! that no feasible route can undercut.
//!
//! Deliberately absent: routes of waypoints, and turns.

mod arc;
mod bound;
mod obstacles;
mod outline;
mod simpler;
mod steep;
mod taut;

pub use bound::{WaysSought, cheap_ways, cheapest_slip, is_closed, lower_bound, lower_bound_until};
pub use obstacles::Obstacles;
pub use outline::{Outline, OutlineShape};
pub use simpler::simpler;
pub use steep::steep_ground;
pub use taut::{Piece, TautString, TautStrings, taut_strings, taut_strings_until};

#[cfg(test)]
mod tests {
    use crate::scenario::Scenario;
    use crate::scenario::json::{self, AlgorithmRule, Rules};
    use crate::scenario::limits::Limits;

    pub(super) fn read(document: &str) -> Scenario {
        let algorithm = AlgorithmRule {
            name: "tms-sba",
            parameters: Vec::new(),
        };
        let rules = Rules::new(Limits::default(), vec![algorithm]);
        json::read(document.as_bytes(), &rules, 1).unwrap_or_else(|fault| panic!("{fault:?}"))
    }

    /// From (200, 100, 0) to (800, 800, 150) in a square of a kilometre, with `members` added.
    pub(super) fn scenario(members: &str) -> Scenario {
        read(&format!(
            r#"{{ "frame": "local",
                "start": {{ "x": 200, "y": 100, "z": 0 }}, "target": {{ "x": 800, "y": 800, "z": 150 }},
                "area": {{ "min": {{ "x": 0, "y": 0 }}, "max": {{ "x": 1000, "y": 1000 }} }},
                "altitude": {{ "min": 0, "max": 200 }},
                "vehicle": {{ "max_turn_deg": 60, "max_climb_deg": 45, "fuel_per_km": 1000 }},
                "weights": {{ "fuel": 0.5, "threat": 1, "altitude": 1 }},
                "planner": {{ "algorithm": "tms-sba" }}, {members} }}"#
        ))
    }

    /// The same among cylinders of unlimited height, each given as centre x and y, radius and influence.
    pub(super) fn among(discs: impl IntoIterator<Item = [f64; 4]>) -> Scenario {
        let discs = discs.into_iter();
        let threats: Vec<String> = discs.map(|[x, y, r, i]| disc(x, y, r, i)).collect();
        scenario(&format!(r#""threats": [{}]"#, threats.join(", ")))
    }

    /// A cylinder of unlimited height, as a member of `threats`.
    pub(super) fn disc(x: f64, y: f64, radius: f64, influence: f64) -> String {
        format!(
            r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {influence}}}"#
        )
    }
}
