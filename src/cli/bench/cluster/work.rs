//! The store under fixed-time jobs: nodes as separate processes would be, each with its connection and view.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use futures_util::stream::{self, TryStreamExt as _};

use super::Took;
use crate::export::document::Convergence;
use crate::job::{self, Event, Submission};
use crate::store::jetstream::{JetStreamStore, Settings};
use crate::store::{End, Ending, Lease, Options, Store, wall_clock};

/// Callers at a time.
pub(super) const CALLERS: usize = 32;

/// Workers that run what was accepted.
pub(super) const WORKERS: u16 = 8;

/// Nodes among which they are shared.
pub(super) const NODES: u16 = 2;

/// Bytes of a scenario document.
pub(super) const SCENARIO: usize = 2_000;

/// Bytes of a result document.
pub(super) const RESULT: usize = 8_000;

/// Nodes of one system, the first of which also accepts plans.
pub(super) struct Nodes {
    all: Vec<Arc<JetStreamStore>>,
    settings: Settings,
    workers: u16,
}

impl Nodes {
    /// As many nodes as `workers` need, with `slots` each.
    pub(super) async fn open(settings: Settings, workers: u16, slots: u16) -> anyhow::Result<Self> {
        let mut all = Vec::new();
        for _ in 0..workers.div_ceil(slots) {
            let options = Options::new(10_000_000);
            all.push(Arc::new(
                JetStreamStore::open(settings.clone(), options).await?,
            ));
        }
        Ok(Self {
            all,
            settings,
            workers,
        })
    }

    /// Accept `plans` plans.
    pub(super) async fn accept(&self, plans: u32) -> anyhow::Result<()> {
        let store = &self.all[0];
        stream::iter((0..plans).map(Ok))
            .try_for_each_concurrent(CALLERS, |_| async move {
                store.submit(submission()).await?;
                anyhow::Ok(())
            })
            .await
    }

    /// Run `plans` plans, each by sleeping for a while.
    pub(super) async fn run(&self, plans: u32, asleep: Duration) -> anyhow::Result<Duration> {
        let left = Arc::new(AtomicU32::new(plans));
        let began = Instant::now();
        let mut workers = tokio::task::JoinSet::new();
        for number in 0..usize::from(self.workers) {
            let store = Arc::clone(&self.all[number % self.all.len()]);
            workers.spawn(work(store, Arc::clone(&left), asleep));
        }
        while let Some(worker) = workers.join_next().await {
            worker??;
        }
        Ok(began.elapsed())
    }

    /// The node that accepts.
    pub(super) fn front(&self) -> Arc<JetStreamStore> {
        Arc::clone(&self.all[0])
    }

    /// Remove everything that was written.
    pub(super) async fn remove(self) -> anyhow::Result<()> {
        for store in &self.all {
            store.close().await;
        }
        super::raw::remove(&self.settings).await
    }
}

/// One worker's life, until no plan is left to be taken.
async fn work(
    store: Arc<JetStreamStore>,
    left: Arc<AtomicU32>,
    asleep: Duration,
) -> anyhow::Result<()> {
    let mut over: Option<Lease> = None;
    loop {
        let has_more = left
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| {
                left.checked_sub(1)
            })
            .is_ok();
        // As the pool does: the next run does not wait for the end of the one before.
        let conclusion = async {
            match over.take() {
                Some(lease) => store.finish(&lease, end()).await.map(drop),
                None => Ok(()),
            }
        };
        let run = async {
            if !has_more {
                return Ok(None);
            }
            let lease = store.claim().await;
            tokio::time::sleep(asleep).await;
            lease.map(Some)
        };
        let (concluded, lease) = tokio::join!(conclusion, run);
        concluded.context("finish")?;
        let Some(lease) = lease.context("claim")? else {
            return Ok(());
        };
        over = Some(lease);
    }
}

/// How fast plans that take no time are accepted, and then run.
pub(super) async fn rates(settings: Settings, plans: u32) -> anyhow::Result<Took> {
    let nodes = Nodes::open(settings, WORKERS, WORKERS / NODES).await?;
    let began = Instant::now();
    nodes.accept(plans).await?;
    let accepting = began.elapsed();
    let running = nodes.run(plans, Duration::ZERO).await?;
    nodes.remove().await?;
    Ok(Took {
        accepting,
        running,
        plans,
    })
}

/// A submission as a caller would make it.
pub(super) fn submission() -> Submission {
    let created_ms = wall_clock()();
    Submission {
        id: job::new_id(created_ms),
        name: Some("bench".to_owned()),
        algorithm: "tms-sba".to_owned(),
        seed: 1,
        iterations: 200,
        work: 400_000,
        scenario: "s".repeat(SCENARIO),
        created_ms,
        owner: None,
        quota: None,
        webhook: None,
        idempotency: None,
        dataset: None,
    }
}

fn point() -> Event {
    Event::Convergence(Convergence {
        iteration: 200,
        evaluations: 40_000,
        elapsed_ms: 20.0,
        best_cost: Some(500.0),
        best_violation: 0.0,
        mean_cost: 510.0,
        feasible_fraction: 1.0,
    })
}

fn end() -> Arc<End> {
    let ending = Ending::Result {
        cancelled: false,
        stop_reason: "iterations".to_owned(),
        feasible: true,
        best_cost: Some(500.0),
        evaluations: 40_000,
        iteration: 200,
        document: "r".repeat(RESULT),
    };
    ending.after(vec![point()], wall_clock()())
}
