//! The plans that a node knows of, indexed and counted so that questions are answered without looking at all of them;
//! except for lists by owner or status, and for the uses of datasets.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

use super::history::{Histories, History};
use super::lane::{Lane, Version};
use super::record::{Placed, Record, State};
use super::turns::{self, Lanes};
use super::view::Standing;
use crate::job::{Owner, Plan, PlanId, Status};
use crate::store::{DatasetUse, ListQuery, RUNS_IN_MEAN, Stats, StoreError, TOMBSTONE_MS};

/// The plans, and their counts.
#[derive(Debug)]
pub(super) struct Known {
    plans: BTreeMap<PlanId, Standing>,
    pub(super) histories: Histories,
    /// In the order of acceptance.
    queue: BTreeSet<(u64, PlanId)>,
    lanes: Lanes,
    running: Lanes,
    /// By the time of their ends.
    ended: BTreeSet<(i64, PlanId)>,
    ended_bytes: u64,
    expiring: BTreeSet<(i64, PlanId)>,
    due: BTreeSet<(i64, PlanId)>,
    graves: BTreeSet<(i64, PlanId)>,
    run_times: VecDeque<i64>,
    /// Plans that are being submitted here, by owner.
    coming: HashMap<String, u64>,
    coming_in_all: u64,
}

impl Known {
    pub(super) fn new(events_kept: u64) -> Self {
        Self {
            plans: BTreeMap::new(),
            histories: Histories::new(events_kept),
            queue: BTreeSet::new(),
            lanes: HashMap::new(),
            running: HashMap::new(),
            ended: BTreeSet::new(),
            ended_bytes: 0,
            expiring: BTreeSet::new(),
            due: BTreeSet::new(),
            graves: BTreeSet::new(),
            run_times: VecDeque::new(),
            coming: HashMap::new(),
            coming_in_all: 0,
        }
    }

    /// False when the step was already known or superseded.
    pub(super) fn stand(&mut self, id: PlanId, placed: &Placed) -> bool {
        if self
            .plans
            .get(&id)
            .is_some_and(|known| known.sequence >= placed.sequence)
        {
            return false;
        }
        let had_ended = self
            .kept(id)
            .is_some_and(|record| record.plan.status.is_final());
        self.unlist(id);
        let state = Arc::clone(&placed.step.state);
        self.list(id, &state);
        if let State::Kept(record) = &*state
            && !had_ended
        {
            self.time_run(&record.plan);
        }
        let sequence = placed.sequence;
        self.plans.insert(id, Standing { sequence, state });
        true
    }

    pub(super) fn forget(&mut self, id: PlanId) {
        self.unlist(id);
        self.plans.remove(&id);
        self.histories.take(id);
    }

    /// Store a history read from the stream, unless the plan has more events meanwhile: those found no history to be
    /// added to, and would be missing from this one for good.
    pub(super) fn keep_history(&mut self, id: PlanId, history: History) {
        let last = self.kept(id).map(|record| record.last_event);
        if last.is_some_and(|last| last <= history.last()) {
            self.histories.put(id, history);
        }
    }

    pub(super) fn standing(&self, id: PlanId) -> Option<Standing> {
        self.plans.get(&id).cloned()
    }

    fn list(&mut self, id: PlanId, state: &State) {
        let record = match state {
            State::Kept(record) => record,
            State::Buried(grave) => {
                self.graves.insert((grave.deleted_ms, id));
                self.histories.take(id);
                return;
            }
        };
        match record.plan.status {
            Status::Queued => {
                self.queue.insert((record.place, id));
                insert(&mut self.lanes, record);
            }
            Status::Running => {
                insert(&mut self.running, record);
            }
            Status::Succeeded | Status::Failed | Status::Cancelled => self.list_ended(record),
        }
    }

    fn list_ended(&mut self, record: &Record) {
        let (id, plan) = (record.id(), &record.plan);
        let ended_ms = plan.finished_ms.unwrap_or_default();
        self.ended.insert((ended_ms, id));
        self.ended_bytes += record.size();
        self.expiring.extend(plan.expires_ms.map(|at| (at, id)));
        let hook = record.webhook.as_ref();
        self.due
            .extend(hook.and_then(|hook| hook.due_ms).map(|at| (at, id)));
    }

    /// Count the run time of a plan that has ended with a result.
    fn time_run(&mut self, plan: &Plan) {
        if plan.stop_reason.is_some()
            && let Some((end_ms, began_ms)) = plan.finished_ms.zip(plan.started_ms)
        {
            self.run_times.push_back(end_ms - began_ms);
            if self.run_times.len() > RUNS_IN_MEAN as usize {
                self.run_times.pop_front();
            }
        }
    }

    fn unlist(&mut self, id: PlanId) {
        let Some(standing) = self.plans.get(&id).cloned() else {
            return;
        };
        let record = match &*standing.state {
            State::Kept(record) => record,
            State::Buried(grave) => {
                self.graves.remove(&(grave.deleted_ms, id));
                return;
            }
        };
        self.queue.remove(&(record.place, id));
        remove(&mut self.lanes, record);
        remove(&mut self.running, record);
        let plan = &record.plan;
        if plan.status.is_final() {
            self.ended
                .remove(&(plan.finished_ms.unwrap_or_default(), id));
            self.ended_bytes -= record.size();
            if let Some(at) = plan.expires_ms {
                self.expiring.remove(&(at, id));
            }
            if let Some(at) = record.webhook.as_ref().and_then(|hook| hook.due_ms) {
                self.due.remove(&(at, id));
            }
        }
    }

    fn kept(&self, id: PlanId) -> Option<&Record> {
        self.plans.get(&id)?.kept()
    }

    pub(super) fn is_queued(&self, id: PlanId) -> bool {
        self.kept(id)
            .is_some_and(|record| record.plan.status == Status::Queued)
    }

    /// A record as it is shown: including its place in the queue.
    pub(super) fn shown(&self, record: &Record) -> Plan {
        Plan {
            queue_position: (record.plan.status == Status::Queued)
                .then(|| self.position(record.place)),
            ..record.plan.clone()
        }
    }

    /// 1 for the next to run.
    pub(super) fn position(&self, place: u64) -> u64 {
        self.queue.range(..(place, PlanId::nil())).count() as u64 + 1
    }

    /// Plans behind `place` in the queue that have been waiting since `accepted_before` or longer, with their places.
    pub(super) fn waiting(
        &self,
        place: u64,
        accepted_before: i64,
        at_most: usize,
    ) -> Vec<(u64, PlanId)> {
        let behind = self.queue.range((place, PlanId::max())..);
        let old = behind.filter(|(_, id)| {
            self.kept(*id)
                .is_some_and(|record| record.plan.created_ms <= accepted_before)
        });
        old.take(at_most).copied().collect()
    }

    /// The plans that are being run, each with the number of its last step.
    pub(super) fn runs(&self) -> Vec<(PlanId, u64)> {
        let running = self.running.values().flatten();
        let last_step = |id: PlanId| self.plans.get(&id).map(|standing| (id, standing.sequence));
        running.filter_map(|(_, id)| last_step(*id)).collect()
    }

    /// Queue place of a plan, if the plan exists.
    pub(super) fn place(&self, id: PlanId) -> Option<u64> {
        self.kept(id).map(|record| record.place)
    }

    pub(super) fn list_plans(&self, query: &ListQuery) -> Vec<Plan> {
        let wanted = |plan: &Plan| {
            query.status.is_none_or(|status| plan.status == status)
                && (query.owner.is_none() || plan.owner == query.owner)
        };
        let older = match query.before {
            Some(before) => self.plans.range(..before),
            None => self.plans.range(..),
        };
        let mut plans: Vec<Plan> = older
            .rev()
            .filter_map(|(_, standing)| standing.kept())
            .filter(|record| wanted(&record.plan))
            .take(query.limit)
            .map(|record| record.plan.clone())
            .collect();
        self.place_in_queue(&mut plans);
        plans
    }

    /// Set each plan's position in the queue; the queue is walked once for all of them.
    fn place_in_queue(&self, plans: &mut [Plan]) {
        let queued = |plan: &&mut Plan| plan.status == Status::Queued;
        let mut waiting: HashMap<PlanId, &mut Option<u64>> = plans
            .iter_mut()
            .filter(queued)
            .map(|plan| (plan.id, &mut plan.queue_position))
            .collect();
        for ((_, id), position) in self.queue.iter().zip(1..) {
            if waiting.is_empty() {
                return;
            }
            if let Some(place) = waiting.remove(id) {
                *place = Some(position);
            }
        }
    }

    pub(super) fn stats(&self) -> Stats {
        let head = self.queue.first().and_then(|(_, id)| self.kept(*id));
        let times = &self.run_times;
        Stats {
            queued: self.queue.len() as u64,
            oldest_queued_ms: head.map(|record| record.plan.created_ms),
            running: self.running.values().map(|lane| lane.len() as u64).sum(),
            mean_run_ms: (!times.is_empty())
                .then(|| times.iter().sum::<i64>() as f64 / times.len() as f64),
            slots: None,
        }
    }

    pub(super) fn datasets(&self) -> Vec<DatasetUse> {
        let mut uses: BTreeMap<&str, (u64, u64)> = BTreeMap::new();
        for standing in self.plans.values() {
            if let Some(record) = standing.kept()
                && let Some(dataset) = &record.dataset
            {
                let (active, plans) = uses.entry(dataset).or_default();
                *active += u64::from(!record.plan.status.is_final());
                *plans += 1;
            }
        }
        uses.into_iter()
            .map(|(sha256, (active, plans))| DatasetUse {
                sha256: sha256.to_owned(),
                active,
                plans,
            })
            .collect()
    }

    /// Make room for a submission in the queue and its owner's quota; returns its place. Undo with [`Known::arrived`].
    pub(super) fn expect(
        &mut self,
        limit: u64,
        quota: Option<u64>,
        lane: &Lane,
    ) -> Result<u64, StoreError> {
        let queued = self.queue.len() as u64 + self.coming_in_all;
        if queued >= limit {
            return Err(StoreError::QueueFull { queued });
        }
        let coming = self.coming.get(&lane.owner).copied().unwrap_or_default();
        let of_owner = |lanes: &Lanes| {
            let own = lanes.iter().filter(|(one, _)| one.owner == lane.owner);
            own.map(|(_, plans)| plans.len() as u64).sum::<u64>()
        };
        let active = coming + of_owner(&self.lanes) + of_owner(&self.running);
        if let Some(quota) = quota
            && active >= quota
        {
            return Err(StoreError::QuotaReached { active, quota });
        }
        *self.coming.entry(lane.owner.clone()).or_default() += 1;
        self.coming_in_all += 1;
        Ok(queued + 1)
    }

    /// A queued plan whose job is here counts as running until its step confirms it.
    pub(super) fn expect_run(&mut self, id: PlanId) {
        let Some(standing) = self.standing(id) else {
            return;
        };
        if let State::Kept(record) = &*standing.state
            && record.plan.status == Status::Queued
        {
            remove(&mut self.lanes, record);
            insert(&mut self.running, record);
        }
    }

    /// The plan keeps its state; true when it is queued.
    pub(super) fn expect_no_run(&mut self, id: PlanId) -> bool {
        if let Some(standing) = self.standing(id) {
            self.unlist(id);
            self.list(id, &standing.state);
        }
        self.is_queued(id)
    }

    /// An expected submission has arrived, or will not come.
    pub(super) fn arrived(&mut self, lane: &Lane) {
        self.coming_in_all -= 1;
        if let Some(coming) = self.coming.get_mut(&lane.owner) {
            *coming -= 1;
            if *coming == 0 {
                self.coming.remove(&lane.owner);
            }
        }
    }

    /// The lane whose turn it is, but for those that are `passed` over; see [`turns::next`].
    pub(super) fn next_lane(
        &self,
        version: Version,
        slots: usize,
        passed: &[Lane],
    ) -> Option<Lane> {
        turns::next(&self.lanes, &self.running, version, slots, passed)
    }

    /// Lanes whose running plans may have lost their workers.
    pub(super) fn running_lanes(&self, version: Version) -> Vec<Lane> {
        let lanes = self.running.keys().filter(|lane| lane.version <= version);
        lanes.cloned().collect()
    }

    /// Plans due for removal at this time or beyond the limits, those that ended longest ago first.
    pub(super) fn removable(
        &self,
        now_ms: i64,
        plans: u64,
        bytes: u64,
        at_most: usize,
    ) -> Vec<PlanId> {
        let expired = self.expiring.range(..=(now_ms, PlanId::max()));
        let mut going: Vec<_> = expired.map(|(_, id)| *id).take(at_most).collect();
        let known: BTreeSet<_> = going.iter().copied().collect();
        let bytes_of = |id| self.kept(id).map_or(0, Record::size);
        let mut left = (self.ended.len() - known.len()) as u64;
        let mut left_bytes = self.ended_bytes - known.iter().copied().map(bytes_of).sum::<u64>();
        for (_, id) in self.ended.iter().filter(|(_, id)| !known.contains(id)) {
            let is_beyond = left > plans || left_bytes > bytes;
            if !is_beyond || going.len() >= at_most {
                break;
            }
            left -= 1;
            left_bytes -= bytes_of(*id);
            going.push(*id);
        }
        going
    }

    /// The newest time that anything bears, milliseconds since 1970; `None` when there is nothing.
    pub(super) fn newest_ms(&self) -> Option<i64> {
        let accepted_last = self.plans.keys().next_back().and_then(|&id| self.kept(id));
        let of = |times: &BTreeSet<(i64, PlanId)>| times.last().map(|&(ms, _)| ms);
        accepted_last
            .map(|record| record.plan.created_ms)
            .max(of(&self.ended))
            .max(of(&self.graves))
    }

    /// Tombstones that have expired.
    pub(super) fn expired_tombstones(&self, now_ms: i64, at_most: usize) -> Vec<PlanId> {
        let until = (now_ms.saturating_sub(TOMBSTONE_MS), PlanId::max());
        let graves = self.graves.range(..=until).take(at_most);
        graves.map(|(_, id)| *id).collect()
    }

    /// Webhooks due at this time: the longest due of each owner first, then each owner's next.
    pub(super) fn due(&self, now_ms: i64, at_most: usize) -> Vec<PlanId> {
        let mut turns: HashMap<Option<&Owner>, usize> = HashMap::new();
        let due = self.due.range(..=(now_ms, PlanId::max()));
        let mut due: Vec<_> = due
            .map(|(at, id)| {
                let owner = self.kept(*id).and_then(|record| record.plan.owner.as_ref());
                let turn = turns.entry(owner).or_default();
                *turn += 1;
                (*turn, *at, *id)
            })
            .collect();
        due.sort_unstable();
        due.into_iter().take(at_most).map(|(_, _, id)| id).collect()
    }
}

fn insert(lanes: &mut Lanes, record: &Record) {
    let lane = lanes.entry(record.lane.clone()).or_default();
    lane.insert((record.place, record.id()));
}

fn remove(lanes: &mut Lanes, record: &Record) {
    if let Some(lane) = lanes.get_mut(&record.lane) {
        lane.remove(&(record.place, record.id()));
        if lane.is_empty() {
            lanes.remove(&record.lane);
        }
    }
}
