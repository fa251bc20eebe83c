//! Every store backend, on a clock that the test controls.

use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use noctule::config::Address;
use noctule::store::jetstream::{JetStreamStore, Settings};
use noctule::store::sqlite::SqliteStore;
use noctule::store::{Options, Retention, Store, StoreError};
use tempfile::TempDir;

use super::nats;
use super::patience::in_time;
use super::process::Service;

/// A kind of store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Backend {
    Sqlite,
    JetStream,
}

/// The backends that the conformance suite runs on.
pub(crate) const BACKENDS: [Backend; 2] = [Backend::Sqlite, Backend::JetStream];

/// How long a run stays with its node after the node's last renewal.
pub(crate) const LEASE: Duration = Duration::from_secs(2);

/// Where a store keeps its plans and finds them when reopened.
pub(crate) struct Place {
    directory: TempDir,
    /// The namespace, for plans on servers.
    address: Option<String>,
}

impl Place {
    /// A place that nobody else uses.
    pub(crate) fn new(backend: Backend) -> Self {
        Self {
            address: (backend == Backend::JetStream).then(nats::address),
            directory: TempDir::new().expect("a temporary directory"),
        }
    }

    /// The directory for whatever a process writes.
    pub(crate) fn path(&self) -> &Path {
        self.directory.path()
    }

    /// Opens the store.
    pub(crate) async fn open(&self, options: Options) -> Result<Arc<dyn Store>, StoreError> {
        if let Some(address) = &self.address {
            let store = Box::pin(JetStreamStore::open(node(address), options)).await?;
            return Ok(Arc::new(store));
        }
        let path = self.path().to_owned();
        let open = move || SqliteStore::open(&path, options);
        let opened = tokio::task::spawn_blocking(open).await;
        Ok(Arc::new(opened.expect("no panic")?))
    }

    /// A service process over the store.
    pub(crate) fn serve(&self, arguments: &[&str]) -> Service {
        let lease = format!("{}s", LEASE.as_secs());
        let mut all = arguments.to_vec();
        if let Some(address) = &self.address {
            all.extend(["--store", address, "--store-lease", &lease]);
        }
        Service::start(self.path(), &all)
    }
}

/// The settings of a node on one server that runs up to four plans at a time.
pub(crate) fn node(address: &str) -> Settings {
    Settings {
        address: Address::read(address).expect("it is one"),
        credentials: None,
        replicas: 1,
        lease: LEASE,
        slots: 4,
    }
}

/// An open store in its own place.
pub(crate) struct Fixture {
    place: Place,
    queue_limit: u64,
    /// Takes effect at the next opening.
    pub(crate) retention: Retention,
    /// Takes effect at the next opening.
    pub(crate) events_kept: u64,
    now_ms: Arc<AtomicI64>,
    store: Option<Arc<dyn Store>>,
}

impl Fixture {
    pub(crate) async fn new(place: Place, queue_limit: u64) -> Self {
        let mut fixture = Self {
            place,
            queue_limit,
            retention: Retention::default(),
            events_kept: u64::MAX,
            now_ms: Arc::new(AtomicI64::new(10_000)),
            store: None,
        };
        fixture.open().await;
        fixture
    }

    /// Opens the store. A server that another test is just starting holds copies of this process's files, locks
    /// included, until it has become a program of its own.
    async fn open(&mut self) {
        let options = || Options {
            clock: self.clock(),
            retention: self.retention,
            events_kept: self.events_kept,
            ..Options::new(self.queue_limit)
        };
        let opened = async {
            loop {
                match self.place.open(options()).await {
                    Err(StoreError::InUse(_)) => tokio::task::yield_now().await,
                    opened => return opened.expect("the store opens"),
                }
            }
        };
        self.store = Some(in_time(opened).await);
    }

    pub(crate) fn clock(&self) -> noctule::store::Clock {
        let now_ms = Arc::clone(&self.now_ms);
        Arc::new(move || now_ms.load(Ordering::SeqCst))
    }

    pub(crate) fn now_ms(&self) -> i64 {
        self.now_ms.load(Ordering::SeqCst)
    }

    pub(crate) fn pass_ms(&self, ms: i64) {
        self.now_ms.fetch_add(ms, Ordering::SeqCst);
    }

    /// Closes the store and opens it again, as a new process would.
    pub(crate) async fn reopen(&mut self) {
        self.close().await;
        self.open().await;
    }

    pub(crate) async fn close(&mut self) {
        if let Some(store) = self.store.take() {
            store.close().await;
        }
    }

    /// Opens the store again without closing it, as after a crash.
    pub(crate) async fn lose(&mut self) {
        drop(self.store.take());
        self.open().await;
    }

    /// Another handle to the same open store.
    pub(crate) fn share(&self) -> Arc<dyn Store> {
        Arc::clone(self.store.as_ref().expect("the store is open"))
    }
}

impl Deref for Fixture {
    type Target = dyn Store;

    fn deref(&self) -> &Self::Target {
        self.store.as_deref().expect("the store is open")
    }
}

/// Runs a test on each backend.
pub(crate) async fn for_every_backend(test: impl AsyncFn(Backend)) {
    for backend in BACKENDS {
        // Printed when the test fails.
        println!("on {backend:?}");
        test(backend).await;
    }
}

/// Runs a test on each backend, with room for `queue_limit` plans.
pub(crate) async fn on_every_backend(queue_limit: u64, test: impl AsyncFn(&mut Fixture)) {
    for_every_backend(async |backend| {
        let mut fixture = Fixture::new(Place::new(backend), queue_limit).await;
        in_time(test(&mut fixture)).await;
        fixture.close().await;
    })
    .await;
}
