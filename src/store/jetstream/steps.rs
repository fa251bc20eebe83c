//! The only way to change a plan: a step that is written if nobody was faster.

use std::time::Duration;

use async_nats::jetstream::context::{self, PublishErrorKind};
use async_nats::jetstream::message::PublishMessage;
use bytes::Bytes;
use tokio::time::timeout;

use super::connect::Servers;
use super::election::Election;
use super::errors::{failed, found, is_outrun, lacks_room};
use super::leases::Leases;
use super::record::{Placed, Record, State, Step};
use super::view::{Standing, View};
use crate::job::{Event, PlanId};
use crate::store::StoreError;

/// How long servers may take to answer a reader who can do without them.
const AN_ANSWER: Duration = Duration::from_secs(1);

/// The effect of a step on a plan.
pub(super) struct Change {
    /// The new state; the writer assigns the event ids.
    pub(super) state: State,
    /// Events before that of the new state.
    pub(super) events: Vec<Event>,
    /// Whether the new state is an event too, and the end with it.
    pub(super) announced: bool,
}

impl Change {
    /// The plan takes this state, and an event says so.
    pub(super) fn announced(record: Box<Record>) -> Self {
        Self {
            state: State::Kept(record),
            events: Vec::new(),
            announced: true,
        }
    }

    /// The plan takes this state, without an event.
    pub(super) fn silent(state: State) -> Self {
        Self {
            state,
            events: Vec::new(),
            announced: false,
        }
    }
}

/// The plans: on the servers, and as known here.
pub(super) struct Plans<'a> {
    pub(super) servers: &'a Servers,
    pub(super) view: &'a View,
    pub(super) leases: &'a Leases,
}

impl Plans<'_> {
    /// Take in a step, whoever wrote it.
    pub(super) fn learn(&self, id: PlanId, placed: &Placed) {
        if self.view.learn(id, placed) {
            self.leases.heed(id, &placed.step.state);
        }
    }

    /// A plan's state as known here; the servers are asked when it is not.
    pub(super) async fn standing(&self, id: PlanId) -> Result<Standing, StoreError> {
        if let Some(standing) = self.view.standing(id) {
            return Ok(standing);
        }
        self.look_up(id).await
    }

    /// A plan's state on the servers, if it is newer than the `known` one, as soon as it has come here too with all steps
    /// before it: whoever is told of an end shall find all events. Where the servers do not answer in time, what is known
    /// has to do.
    pub(super) async fn renewed(&self, id: PlanId, known: Standing) -> Standing {
        let mut newest = known;
        let renewing = async {
            if let Ok(Some(placed)) = self.ask_for_newest(id).await
                && placed.sequence > newest.sequence
            {
                newest = Standing {
                    sequence: placed.sequence,
                    state: placed.step.state,
                };
                self.view.caught_up(id, placed.sequence).await;
            }
        };
        // Too late is as good as never.
        let _ = timeout(AN_ANSWER, renewing).await;
        newest
    }

    /// A plan's state on the servers.
    pub(super) async fn look_up(&self, id: PlanId) -> Result<Standing, StoreError> {
        let known = self.view.standing(id);
        let Some(newest) = self.newest(id).await? else {
            let known = known.map_or(0, |known| known.sequence);
            self.view.forget_since(id, known);
            return Err(StoreError::NotFound(id));
        };
        self.learn(id, &newest);
        Ok(Standing {
            sequence: newest.sequence,
            state: newest.step.state,
        })
    }

    async fn newest(&self, id: PlanId) -> Result<Option<Placed>, StoreError> {
        self.servers.outlast(|| self.ask_for_newest(id)).await
    }

    async fn ask_for_newest(&self, id: PlanId) -> Result<Option<Placed>, StoreError> {
        let subject = self.servers.subject_of(id);
        let plans = &self.servers.plans;
        let newest = plans.get_last_raw_message_by_subject(&subject).await;
        let newest = found(newest, || format!("plan {id}"))?;
        newest.map(Placed::try_from).transpose()
    }

    /// Write the first step of a plan's life.
    pub(super) async fn begin(&self, id: PlanId, change: Change) -> Result<(), StoreError> {
        let mut change = Some(change);
        let begin = |standing: Option<&Standing>| match (standing, change.take()) {
            (None, Some(change)) => Ok(Some(change)),
            _ => Err(StoreError::unavailable(format!(
                "plan {id} is there already"
            ))),
        };
        self.write(id, None, begin).await.map(drop)
    }

    /// Change a plan as `change` decides from its present state; returns the resulting state. `None` from `change`
    /// leaves it as it is. When another writer was faster, `change` is called again.
    pub(super) async fn change(
        &self,
        id: PlanId,
        mut change: impl FnMut(&Standing) -> Result<Option<Change>, StoreError> + Send,
    ) -> Result<Standing, StoreError> {
        let standing = self.standing(id).await?;
        let written = self
            .write(id, Some(standing), |standing| match standing {
                Some(standing) => change(standing),
                None => Err(StoreError::NotFound(id)),
            })
            .await?;
        written.ok_or(StoreError::NotFound(id))
    }

    async fn write(
        &self,
        id: PlanId,
        mut standing: Option<Standing>,
        mut change: impl FnMut(Option<&Standing>) -> Result<Option<Change>, StoreError> + Send,
    ) -> Result<Option<Standing>, StoreError> {
        let mut election = Election::perhaps();
        loop {
            let Some(change) = change(standing.as_ref())? else {
                return Ok(standing);
            };
            let step = Step::of(change);
            let mark = step.mark;
            let expected = standing.as_ref().map_or(0, |standing| standing.sequence);
            let payload = step.write()?;
            let mut unanswered = None;
            let newest = loop {
                match self.publish(id, expected, payload.clone()).await {
                    Ok(sequence) => break Some(Placed { sequence, step }),
                    Err(PublishError::Outrun) => break self.newest(id).await?,
                    // While it may have been written earlier, nobody may be told that it was refused.
                    Err(PublishError::Hopeless(error)) => return Err(unanswered.unwrap_or(error)),
                    // It may have been written. Written again, it is refused, and recognised by its mark.
                    Err(PublishError::Unanswered(error)) => {
                        if !election.goes_on().await {
                            return Err(error);
                        }
                        unanswered = Some(error);
                    }
                }
            };
            match &newest {
                Some(newest) => self.learn(id, newest),
                // All its steps have been removed: by an operator, or long ago by nodes that this one could not hear.
                None => self.view.forget_since(id, expected),
            }
            let own = newest
                .as_ref()
                .is_some_and(|newest| newest.step.mark == mark);
            standing = newest.map(|newest| Standing {
                sequence: newest.sequence,
                state: newest.step.state,
            });
            if own {
                return Ok(standing);
            }
        }
    }

    async fn publish(&self, id: PlanId, expected: u64, step: Bytes) -> Result<u64, PublishError> {
        let message = PublishMessage::build()
            .payload(step)
            .expected_last_subject_sequence(expected);
        let subject = self.servers.subject_of(id);
        let written = self.servers.publish(subject, message).await;
        written
            .map(|ack| ack.sequence)
            .map_err(|error| PublishError::of(&format!("a step of plan {id}"), &error))
    }
}

#[derive(Debug)]
enum PublishError {
    /// The plan has changed meanwhile.
    Outrun,
    /// It may have been written.
    Unanswered(StoreError),
    /// It is not written, and would not be if it were tried again soon.
    Hopeless(StoreError),
}

impl PublishError {
    fn of(what: &str, error: &context::PublishError) -> Self {
        if is_outrun(error) {
            return Self::Outrun;
        }
        let refusal = failed(what, error);
        if error.kind() == PublishErrorKind::MaxPayloadExceeded || lacks_room(&refusal) {
            Self::Hopeless(refusal)
        } else {
            Self::Unanswered(refusal)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_may_have_been_written_is_tried_again() {
        let of = |kind, said: &str| {
            let source = std::io::Error::other(said.to_owned());
            PublishError::of("a step", &context::PublishError::with_source(kind, source))
        };
        let other = PublishErrorKind::Other;
        assert!(matches!(
            of(other, "wrong last sequence: 7"),
            PublishError::Outrun
        ));
        for said in [
            "insufficient storage resources available",
            "maximum bytes exceeded",
        ] {
            assert!(
                matches!(of(other, said), PublishError::Hopeless(_)),
                "{said}"
            );
        }
        for (kind, said) in [
            (PublishErrorKind::TimedOut, ""),
            (other, "write: no space left on device"),
        ] {
            assert!(
                matches!(of(kind, said), PublishError::Unanswered(_)),
                "{said}"
            );
        }
    }
}
