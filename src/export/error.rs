//! Why a plan is not written in a format.

use thiserror::Error;

use super::ALL;
use crate::scenario::json::Unread;

/// Why a plan is not written in a format.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ExportError {
    /// The format needs degrees, but the plan is in metres.
    #[error(
        "{format} needs degrees, and the plan is in a local frame: plan in the frame wgs84, or take {}",
        local_formats()
    )]
    NoGeodeticFrame {
        /// Name of the format.
        format: &'static str,
    },
    /// The format is for flying, but the route violates constraints.
    #[error(
        "the plan has no feasible route and {format} is for flying: allow_infeasible=true writes it all the same"
    )]
    Infeasible {
        /// Name of the format.
        format: &'static str,
    },
    /// No mission is possible with the given options.
    #[error("{0}")]
    Unflyable(String),
    /// An option is unknown, not supported by the format, or has an invalid value.
    #[error(transparent)]
    Option(#[from] OptionFault),
    /// The accepted document cannot be read.
    #[error(transparent)]
    Unread(#[from] Unread),
    /// The result was not written by this program, or does not belong to the request.
    #[error("{0}")]
    Damaged(String),
}

/// The formats of a plan without degrees.
fn local_formats() -> String {
    let local = ALL.iter().filter(|format| !format.geodetic);
    let names: Vec<_> = local.map(|format| format.name).collect();
    let (last, others) = names.split_last().expect("json is one");
    format!("{} or {last}", others.join(", "))
}

/// What is wrong with an option.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{detail}")]
pub struct OptionFault {
    /// Name of the option.
    pub name: String,
    /// The value found and the values allowed.
    pub detail: String,
}
