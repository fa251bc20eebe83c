//! The one thread that writes: it drains its channel into a transaction, commits, and only then
//! answers, so that many callers share one wait for the disk. (What is claimed early is handed out before.)

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use parking_lot::Mutex;
use rusqlite::Connection;
use tokio::runtime::Handle;
use tokio::sync::{oneshot, watch};

use super::claims::{Claimer, Claims, When};
use super::opening::Place;
use super::postponed::Postponed;
use super::records::Records;
use super::transaction::{Effect, Transaction};
use super::{operations, removal};
use crate::job::PlanId;
use crate::store::changes::Changes;
use crate::store::{Lease, Options, StoreError, Trouble};

/// Operations in one transaction, at most.
const BATCH: usize = 256;

/// Work done in a transaction, and answered after its commit.
pub(super) trait Operation: Send {
    /// Do it; called again when the transaction was rolled back.
    fn run(&mut self, tx: &mut Transaction<'_>);

    /// The last run is durable, or has failed.
    fn answer(self: Box<Self>, durable: Result<(), &StoreError>);
}

/// A store operation, and who gets its outcome.
struct Change<T, W, A> {
    work: W,
    done: Result<T, StoreError>,
    answer: A,
}

/// `work`, whose outcome is passed to `answer` once it is durable.
pub(super) fn operation<T, W, A>(work: W, answer: A) -> Box<dyn Operation>
where
    T: Send + 'static,
    W: Fn(&mut Transaction<'_>) -> Result<T, StoreError> + Send + 'static,
    A: FnOnce(Result<T, StoreError>) + Send + 'static,
{
    Box::new(Change {
        work,
        done: Err(StoreError::closed()),
        answer,
    })
}

impl<T, W, A> Operation for Change<T, W, A>
where
    T: Send,
    W: Fn(&mut Transaction<'_>) -> Result<T, StoreError> + Send,
    A: FnOnce(Result<T, StoreError>) + Send,
{
    fn run(&mut self, tx: &mut Transaction<'_>) {
        self.done = tx.step(&self.work);
    }

    fn answer(self: Box<Self>, durable: Result<(), &StoreError>) {
        let outcome = match durable {
            Ok(()) => self.done,
            Err(error) => Err(error.clone()),
        };
        (self.answer)(outcome);
    }
}

/// Messages to the thread.
pub(super) enum Message {
    Change(Box<dyn Operation>),
    Claim(Claimer),
    /// Give back everything that is being run, and end.
    Close(oneshot::Sender<()>),
    /// End as if the process had died.
    Leave,
}

/// The handle to the writing thread.
pub(super) struct Writer {
    messages: Sender<Message>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Writer {
    /// Recover what an earlier process left and start the thread, which holds `lock` until it ends.
    pub(super) fn start(
        (connection, place): (Connection, Arc<Place>),
        lock: File,
        options: Options,
        changes: Arc<Changes>,
        records: Arc<Records>,
    ) -> Result<Self, StoreError> {
        let (messages, inbox) = channel();
        let mut desk = Desk {
            connection,
            place,
            options,
            changes,
            records,
            messages: messages.clone(),
            runtime: Handle::try_current().ok(),
            waiting: VecDeque::new(),
            leases: HashMap::new(),
            postponed: Postponed::default(),
            queued: 0,
            void_attempt: 0,
            claims_fail: false,
            found_full: false,
            recovered: false,
        };
        if let Err(error) = desk.recover() {
            if !is_full(&error) {
                return Err(error);
            }
            // What can be read can be read meanwhile.
            tracing::warn!(%error, "what was being run is not given back yet");
        }
        let thread = std::thread::Builder::new()
            .name("store-writer".to_owned())
            .spawn(move || {
                let closing = desk.serve(&inbox);
                desk.connection.close().ok();
                drop(lock);
                for closed in closing {
                    closed.send(()).ok();
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
        W: Fn(&mut Transaction<'_>) -> Result<T, StoreError> + Send + 'static,
    {
        let (reply, answer) = oneshot::channel();
        self.send(Message::Change(operation(work, move |outcome| {
            // If the caller was dropped, nobody waits; the change stands all the same.
            reply.send(outcome).ok();
        })))?;
        answer.await.map_err(|_| StoreError::closed())?
    }

    /// Wait for a plan to run.
    pub(super) async fn claim(&self, when: When) -> Result<Lease, StoreError> {
        let (reply, answer) = oneshot::channel();
        self.send(Message::Claim(Claimer { when, reply }))?;
        let delivery = answer.await.map_err(|_| StoreError::closed())??;
        Ok(delivery.accept())
    }

    /// Write what has been sent, give back what is being run, and end.
    pub(super) async fn close(&self) {
        let (reply, done) = oneshot::channel();
        if self.send(Message::Close(reply)).is_ok() {
            done.await.ok();
        }
    }

    fn send(&self, message: Message) -> Result<(), StoreError> {
        self.messages
            .send(message)
            .map_err(|_| StoreError::closed())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.send(Message::Leave).ok();
        let thread = self.thread.lock().take();
        if let Some(thread) = thread {
            // Its panic, if any, has been reported by the panic hook.
            thread.join().ok();
        }
    }
}

/// The state of the writing thread.
struct Desk {
    connection: Connection,
    place: Arc<Place>,
    options: Options,
    changes: Arc<Changes>,
    records: Arc<Records>,
    messages: Sender<Message>,
    /// The runtime of the callers; `None` when the store was opened outside one.
    runtime: Option<Handle>,
    /// Claimers, in order of arrival.
    waiting: VecDeque<Claimer>,
    /// How each running plan's worker is told to stop.
    leases: HashMap<PlanId, watch::Sender<bool>>,
    /// Plans that go after the others.
    postponed: Postponed,
    /// Plans queued, as committed.
    queued: u64,
    /// The greatest attempt whose lease was handed out but whose claim was not committed.
    void_attempt: u64,
    /// A claim whose lease was handed out was not committed, and none has been since.
    claims_fail: bool,
    /// The disk was found full, and nothing as large as a plan has been written since.
    found_full: bool,
    /// What an earlier process left has been recovered, without which nothing else is written.
    recovered: bool,
}

fn is_full(error: &StoreError) -> bool {
    matches!(
        error,
        StoreError::Unavailable {
            trouble: Trouble::Full,
            ..
        }
    )
}

impl Desk {
    fn recover(&mut self) -> Result<(), StoreError> {
        if self.recovered {
            return Ok(());
        }
        self.queued = self
            .connection
            .query_row(
                "SELECT count(*) FROM plans WHERE status = 'queued'",
                [],
                |row| row.get::<_, i64>(0),
            )?
            .cast_unsigned();
        let ended = self.commit(|tx, _| {
            tx.step(|tx| {
                removal::bury_for_good(tx, tx.expiry_ms())?;
                operations::recover(tx)
            })
        })??;
        for plan in &ended {
            (self.options.on_lost)(plan);
        }
        self.recovered = true;
        Ok(())
    }

    /// Serve until the store is closed or dropped; returns whom to notify.
    fn serve(&mut self, inbox: &Receiver<Message>) -> Vec<oneshot::Sender<()>> {
        let mut closing = Vec::new();
        while let Ok(first) = inbox.recv() {
            let mut batch = Vec::new();
            let mut ends = false;
            for message in std::iter::once(first).chain(inbox.try_iter().take(BATCH - 1)) {
                match message {
                    Message::Change(operation) => batch.push(operation),
                    Message::Claim(claimer) => self.waiting.push_back(claimer),
                    Message::Close(done) => closing.push(done),
                    Message::Leave => ends = true,
                }
            }
            ends |= !closing.is_empty();
            if ends {
                self.waiting.clear();
            }
            self.serve_batch(batch);
            if ends {
                break;
            }
        }
        if !closing.is_empty() && !self.leases.is_empty() {
            self.release_all();
        }
        closing
    }

    /// Plans that cannot be given back now are recovered at the next start, as if the process had died.
    fn release_all(&mut self) {
        let released = self.commit(|tx, _| tx.step(operations::release_all));
        if let Err(error) = released.flatten() {
            tracing::debug!(%error, "runs are left to the next start");
        }
    }

    fn serve_batch(&mut self, batch: Vec<Box<dyn Operation>>) {
        self.waiting.retain(|claimer| !claimer.reply.is_closed());
        if batch.is_empty() && (self.queued == 0 || self.waiting.is_empty()) {
            return;
        }
        match self.recover() {
            Ok(()) => self.write(batch, true),
            Err(error) => self.refuse(batch, error),
        }
    }

    fn refuse(&mut self, batch: Vec<Box<dyn Operation>>, error: StoreError) {
        for claimer in self.waiting.drain(..) {
            claimer.reply.send(Err(error.clone())).ok();
        }
        self.answer(batch, Err(error));
    }

    /// Do a batch in one transaction, and the waiting claims too if `claiming`.
    fn write(&mut self, mut batch: Vec<Box<dyn Operation>>, claiming: bool) {
        let mut claims = Claims::new(self.messages.clone(), !self.claims_fail);
        let mut spoiled = false;
        let durable = self.commit(|tx, waiting| {
            // A claimer that can be given a plan now need not wait until everything else is written.
            if claiming {
                claims.serve(tx, waiting);
            }
            for operation in &mut batch {
                operation.run(tx);
            }
            if claiming {
                claims.serve(tx, waiting);
            }
            spoiled = tx.sound().is_err();
        });
        self.learn(&claims, durable.is_ok());
        let any_claimed = claims.any;
        claims.answer(durable.as_ref().copied());
        if durable.is_err() && any_claimed && !batch.is_empty() {
            // A claim's failure must not fail the operations that shared its transaction.
            self.write(batch, false);
            // Claimers not yet served wait for a plan, not for the next message.
            self.serve_batch(Vec::new());
            return;
        }
        if spoiled && batch.len() > 1 {
            // One operation's failure must not fail the others.
            for operation in batch {
                self.serve_batch(vec![operation]);
            }
            return;
        }
        if let Err(error) = &durable {
            tracing::error!(%error, operations = batch.len(), "a write failed");
        }
        self.answer(batch, durable);
    }

    /// While claims fail, none is answered early: its plan would be run in vain, over and over, and whoever claims
    /// would not learn that there is reason to pause. Other commits do not show that claims succeed: some write nothing.
    fn learn(&mut self, claims: &Claims, committed: bool) {
        if !committed {
            self.void_attempt = self.void_attempt.max(claims.early_attempt);
            self.claims_fail |= claims.early_attempt > 0;
        } else if claims.granted {
            self.claims_fail = false;
        }
    }

    /// Waking a task from outside the runtime costs a system call each; one spawned task wakes them all.
    fn answer(&self, batch: Vec<Box<dyn Operation>>, durable: Result<(), StoreError>) {
        let is_one = batch.len() == 1;
        let answer = move || {
            for operation in batch {
                operation.answer(durable.as_ref().copied());
            }
        };
        match &self.runtime {
            Some(runtime) if !is_one => drop(runtime.spawn(async { answer() })),
            _ => answer(),
        }
    }

    /// Run `work` in a transaction, make it durable, and notify those concerned.
    fn commit<T>(
        &mut self,
        work: impl FnOnce(&mut Transaction<'_>, &mut VecDeque<Claimer>) -> T,
    ) -> Result<T, StoreError> {
        let committed = self.try_to_commit(work);
        self.found_full |= committed.as_ref().is_err_and(is_full);
        committed
    }

    fn try_to_commit<T>(
        &mut self,
        work: impl FnOnce(&mut Transaction<'_>, &mut VecDeque<Claimer>) -> T,
    ) -> Result<T, StoreError> {
        self.place.check()?;
        self.connection
            .prepare_cached("BEGIN IMMEDIATE")?
            .execute([])?;
        let mut tx = Transaction {
            connection: &self.connection,
            options: &self.options,
            postponed: &mut self.postponed,
            queued: self.queued,
            void_attempt: self.void_attempt,
            effects: Vec::new(),
            spoiled: None,
            found_full: self.found_full,
        };
        let result = work(&mut tx, &mut self.waiting);
        let changed = tx.effects.iter().filter_map(|effect| match effect {
            Effect::Changed(id) => Some(*id),
            _ => None,
        });
        self.records.begin(changed);
        let committed = tx.sound().and_then(|()| {
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
        self.found_full = tx.found_full;
        let effects = tx.effects;
        self.carry_out(effects);
        Ok(result)
    }

    fn carry_out(&mut self, effects: Vec<Effect>) {
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
                Effect::Ended(plan) => (self.options.on_lost)(&plan),
            }
        }
    }
}
