//! What is wrong with a document: faults, their codes, and the collector that readers add to.

use std::fmt::{self, Display};

use thiserror::Error;

use super::path::Path;
use super::tree::Node;
use super::value::quote;

/// Most faults listed in one refusal; one more fault then counts the rest.
pub const MAX_LISTED: usize = 100;

/// Code of the last entry of a list that is not complete.
pub const MORE_FAULTS: &str = "more-faults";

/// Every code that a [`Fault`] can have, with its meaning; `docs/PROBLEMS.md` has an example of each.
pub const CODES: &[(&str, &str)] = &[
    ("missing-field", "a required field is absent"),
    ("unknown-field", "the object has no such field"),
    ("duplicate-key", "the object names the same field twice"),
    (
        "wrong-type",
        "the value has another JSON type than the field takes",
    ),
    (
        "out-of-range",
        "the number lies outside what the field takes",
    ),
    (
        "not-an-integer",
        "the number has a fraction where a whole number is needed",
    ),
    ("too-long", "the text has too many characters"),
    (
        "wrong-length",
        "the array has another length than its neighbours imply",
    ),
    ("too-many", "a limit of this server is exceeded"),
    (
        "too-much-work",
        "population * iterations * waypoints exceeds the limit of this server",
    ),
    (
        "unknown-value",
        "the text is none of the values the field takes",
    ),
    (
        "not-applicable",
        "the field has no meaning beside the others",
    ),
    ("unknown-algorithm", "no algorithm has this name"),
    ("unknown-parameter", "the algorithm has no such parameter"),
    (
        "influence-below-radius",
        "the soft zone of a cylinder ends inside its radius",
    ),
    ("base-above-top", "a threat is not higher than its base"),
    (
        "degenerate-polygon",
        "the vertices enclose no area or repeat a point",
    ),
    (
        "self-crossing-polygon",
        "two edges of the polygon cross or touch",
    ),
    ("empty-area", "the area has no width or no height"),
    (
        "area-outside-terrain",
        "the terrain grid or the dataset does not cover the area",
    ),
    (
        "no-elevation",
        "the dataset has a hole in the area, or below the start or the target",
    ),
    ("unknown-dataset", "no dataset has this name"),
    (
        "replaced-dataset",
        "the content that was asked for is no longer kept",
    ),
    ("unreadable-dataset", "the dataset cannot be used here"),
    (
        "unreachable-datasets",
        "the service cannot reach its datasets now",
    ),
    (
        "area-too-wide",
        "the area in degrees is wider than a local plane fits the earth",
    ),
    ("near-pole", "the area in degrees comes too near to a pole"),
    (
        "too-far",
        "a place in degrees is too far from the area to be laid onto its plane",
    ),
    ("empty-altitude-band", "the altitude band is empty"),
    (
        "below-ground",
        "the start or the target is more than 0.1 m below ground",
    ),
    ("start-in-threat", "the start lies inside a threat"),
    ("target-in-threat", "the target lies inside a threat"),
    (
        "outside-area",
        "the start or the target lies outside the area",
    ),
    (
        "outside-terrain",
        "the start or the target lies outside the terrain grid or the dataset",
    ),
    ("target-is-start", "the target is the start"),
    (
        "target-above-start",
        "the target is straight above or below the start",
    ),
    (
        "unknown-plan",
        "the plan to start from is not there, has no route yet, or one in another frame or more than 500 km away",
    ),
    ("more-faults", "only the first faults are listed"),
];

/// What is wrong with one place of a scenario document.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}: {detail} [{code}]", if pointer.is_empty() { "document" } else { pointer })]
pub struct Fault {
    /// JSON pointer (RFC 6901) of the place; for a missing field, where it would be.
    pub pointer: String,
    /// Stable code from [`CODES`], such as `out-of-range`.
    pub code: &'static str,
    /// The offending value and what is allowed, as a lowercase fragment.
    pub detail: String,
}

impl Fault {
    /// The fault of `/planner/warm_start/plan_id`; `why` comes from the plan store.
    #[must_use]
    pub fn unknown_plan(id: &str, why: &str) -> Self {
        Self {
            pointer: "/planner/warm_start/plan_id".to_owned(),
            code: "unknown-plan",
            detail: format!("plan_id is {}, {why}", quote(id)),
        }
    }
}

/// Why a document is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Refusal {
    /// It is not JSON.
    #[error("line {line}, column {column}: {detail}")]
    Syntax {
        /// Starts at 1.
        line: usize,
        /// Starts at 1, counted in bytes.
        column: usize,
        /// JSON pointer that the parser had reached.
        pointer: String,
        /// What the parser found.
        detail: String,
    },
    /// It is JSON, but not a valid scenario; faults in document order, at most [`MAX_LISTED`] and one more that
    /// counts the rest.
    #[error("{}", Lines(.0))]
    Invalid(Vec<Fault>),
}

impl Refusal {
    /// The fault of a dataset that is missing or unusable, if there is one.
    pub(super) fn lost_ground(&self) -> Option<&Fault> {
        self.fault_of(&["unknown-dataset", "replaced-dataset", "unreadable-dataset"])
    }

    /// The fault of a dataset that is unreachable at present; a retry may succeed.
    #[must_use]
    pub fn unreachable_ground(&self) -> Option<&Fault> {
        self.fault_of(&["unreachable-datasets"])
    }

    fn fault_of(&self, codes: &[&str]) -> Option<&Fault> {
        match self {
            Self::Invalid(faults) => faults.iter().find(|fault| codes.contains(&fault.code)),
            Self::Syntax { .. } => None,
        }
    }
}

/// The faults, one per line.
struct Lines<'a>(&'a [Fault]);

impl Display for Lines<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (fault_idx, fault) in self.0.iter().enumerate() {
            let separator = if fault_idx == 0 { "" } else { "\n" };
            write!(out, "{separator}{fault}")?;
        }
        Ok(())
    }
}

/// Collects faults while reading continues. Keeps the first [`MAX_LISTED`] and counts the rest, so that a hostile
/// document causes neither high memory use nor a huge response.
#[derive(Debug, Default)]
pub(super) struct Faults {
    listed: Vec<Fault>,
    unlisted: usize,
}

impl Faults {
    /// Add a fault with one of the [`CODES`]; `detail` is called only if the fault will be listed.
    pub(super) fn add<D: Into<String>>(
        &mut self,
        path: &Path<'_>,
        code: &'static str,
        detail: impl FnOnce() -> D,
    ) {
        if self.listed.len() < MAX_LISTED {
            self.listed.push(Fault {
                pointer: path.to_string(),
                code,
                detail: detail().into(),
            });
        } else {
            self.unlisted += 1;
        }
    }

    /// The faults in document order; empty if there were none.
    pub(super) fn finish(mut self, document: &Node) -> Vec<Fault> {
        self.listed
            .sort_by_cached_key(|fault| rank(document, &fault.pointer));
        if self.unlisted > 0 {
            self.listed.push(Fault {
                pointer: String::new(),
                code: MORE_FAULTS,
                detail: format!(
                    "{} more faults are not listed, at most {MAX_LISTED} are",
                    self.unlisted
                ),
            });
        }
        self.listed
    }
}

/// Position of a pointer in the document, as an index at every level; missing fields sort last.
fn rank(document: &Node, pointer: &str) -> Vec<usize> {
    let mut node = Some(document);
    let mut ranks = Vec::new();
    for token in pointer.split('/').skip(1) {
        let position = match node {
            Some(Node::Object(entries)) => {
                let key = token.replace("~1", "/").replace("~0", "~");
                let position = entries.iter().position(|(known, _)| **known == *key);
                node = position.map(|position| &entries[position].1);
                position
            }
            Some(Node::Array(items)) => {
                let position = token.parse().ok();
                node = position.and_then(|position: usize| items.get(position));
                position
            }
            Some(Node::Numbers(_)) => {
                node = None;
                token.parse().ok()
            }
            _ => None,
        };
        ranks.push(position.unwrap_or(usize::MAX));
    }
    ranks
}
