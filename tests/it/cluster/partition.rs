//! A node that is cut off from the servers, and one with a wrong clock.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::Arc;

use noctule::job::{Event, Idempotency, Status, Submission};
use noctule::store::jetstream::JetStreamStore;
use noctule::store::{Options, Retention, SteadyClock, Store, StoreError, wall_clock};

use super::open;
use crate::support::nats::{self, NatsServer, namespace};
use crate::support::patience::eventually;
use crate::support::plans::{ending, history, history_to_its_end, kind, point, submission, until};
use crate::support::stores::{LEASE, node};
use crate::support::wire::Wire;

/// Steps written while the other node is away: more than sockets buffer.
const STEPS: usize = 300;

/// Events of each step.
const EVENTS: usize = 40;

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_is_cut_off_loses_its_run_and_catches_up_later() {
    let server = NatsServer::start();
    let address = server.address();
    let wire = Wire::to(server.host()).await;
    let by_wire = format!("nats://{}/{}", wire.host(), namespace(&address));
    let (near, far) = tokio::join!(open(&address), open(&by_wire));
    let id = near.submit(submission()).await.unwrap().plan.id;
    let lost = far.claim().await.unwrap();
    far.append(&lost, vec![point(1, None)]).await.unwrap();

    wire.cut();
    let taken = near.claim().await.unwrap();
    assert_eq!((taken.plan.id, taken.attempt), (id, lost.attempt + 1));
    assert_eq!(kind(far.health().await), Err("unavailable"));
    // Known plans can still be read.
    assert_eq!(far.get(id).await.unwrap().status, Status::Running);
    assert_eq!(kind(far.submit(submission()).await), Err("unavailable"));
    for _ in 0..STEPS {
        near.append(&taken, vec![point(2, None); EVENTS])
            .await
            .unwrap();
    }

    wire.mend();
    eventually(async || far.health().await.is_ok()).await;
    let late = far.finish(&lost, ending(Status::Succeeded).at(0)).await;
    assert_eq!(kind(late), Err("lease lost"));
    let end = ending(Status::Succeeded).after(vec![point(3, None)], 0);
    near.finish(&taken, end).await.unwrap();
    until(&*far, id, |plan| plan.status == Status::Succeeded).await;
    let told = history_to_its_end(&*far, id).await;
    // Queued, running, a point; queued and running again; the points; succeeded, the end.
    assert_eq!(told.len(), 3 + 2 + STEPS * EVENTS + 1 + 2);
    assert_eq!(told.last(), Some(&Event::End(Status::Succeeded)));
    assert_eq!(told, history(&*near, id).await);

    let next = far.submit(submission()).await.unwrap().plan.id;
    assert_eq!(near.claim().await.unwrap().plan.id, next);
}

/// A node whose clock is off by `off_ms`.
async fn open_at(address: &str, off_ms: i64) -> Arc<dyn Store> {
    let clock = wall_clock();
    let options = Options {
        clock: Arc::new(move || clock() + off_ms),
        ..Options::new(1_000)
    };
    let opened = JetStreamStore::open(node(address), options).await;
    Arc::new(opened.unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wrong_clock_never_takes_over_a_run() {
    let address = nats::address();
    let hours = 3_600_000;
    let (fast, slow) = tokio::join!(open_at(&address, 5 * hours), open_at(&address, -5 * hours));
    for (accepting, running) in [(&fast, &slow), (&slow, &fast)] {
        let id = accepting.submit(submission()).await.unwrap().plan.id;
        let lease = running.claim().await.unwrap();
        assert_eq!(lease.plan.id, id);
        let stolen = tokio::time::timeout(2 * LEASE, accepting.claim()).await;
        assert!(stolen.is_err(), "{stolen:?}");
        running
            .finish(&lease, ending(Status::Succeeded).at(0))
            .await
            .unwrap();
        until(&**accepting, id, |plan| plan.status == Status::Succeeded).await;
        assert_eq!(history_to_its_end(&**accepting, id).await.len(), 4);
    }
}

/// The servers' clock may be wrong as well, as on a machine that began with a wrong time and runs them too.
#[tokio::test(flavor = "multi_thread")]
async fn nothing_expires_by_a_clock_that_is_far_ahead_of_all_records() {
    const DAY_MS: i64 = 24 * 60 * 60 * 1_000;
    let address = nats::address();
    let open = async |ahead_ms: i64| {
        let clock = SteadyClock::following(Arc::new(move || wall_clock()() + ahead_ms));
        let options = Options {
            retention: Retention {
                age_ms: Some(DAY_MS),
                ..Retention::default()
            },
            ..Options::new(1_000)
        };
        let opened = JetStreamStore::open(node(&address), options.by(&clock)).await;
        opened.unwrap()
    };
    let (right, now_ms) = (open(0).await, wall_clock()());
    let [kept, deleted] = [(); 2].map(|()| submission());
    let [kept, deleted] = [right.submit(kept).await, right.submit(deleted).await]
        .map(|accepted| accepted.unwrap().plan.id);
    for id in [kept, deleted] {
        right.request_cancel(id, now_ms).await.unwrap();
    }
    right.delete(deleted, now_ms).await.unwrap();

    let ahead = open(2 * DAY_MS).await;
    assert_eq!(ahead.sweep(now_ms + 2 * DAY_MS).await.unwrap(), 0);
    assert!(ahead.get(kept).await.is_ok());
    let cancelled = ahead.request_cancel(deleted, now_ms + 2 * DAY_MS).await;
    for gone in [ahead.get(deleted).await, cancelled] {
        assert!(matches!(gone, Err(StoreError::Gone(_))), "{gone:?}");
    }
}

/// A clock that is a day fast would expire the plans of all nodes, and forget what was deleted.
#[tokio::test(flavor = "multi_thread")]
async fn a_wrong_clock_removes_nothing_for_its_age() {
    const DAY_MS: i64 = 24 * 60 * 60 * 1_000;
    let address = nats::address();
    let options = |ahead_ms: i64, plans| Options {
        clock: Arc::new(move || wall_clock()() + ahead_ms),
        most_apart_ms: Some(60_000),
        retention: Retention {
            age_ms: Some(DAY_MS),
            plans: Some(plans),
            bytes: None,
        },
        ..Options::new(1_000)
    };
    let right = JetStreamStore::open(node(&address), options(0, 100)).await;
    let right = right.unwrap();
    assert_eq!(right.warning(), None);
    let now_ms = wall_clock()();
    let keyed = || Submission {
        idempotency: Some(Idempotency {
            key: "once".to_owned(),
            body_sha256: "0".repeat(64),
        }),
        ..submission()
    };
    let mut ended = vec![right.submit(keyed()).await.unwrap().plan.id];
    for _ in 0..2 {
        ended.push(right.submit(submission()).await.unwrap().plan.id);
    }
    for &id in &ended {
        right.request_cancel(id, now_ms).await.unwrap();
    }
    let deleted = ended.pop().unwrap();
    right.delete(deleted, now_ms).await.unwrap();

    for ahead_ms in [2 * DAY_MS, -2 * DAY_MS] {
        let wrong = JetStreamStore::open(node(&address), options(ahead_ms, 100)).await;
        let wrong = wrong.unwrap();
        let warning = wrong.warning().unwrap();
        assert!(warning.contains("that of the NATS servers"), "{warning}");
        assert_eq!(wrong.sweep(now_ms + ahead_ms).await.unwrap(), 0);
        for id in &ended {
            assert!(right.get(*id).await.is_ok());
        }
        for node in [&right, &wrong] {
            assert_eq!(kind(node.get(deleted).await), Err("gone"));
            assert_eq!(node.submit(keyed()).await.unwrap().plan.id, ended[0]);
        }
    }
    // What is too many goes whatever the time.
    let wrong = JetStreamStore::open(node(&address), options(2 * DAY_MS, 1)).await;
    assert_eq!(wrong.unwrap().sweep(now_ms + 2 * DAY_MS).await.unwrap(), 1);
}
