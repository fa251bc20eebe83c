//! The store for several machines: plans, documents and events on the servers of a NATS system, with `JetStream` as
//! queue, storage and arbiter.
//!
//! Any number of nodes share it. What is accepted is on the servers before it is answered; each step of a plan is
//! written only if nobody was faster; a run belongs to this node for as long as the node renews its lease in time.
//! Deliberately absent: any queue, election or replication of our own.

mod bucket;
mod claim;
mod connect;
mod delivery;
mod documents;
mod election;
mod errors;
mod fetch;
mod follow;
mod giving_back;
mod history;
mod hooks;
mod known;
mod lane;
mod leases;
mod lost_jobs;
mod maker;
mod nodes;
mod objects;
mod orphans;
mod reading;
mod record;
mod removal;
mod run_steps;
mod runs;
mod settings;
mod shelf;
mod steps;
mod strays;
mod streams;
mod submit;
mod together;
mod turns;
mod view;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicUsize};
use std::time::Duration;

use async_nats::jetstream::consumer::PullConsumer;
use async_trait::async_trait;
use parking_lot::Mutex;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::Instant;
use tracing::Instrument as _;
use uuid::Uuid;

pub use settings::Settings;
pub use shelf::JetStreamShelf;

use self::connect::Servers;
use self::follow::Reading;
use self::lane::Lane;
use self::leases::Leases;
use self::lost_jobs::Round;
use self::orphans::Orphans;
use self::reading::Asking;
use self::steps::Plans;
use self::strays::Strays;
use self::view::View;
use super::{
    DatasetUse, End, EventPage, Lease, ListQuery, Options, Stats, Store, StoreError, Submitted,
    Webhook,
};
use crate::export::document::Incumbent;
use crate::job::{Event, Idempotency, Owner, Plan, PlanId, Submission};

/// At the start, existing data must go on being read within this time.
const PATIENCE: Duration = Duration::from_secs(60);

/// The store for several machines.
///
/// Dropping it without [`Store::close`] leaves its runs to the other nodes, as a crash would.
pub struct JetStreamStore {
    store: Arc<JetStream>,
    reading: watch::Receiver<Reading>,
    tasks: Vec<JoinHandle<()>>,
}

/// Shared by all its methods and tasks.
struct JetStream {
    servers: Servers,
    view: View,
    leases: Leases,
    settings: Settings,
    options: Options,
    /// Identifies this node among the others.
    node: Uuid,
    consumers: Mutex<HashMap<Lane, PullConsumer>>,
    /// Held by the claim whose turn it is.
    turn: tokio::sync::Mutex<()>,
    last_patrol: Mutex<Option<Instant>>,
    orphans: Orphans,
    /// The search for missing jobs.
    round: Mutex<Round>,
    strays: Mutex<Strays>,
    asking: Asking,
    all_slots: AtomicUsize,
    /// How far this node's clock is ahead of the servers', milliseconds.
    ahead_ms: AtomicI64,
    /// Plans whose webhooks this node is sending, and when it took the right to.
    telling: Mutex<BTreeMap<PlanId, Instant>>,
    /// Becomes true when the store is closed.
    end: watch::Sender<bool>,
    /// Becomes true when a stream has vanished from the servers.
    vanished: watch::Sender<bool>,
}

impl JetStream {
    fn plans(&self) -> Plans<'_> {
        Plans {
            servers: &self.servers,
            view: &self.view,
            leases: &self.leases,
        }
    }
}

impl JetStreamStore {
    /// Connect, create what is missing on the servers, and read what is there.
    ///
    /// # Errors
    /// [`StoreError::Unavailable`] when no server answers, when it is too old or without `JetStream`,
    /// or when it cannot keep as many replicas as asked.
    pub async fn open(settings: Settings, options: Options) -> Result<Self, StoreError> {
        let servers = Box::pin(Servers::open(&settings, &options)).await?;
        let store = Arc::new(JetStream {
            servers,
            view: View::new(options.events_kept),
            leases: Leases::default(),
            all_slots: AtomicUsize::new(settings.slots),
            settings,
            options,
            node: Uuid::new_v4(),
            consumers: Mutex::default(),
            turn: tokio::sync::Mutex::default(),
            last_patrol: Mutex::default(),
            orphans: Orphans::default(),
            round: Mutex::default(),
            strays: Mutex::default(),
            asking: Asking::default(),
            ahead_ms: AtomicI64::default(),
            telling: Mutex::default(),
            end: watch::Sender::new(false),
            vanished: watch::Sender::new(false),
        });
        store.servers.outlast(|| store.announce()).await?;
        let (read, mut reading) = watch::channel(Reading::Catching { read: 0 });
        let opened = Self {
            tasks: vec![
                tokio::spawn(store.clone().follow(read)),
                tokio::spawn(store.clone().keep_announcing()),
            ],
            store,
            reading: reading.clone(),
        };
        while *reading.borrow_and_update() != Reading::Current {
            let moved = tokio::time::timeout(PATIENCE, reading.changed()).await;
            if !matches!(moved, Ok(Ok(()))) {
                return Err(StoreError::unavailable(
                    "the plans on the servers cannot be read",
                ));
            }
        }
        opened.store.judge_clock().await?;
        Ok(opened)
    }

    fn open_store(&self) -> Result<&Arc<JetStream>, StoreError> {
        if *self.store.end.borrow() {
            return Err(StoreError::closed());
        }
        if *self.store.vanished.borrow() {
            return Err(streams::vanished());
        }
        Ok(&self.store)
    }

    /// Fails while the servers have plans that are not known here yet.
    fn check_current(&self) -> Result<(), StoreError> {
        if *self.reading.borrow() == Reading::Current {
            return Ok(());
        }
        let what = "the plans on the servers are being read";
        Err(StoreError::unavailable(what))
    }
}

impl Drop for JetStreamStore {
    fn drop(&mut self) {
        for task in &self.tasks {
            task.abort();
        }
        self.store.end.send_replace(true);
    }
}

#[async_trait]
impl Store for JetStreamStore {
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError> {
        let store = Arc::clone(self.open_store()?);
        detached(async move { store.submit(&submission).await }).await
    }

    async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError> {
        self.open_store()?.repeated(owner, idempotency).await
    }

    async fn claim(&self) -> Result<Lease, StoreError> {
        let store = self.open_store()?;
        let mut vanished = store.vanished.subscribe();
        let lease = tokio::select! {
            lease = store.claim() => lease,
            _ = vanished.wait_for(|vanished| *vanished) => Err(streams::vanished()),
        };
        lease.inspect_err(|error| {
            store.heed_vanished(error);
        })
    }

    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError> {
        self.open_store()?
            .append(lease.plan.id, lease.attempt, &events)
            .await
    }

    async fn finish(&self, lease: &Lease, end: Arc<End>) -> Result<Plan, StoreError> {
        self.open_store()?
            .finish(lease.plan.id, lease.attempt, &end)
            .await
    }

    async fn release(&self, lease: &Lease) -> Result<Plan, StoreError> {
        self.open_store()?
            .release(lease.plan.id, lease.attempt)
            .await
    }

    async fn postpone(&self, lease: &Lease) -> Result<Plan, StoreError> {
        self.open_store()?
            .postpone(lease.plan.id, lease.attempt)
            .await
    }

    async fn request_cancel_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        self.open_store()?
            .request_cancel(id, revision, now_ms)
            .await
    }

    async fn delete_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError> {
        let store = Arc::clone(self.open_store()?);
        detached(async move { store.delete(id, revision, now_ms).await }).await
    }

    async fn get(&self, id: PlanId) -> Result<Plan, StoreError> {
        self.open_store()?.get(id).await
    }

    async fn scenario(&self, id: PlanId) -> Result<String, StoreError> {
        self.open_store()?.scenario(id).await
    }

    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError> {
        self.open_store()?.result(id).await
    }

    async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError> {
        self.open_store()?.incumbent(id).await
    }

    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError> {
        Ok(self.open_store()?.view.known().list_plans(&query))
    }

    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<EventPage, StoreError> {
        self.open_store()?.events(id, after, limit).await
    }

    async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError> {
        self.open_store()?.has_event(id, event).await
    }

    fn changes(&self, id: PlanId) -> watch::Receiver<u64> {
        self.store.view.changes.subscribe(id)
    }

    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        self.open_store()?.sweep(now_ms).await
    }

    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError> {
        self.open_store()?.due_webhooks(now_ms, limit).await
    }

    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError> {
        self.open_store()?.webhook_tried(id, next_ms).await
    }

    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        Ok(self.open_store()?.view.known().datasets())
    }

    async fn all_datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        let uses = self.datasets_in_use().await?;
        self.check_current()?;
        Ok(uses)
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        let store = self.open_store()?;
        Ok(Stats {
            slots: Some(store.slots()),
            ..store.view.known().stats()
        })
    }

    async fn health(&self) -> Result<(), StoreError> {
        let store = self.open_store()?;
        if !store.servers.is_connected() {
            return Err(StoreError::unavailable("no NATS server answers"));
        }
        store.look_at_streams().await?;
        store.announce().await?;
        self.check_current()
    }

    fn warning(&self) -> Option<String> {
        let ahead_ms = self.store.apart_ms()?;
        Some(format!(
            "the clock is {ahead_ms} ms from that of the NATS servers, and nothing is removed for its age"
        ))
    }

    async fn close(&self) {
        let was_open = !self.store.end.send_replace(true);
        if !was_open {
            return;
        }
        let has_vanished = *self.store.vanished.borrow();
        if has_vanished {
            self.store.give_back_at_once().await;
        } else {
            self.store.give_back_in_order().await;
            self.store.let_tell_all().await;
            self.store.take_leave().await;
        }
        self.tasks.iter().for_each(JoinHandle::abort);
        if !has_vanished && let Err(error) = self.store.servers.client.flush().await {
            tracing::debug!(%error, "the last words may not have been heard");
        }
    }
}

/// Complete several writes even when the caller goes away between them; their log lines keep the caller's span.
async fn detached<T: Send + 'static>(
    writes: impl Future<Output = Result<T, StoreError>> + Send + 'static,
) -> Result<T, StoreError> {
    tokio::spawn(writes.in_current_span())
        .await
        .unwrap_or_else(|broken| {
            Err(StoreError::unavailable(format!(
                "a task of the store broke: {broken}"
            )))
        })
}
