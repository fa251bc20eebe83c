//! What is said of the servers' refusals.

use std::error::Error;
use std::fmt::Display;

use crate::store::{StoreError, Trouble};

/// A step that failed, with what the server or the client says of it.
pub(super) fn failed(what: &str, error: &(impl Error + 'static)) -> StoreError {
    let mut detail = format!("{what}: {error}");
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_said = cause.to_string();
        if !detail.contains(&cause_said) {
            detail = format!("{detail}: {cause_said}");
        }
        source = cause.source();
    }
    described(detail)
}

/// As [`failed`], of an error that has no source.
pub(super) fn refused(what: &str, error: &(impl Display + ?Sized)) -> StoreError {
    described(format!("{what}: {error}"))
}

fn described(detail: String) -> StoreError {
    let full = [
        "insufficient",
        "no space",
        "maximum bytes",
        "limit exceeded",
    ]
    .iter()
    .any(|sign| detail.contains(sign));
    StoreError::Unavailable {
        trouble: if full { Trouble::Full } else { Trouble::Other },
        detail,
    }
}
