//! `GET /plans`: the list, a page at a time.

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD as BASE64;
use serde::Serialize;
use uuid::Uuid;

use crate::http::AppState;
use crate::http::caller::Caller;
use crate::http::params::{self, Params};
use crate::http::problem::Problem;
use crate::http::status::StatusDocument;
use crate::job::{PlanId, Status};
use crate::store::ListQuery;

/// Plans on a page by default.
const DEFAULT_PAGE: usize = 50;
/// Maximum number of plans on a page.
pub(in crate::http) const MAX_PAGE: usize = 1000;

/// A page of the list.
#[derive(Serialize)]
struct Page {
    plans: Vec<StatusDocument>,
    links: PageLinks,
}

#[derive(Serialize)]
struct PageLinks {
    next: Option<String>,
}

/// `GET /plans`.
pub(in crate::http) async fn list(
    State(state): State<AppState>,
    caller: Caller,
    uri: Uri,
) -> Result<Response, Problem> {
    let params = Params::read(&uri, &["status", "limit", "cursor"])?;
    let status = params.text("status").map(read_status).transpose()?;
    let limit = params.within("limit", &(1..=MAX_PAGE), "a number")?;
    let limit = limit.unwrap_or(DEFAULT_PAGE);
    let before = params.text("cursor").map(read_cursor).transpose()?;

    // One more than asked for tells whether there is a next page.
    let query = ListQuery {
        status,
        owner: caller.owner.filter(|_| !caller.sees_all),
        before,
        limit: limit + 1,
    };
    let mut plans = state.store.list(query).await?;
    let more = plans.len() > limit;
    plans.truncate(limit);
    let next = plans
        .last()
        .filter(|_| more)
        .map(|last| next_page(status, limit, last.id));

    let mut response = Json(Page {
        plans: plans.into_iter().map(Into::into).collect(),
        links: PageLinks { next: next.clone() },
    })
    .into_response();
    if let Some(next) = next {
        let link = HeaderValue::from_str(&format!("<{next}>; rel=\"next\""))
            .expect("a link is visible ASCII");
        response.headers_mut().insert(header::LINK, link);
    }
    Ok(response)
}

fn read_status(name: &str) -> Result<Status, Problem> {
    let allowed = || format!("one of {}", Status::ALL.map(Status::name).join(", "));
    Status::from_name(name).ok_or_else(|| params::refused("status", name, &allowed()))
}

/// A cursor is the last id of the previous page; callers should treat it as opaque.
fn read_cursor(text: &str) -> Result<PlanId, Problem> {
    let bytes = BASE64
        .decode(text)
        .ok()
        .and_then(|bytes| bytes.try_into().ok());
    bytes
        .map(Uuid::from_bytes)
        .ok_or_else(|| params::refused("cursor", text, "one out of a next link"))
}

fn next_page(status: Option<Status>, limit: usize, last: PlanId) -> String {
    let cursor = BASE64.encode(last.as_bytes());
    let status = status
        .map(|status| format!("status={}&", status.name()))
        .unwrap_or_default();
    format!("/plans?{status}limit={limit}&cursor={cursor}")
}
