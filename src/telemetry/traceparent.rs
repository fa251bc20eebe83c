//! The trace that a caller's request belongs to: the header `traceparent` of W3C Trace Context.

use std::fmt;
use std::str::FromStr;

/// Name of the header.
pub const HEADER: &str = "traceparent";

/// Content of the header. Neither id is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TraceParent {
    /// Id of the whole trace.
    pub trace_id: u128,
    /// Id of the span that the request was sent in.
    pub span_id: u64,
    /// Whether the caller records the trace.
    pub sampled: bool,
}

impl TraceParent {
    /// The trace id as logs write it: 32 hexadecimal digits.
    #[must_use]
    pub fn trace_id_text(&self) -> String {
        format!("{:032x}", self.trace_id)
    }
}

/// The header has neither the form of version 00 nor that of a later one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not a traceparent")]
pub struct NotATraceParent;

impl FromStr for TraceParent {
    type Err = NotATraceParent;

    fn from_str(text: &str) -> Result<Self, NotATraceParent> {
        let parts: Vec<&str> = text.split('-').collect();
        let [version, trace_id, span_id, flags, later @ ..] = &*parts else {
            return Err(NotATraceParent);
        };
        let version = hex(version, 2)?;
        // Later versions may add parts; version 00 has no more.
        if version == 0xff || (version == 0 && !later.is_empty()) {
            return Err(NotATraceParent);
        }
        let (trace_id, span_id) = (hex(trace_id, 32)?, hex(span_id, 16)?);
        let span_id = u64::try_from(span_id).expect("16 digits");
        let sampled = hex(flags, 2)? & 1 == 1;
        if trace_id == 0 || span_id == 0 {
            return Err(NotATraceParent);
        }
        Ok(Self {
            trace_id,
            span_id,
            sampled,
        })
    }
}

impl fmt::Display for TraceParent {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (trace_id, span_id) = (self.trace_id, self.span_id);
        write!(
            f,
            "00-{trace_id:032x}-{span_id:016x}-{:02x}",
            u8::from(self.sampled)
        )
    }
}

/// Exactly `digits` lower-case digits.
fn hex(text: &str, digits: usize) -> Result<u128, NotATraceParent> {
    let is_digit = |byte: u8| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    if text.len() != digits || !text.bytes().all(is_digit) {
        return Err(NotATraceParent);
    }
    u128::from_str_radix(text, 16).map_err(|_| NotATraceParent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_traceparent_is_parsed_as_the_recommendation_allows() {
        const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
        const SPAN: &str = "00f067aa0ba902b7";
        for (text, expected) in [
            (format!("00-{TRACE}-{SPAN}-01"), Some(true)),
            (format!("00-{TRACE}-{SPAN}-00"), Some(false)),
            (format!("00-{TRACE}-{SPAN}-03"), Some(true)),
            (format!("cc-{TRACE}-{SPAN}-01-what-comes"), Some(true)),
            (format!("00-{TRACE}-{SPAN}-01-x"), None),
            (format!("ff-{TRACE}-{SPAN}-01"), None),
            (format!("00-{}-{SPAN}-01", TRACE.to_uppercase()), None),
            (format!("00-{}-{SPAN}-01", "0".repeat(32)), None),
            (format!("00-{TRACE}-{}-01", "0".repeat(16)), None),
            (format!("00-{TRACE}-{SPAN}"), None),
            (format!("00-{TRACE}-{SPAN}-1"), None),
            (format!("00-+{}-{SPAN}-01", &TRACE[1..]), None),
            (String::new(), None),
        ] {
            let read = text.parse::<TraceParent>().ok();
            assert_eq!(read.map(|parent| parent.sampled), expected, "{text}");
            if let Some(parent) = read {
                assert_eq!(parent.trace_id_text(), TRACE);
            }
        }
    }

    #[test]
    fn a_traceparent_is_written_as_it_was_read() {
        let text = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
        let parent: TraceParent = text.parse().expect("right");
        assert_eq!(parent.to_string(), text);
    }
}
