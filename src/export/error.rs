//! Why a plan is not written in a format.

use thiserror::Error;

/// Why a plan is not written in a format.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ExportError {
    /// The format needs degrees, the plan has metres.
    #[error(
        "{format} needs degrees, and the plan is in a local frame: plan in the frame wgs84, or take json, csv or svg"
    )]
    NoGeodeticFrame {
        /// Its name.
        format: &'static str,
    },
    /// The format is for flying, the route breaks constraints.
    #[error(
        "the plan has no feasible route and {format} is for flying: allow_infeasible=true writes it all the same"
    )]
    Infeasible {
        /// Its name.
        format: &'static str,
    },
    /// No mission can be made as the options ask.
    #[error("{0}")]
    Unflyable(String),
    /// An option is unknown, unknown to the format, or has a value that it cannot have.
    #[error(transparent)]
    Option(#[from] OptionFault),
    /// The dataset that it was planned over is not there any more.
    #[error("the ground that it was planned over is not there: {0}")]
    NoGround(String),
    /// It may be there, but cannot be reached now.
    #[error("{0}")]
    Unreachable(String),
    /// The documents are none that this program wrote, or do not belong together.
    #[error("{0}")]
    Damaged(String),
}

/// What is wrong with an option.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{detail}")]
pub struct OptionFault {
    /// Its name.
    pub name: String,
    /// What was met and what is allowed.
    pub detail: String,
}
