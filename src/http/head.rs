//! What is checked of every request's head before its route is looked up: its size, its host, and that its address
//! holds no key.

use std::future::ready;

use axum::extract::Request;
use axum::http::{HeaderValue, Version, header};
use axum::response::{IntoResponse as _, Response};
use futures_util::FutureExt as _;

use super::auth;
use super::hosts::Hosts;
use super::layer::{Answering, Around, Next};
use super::problem::Problem;

/// Maximum size of an address and headers, as HTTP/1.1 writes them, bytes.
pub(super) const MOST_BYTES: usize = 64 * 1024;

/// Maximum number of headers; hyper's own in HTTP/1.
pub(super) const MOST_HEADERS: usize = 100;

/// The layer before all routes; a single one, because each layer costs every request.
#[derive(Clone)]
pub(super) struct HeadCheck(pub(super) Hosts);

impl Around for HeadCheck {
    fn answer<S: Next>(&self, request: Request, next: &mut S) -> Answering {
        let (uri, headers) = (request.uri(), request.headers());
        let checked = check_size(&request)
            .and_then(|()| self.0.check(uri, request.version(), headers))
            .and_then(|()| auth::refuse_key_in_url(uri));
        match checked {
            Ok(()) => Box::pin(next.run(request).map(Ok)),
            Err(problem) => Box::pin(ready(Ok(refused(problem, request.version())))),
        }
    }
}

/// A head that is too large ends its connection in HTTP/1, as it does where hyper finds out.
fn refused(problem: Problem, version: Version) -> Response {
    let closes = matches!(problem, Problem::HeadTooLarge(_)) && version < Version::HTTP_2;
    let mut answer = problem.into_response();
    if closes {
        let close = HeaderValue::from_static("close");
        answer.headers_mut().insert(header::CONNECTION, close);
    }
    answer
}

/// hyper's limits are not exact: in HTTP/1 it counts only what one read does not bring at once, and HTTP/2 has one on
/// memory alone.
fn check_size(request: &Request) -> Result<(), Problem> {
    let headers = request.headers();
    let path = request.uri().path_and_query();
    let bytes = headers.iter().fold(
        path.map_or(0, |path| path.as_str().len()),
        // A colon, a space and the end of the line.
        |bytes, (name, value)| bytes + name.as_str().len() + value.len() + 4,
    );
    if bytes > MOST_BYTES || headers.len() > MOST_HEADERS {
        return Err(Problem::HeadTooLarge(MOST_BYTES));
    }
    Ok(())
}
