//! A JSON body: the right media type, not too long, not too slow.

use axum::body::Body;
use axum::http::{HeaderMap, header};
use bytes::Bytes;
use http_body_util::{BodyExt, LengthLimitError, Limited};

use super::AppState;
use super::problem::Problem;

/// The whole body.
pub(super) async fn read_json(
    state: &AppState,
    headers: &HeaderMap,
    body: Body,
) -> Result<Bytes, Problem> {
    let (limit, timeout) = (state.rules.limits.body_bytes, state.body_timeout);
    if !is_json(headers) {
        let found = headers.get(header::CONTENT_TYPE);
        return Err(Problem::UnsupportedMediaType(found.map(|value| {
            String::from_utf8_lossy(value.as_bytes()).into_owned()
        })));
    }
    if let Some(coding) = coding(headers) {
        return Err(Problem::UnsupportedCoding(coding));
    }
    if announced_length(headers).is_some_and(|length| length > limit as u64) {
        return Err(Problem::BodyTooLarge(limit));
    }
    match tokio::time::timeout(timeout, Limited::new(body, limit).collect()).await {
        Ok(Ok(collected)) => Ok(collected.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(Problem::BodyTooLarge(limit)),
        Ok(Err(error)) => {
            tracing::debug!(%error, "a body broke off");
            Err(Problem::BodyIncomplete)
        }
        Err(_) => Err(Problem::BodyTooSlow(timeout)),
    }
}

/// How the body is coded, when it is.
fn coding(headers: &HeaderMap) -> Option<String> {
    let coding = headers
        .get_all(header::CONTENT_ENCODING)
        .iter()
        .map(|value| String::from_utf8_lossy(value.as_bytes()).trim().to_owned());
    coding
        .filter(|coding| !coding.is_empty() && !coding.eq_ignore_ascii_case("identity"))
        .reduce(|all, one| format!("{all}, {one}"))
}

fn announced_length(headers: &HeaderMap) -> Option<u64> {
    headers
        .get(header::CONTENT_LENGTH)?
        .to_str()
        .ok()?
        .parse()
        .ok()
}

/// `application/json` or `application/*+json`, in UTF-8 or no charset named.
fn is_json(headers: &HeaderMap) -> bool {
    let Some(value) = headers
        .get(header::CONTENT_TYPE)
        .and_then(|value| value.to_str().ok())
    else {
        return false;
    };
    let mut parts = value.split(';').map(str::trim);
    let essence = parts.next().unwrap_or_default().to_ascii_lowercase();
    let subtype = essence.strip_prefix("application/").unwrap_or_default();
    let utf8 = parts
        .filter_map(|parameter| parameter.split_once('='))
        .filter(|(name, _)| name.eq_ignore_ascii_case("charset"))
        .all(|(_, charset)| charset.trim_matches('"').eq_ignore_ascii_case("utf-8"));
    utf8 && (subtype == "json" || subtype.ends_with("+json"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn tells_a_coded_body() {
        for (values, expected) in [
            (&["gzip"][..], Some("gzip")),
            (&["Identity"], None),
            (&[""], None),
            (&[], None),
            (&["br", "identity", "zstd"], Some("br, zstd")),
        ] {
            let mut headers = HeaderMap::new();
            for value in values {
                headers.append(header::CONTENT_ENCODING, HeaderValue::from_static(value));
            }
            assert_eq!(coding(&headers).as_deref(), expected, "{values:?}");
        }
    }

    #[test]
    fn tells_json_from_the_rest() {
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
