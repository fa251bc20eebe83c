//! Plans on their way to the workers that claimed them: chosen in the writer's transaction, handed out before or after
//! its commit, and put back in the queue when nobody takes them.

use std::collections::VecDeque;
use std::sync::mpsc::Sender;

use tokio::sync::oneshot;

use super::operations;
use super::transaction::Transaction;
use super::writer::{Message, operation};
use crate::store::{Lease, StoreError};

/// When a claimer is given its lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum When {
    /// As soon as its plan is chosen; the commit may still fail. After one that did, only after the commit, until a
    /// claim has been committed.
    Chosen,
    /// After the commit.
    Durable,
}

/// A caller waiting for a plan to run.
pub(super) struct Claimer {
    pub(super) when: When,
    pub(super) reply: oneshot::Sender<Result<Delivery, StoreError>>,
}

/// The claims of one transaction.
pub(super) struct Claims {
    messages: Sender<Message>,
    /// To be answered after the commit.
    held: Vec<(Claimer, Result<Lease, StoreError>)>,
    /// Whether the transaction may contain changes made by a claim.
    pub(super) any: bool,
    /// The greatest attempt whose lease was handed out before the commit.
    pub(super) early_attempt: u64,
    /// Whether a plan was chosen for anybody.
    pub(super) granted: bool,
    /// Whether those who want their lease before the commit get it then.
    early: bool,
}

impl Claims {
    pub(super) fn new(messages: Sender<Message>, early: bool) -> Self {
        Self {
            messages,
            held: Vec::new(),
            any: false,
            early_attempt: 0,
            granted: false,
            early,
        }
    }

    /// Choose a plan for each waiting claimer, while there are any.
    pub(super) fn serve(&mut self, tx: &mut Transaction<'_>, waiting: &mut VecDeque<Claimer>) {
        while tx.queued > 0
            && tx.sound().is_ok()
            && let Some(claimer) = waiting.pop_front()
        {
            self.any = true;
            match tx.step(operations::claim) {
                Ok(None) => {
                    waiting.push_front(claimer);
                    return;
                }
                Ok(Some(lease)) => self.grant(claimer, lease),
                Err(error) => self.held.push((claimer, Err(error))),
            }
        }
    }

    fn grant(&mut self, claimer: Claimer, lease: Lease) {
        self.granted = true;
        if self.early && claimer.when == When::Chosen {
            self.early_attempt = self.early_attempt.max(lease.attempt);
            self.send(claimer, Ok(lease));
        } else {
            self.held.push((claimer, Ok(lease)));
        }
    }

    /// The commit is done, or has failed.
    pub(super) fn answer(mut self, durable: Result<(), &StoreError>) {
        for (claimer, claim) in std::mem::take(&mut self.held) {
            self.send(claimer, durable.map_err(StoreError::clone).and(claim));
        }
    }

    /// A claim that cannot be delivered goes back to the queue when it is dropped.
    fn send(&self, claimer: Claimer, claim: Result<Lease, StoreError>) {
        let delivery = claim.map(|lease| Delivery {
            lease: Some(lease),
            messages: self.messages.clone(),
        });
        drop(claimer.reply.send(delivery));
    }
}

/// A lease on its way to a claimer. If nobody takes it out, its plan goes back to the queue.
pub(super) struct Delivery {
    lease: Option<Lease>,
    messages: Sender<Message>,
}

impl Delivery {
    pub(super) fn accept(mut self) -> Lease {
        self.lease.take().expect("a lease is taken out once")
    }
}

impl Drop for Delivery {
    fn drop(&mut self) {
        let Some(lease) = self.lease.take() else {
            return;
        };
        let (id, attempt) = (lease.plan.id, lease.attempt);
        let give_back = operation(
            move |tx| operations::release(tx, id, attempt),
            move |released| {
                // If the plan was deleted meanwhile, there is nothing to give back.
                if let Err(error) = released
                    && !matches!(error, StoreError::LeaseLost(_))
                {
                    tracing::error!(plan_id = %id, %error, "an undelivered plan stays claimed until the next start");
                }
            },
        );
        self.messages.send(Message::Change(give_back)).ok();
    }
}
