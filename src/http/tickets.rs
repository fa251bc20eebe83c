//! `POST /plans/{id}/tickets`: permission to follow one plan for some minutes, in a form that fits a URL.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use serde::Serialize;

use super::AppState;
use super::caller::Caller;
use super::params::{Id, NoParams};
use super::problem::Problem;
use super::status::location;
use super::time::Time;

/// The ticket, when it expires, and the streams it opens.
#[derive(Serialize)]
pub(super) struct TicketDocument {
    ticket: String,
    expires_at: Time,
    events: String,
}

/// `POST /plans/{id}/tickets`.
pub(super) async fn issue(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    _: NoParams,
) -> Result<(StatusCode, Json<TicketDocument>), Problem> {
    caller.plan(&*state.store, id).await?;
    let ticket = state.access.ticket(id, &caller);
    let (ticket, until) = ticket.map_err(Problem::Unauthorized)?;
    let document = TicketDocument {
        events: format!("{}/events?ticket={ticket}", location(id)),
        expires_at: until.into(),
        ticket,
    };
    Ok((StatusCode::CREATED, Json(document)))
}
