//! What a caller accepts, and prefers: `Accept` and `Accept-Encoding`, RFC 9110 section 12.5.

use axum::http::{HeaderMap, HeaderName, header};

use super::header_list;
use super::shown::Shown;

/// The media type out of `offers` that the caller prefers; `None` when the caller accepts none of them.
pub(super) fn choose(headers: &HeaderMap, offers: &[&'static str]) -> Option<&'static str> {
    ranked(headers, offers).first().copied()
}

/// The media types out of `offers` that the caller accepts, the preferred first, and the earlier one between equals.
/// Without `Accept`, all are accepted.
pub(super) fn ranked(headers: &HeaderMap, offers: &[&'static str]) -> Vec<&'static str> {
    let mut ranges = liked(headers, header::ACCEPT);
    ranges.retain(|(range, _)| range.contains('/'));
    let mut taken = offers.to_vec();
    if ranges.is_empty() {
        return taken;
    }
    // The most specific range decides.
    let quality = |offer: &str| {
        let of_offer = ranges.iter().filter_map(|(range, quality)| {
            let exactness = exactness(range, offer)?;
            Some((exactness, *quality))
        });
        of_offer
            .max_by_key(|(exactness, _)| *exactness)
            .map_or(0.0, |(_, quality)| quality)
    };
    taken.retain(|offer| quality(offer) > 0.0);
    taken.sort_by(|a, b| quality(b).total_cmp(&quality(a)));
    taken
}

/// Whether the caller accepts answers in this coding. Without `Accept-Encoding`, none is accepted.
pub(super) fn takes(headers: &HeaderMap, coding: &str) -> bool {
    let codings = liked(headers, header::ACCEPT_ENCODING);
    let quality = |name: &str| {
        let found = codings.iter().find(|(listed, _)| listed == name);
        found.map(|(_, quality)| *quality)
    };
    quality(coding)
        .or_else(|| quality("*"))
        .is_some_and(|quality| quality > 0.0)
}

/// What the caller sent, for people.
pub(super) fn asked(headers: &HeaderMap) -> Shown {
    let values = headers.get_all(header::ACCEPT).iter();
    let values: Vec<_> = values.filter_map(|value| value.to_str().ok()).collect();
    Shown::of(&values.join(", "))
}

/// The entries of a header, in lower case, and the weight of each, 0 to 1.
fn liked(headers: &HeaderMap, name: HeaderName) -> Vec<(String, f64)> {
    header_list::entries(headers.get_all(name))
        .filter_map(weighed)
        .collect()
}

/// Parses `name;q=0.5`; `None` where `q` is not a number from 0 to 1.
fn weighed(entry: &str) -> Option<(String, f64)> {
    let mut parts = header_list::split(entry, ';');
    let name = parts.next()?.to_ascii_lowercase();
    let quality = parts
        .filter_map(|parameter| parameter.split_once('='))
        .find(|(name, _)| name.trim().eq_ignore_ascii_case("q"))
        .map_or(Ok(1.0), |(_, value)| value.trim().parse());
    let quality = quality.ok();
    let quality = quality.filter(|quality| (0.0..=1.0).contains(quality))?;
    Some((name, quality))
}

/// How specifically `range` names the media type `offer`; `None` when it does not.
fn exactness(range: &str, offer: &str) -> Option<usize> {
    let (kind, _) = offer.split_once('/')?;
    if range == offer {
        Some(2)
    } else if range.strip_suffix("/*") == Some(kind) {
        Some(1)
    } else {
        (range == "*/*").then_some(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn the_most_specific_range_decides_and_order_breaks_ties() {
        const OFFERS: [&str; 2] = ["text/event-stream", "application/x-ndjson"];
        for (accept, expected) in [
            ("*/*", Some("text/event-stream")),
            ("text/event-stream", Some("text/event-stream")),
            ("application/x-ndjson", Some("application/x-ndjson")),
            ("application/*", Some("application/x-ndjson")),
            (
                "text/event-stream;q=0.5, application/x-ndjson",
                Some("application/x-ndjson"),
            ),
            (
                "*/*;q=0.1, text/event-stream;q=0",
                Some("application/x-ndjson"),
            ),
            ("text/html", None),
            ("text/html, */*; Q = 0.1", Some("text/event-stream")),
            ("text/html;level=\"1, text/event-stream\"", None),
            // An entry with an invalid weight is ignored.
            (
                "text/event-stream;q=nan, application/x-ndjson;q=0.1",
                Some("application/x-ndjson"),
            ),
            ("application/x-ndjson;q=2", Some("text/event-stream")),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::ACCEPT, HeaderValue::from_static(accept));
            assert_eq!(choose(&headers, &OFFERS), expected, "{accept}");
        }
        assert_eq!(
            choose(&HeaderMap::new(), &OFFERS),
            Some("text/event-stream")
        );
    }

    #[test]
    fn a_coding_is_accepted_only_when_the_caller_offers_it() {
        for (offer, br, gz) in [
            ("gzip, deflate, br, zstd", true, true),
            ("gzip;q=0.5, br;q=0", false, true),
            ("BR;q=1.0", true, false),
            ("gzip;Q=0, br; q = 0", false, false),
            ("gzip;q=0, *", true, false),
            ("*;q=0, gzip", false, true),
            ("gzip;q=many", false, false),
            ("identity", false, false),
            ("", false, false),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::ACCEPT_ENCODING, HeaderValue::from_static(offer));
            assert_eq!(takes(&headers, "br"), br, "{offer}");
            assert_eq!(takes(&headers, "gzip"), gz, "{offer}");
        }
    }
}
