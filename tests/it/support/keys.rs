//! Keys, and requests that carry them.

use axum::http::Method;
use noctule::digest::sha256_hex;

use super::api::{Answer, Api};

/// The entry of a key named `name` with the secret `secret`; `more` are further lines.
pub(crate) fn entry(name: &str, secret: &str, scope: &str, more: &str) -> String {
    let sum = sha256_hex(secret.as_bytes());
    format!("[[key]]\nname = {name:?}\nsha256 = \"{sum}\"\nscopes = [{scope:?}]\n{more}\n")
}

/// The value of the `Authorization` header.
pub(crate) fn bearer(secret: &str) -> String {
    format!("Bearer {secret}")
}

/// Sends a request with a key.
pub(crate) async fn send(api: &Api, secret: &str, request: &str) -> Answer {
    let (method, uri) = request.split_once(' ').expect("a method and a path");
    let method: Method = method.parse().expect("a method");
    let bearer = bearer(secret);
    api.send(method, uri, &[("authorization", &bearer)], "")
        .await
}

/// Submits the small scenario with a key.
pub(crate) async fn post(api: &Api, secret: &str) -> Answer {
    let bearer = bearer(secret);
    let headers = [
        ("authorization", bearer.as_str()),
        ("content-type", "application/json"),
    ];
    let body = super::scenario().to_string();
    api.send(Method::POST, "/plans", &headers, body).await
}
