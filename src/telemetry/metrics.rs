//! Every metric: its name, its unit, what it counts.
//!
//! Labels come from tables of the program, never from a caller, so that there are only so many
//! series. What is known at the time of reading only is handed to [`Metrics::text`].

use std::sync::atomic::AtomicU64;
use std::time::Duration;

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};

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
    method: &'static str,
    route: String,
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

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Build {
    version: &'static str,
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

impl Default for Metrics {
    fn default() -> Self {
        let mut registry = Registry::with_prefix("noctule");
        let version = env!("CARGO_PKG_VERSION");
        registry.register("build", "The program", Info::new(Build { version }));
        let mut new = Registrar(&mut registry);
        Self {
            requests: new.add(
                "http_requests",
                "Requests answered, by method, route template and status",
            ),
            request_times: new.family_of_times(
                "http_request_duration",
                "From a request to the head of its answer; of a stream, to its beginning",
                request_buckets,
            ),
            connections: new.add("http_connections", "Connections open"),
            streams: new.add("http_event_streams", "Streams of events open"),
            plans: new.add("plans", "Plans by status, of those that have not ended"),
            oldest_queued: new.add_with_unit(
                "queue_oldest_age",
                "For how long the oldest queued plan has been waiting; 0 when none is",
                Unit::Seconds,
            ),
            queue_limit: new.add("queue_limit", "Plans that may wait"),
            workers: new.add("workers", "Plans that may run at the same time"),
            accepted: new.add("plans_accepted", "Plans accepted"),
            ended: new.add("plans_ended", "Runs that ended, by the status of the plan"),
            lost: new.add(
                "plan_runs_lost",
                "Runs whose plan was taken away: it was deleted, or another node runs it",
            ),
            run_times: new.family_of_times(
                "plan_run",
                "From a plan's start to its end, by its status",
                run_buckets,
            ),
            wait_times: new.times(
                "plan_wait",
                "From a plan's acceptance to the start of its run",
                run_buckets(),
            ),
            gaps: new.histogram(
                "plan_gap_ratio",
                "Proven gap of delivered routes: cost over lower bound, less 1",
                Histogram::new([
                    0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0,
                ]),
            ),
            iterations: new.add("search_iterations", "Iterations of searches"),
            evaluations: new.add("search_evaluations", "Routes priced by searches"),
            operation_times: new.family_of_times(
                "store_operation",
                "Time that the store took, by operation; of claim, which waits for a plan, only failures",
                store_buckets,
            ),
            operation_faults: new.add(
                "store_operation_failures",
                "Operations that failed because of the store",
            ),
            terrains: new.add("terrains", "Datasets that can be planned over"),
            terrain_sizes: new.add_with_unit(
                "terrain",
                "Length of all datasets, and of those that only plans still need",
                Unit::Bytes,
            ),
            terrain_copies: new.add_with_unit(
                "terrain_cache",
                "Length of the datasets on this node that are copies of shared ones",
                Unit::Bytes,
            ),
            terrain_fetches: new.add(
                "terrain_fetches",
                "Shared datasets that were copied to this node, by outcome",
            ),
            terrain_fetched: new.add_with_unit(
                "terrain_fetched",
                "Length of what was copied to this node",
                Unit::Bytes,
            ),
            registry,
        }
        .with_all_series()
    }
}

impl Metrics {
    /// Series that are 0 from the start, so that a first event is seen as a rise.
    fn with_all_series(self) -> Self {
        for status in ["succeeded", "failed", "cancelled"] {
            drop(self.ended.get_or_create(&Status { status }));
            drop(self.run_times.get_or_create(&Status { status }));
        }
        let claim = Operation { operation: "claim" };
        drop(self.operation_faults.get_or_create(&claim));
        for outcome in FETCHES {
            drop(self.terrain_fetches.get_or_create(&Fetch { outcome }));
        }
        self
    }

    /// A request was answered. `route` is the template, `None` when no route has the path.
    pub fn answered(&self, method: &str, route: Option<&str>, status: u16, took: Duration) {
        const METHODS: [&str; 5] = ["GET", "POST", "DELETE", "PUT", "HEAD"];
        let known = METHODS.into_iter().find(|known| *known == method);
        let method = known.unwrap_or(OTHER);
        let route = route.unwrap_or("unmatched").to_owned();
        let answered = Answered {
            method,
            route: route.clone(),
        };
        self.request_times
            .get_or_create(&answered)
            .observe(took.as_secs_f64());
        let request = Request {
            method,
            route,
            status,
        };
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

    /// A plan's run ended.
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

/// Gives names to metrics as they are made.
struct Registrar<'a>(&'a mut Registry);

impl Registrar<'_> {
    fn add<M>(&mut self, name: &str, help: &str) -> M
    where
        M: prometheus_client::registry::Metric + Clone + Default,
    {
        let metric = M::default();
        self.0.register(name, help, metric.clone());
        metric
    }

    fn add_with_unit<M>(&mut self, name: &str, help: &str, unit: Unit) -> M
    where
        M: prometheus_client::registry::Metric + Clone + Default,
    {
        let metric = M::default();
        self.0.register_with_unit(name, help, unit, metric.clone());
        metric
    }

    fn histogram(&mut self, name: &str, help: &str, histogram: Histogram) -> Histogram {
        self.0.register(name, help, histogram.clone());
        histogram
    }

    fn times(&mut self, name: &str, help: &str, histogram: Histogram) -> Histogram {
        self.0
            .register_with_unit(name, help, Unit::Seconds, histogram.clone());
        histogram
    }

    fn family_of_times<S>(
        &mut self,
        name: &str,
        help: &str,
        buckets: fn() -> Histogram,
    ) -> Family<S, Histogram, fn() -> Histogram>
    where
        S: Clone + std::hash::Hash + Eq + EncodeLabelSet + std::fmt::Debug + Send + Sync + 'static,
    {
        let family = Family::new_with_constructor(buckets);
        self.0
            .register_with_unit(name, help, Unit::Seconds, family.clone());
        family
    }
}

fn request_buckets() -> Histogram {
    Histogram::new([
        0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0,
    ])
}

fn run_buckets() -> Histogram {
    Histogram::new([
        0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0,
    ])
}

fn store_buckets() -> Histogram {
    Histogram::new([
        0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0,
    ])
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
