//! This process's counters and when they are counted.
//!
//! Labels come from tables in the program, never from a caller, so that the number of series is bounded. Values known
//! only at the time of reading are passed to [`Metrics::text`].

mod names;

use std::sync::atomic::AtomicU64;
use std::time::Duration;

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

/// The media type of what [`Metrics::text`] writes.
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Label for a request's method when no route has it.
const OTHER: &str = "OTHER";

/// How copying a dataset can end.
const FETCHES: [&str; 2] = ["fetched", "failed"];

/// How a try to send a webhook can end: it is received, its receiver is gone for good, it will be tried again, or not any
/// more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WebhookTry {
    /// Answered with a 2xx.
    Delivered,
    /// Answered with 410.
    Gone,
    /// Not received yet.
    Failed,
    /// Not received, the last time.
    GivenUp,
}

impl WebhookTry {
    const ALL: [Self; 4] = [Self::Delivered, Self::Gone, Self::Failed, Self::GivenUp];

    fn outcome(self) -> Outcome {
        let outcome = match self {
            Self::Delivered => "delivered",
            Self::Gone => "gone",
            Self::Failed => "failed",
            Self::GivenUp => "given-up",
        };
        Outcome { outcome }
    }
}

/// Counters and times of this process.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    start: Level,
    requests: Family<Request, Counter>,
    request_times: Family<Answered, Histogram, fn() -> Histogram>,
    connections: Gauge,
    streams: Gauge,
    plans: Family<Status, Level>,
    oldest_queued: Level,
    queue_limit: Level,
    workers: Level,
    accepted: Counter,
    ended: Family<Status, Counter>,
    lost: Counter,
    run_times: Family<Status, Histogram, fn() -> Histogram>,
    wait_times: Histogram,
    gaps: Histogram,
    iterations: Counter,
    evaluations: Counter,
    operation_times: Family<Operation, Histogram, fn() -> Histogram>,
    operation_faults: Family<Operation, Counter>,
    terrains: Level,
    terrain_sizes: Level,
    terrain_copies: Level,
    terrain_fetches: Family<Outcome, Counter>,
    terrain_fetched: Counter,
    webhook_tries: Family<Outcome, Counter>,
    lines_dropped: Counter,
}

/// A gauge read on request; NaN when it cannot be read.
type Level = Gauge<f64, AtomicU64>;

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Request {
    #[prometheus(flatten)]
    answered: Answered,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Answered {
    method: &'static str,
    route: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Status {
    status: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Operation {
    operation: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Outcome {
    outcome: &'static str,
}

/// The state of the queue at the time of reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Queue {
    /// Plans waiting; `None` when the store does not say.
    pub queued: Option<u64>,
    /// Plans being run.
    pub running: Option<u64>,
    /// How long the oldest has been waiting, milliseconds; `None` when none waits.
    pub oldest_queued_ms: Option<i64>,
    /// Maximum number of waiting plans.
    pub limit: usize,
    /// Maximum number of running plans.
    pub workers: usize,
}

/// How a plan ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ended {
    /// `succeeded`, `failed` or `cancelled`.
    pub status: &'static str,
    /// From its start to its end, milliseconds.
    pub run_ms: Option<i64>,
}

impl Metrics {
    /// The process started, milliseconds since 1970.
    pub fn began(&self, at_ms: i64) {
        self.start.set(seconds(at_ms));
    }

    /// A route is served. Its failures are counted from 0: a series that is born at 1 has no rate, so an alert would miss
    /// the first.
    pub fn served(&self, method: &'static str, route: &str) {
        let route = route.to_owned();
        let answered = Answered { method, route };
        let status = 500;
        drop(self.requests.get_or_create(&Request { answered, status }));
    }

    /// A request was answered, or input that is not a request. `route` is the template, `None` when no route has the
    /// path.
    pub fn answered(&self, method: &str, route: Option<&str>, status: u16, took: Duration) {
        const METHODS: [&str; 5] = ["GET", "POST", "DELETE", "PUT", "HEAD"];
        let known = METHODS.into_iter().find(|known| *known == method);
        let method = known.unwrap_or(OTHER);
        let route = route.unwrap_or("unmatched").to_owned();
        let answered = Answered { method, route };
        self.request_times
            .get_or_create(&answered)
            .observe(took.as_secs_f64());
        let request = Request { answered, status };
        self.requests.get_or_create(&request).inc();
    }

    /// A connection was opened; it is open until the returned value is dropped.
    #[must_use]
    pub fn connection(&self) -> Held {
        Held::new(&self.connections)
    }

    /// An event stream was opened; it is open until the returned value is dropped.
    #[must_use]
    pub fn stream(&self) -> Held {
        Held::new(&self.streams)
    }

    /// A plan was accepted.
    pub fn accepted(&self) {
        self.accepted.inc();
    }

    /// A plan's run began after this wait.
    pub fn started(&self, waited_ms: i64) {
        self.wait_times.observe(seconds(waited_ms));
    }

    /// The end of a plan that had been run.
    pub fn ended(&self, ended: Ended) {
        let status = Status {
            status: ended.status,
        };
        self.ended.get_or_create(&status).inc();
        if let Some(run_ms) = ended.run_ms {
            self.run_times
                .get_or_create(&status)
                .observe(seconds(run_ms));
        }
    }

    /// A run lost its plan: it was deleted, or another node runs it.
    pub fn lost(&self) {
        self.lost.inc();
    }

    /// A route was delivered that is proven to be within this gap of the best.
    pub fn gap(&self, gap: f64) {
        self.gaps.observe(gap);
    }

    /// A search progressed.
    pub fn searched(&self, iterations: u64, evaluations: u64) {
        self.iterations.inc_by(iterations);
        self.evaluations.inc_by(evaluations);
    }

    /// The store performed an operation.
    pub fn stored(&self, operation: &'static str, took: Duration) {
        let operation = Operation { operation };
        // The series must be seen as 0 before it rises.
        drop(self.operation_faults.get_or_create(&operation));
        self.operation_times
            .get_or_create(&operation)
            .observe(took.as_secs_f64());
    }

    /// The store failed to perform an operation.
    pub fn store_failed(&self, operation: &'static str) {
        let operation = Operation { operation };
        self.operation_faults.get_or_create(&operation).inc();
    }

    /// A webhook was tried.
    pub fn webhook_tried(&self, tried: WebhookTry) {
        self.webhook_tries.get_or_create(&tried.outcome()).inc();
    }

    /// A shared dataset was copied to this node, or `bytes` of it before that failed.
    pub fn terrain_fetched(&self, wholly: bool, bytes: u64) {
        let outcome = FETCHES[usize::from(!wholly)];
        self.terrain_fetches
            .get_or_create(&Outcome { outcome })
            .inc();
        self.terrain_fetched.inc_by(bytes);
    }

    /// Where log lines are counted that could not be written.
    #[must_use]
    pub fn lines_dropped(&self) -> Counter {
        self.lines_dropped.clone()
    }

    /// The number and total size of datasets, and the bytes of copies on this node.
    pub fn terrains(&self, datasets: u64, bytes: u64, cached_bytes: u64) {
        self.terrains.set(datasets as f64);
        self.terrain_sizes.set(bytes as f64);
        self.terrain_copies.set(cached_bytes as f64);
    }

    /// Everything, in the text format of `OpenMetrics`.
    ///
    /// # Panics
    /// Never: a string takes everything.
    #[must_use]
    pub fn text(&self, queue: Queue) -> String {
        let level = |count: Option<u64>| count.map_or(f64::NAN, |count| count as f64);
        for (status, count) in [("queued", queue.queued), ("running", queue.running)] {
            let plans = self.plans.get_or_create(&Status { status });
            plans.set(level(count));
        }
        self.oldest_queued.set(match queue.queued {
            Some(_) => seconds(queue.oldest_queued_ms.unwrap_or(0)),
            None => f64::NAN,
        });
        self.queue_limit.set(queue.limit as f64);
        self.workers.set(queue.workers as f64);
        let mut text = String::new();
        encode(&mut text, &self.registry).expect("writing to a string cannot fail");
        text
    }
}

/// Counts one for as long as it lives.
#[derive(Debug)]
pub struct Held(Gauge);

impl Held {
    fn new(gauge: &Gauge) -> Self {
        gauge.inc();
        Self(gauge.clone())
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Seconds, from a wall clock that may have been set back meanwhile.
fn seconds(ms: i64) -> f64 {
    ms.max(0) as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Operators need metrics even when the store cannot be read.
    #[test]
    fn unknown_figures_are_exported_as_nan() {
        let queue = Queue {
            queued: None,
            running: None,
            oldest_queued_ms: None,
            limit: 7,
            workers: 2,
        };
        let text = Metrics::default().text(queue);
        for line in [
            "noctule_plans{status=\"queued\"} NaN",
            "noctule_queue_oldest_age_seconds NaN",
            "noctule_queue_limit 7.0",
        ] {
            assert!(text.lines().any(|found| found == line), "{line}\n{text}");
        }
    }
}
