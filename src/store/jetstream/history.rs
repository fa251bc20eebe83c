//! Events of plans that are read often: kept in memory as far as there is room.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;

use super::record::{State, Step};
use crate::export::document::Incumbent;
use crate::job::{Event, NumberedEvent, PlanId};
use crate::store::EventPage;

/// Approximate bytes of events in memory.
const ROOM: usize = 64 << 20;

/// Bytes assumed for a step beside its events.
const STEP: usize = 256;

/// The events of one step.
#[derive(Debug, Clone)]
struct Batch {
    /// Id of the newest event up to and including this step.
    last: u64,
    events: Arc<[NumberedEvent]>,
    bytes: usize,
}

/// The events of one plan.
#[derive(Debug, Clone, Default)]
pub(super) struct History {
    /// Events up to this one are not here.
    before: u64,
    /// Whether the stream no longer has them either.
    complete: bool,
    batches: VecDeque<Batch>,
    incumbent: Option<(u64, Incumbent)>,
    bytes: usize,
    touched: u64,
}

impl History {
    /// Begin where the stream's knowledge of the plan begins.
    pub(super) fn whole() -> Self {
        Self {
            complete: true,
            ..Self::default()
        }
    }

    /// Id of the newest event.
    pub(super) fn last(&self) -> u64 {
        self.batches.back().map_or(self.before, |batch| batch.last)
    }

    /// Add a step; false when steps before it are missing.
    pub(super) fn push(&mut self, step: &Step, events_kept: u64) -> bool {
        let State::Kept(record) = &*step.state else {
            return true;
        };
        let events = step.numbered();
        let first = step.first_event(record);
        if self.batches.is_empty() && self.before == 0 {
            self.before = first - 1;
        }
        if record.last_event < self.last() {
            return true;
        }
        if first != self.last() + 1 {
            return first <= self.last();
        }
        let route = events.iter().rev().find_map(|event| match &event.event {
            Event::Incumbent(route) => Some(route.clone()),
            _ => None,
        });
        if let Some(route) = route {
            self.incumbent = Some((record.attempt, route));
        }
        let bytes = STEP + events.iter().map(|one| one.event.bytes()).sum::<usize>();
        self.bytes += bytes;
        self.batches.push_back(Batch {
            last: record.last_event,
            events: events.into(),
            bytes,
        });
        let last = self.last();
        let is_spare = |oldest: &Batch| last - oldest.last >= events_kept;
        while self.batches.front().is_some_and(is_spare) {
            self.forget_one();
        }
        true
    }

    fn forget_one(&mut self) {
        if let Some(batch) = self.batches.pop_front() {
            self.before = batch.last;
            self.bytes -= batch.bytes;
        }
    }

    /// Whether it has everything after `after`.
    fn reaches(&self, after: u64) -> bool {
        self.complete || after >= self.before
    }

    pub(super) fn page(&self, after: u64, limit: usize) -> EventPage {
        let from = self.batches.partition_point(|batch| batch.last <= after);
        let events = self
            .batches
            .range(from..)
            .flat_map(|batch| batch.events.iter())
            .filter(|event| event.id > after)
            .take(limit)
            .cloned()
            .collect();
        EventPage {
            forgotten: if self.complete { self.before } else { 0 },
            events,
        }
    }

    /// The best route of a run.
    pub(super) fn incumbent(&self, attempt: u64) -> Option<Incumbent> {
        let (under, route) = self.incumbent.as_ref()?;
        (*under == attempt).then(|| route.clone())
    }
}

/// The histories in memory; the least recently used make room.
#[derive(Debug)]
pub(super) struct Histories {
    plans: HashMap<PlanId, History>,
    by_touch: BTreeMap<u64, PlanId>,
    touches: u64,
    bytes: usize,
    events_kept: u64,
}

impl Histories {
    /// For each plan in memory the newest `events_kept` are kept, in whole steps.
    pub(super) fn new(events_kept: u64) -> Self {
        Self {
            plans: HashMap::new(),
            by_touch: BTreeMap::new(),
            touches: 0,
            bytes: 0,
            events_kept,
        }
    }

    /// A step has come. Nothing is kept of plans whose beginning was not seen.
    pub(super) fn push(&mut self, id: PlanId, step: &Step) {
        let begins = matches!(&*step.state, State::Kept(record) if step.first_event(record) == 1);
        let known = self.take(id);
        let Some(mut history) = known.or_else(|| begins.then(History::whole)) else {
            return;
        };
        if history.push(step, self.events_kept) {
            self.put(id, history);
        }
    }

    /// The events after this one; `None` when the stream must be asked.
    pub(super) fn page(&mut self, id: PlanId, after: u64, limit: usize) -> Option<EventPage> {
        self.touched(id)
            .filter(|history| history.reaches(after))
            .map(|history| history.page(after, limit))
    }

    /// All events of a plan; `None` when the stream must be asked.
    pub(super) fn whole(&mut self, id: PlanId) -> Option<&History> {
        self.touched(id).filter(|history| history.complete)
    }

    /// Store it in place of what there was.
    pub(super) fn put(&mut self, id: PlanId, mut history: History) {
        self.take(id);
        self.touches += 1;
        history.touched = self.touches;
        self.bytes += history.bytes;
        self.by_touch.insert(history.touched, id);
        self.plans.insert(id, history);
        while self.bytes > ROOM && self.plans.len() > 1 {
            let Some((_, oldest)) = self.by_touch.first_key_value() else {
                return;
            };
            self.take(*oldest);
        }
    }

    pub(super) fn take(&mut self, id: PlanId) -> Option<History> {
        let history = self.plans.remove(&id)?;
        self.by_touch.remove(&history.touched);
        self.bytes -= history.bytes;
        Some(history)
    }

    fn touched(&mut self, id: PlanId) -> Option<&History> {
        let history = self.take(id)?;
        self.put(id, history);
        self.plans.get(&id)
    }
}

#[cfg(test)]
mod tests {
    use uuid::Uuid;

    use super::*;
    use crate::job::Status;
    use crate::store::jetstream::known::Known;
    use crate::store::jetstream::record::{Placed, Record};

    /// Steps of one, two, one, two, ... events.
    fn steps(count: u64) -> Vec<Step> {
        let mut record = Record::example();
        (0..count)
            .map(|nth| {
                let events = vec![Event::End(Status::Failed); 1 + (nth % 2) as usize];
                record.last_event += events.len() as u64;
                Step {
                    mark: Uuid::nil(),
                    state: Arc::new(State::Kept(Box::new(record.clone()))),
                    events,
                    announced: false,
                }
            })
            .collect()
    }

    #[test]
    fn pages_are_complete_from_any_position_and_count_forgotten_events() {
        let mut histories = Histories::new(6);
        for step in steps(10) {
            histories.push(Uuid::nil(), &step);
        }
        // Fifteen events; the last four steps hold six of them.
        let page = histories.page(Uuid::nil(), 0, 100).expect("it began here");
        assert_eq!(page.forgotten, 9);
        let ids: Vec<_> = page.events.iter().map(|event| event.id).collect();
        assert_eq!(ids, [10, 11, 12, 13, 14, 15]);
        for after in 9..16 {
            let page = histories
                .page(Uuid::nil(), after, 2)
                .expect("it began here");
            let expected: Vec<_> = (after + 1..=15).take(2).collect();
            let ids: Vec<_> = page.events.iter().map(|event| event.id).collect();
            assert_eq!(ids, expected, "after {after}");
        }
    }

    #[test]
    fn a_history_with_a_gap_or_without_its_beginning_is_not_kept() {
        let steps = steps(6);
        let mut histories = Histories::new(u64::MAX);
        histories.push(Uuid::nil(), &steps[2]);
        assert_eq!(histories.page(Uuid::nil(), 0, 100), None);
        for nth in [0, 1, 1, 0, 2] {
            histories.push(Uuid::nil(), &steps[nth]);
        }
        let page = histories.page(Uuid::nil(), 0, 100).expect("it began here");
        assert_eq!(page.events.len(), 4);
        histories.push(Uuid::nil(), &steps[4]);
        assert_eq!(histories.page(Uuid::nil(), 0, 100), None);
    }

    #[test]
    fn a_history_read_before_the_latest_step_is_not_kept() {
        let (id, steps) = (Uuid::nil(), steps(3));
        let mut known = Known::new(u64::MAX);
        for (sequence, step) in (1..).zip(steps.clone()) {
            known.stand(id, &Placed { sequence, step });
        }
        let mut read = History::whole();
        for step in &steps[..2] {
            read.push(step, u64::MAX);
        }
        known.keep_history(id, read.clone());
        assert_eq!(known.histories.page(id, 0, 100), None);
        read.push(&steps[2], u64::MAX);
        known.keep_history(id, read);
        let page = known.histories.page(id, 0, 100).expect("it is whole");
        assert_eq!(page.events.len(), 4);
    }

    #[test]
    fn the_oldest_unread_histories_are_evicted() {
        let mut histories = Histories::new(u64::MAX);
        let step = &steps(1)[0];
        let count = ROOM / (2 * STEP) + 10;
        for nth in 0..count as u128 {
            histories.push(Uuid::from_u128(nth), step);
        }
        assert!(histories.bytes <= ROOM);
        assert_eq!(histories.page(Uuid::from_u128(0), 0, 1), None);
        let last = Uuid::from_u128(count as u128 - 1);
        assert!(histories.page(last, 0, 1).is_some());
    }
}
