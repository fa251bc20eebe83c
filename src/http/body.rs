//! A request body: the right media type, plain or gzip, limits on both lengths and on slowness, and its share of what
//! all bodies may take.

use std::error::Error;
use std::io::{self, ErrorKind, Read as _};
use std::iter;
use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderMap, header};
use bytes::Bytes;
use flate2::read::MultiGzDecoder;
use http_body_util::{BodyExt as _, LengthLimitError, Limited};

use super::bodies::{Bodies, Growing};
use super::caller::Caller;
use super::problem::Problem;
use super::shown::Shown;
use super::{AppState, off_thread};
use crate::import::Syntax;

/// The whole body, which must be JSON.
pub(super) async fn read_json(
    state: &AppState,
    caller: &Caller,
    headers: &HeaderMap,
    body: Body,
) -> Result<Bytes, Problem> {
    Announced::json(state, headers)?.read(caller, body).await
}

/// The whole body, and the syntax that it is declared to have.
pub(super) async fn read_a_map(
    state: &AppState,
    caller: &Caller,
    headers: &HeaderMap,
    body: Body,
) -> Result<(Bytes, Syntax), Problem> {
    let syntax = match essence(headers).as_deref() {
        Some("application/xml" | "text/xml" | "application/vnd.google-earth.kml+xml") => {
            Syntax::Xml
        }
        Some("text/plain") => Syntax::Lines,
        _ if is_json(headers) => Syntax::Json,
        _ => {
            let allowed = "application/json, application/geo+json, application/vnd.google-earth.kml+xml, application/xml, text/xml or text/plain";
            return Err(unsupported(headers, allowed));
        }
    };
    let announced = Announced::of(state, headers)?;
    Ok((announced.read(caller, body).await?, syntax))
}

fn unsupported(headers: &HeaderMap, allowed: &'static str) -> Problem {
    let found = headers.get(header::CONTENT_TYPE);
    let found = found.map(|value| Shown::of(&String::from_utf8_lossy(value.as_bytes())));
    Problem::UnsupportedMediaType { found, allowed }
}

/// A body as announced by its headers, and the limits it will be held to.
pub(super) struct Announced {
    coding: Coding,
    limit: usize,
    timeout: Duration,
    bodies: Bodies,
}

impl Announced {
    /// For a request whose body must be JSON.
    pub(super) fn json(state: &AppState, headers: &HeaderMap) -> Result<Self, Problem> {
        if !is_json(headers) {
            return Err(unsupported(headers, "application/json"));
        }
        Self::of(state, headers)
    }

    fn of(state: &AppState, headers: &HeaderMap) -> Result<Self, Problem> {
        let limit = state.rules.limits.body_bytes;
        let coding = Coding::of(headers)?;
        if announced_length(headers).is_some_and(|length| length > limit as u64) {
            return Err(Problem::BodyTooLarge(limit));
        }
        Ok(Self {
            coding,
            limit,
            timeout: state.body_timeout,
            bodies: state.bodies.clone(),
        })
    }

    /// The whole body.
    pub(super) async fn read(&self, caller: &Caller, body: Body) -> Result<Bytes, Problem> {
        let (limit, timeout) = (self.limit, self.timeout);
        let sent = receive(body, limit, self.bodies.begin(limit));
        let sent = tokio::time::timeout(timeout, sent).await;
        let sent = sent.map_err(|_| Problem::BodyTooSlow(timeout))??;
        match self.coding {
            Coding::Plain => Ok(sent),
            Coding::Gzip => {
                let plain = self.bodies.begin(limit);
                off_thread::run(caller, move || unpack(&sent, limit, plain)).await?
            }
        }
    }
}

/// A body as it was sent.
async fn receive(body: Body, limit: usize, mut whole: Growing) -> Result<Bytes, Problem> {
    let mut body = Limited::new(body, limit);
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|error| {
            if error.is::<LengthLimitError>() {
                Problem::BodyTooLarge(limit)
            } else {
                broken_off(&*error)
            }
        })?;
        if let Ok(piece) = frame.into_data() {
            whole.add(&piece)?;
        }
    }
    Ok(whole.whole())
}

/// Why a body did not arrive whole.
pub(super) fn broken_off(error: &(dyn Error + 'static)) -> Problem {
    tracing::debug!(%error, "a body broke off");
    // Malformed chunks are reported as invalid input or data, a connection that ends early as an unexpected end.
    let bad_input = |cause: &(dyn Error + 'static)| {
        let cause = cause.downcast_ref::<io::Error>().map(io::Error::kind);
        matches!(
            cause,
            Some(ErrorKind::InvalidInput | ErrorKind::InvalidData)
        )
    };
    if iter::successors(Some(error), |error| (**error).source()).any(bad_input) {
        Problem::BodyUnreadable
    } else {
        Problem::BodyIncomplete
    }
}

/// Bytes that are unpacked at once.
const PIECE: usize = 64 * 1024;

/// Unpacks a gzip body; gives up as soon as that is longer than a body may be.
fn unpack(packed: &[u8], limit: usize, mut plain: Growing) -> Result<Bytes, Problem> {
    let mut decoder = MultiGzDecoder::new(packed);
    let mut piece = vec![0; PIECE];
    loop {
        let length = decoder.read(&mut piece);
        let length = length.map_err(|error| Problem::BodyNotGzip(error.to_string()))?;
        if length == 0 {
            return Ok(plain.whole());
        }
        if plain.len() + length > limit {
            return Err(Problem::BodyTooLarge(limit));
        }
        plain.add(&piece[..length])?;
    }
}

/// A body's content coding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    Plain,
    Gzip,
}

impl Coding {
    pub(super) fn of(headers: &HeaderMap) -> Result<Self, Problem> {
        check_transfer(headers)?;
        let codings: Vec<String> = headers
            .get_all(header::CONTENT_ENCODING)
            .iter()
            .map(|value| String::from_utf8_lossy(value.as_bytes()).trim().to_owned())
            .filter(|coding| !coding.is_empty() && !coding.eq_ignore_ascii_case("identity"))
            .collect();
        match codings.as_slice() {
            [] => Ok(Self::Plain),
            [only] if ["gzip", "x-gzip"].contains(&only.to_ascii_lowercase().as_str()) => {
                Ok(Self::Gzip)
            }
            _ => Err(Problem::UnsupportedCoding(Shown::of(&codings.join(", ")))),
        }
    }
}

/// Chunks are assembled below us; no other transfer coding is supported, RFC 9112 section 6.1.
fn check_transfer(headers: &HeaderMap) -> Result<(), Problem> {
    let values = headers.get_all(header::TRANSFER_ENCODING).iter();
    let codings: Vec<_> = values
        .map(|value| String::from_utf8_lossy(value.as_bytes()))
        .collect();
    let codings = codings.join(", ");
    if codings.is_empty() || codings.trim().eq_ignore_ascii_case("chunked") {
        return Ok(());
    }
    Err(Problem::UnsupportedTransferCoding(Shown::of(&codings)))
}

pub(super) fn announced_length(headers: &HeaderMap) -> Option<u64> {
    headers
        .get(header::CONTENT_LENGTH)?
        .to_str()
        .ok()?
        .parse()
        .ok()
}

/// `application/json` or `application/*+json`, in UTF-8 or without a charset.
fn is_json(headers: &HeaderMap) -> bool {
    essence(headers).is_some_and(|essence| {
        let subtype = essence.strip_prefix("application/").unwrap_or_default();
        subtype == "json" || subtype.ends_with("+json")
    })
}

/// The media type, lower case; `None` when there is none, or with a charset other than UTF-8.
fn essence(headers: &HeaderMap) -> Option<String> {
    let value = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    let mut parts = value.split(';').map(str::trim);
    let essence = parts.next().unwrap_or_default().to_ascii_lowercase();
    let utf8 = parts
        .filter_map(|parameter| parameter.split_once('='))
        .filter(|(name, _)| name.eq_ignore_ascii_case("charset"))
        .all(|(_, charset)| charset.trim_matches('"').eq_ignore_ascii_case("utf-8"));
    utf8.then_some(essence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn the_content_coding_of_a_body_is_recognised() {
        for (values, expected) in [
            (&["gzip"][..], Ok(Coding::Gzip)),
            (&["X-Gzip"], Ok(Coding::Gzip)),
            (&["Identity"], Ok(Coding::Plain)),
            (&[""], Ok(Coding::Plain)),
            (&[], Ok(Coding::Plain)),
            (&["br", "identity", "zstd"], Err("br, zstd")),
            (&["gzip", "gzip"], Err("gzip, gzip")),
        ] {
            let mut headers = HeaderMap::new();
            for value in values {
                headers.append(header::CONTENT_ENCODING, HeaderValue::from_static(value));
            }
            let coding = Coding::of(&headers).map_err(|problem| match problem {
                Problem::UnsupportedCoding(codings) => codings.to_string(),
                other => format!("{other:?}"),
            });
            assert_eq!(coding, expected.map_err(ToOwned::to_owned), "{values:?}");
        }
    }

    fn packed(plain: &[u8]) -> Vec<u8> {
        let mut packed = Vec::new();
        flate2::read::GzEncoder::new(plain, flate2::Compression::best())
            .read_to_end(&mut packed)
            .expect("reading from memory");
        packed
    }

    #[test]
    fn a_body_is_unpacked_up_to_the_limit() {
        let check = |packed: &[u8], expected: Result<&[u8], &str>| {
            let plain = Bodies::new(0, 1000).begin(1000);
            let unpacked = unpack(packed, 1000, plain).map_err(|problem| match problem {
                Problem::BodyTooLarge(1000) => "too large",
                Problem::BodyNotGzip(_) => "not gzip",
                _ => "another problem",
            });
            assert_eq!(unpacked.as_deref(), expected.as_deref());
        };
        check(&packed(b"{}"), Ok(b"{}"));
        check(&packed(&[b' '; 1000]), Ok(&[b' '; 1000]));
        check(&packed(&[b' '; 1001]), Err("too large"));
        check(&packed(&vec![0; 5_000_000]), Err("too large"));
        let members = [packed(b"{"), packed(b"}")].concat();
        check(&members, Ok(b"{}"));
        check(&packed(b"{}")[..10], Err("not gzip"));
        check(b"{}", Err("not gzip"));
        check(b"", Err("not gzip"));
    }

    #[test]
    fn json_media_types_are_recognised() {
        for (value, expected) in [
            ("application/json", true),
            ("Application/JSON; charset=UTF-8", true),
            ("application/json;charset=\"utf-8\"", true),
            ("application/vnd.scenario+json", true),
            ("application/json; charset=latin1", false),
            ("application/x-www-form-urlencoded", false),
            ("text/json", false),
            ("json", false),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(value));
            assert_eq!(is_json(&headers), expected, "{value}");
        }
        assert!(!is_json(&HeaderMap::new()));
    }
}
