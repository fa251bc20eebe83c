//! What the planner can be asked for, as the reader of scenarios wants to know it.

use crate::optimizer::{self, Algorithm};
use crate::scenario::json::{AlgorithmRule, ParameterRule, Rules};
use crate::scenario::limits::Limits;

/// What a document is held to where `limits` are in force.
#[must_use]
pub fn rules(limits: Limits) -> Rules {
    let rule = |parameter: &optimizer::Parameter| ParameterRule {
        name: parameter.name,
        min: parameter.min,
        max: parameter.max,
    };
    let rules = |algorithm: &Algorithm| AlgorithmRule {
        name: algorithm.name,
        parameters: algorithm.parameters.iter().map(rule).collect(),
    };
    Rules::new(limits, optimizer::ALL.iter().map(rules).collect())
}
