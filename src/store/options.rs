//! What a store is opened with.

use std::sync::Arc;

use super::clock::{Clock, SteadyClock, wall_clock};
use crate::job::Plan;

/// Called with a plan in its present state.
pub type OnLost = Arc<dyn Fn(&Plan) + Send + Sync>;

/// What a store is opened with.
#[derive(Clone)]
pub struct Options {
    /// How many plans may wait; see [`StoreError::QueueFull`](super::StoreError::QueueFull).
    pub queue_limit: u64,
    /// The clock for claims, tombstones and recovery.
    pub clock: Clock,
    /// What `clock` is, if it is in doubt at times: an opened store tells it how far its records reach, and keeps what it
    /// would expire meanwhile.
    pub steady: Option<Arc<SteadyClock>>,
    /// Where the store's servers have a clock of their own: how far it may be from this one, milliseconds, before nothing is
    /// removed for its age any more, since one of them is wrong; `None` for any distance.
    pub most_apart_ms: Option<i64>,
    /// How long plans are kept.
    pub retention: Retention,
    /// Events kept of each plan; of a longer history the oldest are deleted.
    pub events_kept: u64,
    /// Called with each plan that the store itself ends because its workers, or its document, were lost, once that is
    /// durable: there is no run that could report it.
    pub on_lost: OnLost,
}

impl Options {
    /// For `queue_limit` waiting plans, with no other limit, on the machine's clock.
    #[must_use]
    pub fn new(queue_limit: u64) -> Self {
        Self {
            queue_limit,
            clock: wall_clock(),
            steady: None,
            most_apart_ms: None,
            retention: Retention::default(),
            events_kept: u64::MAX,
            on_lost: Arc::new(|_| {}),
        }
    }

    /// On a clock that is not believed whatever it shows.
    #[must_use]
    pub fn by(self, clock: &Arc<SteadyClock>) -> Self {
        Self {
            clock: clock.clock(),
            steady: Some(Arc::clone(clock)),
            ..self
        }
    }

    /// The newest time among what an opened store has; `None` when it is empty.
    pub(super) fn has_seen(&self, newest_ms: Option<i64>) {
        if let Some((clock, newest_ms)) = self.steady.as_ref().zip(newest_ms) {
            clock.has_seen(newest_ms);
        }
    }

    /// By what time things expire when it is `now_ms`.
    pub(super) fn expiry_ms(&self, now_ms: i64) -> i64 {
        let reached_ms = self.steady.as_ref().and_then(|clock| clock.reached_ms());
        reached_ms.map_or(now_ms, |reached_ms| reached_ms.min(now_ms))
    }
}

/// How long ended plans are kept: until the first of these limits is reached; `None` is no limit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Retention {
    /// Counted from the end of a plan, milliseconds. Sets the plan's `expires_ms` when it ends; later changes of this
    /// setting do not alter it.
    pub age_ms: Option<i64>,
    /// Ended plans kept.
    pub plans: Option<u64>,
    /// Bytes of their documents and events.
    pub bytes: Option<u64>,
}

impl Retention {
    /// The `expires_ms` of a plan that has just ended.
    pub(super) fn expires_ms(self, plan: &Plan) -> Option<i64> {
        let (finished_ms, age_ms) = plan.finished_ms.zip(self.age_ms)?;
        Some(finished_ms.saturating_add(age_ms))
    }
}
