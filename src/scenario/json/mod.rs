//! The wire document: read into a [`Scenario`], reporting all faults at once, and written back with its defaults
//! filled in.
//!
//! Text becomes a tree (`tree`), the sections of the tree become the parts of a scenario (one file each), and
//! whatever is invalid becomes a [`Fault`] while reading continues. Null means absent only in `name`, `base`, `top`,
//! `time_limit_ms` and `warm_start`: elsewhere it is what a careless client writes for NaN. Deliberately absent: the
//! size limit of the body, which is checked before.

mod chart;
mod dataset;
mod document;
mod ends;
mod fault;
mod fields;
mod fitted;
mod parameters;
mod path;
mod planner;
mod point;
mod ranges;
mod sketch;
mod terrain;
mod threats;
mod tree;
mod unread;
mod value;
mod vehicle;
mod writer;

pub use fault::{CODES, Fault, MAX_LISTED, MORE_FAULTS, Refusal};
pub(crate) use fields::hint;
pub use parameters::{COMMON, CommonParameter, Takes};
pub use ranges::MOST_M;
pub use unread::Unread;

use std::sync::Arc;

use super::Scenario;
use super::limits::Limits;
use crate::terrain::{Datasets, NoDatasets};

/// A search algorithm that a document may name.
#[derive(Debug, Clone)]
pub struct AlgorithmRule {
    /// As used in `planner.algorithm`.
    pub name: &'static str,
    /// What `planner.parameters` may set, besides [`COMMON`].
    pub parameters: Vec<ParameterRule>,
}

/// One constant of an algorithm; its range includes both ends.
#[derive(Debug, Clone, Copy)]
pub struct ParameterRule {
    /// As used in `planner.parameters`.
    pub name: &'static str,
    /// Used when absent; within the range.
    pub default: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
}

/// The rules that a document is checked against.
#[derive(Debug, Clone)]
pub struct Rules {
    /// The operator's limits.
    pub limits: Limits,
    /// The table of algorithms; the first one is the default.
    pub algorithms: Vec<AlgorithmRule>,
    /// Where datasets are found.
    pub datasets: Arc<dyn Datasets>,
}

impl Rules {
    /// Rules without datasets.
    #[must_use]
    pub fn new(limits: Limits, algorithms: Vec<AlgorithmRule>) -> Self {
        Self {
            limits,
            algorithms,
            datasets: Arc::new(NoDatasets),
        }
    }

    /// The same rules with `datasets`.
    #[must_use]
    pub fn with_datasets(self, datasets: Arc<dyn Datasets>) -> Self {
        Self { datasets, ..self }
    }
}

/// Read a scenario document; `drawn_seed` (modulo 2^53) is used if it gives no seed.
///
/// # Errors
/// [`Refusal::Syntax`] when `text` is not JSON, else [`Refusal::Invalid`] with every fault.
pub fn read(text: &[u8], rules: &Rules, drawn_seed: u64) -> Result<Scenario, Refusal> {
    let tree = tree::parse(text)?;
    let mut faults = fault::Faults::default();
    let scenario = document::document(&tree, rules, drawn_seed, &mut faults);
    match (scenario, faults.finish(&tree)) {
        (Some(scenario), faults) if faults.is_empty() => Ok(scenario),
        (_, faults) => Err(Refusal::Invalid(faults)),
    }
}

/// Read a document that was accepted before. Limits do not apply: they are for new submissions, and lowering one must
/// not invalidate an accepted document.
///
/// # Errors
/// If a dataset is not available, or the document comes from another version of this program.
pub fn read_accepted(document: &str, rules: &Rules) -> Result<Scenario, Unread> {
    let rules = Rules {
        limits: Limits::NONE,
        ..rules.clone()
    };
    // The document has a seed, so none is drawn.
    Ok(read(document.as_bytes(), &rules, 0)?)
}

/// Write the accepted document, defaults filled in, as one line of JSON. Reading it again gives an equal scenario;
/// equal scenarios give the same bytes.
#[must_use]
pub fn write(scenario: &Scenario) -> String {
    writer::write(scenario)
}
