//! The wire document: read into a [`Scenario`] with every fault at once, and written back with
//! its defaults filled in.

use super::Scenario;
use super::limits::Limits;

/// What is wrong with one place of a scenario document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// JSON pointer (RFC 6901) of the place.
    pub pointer: String,
    /// Stable code, such as `out-of-range`.
    pub code: &'static str,
    /// The offending value and what is allowed.
    pub detail: String,
}

/// Why a document is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// It is not JSON.
    Syntax {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// Where the reader was, as far as it got.
        pointer: String,
        /// What the reader met.
        detail: String,
    },
    /// It is JSON, but no scenario; every fault, in document order.
    Invalid(Vec<Fault>),
}

/// A search algorithm that a document may name.
#[derive(Debug, Clone)]
pub struct AlgorithmRule {
    /// As in `planner.algorithm`.
    pub name: &'static str,
    /// What `planner.parameters` may set.
    pub parameters: Vec<ParameterRule>,
}

/// One constant of an algorithm.
#[derive(Debug, Clone, Copy)]
pub struct ParameterRule {
    /// As in `planner.parameters`.
    pub name: &'static str,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
}

/// What a document is held to.
#[derive(Debug, Clone)]
pub struct Rules {
    /// The operator's limits.
    pub limits: Limits,
    /// The table of algorithms; the first one is the default.
    pub algorithms: Vec<AlgorithmRule>,
}

/// Read a scenario document; `drawn_seed` is used where it names none.
///
/// # Errors
/// [`Refusal::Syntax`] when `text` is not JSON, else [`Refusal::Invalid`] with every fault.
pub fn read(text: &[u8], rules: &Rules, drawn_seed: u64) -> Result<Scenario, Refusal> {
    let _ = (text, rules, drawn_seed);
    unreachable!()
}

/// Write the accepted document, defaults filled in. Reading it again gives the same scenario.
#[must_use]
pub fn write(scenario: &Scenario) -> String {
    let _ = scenario;
    unreachable!()
}
