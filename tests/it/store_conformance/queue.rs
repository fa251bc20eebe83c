//! From acceptance to the claim.

use futures_util::FutureExt;
use futures_util::future::join_all;
use noctule::job::{Event, Status};
use noctule::store::ListQuery;

use crate::support::patience::in_time;
use crate::support::plans::{
    ALL, ending, failure, history, kind, point, statuses, submission, until,
};
use crate::support::stores::on_every_backend;

#[tokio::test(flavor = "multi_thread")]
async fn an_accepted_plan_reads_back_as_submitted() {
    on_every_backend(10, async |store| {
        let first = submission();
        store.submit(submission()).await.unwrap();
        let accepted = store.submit(first.clone()).await.unwrap().plan;
        let read = store.get(first.id).await.unwrap();
        assert_eq!(read, accepted);
        assert_eq!(
            (read.status, read.queue_position),
            (Status::Queued, Some(2))
        );
        assert_eq!((read.name, read.seed), (first.name, first.seed));
        assert_eq!((read.iterations, read.created_ms), (10, 1_000));
        assert_eq!(store.scenario(first.id).await.unwrap(), first.scenario);
        assert_eq!(store.result(first.id).await.unwrap(), None);
        assert_eq!(
            history(&**store, first.id).await,
            [Event::Status(Box::new(accepted))]
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn plans_are_claimed_in_the_order_of_acceptance() {
    on_every_backend(20, async |store| {
        let mut ids = Vec::new();
        for _ in 0..20 {
            ids.push(store.submit(submission()).await.unwrap().plan.id);
        }
        for (place, id) in ids.iter().enumerate() {
            let position = store.get(*id).await.unwrap().queue_position;
            assert_eq!(position, Some(place as u64 + 1));
        }
        for id in ids {
            let lease = store.claim().await.unwrap();
            assert_eq!(lease.plan.id, id);
            assert_eq!(&*lease.scenario, store.scenario(id).await.unwrap());
            assert_eq!(store.get(id).await.unwrap(), lease.plan);
            assert_eq!(lease.plan.started_ms, Some(10_000));
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_refuses_and_a_claim_makes_room() {
    on_every_backend(3, async |store| {
        let tries = join_all((0..10).map(|_| store.submit(submission()))).await;
        let accepted = tries.into_iter().flatten().count();
        assert_eq!(accepted, 3);
        assert_eq!(kind(store.submit(submission()).await), Err("queue full"));
        assert_eq!(store.list(ALL).await.unwrap().len(), 3);

        let lease = store.claim().await.unwrap();
        assert_eq!(kind(store.submit(submission()).await), Ok(()));
        assert_eq!(kind(store.submit(submission()).await), Err("queue full"));
        // A released plan has been accepted already.
        store.release(&lease).await.unwrap();
        assert_eq!(store.stats().await.unwrap().queued, 4);
        store.request_cancel(lease.plan.id, 0).await.unwrap();
        assert_eq!(kind(store.submit(submission()).await), Err("queue full"));
        let waiting = ListQuery {
            status: Some(Status::Queued),
            ..ALL
        };
        let youngest = store.list(waiting).await.unwrap()[0].id;
        store.delete(youngest, 0).await.unwrap();
        assert_eq!(kind(store.submit(submission()).await), Ok(()));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_early_lease_runs_its_plan() {
    on_every_backend(10, async |store| {
        let waiting = store.claim_early();
        let first = store.submit(submission()).await.unwrap().plan.id;
        let second = store.submit(submission()).await.unwrap().plan.id;
        let leases = [waiting.await.unwrap(), store.claim_early().await.unwrap()];
        assert_eq!(leases.clone().map(|lease| lease.plan.id), [first, second]);
        // Later operations find the claim even if it was made durable late.
        store
            .append(&leases[0], vec![point(1, None)])
            .await
            .unwrap();
        let ended = store.finish(&leases[0], ending(Status::Succeeded).at(12_000));
        assert_eq!(ended.await.unwrap().status, Status::Succeeded);
        let told = history(&**store, first).await;
        let expected = [Status::Queued, Status::Running, Status::Succeeded];
        assert_eq!(statuses(&told), expected);
        store.request_cancel(second, 13_000).await.unwrap();
        assert!(*leases[1].cancel.borrow(), "whoever runs it is told");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_claim_waits_for_a_plan() {
    on_every_backend(10, async |store| {
        let mut claims: Vec<_> = (0..3).map(|_| Box::pin(store.claim())).collect();
        for claim in &mut claims {
            assert!(claim.now_or_never().is_none());
        }
        store.health().await.unwrap();
        for claim in &mut claims {
            assert!(claim.now_or_never().is_none());
        }
        let mut submitted = Vec::new();
        for _ in 0..3 {
            submitted.push(store.submit(submission()).await.unwrap().plan.id);
        }
        let claimed = join_all(claims).await;
        let mut claimed: Vec<_> = claimed
            .into_iter()
            .map(|lease| lease.unwrap().plan.id)
            .collect();
        claimed.sort_unstable();
        assert_eq!(claimed, submitted);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_claim_takes_no_plan() {
    on_every_backend(10, async |store| {
        // Dropped while waiting.
        let mut waiting = Box::pin(store.claim());
        assert!(waiting.as_mut().now_or_never().is_none());
        drop(waiting);
        let id = store.submit(submission()).await.unwrap().plan.id;
        assert_eq!(store.get(id).await.unwrap().status, Status::Queued);

        // Dropped at any time after it was sent, with its answer on the way or already there.
        for round in 0..50 {
            let mut claim = Box::pin(store.claim());
            // A claim that is answered at once holds the plan and gives it back.
            if let Some(lease) = claim.as_mut().now_or_never() {
                store.release(&lease.unwrap()).await.unwrap();
            } else if round % 2 == 0 {
                until(&**store, id, |plan| plan.status == Status::Running).await;
            }
            drop(claim);
            until(&**store, id, |plan| plan.status == Status::Queued).await;
        }
        let second = store.submit(submission()).await.unwrap().plan.id;
        assert_eq!(store.claim().await.unwrap().plan.id, id);
        assert_eq!(store.claim().await.unwrap().plan.id, second);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_submission_still_reaches_claimers_and_followers() {
    on_every_backend(10, async |store| {
        let submission = submission();
        let id = submission.id;
        let mut changes = store.changes(id);
        let mut submit = Box::pin(store.submit(submission));
        assert!(submit.as_mut().now_or_never().is_none());
        drop(submit);
        changes.changed().await.unwrap();
        assert_eq!(store.claim().await.unwrap().plan.id, id);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_released_plan_keeps_its_place_and_starts_over() {
    on_every_backend(10, async |store| {
        let ids = [
            store.submit(submission()).await.unwrap().plan.id,
            store.submit(submission()).await.unwrap().plan.id,
            store.submit(submission()).await.unwrap().plan.id,
        ];
        let first = store.claim().await.unwrap();
        let second = store.claim().await.unwrap();
        store
            .append(&first, vec![point(3, Some(480.0))])
            .await
            .unwrap();
        store.release(&second).await.unwrap();
        let released = store.release(&first).await.unwrap();
        let plan = store.get(ids[0]).await.unwrap();
        assert_eq!(released, plan);
        assert_eq!(
            (plan.status, plan.queue_position),
            (Status::Queued, Some(1))
        );
        assert_eq!(
            (plan.iteration, plan.evaluations, plan.best_cost),
            (0, 0, None)
        );
        assert_eq!((plan.feasible, plan.started_ms), (None, None));
        assert_eq!(
            history(&**store, ids[0]).await.last(),
            Some(&Event::Status(Box::new(plan)))
        );
        for id in ids {
            assert_eq!(store.claim().await.unwrap().plan.id, id);
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn others_go_before_a_postponed_plan() {
    on_every_backend(10, async |store| {
        let mut ids = Vec::new();
        for _ in 0..4 {
            ids.push(store.submit(submission()).await.unwrap().plan.id);
        }
        for id in &ids[..2] {
            let lease = store.claim().await.unwrap();
            assert_eq!(lease.plan.id, *id);
            let postponed = store.postpone(&lease).await.unwrap();
            assert_eq!(postponed, store.get(*id).await.unwrap());
            assert_eq!(postponed.status, Status::Queued);
            let late = store.append(&lease, vec![point(1, None)]).await;
            assert_eq!(kind(late), Err("lease lost"));
        }
        assert_eq!(store.get(ids[0]).await.unwrap().queue_position, Some(1));
        for id in [ids[2], ids[3], ids[0]] {
            let lease = in_time(store.claim()).await.unwrap();
            assert_eq!(lease.plan.id, id);
            store.finish(&lease, failure().at(20_000)).await.unwrap();
        }
        // One that was postponed is as good as any other once it is run.
        let last = in_time(store.claim()).await.unwrap();
        store.release(&last).await.unwrap();
        let behind = store.submit(submission()).await.unwrap().plan.id;
        for id in [ids[1], behind] {
            assert_eq!(in_time(store.claim()).await.unwrap().plan.id, id);
        }
    })
    .await;
}
