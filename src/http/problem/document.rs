//! Problem documents, RFC 9457.

use serde::Serialize;
use serde_json::{Value, json};

use super::{Problem, kind};
use crate::http::auth::{Scope, TooMany};
use crate::job::Failure;
use crate::scenario::json::Fault;

impl Problem {
    /// The problem document; `instance` is the request's id.
    pub(in crate::http) fn document(&self, instance: &str) -> String {
        let (status, slug, title) = self.kind();
        let document = Document {
            r#type: format!("/problems/{slug}"),
            title,
            status: status.as_u16(),
            detail: self.detail(),
            instance,
            more: self.more(),
        };
        serde_json::to_string(&document).expect("every map key is a string")
    }

    /// The members specific to this kind of problem.
    fn more(&self) -> Value {
        match self {
            Self::InvalidScenario(faults) => {
                json!({"errors": faults.iter().map(error).collect::<Vec<_>>()})
            }
            Self::InvalidJson {
                line,
                column,
                pointer,
                ..
            } => {
                json!({"line": line, "column": column, "pointer": pointer})
            }
            Self::TerrainInUse { plans, .. } => json!({"plans": plans}),
            Self::NoScenario { unused, .. } => json!({"unused": unused}),
            Self::InvalidParameter { name, .. } => json!({"parameter": name}),
            Self::NotAcceptable { available, .. } => json!({"available": available}),
            Self::Forbidden(_) | Self::TerrainOwned(_) => {
                json!({"scope": self.scope().map(Scope::name)})
            }
            Self::TooManyStreams(TooMany { limit, .. }) => json!({"limit": limit}),
            _ => json!({}),
        }
    }
}

/// A problem document, in the order in which people read it.
#[derive(Serialize)]
struct Document<'a> {
    r#type: String,
    title: &'static str,
    status: u16,
    detail: String,
    instance: &'a str,
    #[serde(flatten)]
    more: Value,
}

fn error(fault: &Fault) -> Value {
    json!({"pointer": fault.pointer, "code": fault.code, "detail": fault.detail})
}

/// Describes a failed plan in a status document: a problem without an instance.
#[derive(Debug, Serialize)]
pub(in crate::http) struct FailureDocument {
    r#type: String,
    title: &'static str,
    status: u16,
    detail: String,
}

impl From<Failure> for FailureDocument {
    fn from(failure: Failure) -> Self {
        let (status, title) = kind::of_failure(&failure.kind);
        Self {
            r#type: format!("/problems/{}", failure.kind),
            title,
            status: status.as_u16(),
            detail: failure.detail,
        }
    }
}
