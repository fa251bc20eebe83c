//! The record of a plan: everything in a status document.

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
    /// Seed of the run.
    pub seed: u64,
    /// Iterations asked for.
    pub iterations: u64,
    /// population * iterations * waypoints of its planner.
    pub work: u64,
    /// The accepted document, defaults filled in.
    pub scenario: String,
    /// Time of acceptance, milliseconds since 1970.
    pub created_ms: i64,
    /// Owner of the plan; `None` where no keys are in use.
    pub owner: Option<Owner>,
    /// Active plans that its owner may have, including this one; `None` for any number.
    pub quota: Option<u64>,
    /// Webhook that is notified when it ends.
    pub webhook: Option<String>,
    /// Distinguishes a repeated request from a new one.
    pub idempotency: Option<Idempotency>,
    /// Identifies the dataset that it is planned over.
    pub dataset: Option<String>,
}

/// The name of the owner of the key that a plan was submitted with.
pub type Owner = String;

/// What identifies a request as a repetition of an earlier one of the same owner.
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
    /// Owner of the plan; `None` where no keys are in use.
    #[serde(default)]
    pub owner: Option<Owner>,
    /// The scenario's name.
    pub name: Option<String>,
    /// Its present status.
    pub status: Status,
    /// Why the search ended, once it has.
    pub stop_reason: Option<String>,
    /// Whether the best route so far meets every constraint; `None` before the first.
    pub feasible: Option<bool>,
    /// Cost of the best feasible route so far.
    pub best_cost: Option<f64>,
    /// Fraction of the iterations done, 0 to 1; 1 once there is a result.
    pub progress: f64,
    /// Iterations done.
    pub iteration: u64,
    /// Iterations asked for.
    pub iterations: u64,
    /// Routes evaluated so far.
    pub evaluations: u64,
    /// 1 for the next to run; `None` when not queued.
    pub queue_position: Option<u64>,
    /// The algorithm's name.
    pub algorithm: String,
    /// Seed of the run.
    pub seed: u64,
    /// When it was accepted.
    pub created_ms: i64,
    /// When the (last) run began.
    pub started_ms: Option<i64>,
    /// When it ended.
    pub finished_ms: Option<i64>,
    /// When its record will be removed; `None` for never.
    pub expires_ms: Option<i64>,
    /// Whether its end has been requested.
    pub cancel_requested: bool,
    /// The failure, when failed.
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
