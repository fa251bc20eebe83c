//! The requests that the planner accepts, in the form needed by the reader of scenarios.

use crate::optimizer::{self, Algorithm};
use crate::scenario::json::{AlgorithmRule, ParameterRule, Rules};
use crate::scenario::limits::Limits;

/// The rules for documents where `limits` are in force.
#[must_use]
pub fn rules(limits: Limits) -> Rules {
    let rule = |parameter: &optimizer::Parameter| ParameterRule {
        name: parameter.name,
        default: parameter.default,
        min: parameter.min,
        max: parameter.max,
    };
    let rules = |algorithm: &Algorithm| AlgorithmRule {
        name: algorithm.name,
        parameters: algorithm.parameters.iter().map(rule).collect(),
    };
    Rules::new(limits, optimizer::ALL.iter().map(rules).collect())
}
