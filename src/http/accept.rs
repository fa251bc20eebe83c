//! Which of several formats the `Accept` header asks for, RFC 9110 section 12.5.1.

use axum::http::{HeaderMap, header};

/// The media type out of `offers` that the caller likes best; `None` when the caller takes none of them.
pub(super) fn choose(headers: &HeaderMap, offers: &[&'static str]) -> Option<&'static str> {
    ranked(headers, offers).first().copied()
}

/// The media types out of `offers` that the caller takes, the best liked first, the earlier one between
/// equals. No `Accept` takes all.
pub(super) fn ranked(headers: &HeaderMap, offers: &[&'static str]) -> Vec<&'static str> {
    let ranges: Vec<Range> = headers
        .get_all(header::ACCEPT)
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .filter_map(Range::read)
        .collect();
    if ranges.is_empty() {
        return offers.to_vec();
    }
    let quality = |offer: &str| {
        ranges
            .iter()
            .filter(|range| range.covers(offer))
            .max_by_key(|range| range.precision())
            .map_or(0.0, |range| range.quality)
    };
    let mut taken = offers.to_vec();
    taken.retain(|offer| quality(offer) > 0.0);
    taken.sort_by(|a, b| quality(b).total_cmp(&quality(a)));
    taken
}

/// What the caller sent, for people.
pub(super) fn asked(headers: &HeaderMap) -> String {
    let values = headers.get_all(header::ACCEPT).iter();
    values
        .filter_map(|value| value.to_str().ok())
        .collect::<Vec<_>>()
        .join(", ")
}

/// One entry of an `Accept` header.
struct Range {
    kind: String,
    subtype: String,
    quality: f64,
}

impl Range {
    fn read(entry: &str) -> Option<Self> {
        let mut parts = entry.split(';').map(str::trim);
        let (kind, subtype) = parts.next()?.split_once('/')?;
        let quality = parts
            .filter_map(|parameter| parameter.split_once('='))
            .find(|(name, _)| name.eq_ignore_ascii_case("q"))
            .map_or(Ok(1.0), |(_, value)| value.parse());
        let quality = quality
            .ok()
            .filter(|quality| (0.0..=1.0).contains(quality))?;
        Some(Self {
            kind: kind.to_ascii_lowercase(),
            subtype: subtype.to_ascii_lowercase(),
            quality,
        })
    }

    fn covers(&self, offer: &str) -> bool {
        let (kind, subtype) = offer.split_once('/').expect("an offer is a media type");
        (self.kind == "*" || self.kind == kind) && (self.subtype == "*" || self.subtype == subtype)
    }

    /// The more exact range decides.
    fn precision(&self) -> usize {
        usize::from(self.kind != "*") + usize::from(self.subtype != "*")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn the_most_exact_range_decides_and_order_breaks_ties() {
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
            // What is no quality makes no entry.
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
}
