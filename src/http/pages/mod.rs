//! Pages for people: the planning page, the API reference, the guides, and one page for each type of problem.
//!
//! All but the planning page are generated from documents of the project, and load nothing else: no script, no font,
//! one style sheet within the page, whose hash the page's policy names.

pub(super) mod front;
pub(super) mod guides;
mod markdown;
mod reference;
mod schema;

use std::sync::LazyLock;

use axum::extract::Path;
use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use super::answers::constant;
use super::params::NoParams;
use super::problem::Problem;

/// The API description of this service.
const OPENAPI_YAML: &str = include_str!("../../../openapi.yaml");

/// A section for each type of problem.
const PROBLEMS: &str = include_str!("../../../docs/PROBLEMS.md");

const STYLE: &str = include_str!("style.css");

/// The parsed description.
static DESCRIPTION: LazyLock<Value> = LazyLock::new(|| {
    serde_yaml_ng::from_str(OPENAPI_YAML).expect("the description is well-formed, as its tests say")
});

/// `GET /openapi.yaml`.
pub(super) async fn openapi_yaml(_: NoParams) -> Result<Response, Problem> {
    Ok(constant((
        [(header::CONTENT_TYPE, "application/yaml")],
        OPENAPI_YAML,
    )))
}

/// `GET /openapi.json`.
pub(super) async fn openapi_json(_: NoParams) -> Result<Response, Problem> {
    static JSON: LazyLock<String> = LazyLock::new(|| DESCRIPTION.to_string());
    Ok(constant((
        [(header::CONTENT_TYPE, "application/json")],
        JSON.as_str(),
    )))
}

/// `GET /docs`.
pub(super) async fn docs(_: NoParams) -> Result<Response, Problem> {
    static PAGE: LazyLock<String> = LazyLock::new(|| {
        let title = "Noctule: reference of the HTTP interface";
        page(title, &reference::body(&DESCRIPTION))
    });
    Ok(constant(html(PAGE.as_str())))
}

/// `GET /problems/{slug}`: the page that a problem's `type` links to.
pub(super) async fn problem(
    uri: Uri,
    slug: Option<Path<String>>,
    _: NoParams,
) -> Result<Response, Problem> {
    let section = slug.as_ref().and_then(|Path(slug)| section(slug));
    let Some(text) = section else {
        return Err(Problem::no_such_resource(&uri));
    };
    let body = format!(
        "<p><a href=\"/docs\">Reference</a></p>\n<main>{}</main>",
        // In the document the other sections are further down; here they are pages beside this one.
        markdown::html(&text.replace("](#", "]("))
    );
    let title = text.lines().next().unwrap_or_default();
    Ok(html(page(title.trim_start_matches("## "), &body)))
}

/// The section about the problem called `slug`, with its heading.
fn section(slug: &str) -> Option<&'static str> {
    let heading = format!("\n## {slug}\n");
    let start = PROBLEMS.find(&heading)? + 1;
    let text = &PROBLEMS[start..];
    let end = text[1..].find("\n## ").map_or(text.len(), |end| end + 1);
    Some(&text[..end])
}

/// A complete page; `title` is text, `body` is HTML.
fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n",
        escape(title)
    )
}

fn html(page: impl IntoResponse) -> Response {
    static POLICY: LazyLock<HeaderValue> = LazyLock::new(|| {
        let hash = BASE64.encode(Sha256::digest(STYLE));
        let policy = format!(
            "default-src 'none'; style-src 'sha256-{hash}'; base-uri 'none'; form-action 'none'; \
             frame-ancestors 'none'"
        );
        HeaderValue::from_str(&policy).expect("visible ASCII")
    });
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static("text/html; charset=utf-8"),
        ),
        (header::CONTENT_SECURITY_POLICY, POLICY.clone()),
    ];
    (headers, page).into_response()
}

/// `text` escaped for use in an element or an attribute.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_ends_where_the_next_begins() {
        let text = section("invalid-json").expect("there");
        assert!(text.starts_with("## invalid-json\n"), "{text}");
        assert_eq!(text.matches("\n## ").count(), 0, "{text}");
        assert!(text.trim_end().len() > 100, "{text}");
        assert_eq!(section("nothing"), None);
        assert_eq!(section(""), None);
    }

    #[test]
    fn text_does_not_become_markup() {
        assert_eq!(
            escape("<a href='x'>\"&\"</a>"),
            "&lt;a href=&#39;x&#39;&gt;&quot;&amp;&quot;&lt;/a&gt;"
        );
    }
}
