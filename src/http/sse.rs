//! Events on the wire: frames of `text/event-stream`, or lines of JSON.

use std::fmt::Write as _;

use serde::Serialize;

use super::status::{StatusDocument, location};
use crate::job::{Event, NumberedEvent, PlanId, Status};

/// The format of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wire {
    /// `text/event-stream`.
    Sse,
    /// `application/x-ndjson`.
    Lines,
}

impl Wire {
    /// The media types, the default first.
    pub(super) const MEDIA_TYPES: [&str; 2] = ["text/event-stream", "application/x-ndjson"];

    pub(super) fn of(media_type: &str) -> Self {
        if media_type == Self::MEDIA_TYPES[1] {
            Self::Lines
        } else {
            Self::Sse
        }
    }

    pub(super) fn media_type(self) -> &'static str {
        match self {
            Self::Sse => Self::MEDIA_TYPES[0],
            Self::Lines => Self::MEDIA_TYPES[1],
        }
    }

    /// Start of a stream: how long to wait before reconnecting, milliseconds.
    pub(super) fn prologue(self) -> &'static str {
        match self {
            Self::Sse => "retry: 2000\n\n",
            Self::Lines => "",
        }
    }

    /// Keeps the connection alive without an event; readers of JSON lines skip empty ones.
    pub(super) fn silence(self) -> &'static str {
        match self {
            Self::Sse => ":\n\n",
            Self::Lines => "\n",
        }
    }

    /// Says that the server is stopping, not that the plan has ended.
    pub(super) fn stopping(self) -> &'static str {
        match self {
            Self::Sse => ": the service is shutting down\n\n",
            Self::Lines => "",
        }
    }

    /// Add `outgoing` to `text`.
    pub(super) fn write(self, outgoing: Outgoing, text: &mut String) {
        let Outgoing { id, event, data } = outgoing;
        match self {
            Self::Sse => write!(text, "id: {id}\nevent: {event}\ndata: {data}\n\n"),
            Self::Lines => writeln!(text, r#"{{"id":{id},"event":"{event}","data":{data}}}"#),
        }
        .expect("writing to a string cannot fail");
    }
}

/// An event as callers see it.
pub(super) struct Outgoing {
    id: u64,
    event: &'static str,
    /// One line of JSON.
    data: String,
}

impl Outgoing {
    /// `has_result` is used only for the end.
    pub(super) fn new(plan: PlanId, event: NumberedEvent, has_result: bool) -> Self {
        let NumberedEvent { id, event } = event;
        let (event, data) = match event {
            Event::Status(plan) => ("status", json(StatusDocument::from(*plan))),
            Event::Convergence(point) => ("convergence", json(point)),
            Event::Incumbent(incumbent) => ("incumbent", json(incumbent)),
            Event::End(status) => ("end", json(End::new(plan, status, has_result))),
        };
        Self { id, event, data }
    }

    /// The events `from` to `to` are no longer kept. Its id is that of the last of them.
    pub(super) fn gap(from: u64, to: u64) -> Self {
        Self {
            id: to,
            event: "gap",
            data: json(Gap { from, to }),
        }
    }
}

/// The data of a `gap` event.
#[derive(Serialize)]
struct Gap {
    from: u64,
    to: u64,
}

/// The data of an `end` event.
#[derive(Serialize)]
struct End {
    status: &'static str,
    /// Where the result is, if there is one.
    result: Option<String>,
}

impl End {
    fn new(plan: PlanId, status: Status, has_result: bool) -> Self {
        Self {
            status: status.name(),
            result: has_result.then(|| format!("{}/result", location(plan))),
        }
    }
}

fn json(data: impl Serialize) -> String {
    serde_json::to_string(&data).expect("every map key is a string")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without these keep-alives a lost reader is never noticed, and proxies cut the remaining ones.
    #[test]
    fn a_keep_alive_is_written_and_carries_no_event() {
        for wire in [Wire::Sse, Wire::Lines] {
            let mut lines = wire.silence().lines().peekable();
            assert!(lines.peek().is_some(), "{wire:?}");
            assert!(lines.all(|line| line.is_empty() || line == ":"), "{wire:?}");
        }
    }
}
