//! Every store there is, on a clock that the test turns.

use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use noctule::store::sqlite::SqliteStore;
use noctule::store::{Options, Retention, Store, StoreError};
use tempfile::TempDir;

type Open = fn(&Path, Options) -> Result<Arc<dyn Store>, StoreError>;

/// The backends that the conformance suite runs on.
pub(crate) const BACKENDS: &[(&str, Open)] = &[("sqlite", |dir, options| {
    Ok(Arc::new(SqliteStore::open(dir, options)?))
})];

/// A hanging test fails after this.
const PATIENCE: Duration = Duration::from_secs(60);

/// An open store in a directory of its own.
pub(crate) struct Fixture {
    open: Open,
    directory: TempDir,
    queue_limit: u64,
    /// Of the next opening.
    pub(crate) retention: Retention,
    /// Of the next opening.
    pub(crate) events_kept: u64,
    now_ms: Arc<AtomicI64>,
    store: Option<Arc<dyn Store>>,
}

impl Fixture {
    pub(crate) fn new(open: Open, queue_limit: u64) -> Self {
        let mut fixture = Self {
            open,
            directory: TempDir::new().expect("a temporary directory"),
            queue_limit,
            retention: Retention::default(),
            events_kept: u64::MAX,
            now_ms: Arc::new(AtomicI64::new(10_000)),
            store: None,
        };
        fixture.open();
        fixture
    }

    fn open(&mut self) {
        let options = Options {
            clock: self.clock(),
            retention: self.retention,
            events_kept: self.events_kept,
            ..Options::new(self.queue_limit)
        };
        self.store = Some((self.open)(self.directory.path(), options).expect("the store opens"));
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

    /// Close the store and open it again, as a new process would.
    pub(crate) async fn reopen(&mut self) {
        self.close().await;
        self.open();
    }

    pub(crate) async fn close(&mut self) {
        if let Some(store) = self.store.take() {
            store.close().await;
        }
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

/// Run a test on each backend, with room for `queue_limit` plans.
pub(crate) async fn on_every_backend(queue_limit: u64, test: impl AsyncFn(&mut Fixture)) {
    for &(name, open) in BACKENDS {
        let mut fixture = Fixture::new(open, queue_limit);
        tokio::time::timeout(PATIENCE, test(&mut fixture))
            .await
            .unwrap_or_else(|_| panic!("{name}: still waiting after {PATIENCE:?}"));
        fixture.close().await;
    }
}
