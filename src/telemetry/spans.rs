//! The service's two spans: a request, and a plan's run. Every log line within one carries its fields.
//!
//! Their level is one that no filter but `off` excludes, because lines of any level need the fields.

use opentelemetry::trace::{
    SpanContext, SpanId, Status, TraceContextExt as _, TraceFlags, TraceId, TraceState,
};
use opentelemetry::{Context, Value};
use tracing::Span;
use tracing::field::{Empty, display};
use tracing_opentelemetry::OpenTelemetrySpanExt as _;
use uuid::Uuid;

use super::Origin;
use super::traceparent::TraceParent;

/// The span of a request. Returned with it: the origin of a plan that it submits.
#[must_use]
pub fn of_request(request_id: String, caller: Option<TraceParent>) -> (Span, Origin) {
    let span = tracing::error_span!("request", request_id = %request_id, trace_id = Empty, plan_id = Empty, key = Empty);
    let traceparent = join(&span, caller);
    let origin = Origin {
        request_id,
        traceparent,
    };
    (span, origin)
}

/// The span of a plan's run, which belongs to the trace of the request that submitted it, if that is known.
#[must_use]
pub fn of_run(plan: Uuid, origin: Option<&Origin>) -> Span {
    let span = tracing::error_span!("plan", plan_id = %plan, request_id = Empty, trace_id = Empty);
    let caller = origin.and_then(|origin| origin.traceparent);
    if let Some(origin) = origin {
        span.record("request_id", &origin.request_id);
    }
    join(&span, caller);
    span
}

/// Record that the current request came with the key of this name.
pub fn name_key(name: &str) {
    Span::current().record("key", name);
}

/// Record that the current request is about this plan.
pub fn name_plan(plan: Uuid) {
    Span::current().record("plan_id", display(plan));
}

/// Record the answer in the exported span of a request.
pub fn answered(span: &Span, method: &str, route: Option<&str>, status: u16) {
    let context = span.context();
    if !context.has_active_span() {
        return;
    }
    let route = route.unwrap_or("unmatched").to_owned();
    context.span().update_name(format!("{method} {route}"));
    span.set_attribute("http.request.method", method.to_owned());
    span.set_attribute("http.route", route);
    span.set_attribute("http.response.status_code", Value::from(i64::from(status)));
    if status >= 500 {
        span.set_status(Status::error(""));
    }
}

/// Make `span` part of the caller's trace. Returns the parent to name in outgoing requests: this span when traces are
/// exported, otherwise the caller's.
fn join(span: &Span, caller: Option<TraceParent>) -> Option<TraceParent> {
    if let Some(caller) = caller {
        let flags = TraceFlags::default().with_sampled(caller.sampled);
        let remote = SpanContext::new(
            TraceId::from(caller.trace_id),
            SpanId::from(caller.span_id),
            flags,
            true,
            TraceState::default(),
        );
        // Without an export there is nothing to set it on.
        let _ = span.set_parent(Context::new().with_remote_span_context(remote));
    }
    let context = span.context();
    let own = context.span().span_context().clone();
    let traceparent = if own.is_valid() {
        Some(TraceParent {
            trace_id: u128::from_be_bytes(own.trace_id().to_bytes()),
            span_id: u64::from_be_bytes(own.span_id().to_bytes()),
            sampled: own.is_sampled(),
        })
    } else {
        caller
    };
    if let Some(traceparent) = traceparent {
        span.record("trace_id", traceparent.trace_id_text());
    }
    traceparent
}
