//! Requests that hyper refuses before any handler sees them: its answer holds nothing but a status, and no setting adds
//! more.

use std::str;

use super::connection::HEAD_BYTES;
use crate::http::problem::Problem;
use crate::http::request_id;
use crate::telemetry::Instruments;

/// Longer answers are not hyper's refusals.
const MOST: usize = 200;

/// What to send in place of `bytes`, if they are such a refusal.
pub(super) fn explained(bytes: &[u8], instruments: &Instruments) -> Option<Vec<u8>> {
    if bytes.len() > MOST || !bytes.starts_with(b"HTTP/1.1 4") {
        return None;
    }
    let text = str::from_utf8(bytes).ok()?;
    // The service's own answers have more header lines than these and the date.
    let (status, rest) = text.split_once("\r\nconnection: close\r\ncontent-length: 0\r\n")?;
    if !rest.starts_with("date: ") || rest.matches("\r\n").count() != 2 {
        return None;
    }
    let problem = match status.strip_prefix("HTTP/1.1 ")?.get(..3)? {
        "400" => Problem::Malformed,
        "414" | "431" => Problem::HeadTooLarge(HEAD_BYTES),
        _ => return None,
    };
    let (head, body) = request_id::refuse(problem, instruments).into_parts();
    let (code, reason) = (head.status.as_str(), head.status.canonical_reason()?);
    let mut answer = format!("HTTP/1.1 {code} {reason}\r\nconnection: close\r\n").into_bytes();
    for (name, value) in &head.headers {
        for part in [name.as_str().as_bytes(), b": ", value.as_bytes(), b"\r\n"] {
            answer.extend_from_slice(part);
        }
    }
    // The rest ends the head.
    answer.extend_from_slice(rest.as_bytes());
    answer.extend_from_slice(body.as_bytes());
    Some(answer)
}
