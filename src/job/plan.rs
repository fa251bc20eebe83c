//! The record of a plan: everything a status document tells.

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::{Failure, Status};

/// Identifies a plan; version 7, so ids sort by the time of acceptance.
pub type PlanId = Uuid;

/// What a caller hands in, already validated.
#[derive(Debug, Clone)]
pub struct Submission {
    /// A new id.
    pub id: PlanId,
    /// The scenario's name.
    pub name: Option<String>,
    /// The algorithm's name.
    pub algorithm: String,
    /// Of the run.
    pub seed: u64,
    /// Iterations asked for.
    pub iterations: u64,
    /// population * iterations * waypoints of its planner.
    pub work: u64,
    /// The accepted document, defaults filled in.
    pub scenario: String,
    /// Now, milliseconds since 1970.
    pub created_ms: i64,
    /// Whose plan it is; `None` where nobody has a key.
    pub owner: Option<Owner>,
    /// Active plans that its owner may have, this one included; `None` for any number.
    pub quota: Option<u64>,
    /// Where its end is to be told.
    pub webhook: Option<String>,
    /// Tells a repeated request from a new one.
    pub idempotency: Option<Idempotency>,
    /// What stands for the dataset that it is planned over.
    pub dataset: Option<String>,
}

/// The name of the key that a plan was handed in with.
pub type Owner = String;

/// What makes a request the same as an earlier one of the same owner.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Idempotency {
    /// Chosen by the caller.
    pub key: String,
    /// SHA-256 of the request's body, hexadecimal.
    pub body_sha256: String,
}

/// The record of a plan. Times are milliseconds since 1970.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// See [`PlanId`].
    pub id: PlanId,
    /// Whose plan it is; `None` where nobody has a key.
    #[serde(default)]
    pub owner: Option<Owner>,
    /// The scenario's name.
    pub name: Option<String>,
    /// Where it stands.
    pub status: Status,
    /// Why the search ended, once it has.
    pub stop_reason: Option<String>,
    /// Whether the best route so far meets every constraint; `None` before the first.
    pub feasible: Option<bool>,
    /// Of the best feasible route so far.
    pub best_cost: Option<f64>,
    /// Share of the iterations done, 0 to 1; 1 at a result.
    pub progress: f64,
    /// Iterations done.
    pub iteration: u64,
    /// Iterations asked for.
    pub iterations: u64,
    /// Routes priced so far.
    pub evaluations: u64,
    /// 1 for the next to run; `None` when not queued.
    pub queue_position: Option<u64>,
    /// The algorithm's name.
    pub algorithm: String,
    /// Of the run.
    pub seed: u64,
    /// When it was accepted.
    pub created_ms: i64,
    /// When the (last) run began.
    pub started_ms: Option<i64>,
    /// When it ended.
    pub finished_ms: Option<i64>,
    /// When its record will be removed; `None` is never.
    pub expires_ms: Option<i64>,
    /// Whether somebody asked for its end.
    pub cancel_requested: bool,
    /// What broke, when failed.
    pub error: Option<Failure>,
    /// Grows with every change of this record.
    pub revision: u64,
}

#[cfg(test)]
impl Submission {
    /// The same each time.
    pub(crate) fn example() -> Self {
        Self {
            id: Uuid::nil(),
            name: None,
            algorithm: "tms-sba".to_owned(),
            seed: 7,
            iterations: 200,
            work: 400_000,
            scenario: "{}".to_owned(),
            created_ms: 1_000,
            owner: None,
            quota: None,
            webhook: None,
            idempotency: None,
            dataset: None,
        }
    }
}
