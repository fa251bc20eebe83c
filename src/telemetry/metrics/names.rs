//! Every metric's name, unit, buckets and description.

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};

use super::{FETCHES, Metrics, Operation, Outcome, Status, WebhookTry};

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Build {
    version: &'static str,
}

impl Default for Metrics {
    fn default() -> Self {
        let mut registry = Registry::with_prefix("noctule");
        let version = env!("CARGO_PKG_VERSION");
        registry.register("build", "The program", Info::new(Build { version }));
        let mut new = Registrar(&mut registry);
        Self {
            start: new.add_with_unit(
                "start_time",
                "When the process began, since 1970",
                Unit::Seconds,
            ),
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
            ended: new.add("plans_ended", "Plans that ended once they had been run, by status"),
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
                "Time that the store took, by operation; claim, which waits for a plan, is not timed",
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
            webhook_tries: new.add("webhook_tries", "Tries to send a webhook, by outcome"),
            lines_dropped: new.add(
                "log_lines_dropped",
                "Log lines dropped because stderr was not read",
            ),
            registry,
        }
        .with_all_series()
    }
}

impl Metrics {
    /// Creates all series at 0, so that a first event is seen as a rise.
    fn with_all_series(self) -> Self {
        for status in ["succeeded", "failed", "cancelled"] {
            drop(self.ended.get_or_create(&Status { status }));
            drop(self.run_times.get_or_create(&Status { status }));
        }
        let claim = Operation { operation: "claim" };
        drop(self.operation_faults.get_or_create(&claim));
        for outcome in FETCHES {
            drop(self.terrain_fetches.get_or_create(&Outcome { outcome }));
        }
        for tried in WebhookTry::ALL {
            drop(self.webhook_tries.get_or_create(&tried.outcome()));
        }
        self
    }
}

/// Registers metrics under their names as they are created.
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
