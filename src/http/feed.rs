//! A plan's events as they come: first from the store's pages, then as the store ticks.
//!
//! Nothing is buffered beyond one page: a reader that does not read costs no memory, because the events stay in the
//! store.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::Instant;

use super::Phase;
use super::phase::stopping;
use super::throttle::Throttle;
use crate::job::{Event, NumberedEvent, PlanId, Status};
use crate::store::{LastEvent, Store, StoreError};

/// Events read at once, at most.
const PAGE: usize = 128;

/// Events read first, since they may be long: not many more than are given out at once.
const FIRST_PAGE: usize = 8;

/// About so many bytes of them are given out at once, or one event: whoever takes nothing holds this much memory.
const PAGE_BYTES: usize = 32 * 1024;

/// About so many events are read when the service stops, at most: enough for what the last runs report in their last
/// moments, including their end, and no more, so that nobody holds up the exit.
const LAST_EVENTS: usize = 2_048;

/// How much later than it happened an event of a run may be read: it is stored together with others.
const LATE: Duration = Duration::from_millis(100);

/// A comment is due when nothing has been sent to the reader for this long.
const SILENCE: Duration = Duration::from_secs(15);

/// What a reader gets next.
#[derive(Debug)]
pub(super) enum News {
    /// One or more events; after the `end` nothing follows.
    Events(Vec<NumberedEvent>),
    /// The store no longer keeps the events `from` to `to`.
    Gap {
        /// The first missing event.
        from: u64,
        /// The last missing event.
        to: u64,
    },
    /// Nothing has happened for a while.
    Silence,
    /// The service is stopping, after these events; the reader may resume with the next process.
    Stopping(Vec<NumberedEvent>),
}

/// One reader's place in a plan's events.
pub(super) struct Feed {
    store: Arc<dyn Store>,
    id: PlanId,
    /// The last event read.
    after: u64,
    throttle: Throttle,
    changes: watch::Receiver<u64>,
    phase: watch::Receiver<Phase>,
    /// Since when the throttle has been holding something back that it may release.
    held_since: Option<Instant>,
    /// When something was last sent to the reader.
    last_sent: Instant,
    /// Whether the reader has been given everything that the store had when last read.
    caught_up: bool,
    /// Whether it began at the first event and has not reached the newest.
    is_new: bool,
    /// Events to ask the store for: twice as many as could be given out last, since long ones would be read again and
    /// again.
    page: usize,
    /// Events that may still be read once the service stops.
    last_events: usize,
    over: bool,
}

impl Feed {
    /// The feed of a plan that has reached at least the event `after`.
    pub(super) fn new(
        store: Arc<dyn Store>,
        phase: watch::Receiver<Phase>,
        id: PlanId,
        after: u64,
        rate_hz: f64,
    ) -> Self {
        Self {
            // Subscribed before the first read, so that nothing is missed.
            changes: store.changes(id),
            store,
            id,
            after,
            is_new: after == 0,
            throttle: Throttle::new(rate_hz),
            phase,
            held_since: None,
            last_sent: Instant::now(),
            caught_up: false,
            page: FIRST_PAGE,
            last_events: LAST_EVENTS,
            over: false,
        }
    }

    pub(super) fn plan_id(&self) -> PlanId {
        self.id
    }

    /// Wait for what comes next; `None` after the end and after [`News::Stopping`].
    pub(super) async fn next(&mut self) -> Option<News> {
        let news = self.wait_for_next().await;
        self.last_sent = Instant::now();
        news
    }

    async fn wait_for_next(&mut self) -> Option<News> {
        while !self.over {
            // Read before the store: what is stored by then will still be read.
            let stopping = *self.phase.borrow() == Phase::Stopping;
            self.changes.mark_unchanged();
            let events = match self.read().await {
                Ok(events) => events,
                Err(instead) => return instead,
            };
            let (count, mut out) = (events.len(), Vec::new());
            self.take(events, &mut out);
            if stopping && self.leaves_after(count) {
                return Some(News::Stopping(out));
            }
            if !out.is_empty() {
                return Some(News::Events(out));
            }
            if count == 0
                && let Some(news) = self.wait().await
            {
                return Some(news);
            }
        }
        None
    }

    /// The next events, as many as may be given out at once, none if there are none yet; or what comes in their place.
    async fn read(&mut self) -> Result<Vec<NumberedEvent>, Option<News>> {
        let page = match self.store.events(self.id, self.after, self.page).await {
            Ok(page) => page,
            Err(error) => return Err(self.broken(error)),
        };
        if page.forgotten > self.after {
            return Err(self.skip(page.forgotten).await);
        }
        let mut events = page.events;
        self.caught_up = events.is_empty();
        let read = events.len();
        if read < self.page && std::mem::take(&mut self.is_new) {
            self.show_place_in_queue(&mut events).await;
        }
        shorten(&mut events);
        if events.len() < read || read == self.page {
            self.page = (2 * events.len()).min(PAGE);
        }
        Ok(events)
    }

    /// Whether a reader who has just been given so many events leaves, now that the service stops: one that is further
    /// behind can read the rest from the next process.
    fn leaves_after(&mut self, count: usize) -> bool {
        if self.over {
            return false;
        }
        self.over = count == 0 || self.last_events == 0;
        self.last_events = self.last_events.saturating_sub(count);
        self.over
    }

    /// Continue after the events that the store has deleted. A new reader asked for none of them, and starts with the
    /// current record.
    async fn skip(&mut self, forgotten: u64) -> Option<News> {
        let held = self.held();
        if held.is_some() {
            return held;
        }
        let from = self.after + 1;
        (self.after, self.caught_up) = (forgotten, false);
        if from > 1 {
            return Some(News::Gap {
                from,
                to: forgotten,
            });
        }
        match self.store.get(self.id).await {
            Ok(plan) => Some(News::Events(vec![NumberedEvent {
                id: forgotten,
                event: Event::Status(Box::new(plan)),
            }])),
            Err(error) => self.broken(error),
        }
    }

    /// What the throttle holds back, which comes before whatever takes the place of later events.
    fn held(&mut self) -> Option<News> {
        if !self.throttle.holds() {
            return None;
        }
        let mut out = Vec::new();
        self.throttle.flush(&mut out);
        self.held_since = None;
        Some(News::Events(out))
    }

    /// If the plan still waits, its newest event says where it was in the queue when it got there. A new reader is shown
    /// the record as it is now in its place; those who read it earlier have it under the same id.
    async fn show_place_in_queue(&self, events: &mut [NumberedEvent]) {
        let newest = events.last_mut().map(|newest| &mut newest.event);
        let Some(Event::Status(shown)) = newest else {
            return;
        };
        if shown.status != Status::Queued {
            return;
        }
        // If it has been taken off the queue meanwhile, the next event says so.
        match self.store.get(self.id).await {
            Ok(plan) if plan.status == Status::Queued => **shown = plan,
            _ => {}
        }
    }

    /// The store has no more of the plan, or fails.
    fn broken(&mut self, error: StoreError) -> Option<News> {
        match error {
            StoreError::Gone(tombstone) => self.removed(tombstone.end),
            StoreError::NotFound(_) => self.removed(None),
            error => {
                tracing::warn!(%error, "a stream of events broke off");
                self.over = true;
                None
            }
        }
    }

    /// The plan has been removed, and its events with it: what was not read is missing. Where nothing says how the plan
    /// ended, a reader who is behind cannot be told.
    fn removed(&mut self, end: Option<LastEvent>) -> Option<News> {
        let held = self.held();
        if held.is_some() {
            return held;
        }
        let next = self.after + 1;
        let here = self.caught_up.then_some(LastEvent {
            id: next,
            status: Status::Cancelled,
        });
        let Some(end) = end.or(here) else {
            self.over = true;
            return None;
        };
        if next < end.id {
            self.after = end.id - 1;
            return Some(News::Gap {
                from: next,
                to: self.after,
            });
        }
        self.over = true;
        Some(News::Events(vec![NumberedEvent {
            id: end.id.max(next),
            event: Event::End(end.status),
        }]))
    }

    fn take(&mut self, page: Vec<NumberedEvent>, out: &mut Vec<NumberedEvent>) {
        for event in page {
            self.after = event.id;
            self.over = matches!(event.event, Event::End(_));
            self.throttle.push(event, out);
        }
        self.held_since = match self.held_since {
            Some(since) if out.is_empty() => Some(since),
            _ => self.throttle.may_release().then(Instant::now),
        };
    }

    /// Wait until there may be more to read, or for something to say meanwhile.
    async fn wait(&mut self) -> Option<News> {
        match self.wake().await {
            Woken::Changed | Woken::Stopping => None,
            Woken::WindowClosed => {
                let mut out = Vec::new();
                self.throttle.release(&mut out);
                self.held_since = None;
                Some(News::Events(out))
            }
            Woken::Silence => Some(News::Silence),
            Woken::Closed => {
                self.over = true;
                None
            }
        }
    }

    async fn wake(&mut self) -> Woken {
        let window_closes = self
            .held_since
            .zip(self.throttle.window_ms())
            .map(|(since, window_ms)| since + Duration::from_secs_f64(window_ms / 1000.0) + LATE);
        let (deadline, woken) = due(self.last_sent, window_closes);
        tokio::select! {
            changed = self.changes.changed() => match changed {
                Ok(()) => Woken::Changed,
                Err(_) => Woken::Closed,
            },
            () = tokio::time::sleep_until(deadline) => woken,
            () = stopping(&mut self.phase) => Woken::Stopping,
        }
    }
}

/// Leaves the first events of a page, as many as may be given out at once; the store is asked for the others again.
fn shorten(page: &mut Vec<NumberedEvent>) {
    let mut bytes = 0;
    let within = page.iter().take_while(|numbered| {
        bytes += numbered.event.bytes();
        bytes <= PAGE_BYTES
    });
    let count = within.count();
    page.truncate(count.max(1));
}

/// When to wake for a reader to whom something was last sent at `last_sent`: to release what the throttle holds when its
/// window closes, or to send a comment. Events that are held back postpone neither.
fn due(last_sent: Instant, window_closes: Option<Instant>) -> (Instant, Woken) {
    let silent = last_sent + SILENCE;
    match window_closes {
        Some(closes) if closes <= silent => (closes, Woken::WindowClosed),
        _ => (silent, Woken::Silence),
    }
}

/// Why a wait ended.
#[derive(Debug, PartialEq, Eq)]
enum Woken {
    Changed,
    WindowClosed,
    Silence,
    Stopping,
    Closed,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Proxies cut silent connections, even when the reader's own rate holds events back.
    #[test]
    fn a_comment_is_due_while_the_throttle_holds_events_back() {
        let last_sent = Instant::now();
        let after = |seconds| last_sent + Duration::from_secs(seconds);
        let silence = (after(15), Woken::Silence);
        assert_eq!(due(last_sent, None), silence);
        assert_eq!(due(last_sent, Some(after(100))), silence);
        assert_eq!(
            due(last_sent, Some(after(3))),
            (after(3), Woken::WindowClosed)
        );
    }
}
