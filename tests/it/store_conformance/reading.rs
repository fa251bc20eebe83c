//! What can be read, and for how long.

use noctule::job::{Event, NumberedEvent, PlanId, Status, Submission};
use noctule::store::{ListQuery, Store, StoreError, TOMBSTONE_MS};

use crate::support::plans::{
    ALL, ending, failure, history, kind, point, statuses, submission, until,
};
use crate::support::stores::on_every_backend;

#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_plan_is_not_found() {
    on_every_backend(10, async |store| {
        let id = PlanId::now_v7();
        assert_eq!(kind(store.get(id).await), Err("not found"));
        assert_eq!(kind(store.scenario(id).await), Err("not found"));
        assert_eq!(kind(store.result(id).await), Err("not found"));
        assert_eq!(kind(store.events(id, 0, 10).await), Err("not found"));
        assert_eq!(kind(store.request_cancel(id, 0).await), Err("not found"));
        assert_eq!(kind(store.delete(id, 0).await), Err("not found"));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_that_expects_a_revision_is_made_to_that_revision_alone() {
    on_every_backend(10, async |store| {
        let queued = store.submit(submission()).await.unwrap().plan;
        let (id, seen) = (queued.id, Some(queued.revision));
        let lease = store.claim().await.unwrap();
        let running = store.get(id).await.unwrap();
        let cancelled = store.request_cancel_if(id, seen, 0).await;
        let Err(StoreError::Changed(now)) = &cancelled else {
            panic!("{cancelled:?}");
        };
        assert_eq!(
            (now.status, now.revision),
            (Status::Running, running.revision)
        );
        let now_ms = store.now_ms();
        assert_eq!(
            kind(store.delete_if(id, seen, now_ms).await),
            Err("changed")
        );
        assert!(!*lease.cancel.borrow());
        assert_eq!(store.get(id).await.unwrap(), running);

        let seen = Some(running.revision);
        let cancelled = store.request_cancel_if(id, seen, 0).await.unwrap();
        assert!(cancelled.cancel_requested);
        assert_eq!(
            kind(store.request_cancel_if(id, seen, 0).await),
            Err("changed")
        );
        let seen = Some(cancelled.revision);
        store.delete_if(id, seen, now_ms).await.unwrap();
        assert_eq!(kind(store.delete_if(id, seen, now_ms).await), Err("gone"));
        assert_eq!(
            kind(store.request_cancel_if(id, seen, 0).await),
            Err("gone")
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deleted_plan_is_gone_for_a_day_and_then_unknown() {
    on_every_backend(10, async |store| {
        let queued = store.submit(submission()).await.unwrap().plan.id;
        let running = store.submit(submission()).await.unwrap().plan.id;
        let ended = store.submit(submission()).await.unwrap().plan.id;
        store.delete(queued, store.now_ms()).await.unwrap();
        let mut lease = store.claim().await.unwrap();
        assert_eq!(lease.plan.id, running);
        let last = store.claim().await.unwrap();
        store
            .finish(&last, ending(Status::Succeeded).at(0))
            .await
            .unwrap();

        let mut changes = store.changes(running);
        store.delete(running, store.now_ms()).await.unwrap();
        store.delete(ended, store.now_ms()).await.unwrap();
        changes.changed().await.unwrap();
        assert!(*lease.cancel.wait_for(|cancelled| *cancelled).await.unwrap());
        assert_eq!(
            kind(store.append(&lease, vec![point(0, None)]).await),
            Err("lease lost")
        );
        assert_eq!(
            kind(store.finish(&lease, failure().at(0)).await),
            Err("lease lost")
        );
        assert_eq!(kind(store.release(&lease).await), Err("lease lost"));

        store.pass_ms(TOMBSTONE_MS - 1);
        store.reopen().await;
        for id in [queued, running, ended] {
            assert_eq!(kind(store.delete(id, store.now_ms()).await), Ok(()));
            assert_eq!(kind(store.get(id).await), Err("gone"));
            assert_eq!(kind(store.scenario(id).await), Err("gone"));
            assert_eq!(kind(store.result(id).await), Err("gone"));
            assert_eq!(kind(store.events(id, 0, 10).await), Err("gone"));
            assert_eq!(kind(store.request_cancel(id, 0).await), Err("gone"));
        }
        store.pass_ms(1);
        for id in [queued, running, ended] {
            assert_eq!(kind(store.get(id).await), Err("not found"));
            assert_eq!(kind(store.request_cancel(id, 0).await), Err("not found"));
            assert_eq!(
                kind(store.delete(id, store.now_ms()).await),
                Err("not found")
            );
        }
        assert_eq!(store.list(ALL).await.unwrap(), []);
        let stats = store.stats().await.unwrap();
        assert_eq!((stats.queued, stats.running), (0, 0));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn events_are_read_without_loss_or_repeat_from_any_position() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        let lease = store.claim().await.unwrap();
        let mut iteration = 0;
        for size in [1, 2, 0, 7, 300, 3] {
            let batch = (0..size).map(|_| {
                iteration += 1;
                point(iteration, None)
            });
            store.append(&lease, batch.collect()).await.unwrap();
        }
        store
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();

        let all = store.events(id, 0, usize::MAX).await.unwrap().events;
        assert_eq!(all.len(), 2 + 313 + 2);
        assert_eq!(all[0].id, 1);
        assert!(all.windows(2).all(|pair| pair[0].id < pair[1].id));
        assert_eq!(
            all.last().map(|last| &last.event),
            Some(&Event::End(Status::Succeeded))
        );
        for limit in [1, 2, 5, 100, 1_000] {
            assert_eq!(read_by(&**store, id, limit).await, all, "limit {limit}");
        }
        for after in [0, 1, 2, 3, 4, 11, 12, 200, 316, 317, 318, u64::MAX] {
            let rest: Vec<_> = all
                .iter()
                .filter(|event| event.id > after)
                .cloned()
                .collect();
            assert_eq!(
                store.events(id, after, usize::MAX).await.unwrap().events,
                rest,
                "after {after}"
            );
        }
        assert_eq!(store.events(id, 0, 0).await.unwrap().events, []);
        for (event, told) in [(0, true), (1, true), (317, true), (318, false)] {
            assert_eq!(store.has_event(id, event).await.unwrap(), told, "{event}");
        }
    })
    .await;
}

async fn read_by(store: &dyn Store, id: PlanId, limit: usize) -> Vec<NumberedEvent> {
    let mut read: Vec<NumberedEvent> = Vec::new();
    loop {
        let after = read.last().map_or(0, |last| last.id);
        let page = store.events(id, after, limit).await.unwrap().events;
        assert!(page.len() <= limit);
        if page.is_empty() {
            return read;
        }
        read.extend(page);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn event_ids_increase_across_releases_and_restarts() {
    on_every_backend(10, async |store| {
        let id = store.submit(submission()).await.unwrap().plan.id;
        for round in 0..4 {
            let lease = store.claim().await.unwrap();
            store
                .append(&lease, vec![point(round, None)])
                .await
                .unwrap();
            if round % 2 == 0 {
                store.release(&lease).await.unwrap();
            } else {
                store.reopen().await;
            }
        }
        let all = store.events(id, 0, usize::MAX).await.unwrap().events;
        assert_eq!(all.len(), 1 + 4 * 3);
        assert!(all.windows(2).all(|pair| pair[0].id < pair[1].id));
        let told = history(&**store, id).await;
        let path = statuses(&told);
        assert!(path.windows(2).all(|step| step[0].may_become(step[1])));
        let revisions: Vec<_> = told
            .iter()
            .filter_map(|event| match event {
                Event::Status(plan) => Some(plan.revision),
                _ => None,
            })
            .collect();
        assert!(revisions.is_sorted_by(|a, b| a < b), "{revisions:?}");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_follower_that_subscribes_before_reading_misses_nothing() {
    on_every_backend(50, async |store| {
        for _ in 0..20 {
            let id = store.submit(submission()).await.unwrap().plan.id;
            let lease = store.claim().await.unwrap();
            let shared = store.share();
            let followers = [0, 1, 2].map(|_| {
                let store = store.share();
                tokio::spawn(async move {
                    let mut changes = store.changes(id);
                    let mut read: Vec<NumberedEvent> = Vec::new();
                    while !matches!(
                        read.last(),
                        Some(NumberedEvent {
                            event: Event::End(_),
                            ..
                        })
                    ) {
                        let after = read.last().map_or(0, |last| last.id);
                        let page = store.events(id, after, 4).await.unwrap().events;
                        if page.is_empty() {
                            changes.changed().await.unwrap();
                        }
                        read.extend(page);
                    }
                    read
                })
            });
            for iteration in 0..10 {
                shared
                    .append(&lease, vec![point(iteration, None)])
                    .await
                    .unwrap();
            }
            shared
                .finish(&lease, ending(Status::Succeeded).at(0))
                .await
                .unwrap();
            let all = shared.events(id, 0, usize::MAX).await.unwrap().events;
            for follower in followers {
                assert_eq!(follower.await.unwrap(), all);
            }
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn plans_are_listed_newest_first_by_status_and_page() {
    on_every_backend(50, async |store| {
        let mut ids = Vec::new();
        for _ in 0..25 {
            ids.push(store.submit(submission()).await.unwrap().plan.id);
        }
        let lease = store.claim().await.unwrap();
        store
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        let _running = store.claim().await.unwrap();
        store.request_cancel(ids[24], 0).await.unwrap();

        let newest_first: Vec<_> = ids.iter().rev().copied().collect();
        let all = store.list(ALL).await.unwrap();
        assert_eq!(
            all.iter().map(|plan| plan.id).collect::<Vec<_>>(),
            newest_first
        );
        for plan in &all {
            assert_eq!(*plan, store.get(plan.id).await.unwrap());
        }
        for limit in [1, 2, 7, 24, 25, 26] {
            let mut paged = Vec::new();
            loop {
                let before = paged.last().copied();
                let query = ListQuery {
                    status: None,
                    owner: None,
                    before,
                    limit,
                };
                let page = store.list(query).await.unwrap();
                if page.is_empty() {
                    break;
                }
                paged.extend(page.iter().map(|plan| plan.id));
            }
            assert_eq!(paged, newest_first, "limit {limit}");
        }
        let of_status = async |status, before| {
            let query = ListQuery {
                status: Some(status),
                owner: None,
                before,
                limit: 1_000,
            };
            let page = store.list(query).await.unwrap();
            page.into_iter().map(|plan| plan.id).collect::<Vec<_>>()
        };
        assert_eq!(of_status(Status::Succeeded, None).await, [ids[0]]);
        assert_eq!(of_status(Status::Running, None).await, [ids[1]]);
        assert_eq!(of_status(Status::Cancelled, None).await, [ids[24]]);
        assert!(of_status(Status::Failed, None).await.is_empty());
        assert_eq!(
            of_status(Status::Queued, Some(ids[4])).await,
            [ids[3], ids[2]]
        );

        // A page cursor stays valid when its plan has been deleted.
        store.delete(ids[20], 0).await.unwrap();
        let rest = ListQuery {
            before: Some(ids[20]),
            ..ALL
        };
        assert_eq!(store.list(rest).await.unwrap().len(), 20);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_mean_run_time_covers_the_last_runs_with_a_result() {
    on_every_backend(50, async |store| {
        assert_eq!(store.stats().await.unwrap().mean_run_ms, None);
        for run in 0..40 {
            store.submit(submission()).await.unwrap();
            let lease = store.claim().await.unwrap();
            store.pass_ms(if run < 20 { 1_000 } else { 300 });
            let status = if run % 2 == 0 {
                Status::Succeeded
            } else {
                Status::Cancelled
            };
            store
                .finish(&lease, ending(status).at(store.now_ms()))
                .await
                .unwrap();
        }
        store.submit(submission()).await.unwrap();
        let lease = store.claim().await.unwrap();
        store.pass_ms(1_000_000);
        store
            .finish(&lease, failure().at(store.now_ms()))
            .await
            .unwrap();
        let unseen = store.submit(submission()).await.unwrap().plan;
        store
            .request_cancel(unseen.id, store.now_ms())
            .await
            .unwrap();
        let check_mean = async |expected: f64| {
            let mean_run_ms = store.stats().await.unwrap().mean_run_ms;
            assert!(
                mean_run_ms.is_some_and(|mean| (mean - expected).abs() < 1e-9),
                "{mean_run_ms:?} is not {expected}"
            );
        };
        check_mean(300.0).await;

        // A run counts once, however often its webhook is tried.
        let told = Submission {
            webhook: Some("a".to_owned()),
            ..submission()
        };
        store.submit(told).await.unwrap();
        let lease = store.claim().await.unwrap();
        store.pass_ms(2_300);
        let told = store
            .finish(&lease, ending(Status::Succeeded).at(store.now_ms()))
            .await
            .unwrap();
        for due_ms in 1..4 {
            store.webhook_tried(told.id, Some(due_ms)).await.unwrap();
        }
        check_mean(400.0).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn reopening_requeues_running_plans_in_their_order() {
    on_every_backend(50, async |store| {
        let mut ids = Vec::new();
        for _ in 0..9 {
            ids.push(store.submit(submission()).await.unwrap().plan.id);
        }
        let lease = store.claim().await.unwrap();
        store
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        let _first = store.claim().await.unwrap();
        let third = store.claim().await.unwrap();
        store
            .append(&third, vec![point(5, Some(1.0))])
            .await
            .unwrap();
        store.reopen().await;
        let stats = store.stats().await.unwrap();
        assert_eq!((stats.queued, stats.running), (8, 0));
        let plan = store.get(ids[2]).await.unwrap();
        assert_eq!(
            (plan.queue_position, plan.iteration, plan.best_cost),
            (Some(2), 0, None)
        );
        let told = history(&**store, ids[2]).await;
        assert_eq!(told.last(), Some(&Event::Status(Box::new(plan))));
        for id in &ids[1..] {
            assert_eq!(store.claim().await.unwrap().plan.id, *id);
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_closed_store_refuses_everything() {
    on_every_backend(200, async |store| {
        store.health().await.unwrap();
        let shared = store.share();
        let waiting = {
            let store = store.share();
            tokio::spawn(async move {
                loop {
                    store.claim().await?;
                }
            })
        };
        store.close().await;
        let error: Result<(), _> = waiting.await.unwrap();
        assert_eq!(kind(error), Err("unavailable"));
        assert_eq!(kind(shared.health().await), Err("unavailable"));
        assert_eq!(kind(shared.submit(submission()).await), Err("unavailable"));
        assert_eq!(kind(shared.claim().await), Err("unavailable"));
        assert_eq!(kind(shared.stats().await), Err("unavailable"));
        shared.close().await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_closed_store_keeps_what_it_acknowledged() {
    on_every_backend(200, async |store| {
        let tasks = (0..100).map(|_| {
            let store = store.share();
            tokio::spawn(async move { store.submit(submission()).await })
        });
        let mut tasks: Vec<_> = tasks.collect();
        // One at least is acknowledged before the store closes; the others race with that.
        let first = tasks.remove(0).await.unwrap().unwrap();
        let mut acknowledged = vec![first.plan.id];
        store.close().await;
        for task in tasks {
            if let Ok(submitted) = task.await.unwrap() {
                acknowledged.push(submitted.plan.id);
            }
        }
        store.reopen().await;
        for id in acknowledged {
            until(&**store, id, |plan| plan.status == Status::Queued).await;
        }
    })
    .await;
}
