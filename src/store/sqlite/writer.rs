//! The one thread that writes: it drains its channel into a transaction, commits, and only then
//! answers, so that many callers share one wait for the disk.

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use rusqlite::Connection;
use tokio::sync::{oneshot, watch};

use super::closed;
use super::records::Records;
use super::transaction::{Effect, Transaction};
use super::{operations, removal};
use crate::job::PlanId;
use crate::store::changes::Changes;
use crate::store::{Lease, Options, StoreError};

/// Operations in one transaction, at most.
const BATCH: usize = 256;

/// Runs in the transaction, or learns that there is none; what it returns is called after the commit.
type Operation = Box<dyn FnOnce(Option<&mut Transaction<'_>>) -> Answer + Send>;

/// Told whether the transaction became durable, or why not.
type Answer = Box<dyn FnOnce(Result<(), &StoreError>)>;

type Claimer = oneshot::Sender<Result<Delivery, StoreError>>;

enum Message {
    Change(Operation),
    Claim(Claimer),
    Close(oneshot::Sender<()>),
}

/// The handle to the writing thread.
pub(super) struct Writer {
    messages: Sender<Message>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Writer {
    /// Recover what an earlier process left and start the thread. `lock` is held until its end.
    pub(super) fn start(
        connection: Connection,
        lock: File,
        options: Options,
        changes: Arc<Changes>,
        records: Arc<Records>,
    ) -> Result<Self, StoreError> {
        let (messages, inbox) = channel();
        let mut desk = Desk {
            connection,
            options,
            changes,
            records,
            messages: messages.clone(),
            waiting: VecDeque::new(),
            leases: HashMap::new(),
            queued: 0,
        };
        desk.recover()?;
        let thread = std::thread::Builder::new()
            .name("store-writer".to_owned())
            .spawn(move || {
                let closing = desk.serve(&inbox);
                desk.connection.close().ok();
                drop(lock);
                if let Some(closing) = closing {
                    closing.send(()).ok();
                }
            })
            .map_err(|error| {
                StoreError::unavailable(format!("no thread for the writer: {error}"))
            })?;
        Ok(Self {
            messages,
            thread: Mutex::new(Some(thread)),
        })
    }

    /// Do `work` in the next transaction and wait until it is durable.
    pub(super) async fn change<T, W>(&self, work: W) -> Result<T, StoreError>
    where
        T: Send + 'static,
        W: FnOnce(&mut Transaction<'_>) -> Result<T, StoreError> + Send + 'static,
    {
        let (reply, answer) = oneshot::channel();
        self.send(Message::Change(Box::new(move |tx| {
            let done = tx.map_or_else(|| Err(closed()), |tx| tx.savepoint(work));
            Box::new(move |durable| {
                let outcome = match durable {
                    Ok(()) => done,
                    Err(error) => Err(error.clone()),
                };
                // Nobody waits when the caller was dropped; the change stands all the same.
                reply.send(outcome).ok();
            })
        })))?;
        answer.await.map_err(|_| closed())?
    }

    /// Wait for a plan to run.
    pub(super) async fn claim(&self) -> Result<Lease, StoreError> {
        let (reply, answer) = oneshot::channel();
        self.send(Message::Claim(reply))?;
        let delivery = answer.await.map_err(|_| closed())??;
        Ok(delivery.accept())
    }

    /// Write what has been sent, and end.
    pub(super) async fn close(&self) {
        let (reply, done) = oneshot::channel();
        if self.send(Message::Close(reply)).is_ok() {
            done.await.ok();
        }
    }

    fn send(&self, message: Message) -> Result<(), StoreError> {
        self.messages.send(message).map_err(|_| closed())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        let (reply, _) = oneshot::channel();
        self.send(Message::Close(reply)).ok();
        let thread = self
            .thread
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(thread) = thread {
            // Its panic, if any, has been reported by the panic hook.
            thread.join().ok();
        }
    }
}

/// A lease on its way to a claimer. If nobody takes it out, its plan goes back to the queue.
struct Delivery {
    lease: Option<Lease>,
    messages: Sender<Message>,
}

impl Delivery {
    fn accept(mut self) -> Lease {
        self.lease.take().expect("a lease is taken out once")
    }
}

impl Drop for Delivery {
    fn drop(&mut self) {
        let Some(lease) = self.lease.take() else {
            return;
        };
        let (id, attempt) = (lease.plan.id, lease.attempt);
        let give_back: Operation = Box::new(move |tx| {
            let done = tx.map_or_else(
                || Err(closed()),
                |tx| tx.savepoint(|tx| operations::release(tx, id, attempt)),
            );
            Box::new(move |durable| {
                // A plan that was deleted meanwhile is nobody's loss.
                if let Err(error) = done.and(durable.map_err(StoreError::clone))
                    && !matches!(error, StoreError::LeaseLost(_))
                {
                    tracing::error!(plan_id = %id, %error, "an undelivered plan stays claimed until the next start");
                }
            })
        });
        self.messages.send(Message::Change(give_back)).ok();
    }
}

/// What the thread has in front of it.
struct Desk {
    connection: Connection,
    options: Options,
    changes: Arc<Changes>,
    records: Arc<Records>,
    messages: Sender<Message>,
    /// Claimers, in the order in which they came.
    waiting: VecDeque<Claimer>,
    /// How each running plan's worker is told to stop.
    leases: HashMap<PlanId, watch::Sender<bool>>,
    /// Plans queued, as committed.
    queued: u64,
}

impl Desk {
    fn recover(&mut self) -> Result<(), StoreError> {
        self.queued = self
            .connection
            .query_row(
                "SELECT count(*) FROM plans WHERE status = 'queued'",
                [],
                |row| row.get::<_, i64>(0),
            )?
            .cast_unsigned();
        let now_ms = (self.options.clock)();
        self.commit(|tx, _| {
            tx.savepoint(|tx| {
                removal::bury_for_good(tx, now_ms)?;
                operations::recover(tx)
            })
        })?
    }

    /// Serve until somebody closes the store; returns whom to tell.
    fn serve(&mut self, inbox: &Receiver<Message>) -> Option<oneshot::Sender<()>> {
        loop {
            let first = inbox.recv().ok()?;
            let mut batch = Vec::new();
            let mut closing = None;
            for message in std::iter::once(first).chain(inbox.try_iter().take(BATCH - 1)) {
                match message {
                    Message::Change(operation) => batch.push(operation),
                    Message::Claim(claimer) => self.waiting.push_back(claimer),
                    Message::Close(done) => closing = Some(done),
                }
            }
            if closing.is_some() {
                self.waiting.clear();
            }
            self.serve_batch(batch);
            if closing.is_some() {
                return closing;
            }
        }
    }

    fn serve_batch(&mut self, batch: Vec<Operation>) {
        self.waiting.retain(|claimer| !claimer.is_closed());
        if batch.is_empty() && (self.queued == 0 || self.waiting.is_empty()) {
            return;
        }
        let mut batch = batch.into_iter();
        let mut answers = Vec::new();
        let mut claims = Vec::new();
        let durable = self.commit(|tx, waiting| {
            answers.extend(batch.by_ref().map(|operation| operation(Some(&mut *tx))));
            while tx.queued > 0
                && let Some(claimer) = waiting.pop_front()
            {
                claims.push((claimer, tx.savepoint(operations::claim)));
            }
        });
        if let Err(error) = &durable {
            tracing::error!(%error, operations = answers.len() + batch.len(), "a write failed");
        }
        // Whatever did not get its transaction is told so.
        answers.extend(batch.map(|operation| operation(None)));
        for answer in answers {
            answer(durable.as_ref().copied());
        }
        for (claimer, claim) in claims {
            self.answer_claim(claimer, claim, durable.as_ref().copied());
        }
    }

    fn answer_claim(
        &mut self,
        claimer: Claimer,
        claim: Result<Option<Lease>, StoreError>,
        durable: Result<(), &StoreError>,
    ) {
        let answer = match (durable, claim) {
            (Ok(()), Ok(None)) => {
                self.waiting.push_back(claimer);
                return;
            }
            (Ok(()), Ok(Some(lease))) => Ok(Delivery {
                lease: Some(lease),
                messages: self.messages.clone(),
            }),
            (Ok(()), Err(error)) => Err(error),
            (Err(error), _) => Err(error.clone()),
        };
        // What cannot be delivered goes back to the queue when it is dropped.
        drop(claimer.send(answer));
    }

    /// Run `work` in a transaction, make it durable, and tell whom it concerns.
    fn commit<T>(
        &mut self,
        work: impl FnOnce(&mut Transaction<'_>, &mut VecDeque<Claimer>) -> T,
    ) -> Result<T, StoreError> {
        self.connection
            .prepare_cached("BEGIN IMMEDIATE")?
            .execute([])?;
        let mut tx = Transaction {
            connection: &self.connection,
            options: &self.options,
            queued: self.queued,
            effects: Vec::new(),
            lost: None,
        };
        let result = work(&mut tx, &mut self.waiting);
        let changed = tx.effects.iter().filter_map(|effect| match effect {
            Effect::Changed(id) => Some(*id),
            _ => None,
        });
        self.records.begin(changed);
        let committed = tx.still_open().and_then(|()| {
            tx.connection.prepare_cached("COMMIT")?.execute([])?;
            Ok(())
        });
        self.records.end();
        if let Err(error) = committed {
            if !tx.connection.is_autocommit() {
                tx.connection.execute_batch("ROLLBACK")?;
            }
            return Err(error);
        }
        self.queued = tx.queued;
        let effects = tx.effects;
        self.tell(effects);
        Ok(result)
    }

    fn tell(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Changed(id) => self.changes.tick(id),
                Effect::Leased(id, cancel) => {
                    self.leases.insert(id, cancel);
                }
                Effect::Stop(id) => {
                    if let Some(cancel) = self.leases.get(&id) {
                        cancel.send_replace(true);
                    }
                }
                Effect::Unleased(id) => {
                    self.leases.remove(&id);
                }
            }
        }
    }
}
