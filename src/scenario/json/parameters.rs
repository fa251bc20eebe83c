//! `planner.parameters`: the algorithm's constants, and those common to all algorithms.

use std::collections::BTreeMap;

use crate::scenario::Quadrature;

use super::fault::Faults;
use super::fields::{given_twice, unknown_key};
use super::path::Path;
use super::ranges::{GAP, Range, THREADS};
use super::tree::Node;
use super::value::At;
use super::{AlgorithmRule, ParameterRule};

/// A parameter listed among the algorithm's constants that every algorithm has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommonParameter {
    /// Its key in `planner.parameters`.
    pub name: &'static str,
    /// Allowed values and the default.
    pub takes: Takes,
    /// One sentence for the user.
    pub meaning: &'static str,
}

/// The values of a [`CommonParameter`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Takes {
    /// One of some words.
    Choice {
        /// Used when absent.
        default: &'static str,
        /// All choices.
        choices: &'static [&'static str],
    },
    /// A number.
    Number {
        /// Used when absent.
        default: f64,
        /// Least allowed value.
        min: f64,
        /// Greatest allowed value.
        max: f64,
    },
}

const QUADRATURES: [&str; Quadrature::ALL.len()] = {
    let [integral, paper] = Quadrature::ALL;
    [integral.name(), paper.name()]
};
const NO_GAP: f64 = 0.0;
const ONE_THREAD: usize = 1;

/// Every [`CommonParameter`].
pub const COMMON: [CommonParameter; 3] = [
    CommonParameter {
        name: "quadrature",
        takes: Takes::Choice {
            default: QUADRATURES[0],
            choices: &QUADRATURES,
        },
        meaning: "how a leg is priced: integral exactly, paper by the published five samples",
    },
    CommonParameter {
        name: "gap",
        takes: Takes::Number {
            default: NO_GAP,
            min: GAP.min,
            max: GAP.max,
        },
        meaning: "the search ends once its cost is proven to be within this share of the optimum; 0 never ends it",
    },
    CommonParameter {
        name: "threads",
        takes: Takes::Number {
            default: ONE_THREAD as f64,
            min: THREADS.min,
            max: THREADS.max,
        },
        meaning: "threads that may price routes, a whole number; the result does not depend on it",
    },
];

/// The parameters read from a document.
pub(super) struct Parameters {
    pub(super) quadrature: Quadrature,
    pub(super) gap: f64,
    pub(super) threads: usize,
    pub(super) constants: BTreeMap<String, f64>,
}

impl Parameters {
    /// Those of a document that gives none.
    pub(super) fn default(rule: Option<&AlgorithmRule>) -> Self {
        let constants = constants(rule).iter();
        Self {
            quadrature: Quadrature::Integral,
            gap: NO_GAP,
            threads: ONE_THREAD,
            constants: constants
                .map(|constant| (constant.name.to_owned(), constant.default))
                .collect(),
        }
    }
}

fn constants(rule: Option<&AlgorithmRule>) -> &[ParameterRule] {
    rule.map_or(&[], |rule| &rule.parameters)
}

/// Reads the common parameters and the constants that `rule` allows; those not given get their defaults, so that an
/// accepted document says what its plan was made with. Without a rule the other keys cannot be checked, so they are
/// skipped.
pub(super) fn parameters(
    at: At<'_>,
    rule: Option<&AlgorithmRule>,
    faults: &mut Faults,
) -> Option<Parameters> {
    let Node::Object(entries) = at.node else {
        at.fields(&[], faults);
        return None;
    };
    let constants = constants(rule);
    let mut allowed: Vec<&str> = COMMON.iter().map(|parameter| parameter.name).collect();
    allowed.extend(constants.iter().map(|parameter| parameter.name));
    let mut seen = vec![false; allowed.len()];
    let mut sound = true;
    let mut parameters = Parameters::default(rule);
    for (key, node) in entries {
        let Some(slot) = allowed.iter().position(|name| *name == &**key) else {
            if let Some(rule) = rule {
                let role = format!("parameter of {}", rule.name);
                unknown_key(at.path, key, "unknown-parameter", &role, &allowed, faults);
            }
            sound = false;
            continue;
        };
        let path = Path::Key(at.path, key);
        if std::mem::replace(&mut seen[slot], true) {
            given_twice(&path, key, faults);
            continue;
        }
        let at = At { node, path: &path };
        sound &= match allowed[slot] {
            "quadrature" => at
                .named(Quadrature::ALL, Quadrature::name, faults)
                .map(|quadrature| parameters.quadrature = quadrature)
                .is_some(),
            "gap" => at
                .number(GAP, faults)
                .map(|gap| parameters.gap = gap)
                .is_some(),
            "threads" => at
                .whole(THREADS, faults)
                .and_then(|threads| usize::try_from(threads).ok())
                .map(|threads| parameters.threads = threads)
                .is_some(),
            _ => {
                let constant = constants[slot - COMMON.len()];
                at.number(Range::closed(constant.min, constant.max), faults)
                    .map(|value| parameters.constants.insert(key.to_string(), value))
                    .is_some()
            }
        };
    }
    sound.then_some(parameters)
}
