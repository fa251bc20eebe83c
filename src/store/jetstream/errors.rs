//! How errors from the servers are reported.

use std::error::Error;
use std::fmt::Display;

use async_nats::jetstream::message::StreamMessage;
use async_nats::jetstream::stream::{LastRawMessageError, LastRawMessageErrorKind};

use crate::store::{StoreError, Trouble};

/// An error for a step that failed, with the message of the server or client.
pub(super) fn failed(what: &str, error: &(impl Error + 'static)) -> StoreError {
    described(said(what, error))
}

/// As [`failed`], for a failure whose kind is known.
pub(super) fn failed_by(
    trouble: Trouble,
    what: &str,
    error: &(impl Error + 'static),
) -> StoreError {
    StoreError::Unavailable {
        trouble,
        detail: said(what, error),
    }
}

fn said(what: &str, error: &(impl Error + 'static)) -> String {
    let mut detail = format!("{what}: {error}");
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_said = cause.to_string();
        if !detail.contains(&cause_said) {
            detail = format!("{detail}: {cause_said}");
        }
        source = cause.source();
    }
    detail
}

/// As [`failed`], for an error that has no source.
pub(super) fn refused(what: &str, error: &(impl Display + ?Sized)) -> StoreError {
    described(format!("{what}: {error}"))
}

/// The message that was asked for, if there is one; `what` it belongs to, for an error.
pub(super) fn found(
    answer: Result<StreamMessage, LastRawMessageError>,
    what: impl FnOnce() -> String,
) -> Result<Option<StreamMessage>, StoreError> {
    match answer {
        Ok(message) => Ok(Some(message)),
        Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
        Err(error) => Err(failed(&what(), &error)),
    }
}

/// Whether it results from an election among the servers, or another short outage: a retry will succeed.
pub(super) fn passes(error: &StoreError) -> bool {
    let StoreError::Unavailable {
        trouble: Trouble::Other,
        detail,
    } = error
    else {
        return false;
    };
    // The last is what the client makes of "no responders" on a write.
    [
        "timed out",
        "temporarily unavailable",
        "no responders",
        "no stream found",
    ]
    .iter()
    .any(|sign| detail.contains(sign))
}

/// Whether the servers refused a write because they have no room for it: it has certainly not been written. (When a disk
/// is full before their limit is reached, a server that does not lead the stream may have written it.)
pub(super) fn lacks_room(error: &StoreError) -> bool {
    matches!(
        error,
        StoreError::Unavailable { trouble: Trouble::Full, detail } if !detail.contains("no space")
    )
}

/// Whether the servers allow the stream no further consumer.
pub(super) fn lacks_consumers(error: &StoreError) -> bool {
    matches!(error, StoreError::Unavailable { detail, .. } if detail.contains("maximum consumers"))
}

/// Whether a stream is no longer on the servers.
pub(super) fn is_vanished(error: &StoreError) -> bool {
    matches!(
        error,
        StoreError::Unavailable {
            trouble: Trouble::Vanished,
            ..
        }
    )
}

/// Whether a write was refused because what it builds on has been overwritten. The servers have two codes for it, of
/// which the client knows one.
pub(super) fn is_outrun(error: &(impl Error + 'static)) -> bool {
    let said = failed("", error).to_string();
    said.contains("wrong last sequence")
}

fn described(detail: String) -> StoreError {
    let full = [
        "insufficient",
        "no space",
        "maximum bytes",
        "limit exceeded",
        "limits exceeded",
    ]
    .iter()
    .any(|sign| detail.contains(sign));
    let trouble = if full {
        Trouble::Full
    } else if detail.contains("stream not found") {
        Trouble::Vanished
    } else {
        Trouble::Other
    };
    StoreError::Unavailable { trouble, detail }
}
