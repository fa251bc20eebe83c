//! A store and its in-memory model agree over random operations.

use std::collections::BTreeSet;

use noctule::job::{Event, PlanId, Status};
use noctule::store::Lease;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::support::patience::in_time;
use crate::support::plans::{ending, failure, history, kind, point, statuses, submission};
use crate::support::size::cases;
use crate::support::stores::{BACKENDS, Fixture, Place};

const QUEUE_LIMIT: usize = 4;

/// Plans and leases are given by a number, taken modulo their count.
#[derive(Debug, Clone)]
enum Step {
    Submit,
    Claim,
    Append(usize),
    Finish(usize, Status),
    Release(usize),
    Cancel(usize),
    Delete(usize),
    /// Reads a plan's state; the answer may come from a cache.
    Look(usize),
    Sweep,
    Reopen,
}

fn step() -> impl Strategy<Value = Step> {
    let which = 0_usize..64;
    let status = prop_oneof![
        Just(Status::Succeeded),
        Just(Status::Failed),
        Just(Status::Cancelled)
    ];
    prop_oneof![
        4 => Just(Step::Submit),
        4 => Just(Step::Claim),
        2 => which.clone().prop_map(Step::Append),
        3 => (which.clone(), status).prop_map(|(lease, status)| Step::Finish(lease, status)),
        2 => which.clone().prop_map(Step::Release),
        2 => which.clone().prop_map(Step::Cancel),
        1 => which.clone().prop_map(Step::Delete),
        4 => which.prop_map(Step::Look),
        1 => Just(Step::Sweep),
        1 => Just(Step::Reopen),
    ]
}

/// What the store should hold about a plan.
#[derive(Debug)]
struct Expected {
    id: PlanId,
    /// `None` once deleted.
    status: Option<Status>,
    runs: u64,
    cancel_requested: bool,
}

#[derive(Default)]
struct Model {
    plans: Vec<Expected>,
    /// Indices into `plans`, in order of acceptance.
    queue: BTreeSet<usize>,
    /// Every lease there has been, with its plan.
    leases: Vec<(usize, Lease)>,
}

impl Model {
    /// Whether that lease still holds.
    fn holds(&self, which: usize) -> bool {
        let (plan, lease) = &self.leases[which];
        let expected = &self.plans[*plan];
        expected.status == Some(Status::Running) && expected.runs == lease.attempt
    }

    fn give_back(&mut self, which: usize) {
        let plan = &mut self.plans[which];
        if plan.cancel_requested {
            plan.status = Some(Status::Cancelled);
        } else {
            plan.status = Some(Status::Queued);
            self.queue.insert(which);
        }
    }

    async fn apply(&mut self, store: &mut Fixture, step: &Step) {
        match *step {
            Step::Submit => self.submit(store).await,
            Step::Claim if self.queue.is_empty() => {}
            Step::Claim => self.claim(store).await,
            Step::Append(which) | Step::Finish(which, _) | Step::Release(which) => {
                if !self.leases.is_empty() {
                    self.apply_to_lease(store, step, which % self.leases.len())
                        .await;
                }
            }
            Step::Cancel(which) | Step::Delete(which) => {
                if !self.plans.is_empty() {
                    self.apply_to_plan(store, step, which % self.plans.len())
                        .await;
                }
            }
            Step::Look(which) => {
                if !self.plans.is_empty() {
                    self.look(store, which % self.plans.len()).await;
                }
            }
            // Nothing expires while the clock stands still.
            Step::Sweep => assert_eq!(store.sweep(store.now_ms()).await.expect("it is open"), 0),
            Step::Reopen => {
                store.reopen().await;
                for which in 0..self.plans.len() {
                    if self.plans[which].status == Some(Status::Running) {
                        self.give_back(which);
                    }
                }
            }
        }
    }

    async fn submit(&mut self, store: &Fixture) {
        let submission = submission();
        let id = submission.id;
        let answer = store.submit(submission).await;
        if self.queue.len() >= QUEUE_LIMIT {
            assert_eq!(kind(answer), Err("queue full"));
            return;
        }
        assert_eq!(kind(answer), Ok(()));
        self.queue.insert(self.plans.len());
        self.plans.push(Expected {
            id,
            status: Some(Status::Queued),
            runs: 0,
            cancel_requested: false,
        });
    }

    async fn claim(&mut self, store: &Fixture) {
        let head = self.queue.pop_first().expect("somebody is queued");
        let lease = store.claim().await.expect("somebody is queued");
        let plan = &mut self.plans[head];
        assert_eq!(lease.plan.id, plan.id);
        plan.status = Some(Status::Running);
        plan.runs += 1;
        assert_eq!(lease.attempt, plan.runs);
        self.leases.push((head, lease));
    }

    async fn apply_to_lease(&mut self, store: &Fixture, step: &Step, which: usize) {
        let (plan, lease) = &self.leases[which];
        let answer = match step {
            Step::Append(_) => store.append(lease, vec![point(2, None)]).await,
            Step::Finish(_, Status::Failed) => {
                store.finish(lease, failure().at(0)).await.map(|_| ())
            }
            Step::Finish(_, status) => store.finish(lease, ending(*status).at(0)).await.map(|_| ()),
            _ => store.release(lease).await.map(|_| ()),
        };
        let (plan, holds) = (*plan, self.holds(which));
        assert_eq!(kind(answer), if holds { Ok(()) } else { Err("lease lost") });
        match step {
            Step::Finish(_, status) if holds => self.plans[plan].status = Some(*status),
            Step::Release(_) if holds => self.give_back(plan),
            _ => {}
        }
    }

    async fn apply_to_plan(&mut self, store: &Fixture, step: &Step, which: usize) {
        let plan = &mut self.plans[which];
        if let Step::Delete(_) = step {
            assert_eq!(kind(store.delete(plan.id, store.now_ms()).await), Ok(()));
            plan.status = None;
            self.queue.remove(&which);
            return;
        }
        let answer = store.request_cancel(plan.id, 0).await;
        match plan.status {
            None => assert_eq!(kind(answer), Err("gone")),
            Some(status) => {
                assert_eq!(kind(answer), Ok(()));
                if status == Status::Queued {
                    plan.status = Some(Status::Cancelled);
                    self.queue.remove(&which);
                }
                plan.cancel_requested |= !status.is_final();
            }
        }
    }

    async fn look(&self, store: &Fixture, which: usize) {
        let expected = &self.plans[which];
        let Some(status) = expected.status else {
            assert_eq!(kind(store.get(expected.id).await), Err("gone"));
            return;
        };
        let plan = store.get(expected.id).await.expect("it was not deleted");
        assert_eq!(plan.status, status);
        assert_eq!(plan.cancel_requested, expected.cancel_requested);
        let place = self.queue.iter().position(|queued| *queued == which);
        assert_eq!(plan.queue_position, place.map(|place| place as u64 + 1));
        let stats = store.stats().await.expect("the store is open");
        assert_eq!(stats.queued, self.queue.len() as u64);
    }

    async fn compare(&self, store: &Fixture) {
        for (which, expected) in self.plans.iter().enumerate() {
            self.look(store, which).await;
            let Some(status) = expected.status else {
                continue;
            };
            compare_history(&history(&**store, expected.id).await, status);
        }
        for (which, (_, lease)) in self.leases.iter().enumerate() {
            if self.holds(which) {
                let cancelled = *lease.cancel.borrow();
                assert_eq!(cancelled, self.plans[self.leases[which].0].cancel_requested);
            }
        }
        let stats = store.stats().await.expect("the store is open");
        assert_eq!(stats.queued, self.queue.len() as u64);
    }
}

fn compare_history(told: &[Event], status: Status) {
    let path = statuses(told);
    assert_eq!((path[0], path.last()), (Status::Queued, Some(&status)));
    assert!(
        path.windows(2)
            .all(|step| step[0] == step[1] || step[0].may_become(step[1]))
    );
    let ends: Vec<_> = (0..told.len())
        .filter(|place| matches!(told[*place], Event::End(_)))
        .collect();
    if status.is_final() {
        assert_eq!(ends, [told.len() - 1]);
        assert_eq!(told.last(), Some(&Event::End(status)));
    } else {
        assert!(ends.is_empty());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..cases(12, 300) })]

    #[test]
    fn a_store_and_its_model_agree(steps in vec(step(), 1..60)) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            for backend in BACKENDS {
                println!("on {backend:?}");
                let mut store = Fixture::new(Place::new(backend), QUEUE_LIMIT as u64).await;
                let mut model = Model::default();
                let agree = async {
                    for step in &steps {
                        model.apply(&mut store, step).await;
                    }
                    model.compare(&store).await;
                };
                in_time(agree).await;
            }
        });
    }
}
