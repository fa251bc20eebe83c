//! `GET /plans/{id}/events`: follow a plan, or resume where a stream was cut off.

use axum::Extension;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::stream;
use std::convert::Infallible;
use std::sync::Arc;
use tracing::{Instrument as _, Span};

use super::auth::{Access, Digest, Permit, Scope};
use super::caller::Caller;
use super::feed::{Feed, News};
use super::params::{self, Id, Params};
use super::problem::Problem;
use super::server::traffic::MayStandStill;
use super::sse::{Outgoing, Wire};
use super::{AppState, accept};
use crate::job::{Event, NumberedEvent};
use crate::store::Store;
use crate::telemetry::metrics::Held;

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");
const X_ACCEL_BUFFERING: HeaderName = HeaderName::from_static("x-accel-buffering");

/// Points a second by default.
const DEFAULT_RATE_HZ: f64 = 10.0;
/// Rates that may be requested, beside 0.
pub(super) const RATES_HZ: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// `GET /plans/{id}/events`.
pub(super) async fn follow(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let params = Params::read(&uri, &["rate", "last_event_id", "ticket"])?;
    let rate_hz = read_rate(&params)?;
    let after = read_last_event_id(&params, &headers)?;
    let media_type =
        accept::choose(&headers, &Wire::MEDIA_TYPES).ok_or_else(|| Problem::NotAcceptable {
            asked: accept::asked(&headers),
            available: Wire::MEDIA_TYPES.to_vec(),
        })?;
    let mut plan = caller.plan(&*state.store, id).await?;
    let mut exists = true;
    if after > 0 {
        exists = state.store.has_event(id, after).await?;
        // Read again, since that query may have brought news of the plan.
        plan = state.store.get(id).await?;
    }
    if plan.status.is_final() && !state.store.has_event(id, after + 1).await? {
        // The reader has had everything; EventSource stops asking at a 204.
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    // An event that the plan does not have yet belongs to another history, as after a restore from an older copy: a reader
    // who names one starts from the beginning.
    let after = if exists { after } else { 0 };
    let permit = state
        .access
        .open_stream(caller.owner.as_ref())
        .map_err(Problem::TooManyStreams)?;
    let feed = Feed::new(state.store.clone(), state.phase.clone(), id, after, rate_hz);
    let stream = Stream {
        feed,
        store: state.store.clone(),
        _permit: permit,
        _counted: state.instruments.metrics.stream(),
        access: state.access.clone(),
        key: caller.key,
        span: Span::current(),
    };
    Ok(streamed(stream, Wire::of(media_type)))
}

fn read_rate(params: &Params) -> Result<f64, Problem> {
    let (least, most) = RATES_HZ.into_inner();
    let allowed = format!("0 (every iteration) or from {least} to {most} a second");
    let rate_hz = params.parse("rate", &allowed)?.unwrap_or(DEFAULT_RATE_HZ);
    if rate_hz == 0.0 || RATES_HZ.contains(&rate_hz) {
        Ok(rate_hz)
    } else {
        Err(params::refused("rate", &rate_hz.to_string(), &allowed))
    }
}

/// Greatest id that may be requested; many JSON readers cannot represent greater integers.
const MAX_EVENT_ID: u64 = (1 << 53) - 1;

/// The header comes from a reconnecting browser and is newer than the query of the page's own address.
fn read_last_event_id(params: &Params, headers: &HeaderMap) -> Result<u64, Problem> {
    const ALLOWED: &str = "the id of an event, a whole number below 2^53";
    let read = |name: &str, value: &str| {
        let id = value.parse().ok().filter(|id| *id <= MAX_EVENT_ID);
        id.ok_or_else(|| params::refused(name, value, ALLOWED))
    };
    let query = params.text("last_event_id");
    let query = query
        .map(|value| read("last_event_id", value))
        .transpose()?;
    // Some clients send an empty one before the first event.
    let header = headers
        .get(LAST_EVENT_ID)
        .map(|value| String::from_utf8_lossy(value.as_bytes()))
        .filter(|value| !value.is_empty());
    let header = header
        .map(|value| read("last-event-id", &value))
        .transpose()?;
    Ok(header.or(query).unwrap_or(0))
}

/// Everything an open stream holds, whether anybody reads it or not.
struct Stream {
    feed: Feed,
    store: Arc<dyn Store>,
    _permit: Permit,
    _counted: Held,
    access: Access,
    key: Option<Digest>,
    /// The request's span: log lines are written after its answer has begun.
    span: Span,
}

fn streamed(stream: Stream, wire: Wire) -> Response {
    let prologue = stream::iter([Ok(Bytes::from_static(wire.prologue().as_bytes()))]);
    let events = stream::unfold(stream, move |mut stream| async move {
        let span = stream.span.clone();
        let mut text = stream.next(wire).instrument(span).await?;
        // It is kept for as long as its reader takes nothing.
        text.shrink_to_fit();
        Some((Ok::<_, Infallible>(Bytes::from(text)), stream))
    });
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static(wire.media_type()),
        ),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static("no-cache, no-transform"),
        ),
        (X_ACCEL_BUFFERING, HeaderValue::from_static("no")),
        (header::VARY, HeaderValue::from_static("accept")),
    ];
    let body = Body::from_stream(futures_util::StreamExt::chain(prologue, events));
    // A slow reader costs a position in a plan's events and no memory, so it may be slow.
    (Extension(MayStandStill), headers, body).into_response()
}

impl Stream {
    /// The next data to send; `None` at the end.
    async fn next(&mut self, wire: Wire) -> Option<String> {
        let news = tokio::select! {
            news = self.feed.next() => news?,
            // Withdrawing a key ends its streams.
            () = self.access.withdrawn(self.key, Scope::Read) => return None,
        };
        Some(match news {
            News::Events(events) => self.written(events, wire).await,
            News::Gap { from, to } => {
                let mut text = String::new();
                wire.write(Outgoing::gap(from, to), &mut text);
                text
            }
            News::Silence => wire.silence().to_owned(),
            News::Stopping(events) => self.written(events, wire).await + wire.stopping(),
        })
    }

    /// Taken from the record, which is shorter than the result.
    async fn has_result(&self) -> bool {
        let plan = self.store.get(self.feed.plan_id()).await;
        plan.is_ok_and(|plan| plan.stop_reason.is_some())
    }

    async fn written(&self, events: Vec<NumberedEvent>, wire: Wire) -> String {
        let plan = self.feed.plan_id();
        let mut text = String::new();
        for event in events {
            let ends = matches!(event.event, Event::End(_));
            let has_result = ends && self.has_result().await;
            wire.write(Outgoing::new(plan, event, has_result), &mut text);
        }
        text
    }
}
