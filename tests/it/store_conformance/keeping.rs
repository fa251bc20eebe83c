//! What is retained, and for how long.

use noctule::job::{Event, PlanId, Status, Submission};
use noctule::store::{Retention, SWEEP, Store, StoreError, TOMBSTONE_MS};

use crate::support::plans::{ending, failure, history, kind, point, submission};
use crate::support::run::incumbent;
use crate::support::stores::{Fixture, on_every_backend};

/// Submits a plan and ends it now.
async fn ended(store: &Fixture) -> PlanId {
    store.submit(submission()).await.unwrap();
    let lease = store.claim().await.unwrap();
    let now_ms = store.now_ms();
    let ending = ending(Status::Succeeded);
    store.finish(&lease, ending.at(now_ms)).await.unwrap().id
}

async fn kept(store: &dyn Store, ids: &[PlanId]) -> Vec<bool> {
    let mut kept = Vec::new();
    for id in ids {
        kept.push(store.get(*id).await.is_ok());
    }
    kept
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_expires_its_retention_time_after_its_end() {
    on_every_backend(10, async |store| {
        store.retention = Retention {
            age_ms: Some(1_000),
            ..Retention::default()
        };
        store.reopen().await;
        let done = ended(store).await;
        let waiting = store.submit(submission()).await.unwrap().plan;
        assert_eq!(waiting.expires_ms, None);
        let plan = store.get(done).await.unwrap();
        assert_eq!(plan.expires_ms, Some(store.now_ms() + 1_000));
        assert!(matches!(
            history(&**store, done).await.iter().nth_back(1),
            Some(Event::Status(told)) if told.expires_ms == plan.expires_ms
        ));

        store.pass_ms(999);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 0);
        let mut changes = store.changes(done);
        store.pass_ms(1);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 1);
        changes.changed().await.unwrap();
        let gone = store.get(done).await.unwrap_err();
        assert!(matches!(gone, StoreError::Gone(tombstone) if tombstone.expired));
        assert_eq!(kind(store.get(waiting.id).await), Ok(()));
        assert_eq!(kind(store.delete(done, store.now_ms()).await), Ok(()));
        store.pass_ms(TOMBSTONE_MS);
        assert_eq!(kind(store.get(done).await), Err("not found"));

        // An expiry time already promised stands when the setting changes.
        let promised = ended(store).await;
        store.retention = Retention::default();
        store.reopen().await;
        let endless = ended(store).await;
        store.pass_ms(1_000_000);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 1);
        assert_eq!(kept(&**store, &[promised, endless]).await, [false, true]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn beyond_the_plan_limit_the_earliest_ended_plans_are_removed() {
    on_every_backend(1_000, async |store| {
        store.retention = Retention {
            plans: Some(3),
            ..Retention::default()
        };
        store.reopen().await;
        // The order of the ends counts, not the order of acceptance.
        let mut leases = Vec::new();
        for _ in 0..5 {
            store.submit(submission()).await.unwrap();
            leases.push(store.claim().await.unwrap());
        }
        for lease in leases.iter().rev() {
            store.pass_ms(1);
            store
                .finish(lease, failure().at(store.now_ms()))
                .await
                .unwrap();
        }
        let waiting = store.submit(submission()).await.unwrap().plan.id;
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 2);
        let ids: Vec<_> = leases.iter().map(|lease| lease.plan.id).collect();
        let expected = [true, true, true, false, false];
        assert_eq!(kept(&**store, &ids).await, expected);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 0);
        assert_eq!(kind(store.get(waiting).await), Ok(()));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn beyond_the_byte_limit_the_earliest_ended_plans_are_removed() {
    on_every_backend(10, async |store| {
        store.retention = Retention::default();
        store.reopen().await;
        let mut ids = Vec::new();
        for _ in 0..4 {
            store.pass_ms(1);
            let large = Submission {
                scenario: "x".repeat(100_000),
                ..submission()
            };
            ids.push(store.submit(large).await.unwrap().plan.id);
            let lease = store.claim().await.unwrap();
            let now_ms = store.now_ms();
            store.finish(&lease, failure().at(now_ms)).await.unwrap();
        }
        store.retention.bytes = Some(250_000);
        store.reopen().await;
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 2);
        let expected = [false, false, true, true];
        assert_eq!(kept(&**store, &ids).await, expected);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 0);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn kept_events_count_towards_the_byte_limit() {
    const LIMIT: u64 = 20_000;
    on_every_backend(10, async |store| {
        store.retention.bytes = Some(LIMIT);
        for (events_kept, is_kept) in [(u64::MAX, false), (50, true)] {
            store.events_kept = events_kept;
            store.reopen().await;
            let id = store.submit(submission()).await.unwrap().plan.id;
            let lease = store.claim().await.unwrap();
            for iteration in 0..1_000 {
                let told = vec![incumbent(iteration, 0.5)];
                store.append(&lease, told).await.unwrap();
            }
            let now_ms = store.now_ms();
            store.finish(&lease, failure().at(now_ms)).await.unwrap();
            store.sweep(now_ms).await.unwrap();
            assert_eq!(kept(&**store, &[id]).await, [is_kept], "{events_kept}");
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_events_of_large_steps_are_kept() {
    on_every_backend(10, async |store| {
        store.events_kept = 100;
        store.reopen().await;
        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        for step in 0..20 {
            let told = (0..40).map(|nth| point(40 * step + nth, None)).collect();
            store.append(&lease, told).await.unwrap();
        }
        store.lose().await;
        let told = history(&**store, id).await.len();
        assert!((100..=200).contains(&told), "{told}");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sweep_is_bounded_and_the_next_one_continues() {
    on_every_backend(10, async |store| {
        store.retention = Retention {
            plans: Some(0),
            ..Retention::default()
        };
        store.reopen().await;
        for _ in 0..SWEEP + 5 {
            ended(store).await;
        }
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), SWEEP);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 5);
        assert_eq!(store.sweep(store.now_ms()).await.unwrap(), 0);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_events_of_a_long_history_are_kept() {
    on_every_backend(10, async |store| {
        store.events_kept = 20;
        store.reopen().await;
        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        let page = store.events(id, 0, 100).await.unwrap();
        assert_eq!((page.forgotten, page.events.len()), (0, 2));
        for iteration in 0..100 {
            let batch = vec![point(iteration, None), incumbent(iteration, 0.5)];
            store.append(&lease, batch).await.unwrap();
            let page = store.events(id, 0, 1_000).await.unwrap();
            let told = 2 * (iteration as u64 + 1) + 2;
            let least = told.min(20);
            assert!(page.events.len() as u64 >= least && page.events.len() <= 40);
            assert_eq!(page.forgotten + page.events.len() as u64, told);
            assert_eq!(page.events[0].id, page.forgotten + 1);
            let rest = store.events(id, told - 3, 2).await.unwrap();
            assert_eq!(rest.forgotten, page.forgotten);
            assert_eq!(rest.events, page.events[page.events.len() - 3..][..2]);
        }
        store
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        let told = history(&**store, id).await;
        assert_eq!(told.last(), Some(&Event::End(Status::Succeeded)));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_best_route_of_the_current_run_is_kept() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        assert_eq!(store.incumbent(id).await.unwrap(), None);
        let lease = store.claim().await.unwrap();
        let Event::Incumbent(best) = incumbent(4, 2.0) else {
            unreachable!("as it is named")
        };
        let told = vec![
            incumbent(3, 1.0),
            Event::Incumbent(best.clone()),
            point(5, Some(1.0)),
        ];
        store.append(&lease, told).await.unwrap();
        store
            .append(&lease, vec![point(6, Some(1.0))])
            .await
            .unwrap();
        assert_eq!(store.incumbent(id).await.unwrap(), Some(best));
        store.reopen().await;
        assert_eq!(
            store.incumbent(id).await.unwrap(),
            None,
            "the run begins again"
        );

        let lease = store.claim().await.unwrap();
        store.append(&lease, vec![incumbent(1, 0.1)]).await.unwrap();
        assert!(store.incumbent(id).await.unwrap().is_some());
        store.finish(&lease, failure().at(0)).await.unwrap();
        assert_eq!(store.incumbent(id).await.unwrap(), None);
        store.delete(id, store.now_ms()).await.unwrap();
        assert_eq!(kind(store.incumbent(id).await), Err("gone"));

        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        store.append(&lease, vec![incumbent(1, 0.1)]).await.unwrap();
        store.request_cancel(id, store.now_ms()).await.unwrap();
        let given_back = store.release(&lease).await.unwrap();
        assert_eq!(given_back.status, Status::Cancelled);
        assert_eq!(store.incumbent(id).await.unwrap(), None);

        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        store.append(&lease, vec![incumbent(1, 0.1)]).await.unwrap();
        store
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        assert!(store.result(id).await.unwrap().is_some());
        assert_eq!(store.incumbent(id).await.unwrap(), None);
        let unknown = store.incumbent(PlanId::now_v7()).await;
        assert_eq!(kind(unknown), Err("not found"));
    })
    .await;
}
