//! Several nodes over the same servers: each sees what the others do, and no two nodes run the same plan.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::collections::BTreeSet;
use std::time::Duration;

use futures_util::future::join_all;
use noctule::config::Address;
use noctule::job::{Event, Idempotency, PlanId, Status, Submission};
use noctule::store::jetstream::{JetStreamStore, Settings};
use noctule::store::{Options, Retention, SWEEP, Store, StoreError, wall_clock};
use parking_lot::Mutex;

use super::{open, open_as};
use crate::support::nats::{self, NatsServer};
use crate::support::patience::in_time;
use crate::support::plans::{ending, history, kind, point, statuses, submission, until};
use crate::support::stores::node;

/// Waits until another node knows the plan.
async fn known(store: &dyn Store, id: PlanId) {
    let mut changes = store.changes(id);
    while store.get(id).await.is_err() {
        changes.changed().await.unwrap();
    }
}

fn of(owner: &str, work: u64) -> Submission {
    Submission {
        owner: Some(owner.to_owned()),
        work,
        ..submission()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_accepted_by_one_node_and_run_by_another_is_readable_on_a_third() {
    let address = nats::address();
    let (accepting, running, telling) =
        tokio::join!(open(&address), open(&address), open(&address));
    let id = accepting.submit(submission()).await.unwrap().plan.id;
    let reader = tokio::spawn(async move {
        known(&*telling, id).await;
        let mut changes = telling.changes(id);
        let mut read = Vec::new();
        while !matches!(read.last(), Some(Event::End(_))) {
            let page = telling.events(id, read.len() as u64, 3).await.unwrap();
            if page.events.is_empty() {
                changes.changed().await.unwrap();
            }
            read.extend(page.events.into_iter().map(|numbered| numbered.event));
        }
        (read, telling.result(id).await.unwrap())
    });
    let lease = running.claim().await.unwrap();
    assert_eq!(&*lease.scenario, accepting.scenario(id).await.unwrap());
    for iteration in 0..20 {
        running
            .append(&lease, vec![point(iteration, None)])
            .await
            .unwrap();
    }
    running
        .finish(&lease, ending(Status::Succeeded).at(0))
        .await
        .unwrap();
    let (read, result) = reader.await.unwrap();
    assert_eq!(read, history(&*running, id).await);
    assert!(result.is_some());
    until(&*accepting, id, |plan| plan.status == Status::Succeeded).await;
}

/// Whoever was told by one node may ask another next, behind a load balancer.
#[tokio::test(flavor = "multi_thread")]
async fn what_one_node_has_told_no_other_node_denies() {
    let address = nats::address();
    let (one, other) = tokio::join!(open(&address), open(&address));
    let present = async |id| other.get(id).await.unwrap().status;
    for _ in 0..20 {
        let id = one.submit(submission()).await.unwrap().plan.id;
        assert_eq!(present(id).await, Status::Queued);
        let lease = one.claim().await.unwrap();
        assert_eq!(present(id).await, Status::Running);
        one.request_cancel(id, 0).await.unwrap();
        assert!(other.get(id).await.unwrap().cancel_requested);
        let end = ending(Status::Cancelled).at(0);
        one.finish(&lease, end).await.unwrap();
        assert!(other.result(id).await.unwrap().is_some());
        assert_eq!(present(id).await, Status::Cancelled);
        assert_eq!(history(&*other, id).await.len(), 5, "up to the end");

        let id = one.submit(submission()).await.unwrap().plan.id;
        one.delete(id, wall_clock()()).await.unwrap();
        assert!(matches!(other.get(id).await, Err(StoreError::Gone(_))));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancel_reaches_the_node_that_runs_the_plan() {
    let address = nats::address();
    let (asked, running) = tokio::join!(open(&address), open(&address));
    let id = asked.submit(submission()).await.unwrap().plan.id;
    let mut lease = running.claim().await.unwrap();
    asked.request_cancel(id, 1).await.unwrap();
    lease.cancel.wait_for(|cancelled| *cancelled).await.unwrap();
    running
        .finish(&lease, ending(Status::Cancelled).at(2))
        .await
        .unwrap();
    until(&*asked, id, |plan| plan.status == Status::Cancelled).await;

    let id = asked.submit(submission()).await.unwrap().plan.id;
    let mut lease = running.claim().await.unwrap();
    asked.delete(id, 1).await.unwrap();
    lease.cancel.wait_for(|cancelled| *cancelled).await.unwrap();
    let late = running
        .finish(&lease, ending(Status::Succeeded).at(2))
        .await;
    assert_eq!(kind(late), Err("lease lost"));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_idempotency_key_makes_one_plan_across_all_nodes() {
    let address = nats::address();
    let nodes = join_all((0..3).map(|_| open(&address))).await;
    let answers = join_all((0..60).map(|nth| {
        nodes[nth % 3].submit(Submission {
            idempotency: Some(Idempotency {
                key: "k".to_owned(),
                body_sha256: "body".to_owned(),
            }),
            ..submission()
        })
    }))
    .await;
    let answers: Vec<_> = answers.into_iter().map(Result::unwrap).collect();
    let ids: BTreeSet<_> = answers.iter().map(|answer| answer.plan.id).collect();
    assert_eq!(ids.len(), 1);
    assert_eq!(answers.iter().filter(|answer| !answer.replayed).count(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn every_plan_is_claimed_once_by_concurrent_nodes() {
    let address = nats::address();
    let nodes = join_all((0..3).map(|_| open(&address))).await;
    let submitted = join_all((0..90).map(|nth| nodes[nth % 3].submit(submission()))).await;
    let submitted: BTreeSet<_> = submitted
        .into_iter()
        .map(|answer| answer.unwrap().plan.id)
        .collect();
    let takers = (0..90).map(|nth| {
        let node = nodes[nth % 3].clone();
        tokio::spawn(async move {
            let lease = node.claim().await.unwrap();
            assert_eq!(lease.attempt, 1);
            node.finish(&lease, ending(Status::Succeeded).at(0))
                .await
                .unwrap();
            lease.plan.id
        })
    });
    let taken: BTreeSet<_> = join_all(takers)
        .await
        .into_iter()
        .map(Result::unwrap)
        .collect();
    assert_eq!(taken, submitted);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_of_a_lost_node_is_run_by_another() {
    let address = nats::address();
    let (lost, other) = tokio::join!(open(&address), open(&address));
    let id = other.submit(submission()).await.unwrap().plan.id;
    let lease = lost.claim().await.unwrap();
    lost.append(&lease, vec![point(1, None)]).await.unwrap();
    drop(lost);
    let lease = other.claim().await.unwrap();
    assert_eq!((lease.plan.id, lease.attempt), (id, 2));
    other
        .finish(&lease, ending(Status::Succeeded).at(0))
        .await
        .unwrap();
    let told = history(&*other, id).await;
    let expected = [
        Status::Queued,
        Status::Running,
        Status::Queued,
        Status::Running,
        Status::Succeeded,
    ];
    assert_eq!(statuses(&told), expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_that_loses_five_nodes_fails() {
    let address = nats::address();
    let settings = || Settings {
        lease: Duration::from_secs(1),
        ..node(&address)
    };
    let observer = open_as(Settings {
        slots: 0,
        ..settings()
    })
    .await;
    let id = observer.submit(submission()).await.unwrap().plan.id;
    for attempt in 1..=5 {
        let lost = open_as(settings()).await;
        assert_eq!(lost.claim().await.unwrap().attempt, attempt);
        drop(lost);
    }
    let last = open_as(settings()).await;
    let idle = tokio::spawn(async move { last.claim().await });
    let plan = until(&*observer, id, |plan| plan.status.is_final()).await;
    assert_eq!(plan.status, Status::Failed);
    assert_eq!(plan.error.unwrap().kind, "worker-lost");
    idle.abort();
}

#[tokio::test(flavor = "multi_thread")]
async fn other_owners_and_small_plans_do_not_wait_behind_a_crowd() {
    let store = open(&nats::address()).await;
    for _ in 0..10 {
        store.submit(of("crowd", 1)).await.unwrap();
    }
    store.submit(of("late", 1)).await.unwrap();
    let mut owners = Vec::new();
    for _ in 0..3 {
        owners.push(store.claim().await.unwrap().plan.owner.unwrap());
    }
    assert_eq!(owners, ["crowd", "late", "crowd"]);

    // One of four slots is reserved for small plans.
    let store = open(&nats::address()).await;
    for _ in 0..6 {
        store.submit(of("same", u64::MAX)).await.unwrap();
    }
    let small = store.submit(of("same", 1)).await.unwrap().plan.id;
    let mut taken = Vec::new();
    for _ in 0..4 {
        taken.push(store.claim().await.unwrap().plan.id);
    }
    assert_eq!(taken[3], small);
}

async fn refusal(settings: Settings) -> String {
    let opened = JetStreamStore::open(settings, Options::new(10)).await;
    match opened.map(drop) {
        Err(StoreError::Unavailable { detail, .. }) => detail,
        other => panic!("{other:?}"),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn servers_without_enough_replicas_or_jetstream_are_refused() {
    let address = nats::address();
    let three = Settings {
        replicas: 3,
        ..node(&address)
    };
    let detail = refusal(three).await;
    assert!(detail.contains("replicas"), "{detail}");

    let plain = NatsServer::without_jetstream();
    let detail = refusal(node(&plain.address())).await;
    assert!(detail.contains("JetStream"), "{detail}");

    let gone = plain.address();
    drop(plain);
    let detail = refusal(node(&gone)).await;
    let Address { servers, .. } = Address::read(&gone).unwrap();
    assert!(detail.contains(&servers[0]), "{detail}");
}

#[tokio::test(flavor = "multi_thread")]
async fn webhooks_behind_those_that_another_node_sends_are_sent() {
    let address = nats::address();
    let (one, other) = tokio::join!(open(&address), open(&address));
    let mut ids = Vec::new();
    for url in ["a", "b"] {
        let submission = Submission {
            webhook: Some(url.to_owned()),
            ..submission()
        };
        let id = one.submit(submission).await.unwrap().plan.id;
        one.request_cancel(id, 1_000).await.unwrap();
        until(&*other, id, |plan| plan.status.is_final()).await;
        ids.push(id);
    }
    for (node, id) in [(&one, ids[0]), (&other, ids[1])] {
        let due = node.due_webhooks(i64::MAX, 1).await.unwrap();
        let due: Vec<_> = due.iter().map(|due| due.plan.id).collect();
        assert_eq!(due, [id]);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn each_node_that_sweeps_removes_as_many_plans_as_one_alone() {
    let address = nats::address();
    let open = async || {
        let retention = Retention {
            age_ms: Some(1),
            ..Retention::default()
        };
        let options = Options {
            retention,
            ..Options::new(1_000)
        };
        JetStreamStore::open(node(&address), options).await.unwrap()
    };
    let (one, other) = tokio::join!(open(), open());
    let n_plans = SWEEP + SWEEP / 2;
    let ended = join_all((0..n_plans).map(async |_| {
        let id = one.submit(submission()).await.unwrap().plan.id;
        one.request_cancel(id, 0).await.unwrap();
        id
    }));
    for id in ended.await {
        until(&other, id, |plan| plan.status.is_final()).await;
    }
    let (by_one, by_other) = tokio::join!(one.sweep(1_000), other.sweep(1_000));
    assert_eq!(by_one.unwrap() + by_other.unwrap(), n_plans);
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_nodes_that_look_for_webhooks_one_sends_each() {
    const PLANS: usize = 200;
    let address = nats::address();
    let (one, other) = tokio::join!(open(&address), open(&address));
    for _ in 0..PLANS {
        let submission = Submission {
            webhook: Some("https://hooks.example/".to_owned()),
            ..submission()
        };
        let id = one.submit(submission).await.unwrap().plan.id;
        one.request_cancel(id, 0).await.unwrap();
    }
    let sent = Mutex::new(Vec::new());
    let send = async |store: &dyn Store| {
        while sent.lock().len() < PLANS {
            for webhook in store.due_webhooks(i64::MAX, 8).await.unwrap() {
                sent.lock().push(webhook.plan.id);
                store.webhook_tried(webhook.plan.id, None).await.unwrap();
            }
        }
    };
    in_time(async { tokio::join!(send(&*one), send(&*other)) }).await;
    let mut sent = sent.into_inner();
    sent.sort();
    let count = sent.len();
    sent.dedup();
    assert_eq!((sent.len(), count), (PLANS, PLANS));
}
