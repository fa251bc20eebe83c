//! From the claim to the end.

use std::sync::Arc;

use futures_util::future::join_all;
use noctule::job::{Event, FailureKind, Status};
use noctule::store::Ending;

use crate::support::plans::{ending, failure, history, kind, point, statuses, submission, until};
use crate::support::stores::on_every_backend;

#[tokio::test(flavor = "multi_thread")]
async fn the_last_events_of_a_run_come_before_its_end() {
    on_every_backend(10, async |store| {
        for count in [1, 700] {
            let id = store.submit(submission()).await.unwrap().plan.id;
            let lease = store.claim().await.unwrap();
            let told: Vec<_> = (1..=count).map(|nth| point(nth, Some(500.0))).collect();
            store.append(&lease, vec![point(0, None)]).await.unwrap();
            let ended = store
                .finish(&lease, failure().after(told.clone(), 12_500))
                .await
                .unwrap();
            assert_eq!(
                (ended.iteration, ended.best_cost),
                (count as u64, Some(500.0))
            );
            let history = history(&**store, id).await;
            assert_eq!(statuses(&history).len(), 3);
            assert_eq!(history[2], point(0, None));
            assert_eq!(history[3..3 + count], told);
            let end = [Event::Status(Box::new(ended)), Event::End(Status::Failed)];
            assert_eq!(history[3 + count..], end);
            let late = store.finish(&lease, failure().after(told, 13_000)).await;
            assert_eq!(kind(late), Err("lease lost"));
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_updates_the_plan_record() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        store
            .append(&lease, vec![point(0, None), point(1, None)])
            .await
            .unwrap();
        let early = store.get(id).await.unwrap();
        assert_eq!((early.feasible, early.best_cost), (Some(false), None));
        store
            .append(&lease, vec![point(2, Some(480.0)), point(4, Some(475.5))])
            .await
            .unwrap();
        let later = store.get(id).await.unwrap();
        assert_eq!((later.feasible, later.best_cost), (Some(true), Some(475.5)));
        assert_eq!((later.iteration, later.evaluations), (4, 100));
        assert!((later.progress - 0.4).abs() < 1e-12);
        assert!(lease.plan.revision < early.revision && early.revision < later.revision);

        let ended = store
            .finish(&lease, ending(Status::Succeeded).at(12_500))
            .await
            .unwrap();
        assert_eq!(ended, store.get(id).await.unwrap());
        assert_eq!(
            (ended.status, ended.finished_ms),
            (Status::Succeeded, Some(12_500))
        );
        assert_eq!((ended.best_cost, ended.evaluations), (Some(471.2), 220));
        assert_eq!(ended.stop_reason.as_deref(), Some("iterations"));
        assert!((ended.progress - 1.0).abs() < 1e-12 && ended.revision > later.revision);

        let told = history(&**store, id).await;
        assert_eq!(
            statuses(&told),
            [Status::Queued, Status::Running, Status::Succeeded]
        );
        assert_eq!(
            told[2..6],
            [
                point(0, None),
                point(1, None),
                point(2, Some(480.0)),
                point(4, Some(475.5))
            ]
        );
        assert_eq!(
            told[6..],
            [
                Event::Status(Box::new(ended)),
                Event::End(Status::Succeeded)
            ]
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failed_run_keeps_its_error() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        store.finish(&lease, failure().at(12_000)).await.unwrap();
        let plan = store.get(id).await.unwrap();
        let Ending::Failed(expected) = failure() else {
            unreachable!("that is what it makes")
        };
        assert_eq!((plan.status, plan.error), (Status::Failed, Some(expected)));
        assert_eq!(plan.stop_reason, None);
        assert_eq!(store.result(id).await.unwrap(), None);
        assert_eq!(
            history(&**store, id).await.last(),
            Some(&Event::End(Status::Failed))
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_result_is_kept_byte_for_byte() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        store
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        let Ending::Result { document, .. } = ending(Status::Succeeded) else {
            unreachable!("that is what it makes")
        };
        assert_eq!(store.result(id).await.unwrap().as_ref(), Some(&document));
        let (plan, told) = (store.get(id).await.unwrap(), history(&**store, id).await);
        store.reopen().await;
        assert_eq!(store.result(id).await.unwrap(), Some(document));
        assert_eq!(store.get(id).await.unwrap(), plan);
        assert_eq!(history(&**store, id).await, told);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_lease_changes_nothing() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let released = store.claim().await.unwrap();
        store.release(&released).await.unwrap();
        let recovered = store.claim().await.unwrap();
        store.reopen().await;
        let ended = store.claim().await.unwrap();
        store.append(&ended, vec![point(0, None)]).await.unwrap();
        for stale in [&released, &recovered] {
            assert_eq!(
                kind(store.append(stale, vec![point(5, None)]).await),
                Err("lease lost")
            );
            assert_eq!(
                kind(store.finish(stale, failure().at(0)).await),
                Err("lease lost")
            );
            assert_eq!(kind(store.release(stale).await), Err("lease lost"));
        }
        store
            .finish(&ended, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        let plan = store.get(id).await.unwrap();
        let told = history(&**store, id).await;
        assert_eq!(kind(store.append(&ended, vec![]).await), Err("lease lost"));
        assert_eq!(
            kind(store.finish(&ended, failure().at(0)).await),
            Err("lease lost")
        );
        assert_eq!(kind(store.release(&ended).await), Err("lease lost"));
        assert_eq!(store.get(id).await.unwrap(), plan);
        assert_eq!(history(&**store, id).await, told);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_queued_plan_is_cancelled_at_once_without_a_result() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let next = store.submit(submission()).await.unwrap().plan.id;
        let plan = store.request_cancel(id, 11_000).await.unwrap();
        assert_eq!(
            (plan.status, plan.finished_ms),
            (Status::Cancelled, Some(11_000))
        );
        assert_eq!((plan.queue_position, &plan.stop_reason), (None, &None));
        assert_eq!(store.result(id).await.unwrap(), None);
        let told = history(&**store, id).await;
        assert_eq!(statuses(&told), [Status::Queued, Status::Cancelled]);
        assert_eq!(told.last(), Some(&Event::End(Status::Cancelled)));
        // A second cancel changes nothing.
        assert_eq!(store.request_cancel(id, 12_000).await.unwrap(), plan);
        assert_eq!(history(&**store, id).await, told);
        assert_eq!(store.get(next).await.unwrap().queue_position, Some(1));
        assert_eq!(store.claim().await.unwrap().plan.id, next);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_running_plan_is_told_to_stop_and_ends_with_its_result() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let mut lease = store.claim().await.unwrap();
        assert!(!*lease.cancel.borrow());
        let plan = store.request_cancel(id, 11_000).await.unwrap();
        assert_eq!(
            (plan.status, plan.cancel_requested),
            (Status::Running, true)
        );
        assert_eq!(store.request_cancel(id, 11_500).await.unwrap(), plan);
        assert!(*lease.cancel.wait_for(|cancelled| *cancelled).await.unwrap());
        store
            .finish(&lease, ending(Status::Cancelled).at(12_000))
            .await
            .unwrap();
        let plan = store.request_cancel(id, 13_000).await.unwrap();
        assert_eq!(
            (plan.status, plan.finished_ms),
            (Status::Cancelled, Some(12_000))
        );
        assert!(store.result(id).await.unwrap().is_some());
        let told = history(&**store, id).await;
        assert_eq!(
            statuses(&told),
            [
                Status::Queued,
                Status::Running,
                Status::Running,
                Status::Cancelled
            ]
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_plan_is_never_claimed_again() {
    on_every_backend(10, async |store| {
        let released = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        store.request_cancel(released, 11_000).await.unwrap();
        let plan = store.release(&lease).await.unwrap();
        assert_eq!(plan, store.get(released).await.unwrap());

        let recovered = store.submit(submission()).await.unwrap().plan.id;
        let _lease = store.claim().await.unwrap();
        store.request_cancel(recovered, 11_000).await.unwrap();
        store.reopen().await;
        for id in [released, recovered] {
            let plan = store.get(id).await.unwrap();
            assert_eq!(
                (plan.status, plan.finished_ms),
                (Status::Cancelled, Some(10_000))
            );
            assert_eq!(
                history(&**store, id).await.last(),
                Some(&Event::End(Status::Cancelled))
            );
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_that_loses_five_workers_fails() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        // A run that its worker or a closing store gives back does not count against the plan.
        for _ in 0..3 {
            let lease = store.claim().await.unwrap();
            store.release(&lease).await.unwrap();
            store.claim().await.unwrap();
            store.reopen().await;
            assert_eq!(store.get(id).await.unwrap().status, Status::Queued);
        }
        for attempt in 7..12 {
            let lease = store.claim().await.unwrap();
            assert_eq!((lease.plan.id, lease.attempt), (id, attempt));
            store.append(&lease, vec![point(0, None)]).await.unwrap();
            store.lose().await;
        }
        // On a shared store, the loss is detected by the next claim.
        let claimer = store.share();
        let idle = tokio::spawn(async move { claimer.claim().await });
        let plan = until(&**store, id, |plan| plan.status.is_final()).await;
        assert_eq!(plan.status, Status::Failed);
        let error = plan.error.expect("it failed");
        assert_eq!(error.kind, FailureKind::WorkerLost.name());
        assert!(error.detail.starts_with("5 workers"), "{}", error.detail);
        let told = history(&**store, id).await;
        assert_eq!(told.last(), Some(&Event::End(Status::Failed)));
        assert_eq!(statuses(&told).last(), Some(&Status::Failed));
        for event in &told {
            if let Event::Status(plan) = event
                && plan.status == Status::Queued
            {
                assert_eq!(plan.queue_position, Some(1));
            }
        }
        assert_eq!(store.incumbent(id).await.unwrap(), None);
        idle.abort();
        idle.await.ok();
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_ends_once_when_its_endings_race() {
    on_every_backend(300, async |store| {
        for round in 0..150 {
            let id = store.submit(submission()).await.unwrap().plan.id;
            let (claimer, canceller) = (store.share(), store.share());
            // In half of the rounds the plan runs before anything can cancel it.
            let lease = if round % 2 == 0 {
                Some(store.claim().await.unwrap())
            } else {
                None
            };
            let worker = tokio::spawn(async move {
                let lease = match lease {
                    Some(lease) => lease,
                    None => claimer.claim().await.unwrap(),
                };
                claimer.append(&lease, vec![point(0, None)]).await.ok();
                let ends = [
                    claimer.finish(&lease, ending(Status::Succeeded).at(1)),
                    claimer.finish(&lease, failure().at(2)),
                    claimer.finish(&lease, ending(Status::Cancelled).at(3)),
                ];
                let done = join_all(ends).await.into_iter().flatten().count();
                assert_eq!(done, 1);
            });
            let cancels = (0..3).map(|_| {
                let store = Arc::clone(&canceller);
                tokio::spawn(async move { store.request_cancel(id, 4).await.map(|_| ()) })
            });
            let cancels = join_all(cancels.collect::<Vec<_>>()).await;
            assert!(cancels.into_iter().all(|cancel| cancel.unwrap().is_ok()));
            until(&**store, id, |plan| plan.status.is_final()).await;

            let status = store.get(id).await.unwrap().status;
            let told = history(&**store, id).await;
            let path = statuses(&told);
            if path.contains(&Status::Running) {
                worker.await.unwrap();
            } else {
                // Cancelled in the queue: its worker has nothing to claim and waits for ever.
                worker.abort();
                worker.await.unwrap_err();
            }
            let ends = told
                .iter()
                .filter(|event| matches!(event, Event::End(_)))
                .count();
            assert_eq!(ends, 1, "{told:?}");
            assert_eq!(told.last(), Some(&Event::End(status)));
            assert!(
                path.windows(2)
                    .all(|step| step[0] == step[1] || step[0].may_become(step[1]))
            );
        }
    })
    .await;
}
