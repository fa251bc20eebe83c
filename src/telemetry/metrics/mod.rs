//! What is counted of this process, and when.
//!
//! Labels come from tables of the program, never from a caller, so that there are only so many
//! series. What is known at the time of reading only is handed to [`Metrics::text`].

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

/// Of what [`Metrics::text`] writes.
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// What a request's method is called when it is none of those that routes have.
const OTHER: &str = "OTHER";

/// How a copy ends.
const FETCHES: [&str; 2] = ["fetched", "failed"];

/// Counts and times of this process.
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
    terrain_fetches: Family<Fetch, Counter>,
    terrain_fetched: Counter,
}

/// A figure that is read when it is asked for; not a number when it cannot be read.
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
struct Fetch {
    outcome: &'static str,
}

/// What the queue is like at the time of reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Queue {
    /// Plans waiting; `None` when the store does not say.
    pub queued: Option<u64>,
    /// Plans being run.
    pub running: Option<u64>,
    /// For how long the oldest has been waiting, milliseconds; `None` when none waits.
    pub oldest_queued_ms: Option<i64>,
    /// Plans that may wait.
    pub limit: usize,
    /// Plans that may run.
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
    /// The process began, milliseconds since 1970.
    pub fn began(&self, at_ms: i64) {
        self.start.set(seconds(at_ms));
    }

    /// A request was answered, or something that is none. `route` is the template, `None` when no route has the path.
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

    /// A connection is open until what is returned is dropped.
    #[must_use]
    pub fn connection(&self) -> Held {
        Held::new(&self.connections)
    }

    /// A stream of events is open until what is returned is dropped.
    #[must_use]
    pub fn stream(&self) -> Held {
        Held::new(&self.streams)
    }

    /// A plan was accepted.
    pub fn accepted(&self) {
        self.accepted.inc();
    }

    /// A plan's run began after so long a wait.
    pub fn started(&self, waited_ms: i64) {
        self.wait_times.observe(seconds(waited_ms));
    }

    /// A plan that had been run ended.
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

    /// A plan was taken from its run.
    pub fn lost(&self) {
        self.lost.inc();
    }

    /// A route was delivered that is proven to be so near to the best.
    pub fn gap(&self, gap: f64) {
        self.gaps.observe(gap);
    }

    /// A search went on.
    pub fn searched(&self, iterations: u64, evaluations: u64) {
        self.iterations.inc_by(iterations);
        self.evaluations.inc_by(evaluations);
    }

    /// The store did an operation.
    pub fn stored(&self, operation: &'static str, took: Duration) {
        let operation = Operation { operation };
        // Seen as 0 before it rises.
        drop(self.operation_faults.get_or_create(&operation));
        self.operation_times
            .get_or_create(&operation)
            .observe(took.as_secs_f64());
    }

    /// The store failed to do an operation.
    pub fn store_failed(&self, operation: &'static str) {
        let operation = Operation { operation };
        self.operation_faults.get_or_create(&operation).inc();
    }

    /// A shared dataset was copied to this node, or so many bytes of it before that failed.
    pub fn terrain_fetched(&self, wholly: bool, bytes: u64) {
        let outcome = FETCHES[usize::from(!wholly)];
        self.terrain_fetches.get_or_create(&Fetch { outcome }).inc();
        self.terrain_fetched.inc_by(bytes);
    }

    /// There are so many datasets, so many bytes long, with so many bytes of copies on this node.
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

/// Of a time by the wall clock, which may have been set back meanwhile.
fn seconds(ms: i64) -> f64 {
    ms.max(0) as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The operator reads metrics also when the store cannot be read.
    #[test]
    fn what_is_not_known_is_not_a_number() {
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
