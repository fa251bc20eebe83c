//! `openapi.yaml`, and whether a response matches it.

use std::collections::HashMap;
use std::io::Read as _;
use std::sync::{Arc, LazyLock, Mutex};

use axum::http::{HeaderMap, Method, StatusCode};
use jsonschema::Validator;
use serde_json::{Value, json};

/// The description served by the service.
pub(crate) static DESCRIPTION: LazyLock<Value> = LazyLock::new(|| {
    serde_yaml_ng::from_str(include_str!("../../../openapi.yaml")).expect("well-formed YAML")
});

/// Follows `$ref`s within the description.
pub(crate) fn resolve(node: &'static Value) -> &'static Value {
    match node.get("$ref").and_then(Value::as_str) {
        Some(reference) => {
            let pointer = reference.strip_prefix('#').expect("references are local");
            resolve(
                DESCRIPTION
                    .pointer(pointer)
                    .unwrap_or_else(|| panic!("{reference} leads nowhere")),
            )
        }
        None => node,
    }
}

/// The described path that matches `path`.
pub(crate) fn template(path: &str) -> Option<&'static str> {
    let paths = DESCRIPTION["paths"].as_object().expect("paths");
    let matches = |template: &str| {
        let (mut parts, mut given) = (template.split('/'), path.split('/'));
        parts
            .by_ref()
            .zip(given.by_ref())
            .all(|(part, given)| part.starts_with('{') || part == given)
            && template.split('/').count() == path.split('/').count()
    };
    paths
        .keys()
        .map(String::as_str)
        .find(|template| matches(template))
}

/// Panics unless the description allows this response.
pub(crate) fn check(
    method: &Method,
    path: &str,
    status: StatusCode,
    headers: &HeaderMap,
    body: &[u8],
) {
    let body = &plain(headers, body);
    let place = format!("{method} {path} -> {status}");
    assert!(
        headers.contains_key("x-request-id"),
        "{place} has no x-request-id"
    );
    let name = if method == Method::HEAD {
        "get".to_owned()
    } else {
        method.as_str().to_lowercase()
    };
    let operation = template(path).and_then(|template| DESCRIPTION["paths"][template].get(&name));
    let Some(operation) = operation else {
        // 400 is for a key in the URL.
        let known = [400, 404, 405].contains(&status.as_u16());
        assert!(known, "{place} is not described");
        if method != Method::HEAD {
            let problem = json!({"$ref": "#/components/schemas/Problem"});
            check_schema(&problem, &parse(body, &place), &place);
        }
        return;
    };
    let response = operation["responses"].get(status.as_str());
    let response = resolve(response.unwrap_or_else(|| panic!("{place} is not described")));
    check_headers(response, headers, &place);
    match response.get("content").and_then(Value::as_object) {
        None => assert!(body.is_empty(), "{place} has a body that is not described"),
        Some(_) if method == Method::HEAD => assert!(body.is_empty(), "{place} has a body"),
        Some(content) => {
            let media_type = headers["content-type"].to_str().expect("visible ASCII");
            let described = content.get(media_type);
            let described =
                described.unwrap_or_else(|| panic!("{place}: {media_type} is not described"));
            check_body(media_type, &described["schema"], body, &place);
        }
    }
}

/// The body without gzip; a brotli body is no document and is left as it is.
fn plain(headers: &HeaderMap, body: &[u8]) -> Vec<u8> {
    let mut plain = Vec::new();
    if headers
        .get("content-encoding")
        .is_some_and(|coding| coding == "gzip")
    {
        flate2::read::GzDecoder::new(body)
            .read_to_end(&mut plain)
            .expect("gzip");
    } else {
        plain.extend_from_slice(body);
    }
    plain
}

fn check_headers(response: &Value, headers: &HeaderMap, place: &str) {
    // Headers that every response has, that every response to a limited key or a cross-origin page has, or that
    // transport adds.
    const COMMON: [&str; 16] = [
        "access-control-allow-origin",
        "access-control-expose-headers",
        "content-security-policy",
        "cross-origin-resource-policy",
        "ratelimit",
        "ratelimit-policy",
        "referrer-policy",
        "content-type",
        "content-length",
        "cache-control",
        "x-content-type-options",
        "x-request-id",
        "transfer-encoding",
        "content-encoding",
        "vary",
        "date",
    ];
    let described = response["headers"]
        .as_object()
        .expect("every response has headers");
    for name in headers
        .keys()
        .filter(|name| !COMMON.contains(&name.as_str()))
    {
        let known = described
            .keys()
            .any(|known| known.eq_ignore_ascii_case(name.as_str()));
        assert!(known, "{place}: the header {name} is not described");
    }
}

fn check_body(media_type: &str, schema: &Value, body: &[u8], place: &str) {
    match media_type {
        "application/json" | "application/problem+json" => {
            check_schema(schema, &parse(body, place), place);
        }
        "application/x-ndjson" => {
            for line in body
                .split(|byte| *byte == b'\n')
                .filter(|line| !line.is_empty())
            {
                check_schema(schema, &parse(line, place), place);
            }
        }
        _ => {}
    }
}

fn parse(body: &[u8], place: &str) -> Value {
    serde_json::from_slice(body).unwrap_or_else(|error| panic!("{place}: {error}"))
}

/// Panics unless `instance` matches `schema`, with references resolved within the description.
pub(crate) fn check_schema(schema: &Value, instance: &Value, place: &str) {
    let faults: Vec<String> = validator(schema)
        .iter_errors(instance)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(faults.is_empty(), "{place}: {faults:#?}\n{instance:#}");
}

/// Each schema is compiled once.
fn validator(schema: &Value) -> Arc<Validator> {
    static COMPILED: LazyLock<Mutex<HashMap<String, Arc<Validator>>>> =
        LazyLock::new(Mutex::default);
    let mut compiled = COMPILED
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let compile = || {
        let whole = json!({
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "allOf": [schema],
            "components": DESCRIPTION["components"],
        });
        let options = jsonschema::options().should_validate_formats(true);
        Arc::new(
            options
                .build(&whole)
                .expect("the description's schemas are well-formed"),
        )
    };
    compiled
        .entry(schema.to_string())
        .or_insert_with(compile)
        .clone()
}
