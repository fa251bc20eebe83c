//! A store that is opened as soon as it can be, and again when it turns out to be damaged, or not to be there any more.
//!
//! A service whose store cannot be opened does not exit: whatever restarts it would only do so for ever. It answers,
//! says that it is not ready and why, and accepts plans once the cause is gone.

use std::sync::{Arc, Weak};
use std::time::Duration;

use async_trait::async_trait;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::timeout;

use super::{
    DatasetUse, End, EventPage, Lease, ListQuery, Stats, Store, StoreError, Submitted, Trouble,
    Webhook,
};
use crate::export::document::Incumbent;
use crate::job::{Event, Idempotency, Owner, Plan, PlanId, Submission};

/// Opens the store; `true` asks it to look for damage first. May block.
pub type Open = Arc<dyn Fn(bool) -> Result<Arc<dyn Store>, StoreError> + Send + Sync>;

/// Pause between attempts to open it.
const PAUSE: Duration = Duration::from_secs(1);

/// How long the start waits for the first attempt, which usually succeeds at once.
const FIRST: Duration = Duration::from_secs(5);

/// Its state: open, or why not.
type State = Result<Arc<dyn Store>, StoreError>;

/// See the module's documentation.
pub struct Reopening {
    state: watch::Receiver<State>,
    /// Which store was found to be damaged or missing.
    lost: watch::Sender<Option<Lost>>,
    opener: JoinHandle<()>,
}

/// A store that is of no use until it is opened again.
#[derive(Clone)]
struct Lost {
    /// Kept alive by nothing but its use: who follows its plans learns that it is gone when it is dropped.
    store: Weak<dyn Store>,
    trouble: Trouble,
    detail: String,
}

impl Reopening {
    /// Try to open it, and go on trying. Returns after the first attempt, or while that is taking long.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    pub async fn start(open: Open) -> Self {
        Self::start_within(open, FIRST).await
    }

    async fn start_within(open: Open, patience: Duration) -> Self {
        let (lost, reports) = watch::channel(None);
        let (opened, state) =
            watch::channel(Err(StoreError::unavailable("the store is being opened")));
        let opener = tokio::spawn(keep_open(open, opened, reports));
        let mut first = state.clone();
        let reopening = Self {
            state,
            lost,
            opener,
        };
        if timeout(patience, first.changed()).await.is_err() {
            tracing::warn!("opening the store takes long; the service begins without it");
        }
        reopening
    }

    fn store(&self) -> State {
        self.state.borrow().clone()
    }

    /// Wait until the store is open.
    async fn opened(&self) -> State {
        let mut state = self.state.clone();
        let opened = state.wait_for(Result::is_ok).await;
        opened.map_err(|_| StoreError::closed())?.clone()
    }

    /// Pass an answer on, and have the store reopened when the answer says that it is damaged or missing.
    fn heed<T>(
        &self,
        store: &Arc<dyn Store>,
        answer: Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        if let Err(StoreError::Unavailable {
            trouble: trouble @ (Trouble::Damaged | Trouble::Vanished),
            detail,
        }) = &answer
        {
            self.lost.send_replace(Some(Lost {
                store: Arc::downgrade(store),
                trouble: *trouble,
                detail: detail.clone(),
            }));
        }
        answer
    }
}

impl Drop for Reopening {
    fn drop(&mut self) {
        self.opener.abort();
    }
}

async fn try_to_open(open: &Open, suspicious: bool) -> State {
    let open = Arc::clone(open);
    tokio::task::spawn_blocking(move || open(suspicious))
        .await
        .unwrap_or_else(|broken| {
            Err(StoreError::unavailable(format!(
                "opening the store broke: {broken}"
            )))
        })
}

async fn keep_open(
    open: Open,
    state: watch::Sender<State>,
    mut reports: watch::Receiver<Option<Lost>>,
) {
    let mut suspicious = false;
    let mut opened = try_to_open(&open, suspicious).await;
    if let Err(error) = &opened {
        tracing::error!(%error, "the store cannot be opened; trying again every second");
    }
    loop {
        suspicious &= opened.is_err();
        drop(state.send_replace(opened.clone()));
        if let Ok(store) = opened {
            let Some(lost) = report_of(&store, &mut reports).await else {
                return;
            };
            let detail = if lost.trouble == Trouble::Damaged {
                tracing::error!("the store is damaged; it is opened again once it is sound");
                suspicious = true;
                "damage was found; the file is being checked".to_owned()
            } else {
                tracing::error!(
                    detail = lost.detail,
                    "the store has lost what it kept; what is missing is made again, empty"
                );
                lost.detail
            };
            let reopening = Err(StoreError::Unavailable {
                trouble: lost.trouble,
                detail,
            });
            drop(state.send_replace(reopening));
            store.close().await;
        } else {
            tokio::time::sleep(PAUSE).await;
        }
        opened = try_to_open(&open, suspicious).await;
    }
}

/// Wait until this store is reported as damaged or missing; `None` when nobody is left to report it.
async fn report_of(
    store: &Arc<dyn Store>,
    reports: &mut watch::Receiver<Option<Lost>>,
) -> Option<Lost> {
    // A late report about a store that has since been replaced is ignored.
    let store = Arc::downgrade(store);
    let this = |reported: &Option<Lost>| {
        let reported = reported.as_ref();
        reported.is_some_and(|lost| Weak::ptr_eq(&lost.store, &store))
    };
    reports.wait_for(this).await.ok()?.clone()
}

#[async_trait]
impl Store for Reopening {
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.submit(submission).await)
    }

    async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.repeated(owner, idempotency).await)
    }

    /// Also waits for the store to be open.
    async fn claim(&self) -> Result<Lease, StoreError> {
        let store = self.opened().await?;
        self.heed(&store, store.claim().await)
    }

    async fn claim_early(&self) -> Result<Lease, StoreError> {
        let store = self.opened().await?;
        self.heed(&store, store.claim_early().await)
    }

    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError> {
        let store = self.store()?;
        self.heed(&store, store.append(lease, events).await)
    }

    async fn finish(&self, lease: &Lease, end: Arc<End>) -> Result<Plan, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.finish(lease, end).await)
    }

    async fn release(&self, lease: &Lease) -> Result<Plan, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.release(lease).await)
    }

    async fn postpone(&self, lease: &Lease) -> Result<Plan, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.postpone(lease).await)
    }

    async fn request_cancel_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.request_cancel_if(id, revision, now_ms).await)
    }

    async fn delete_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError> {
        let store = self.store()?;
        self.heed(&store, store.delete_if(id, revision, now_ms).await)
    }

    async fn get(&self, id: PlanId) -> Result<Plan, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.get(id).await)
    }

    async fn scenario(&self, id: PlanId) -> Result<String, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.scenario(id).await)
    }

    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.result(id).await)
    }

    async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.incumbent(id).await)
    }

    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.list(query).await)
    }

    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<EventPage, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.events(id, after, limit).await)
    }

    async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.has_event(id, event).await)
    }

    /// While it is not open, the sender is gone: a waiting reader reads again, and learns why.
    fn changes(&self, id: PlanId) -> watch::Receiver<u64> {
        self.store()
            .map_or_else(|_| watch::channel(0).1, |store| store.changes(id))
    }

    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.sweep(now_ms).await)
    }

    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.due_webhooks(now_ms, limit).await)
    }

    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError> {
        let store = self.store()?;
        self.heed(&store, store.webhook_tried(id, next_ms).await)
    }

    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.datasets_in_use().await)
    }

    async fn all_datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.all_datasets_in_use().await)
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        let store = self.store()?;
        self.heed(&store, store.stats().await)
    }

    async fn health(&self) -> Result<(), StoreError> {
        let store = self.store()?;
        self.heed(&store, store.health().await)
    }

    fn warning(&self) -> Option<String> {
        self.store().ok()?.warning()
    }

    async fn close(&self) {
        self.opener.abort();
        if let Ok(store) = self.store() {
            store.close().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use parking_lot::Mutex;

    use super::*;

    #[tokio::test]
    async fn the_start_does_not_wait_for_a_store_that_does_not_answer() {
        let (answer, answers) = channel::<()>();
        let answers = Mutex::new(answers);
        let open: Open = Arc::new(move |_| {
            answers.lock().recv().ok();
            Err(StoreError::unavailable("it answers at last"))
        });
        let store = Reopening::start_within(open, Duration::from_millis(1)).await;
        let said = store.health().await.expect_err("it is not open");
        assert_eq!(
            said.to_string(),
            "store unavailable: the store is being opened"
        );
        let mut state = store.state.clone();
        state.mark_unchanged();
        answer.send(()).expect("it waits");
        state.changed().await.expect("it goes on trying");
        let said = store.health().await.expect_err("it is not open");
        assert_eq!(said.to_string(), "store unavailable: it answers at last");
    }
}
