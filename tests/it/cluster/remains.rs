//! What interrupted work leaves on the servers, and how it is cleaned up.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_nats::jetstream::consumer::PullConsumer;
use futures_util::StreamExt as _;
use noctule::job::{Event, Idempotency, Plan, PlanId, Status, Submission};
use noctule::store::jetstream::{JetStreamStore, Settings};
use noctule::store::{Options, Retention, Store, StoreError};

use crate::support::nats::{self, client};
use crate::support::patience::{eventually, in_time};
use crate::support::plans::{failure, history, kind, point, submission};
use crate::support::stores::node;

#[tokio::test(flavor = "multi_thread")]
async fn deleting_a_plan_removes_results_that_no_record_names() {
    let address = nats::address();
    let store = super::open(&address).await;
    let id = store.submit(submission()).await.unwrap().plan.id;
    let first = store.claim().await.unwrap();
    store.release(&first).await.unwrap();
    let second = store.claim().await.unwrap();
    assert_eq!(second.attempt, 2);

    let objects = format!("{}-objects", nats::namespace(&address));
    let objects = client(&address).await.get_object_store(objects).await;
    let objects = objects.unwrap();
    let keys = [1, 2].map(|attempt| format!("{id}.result.{attempt}"));
    for key in &keys {
        let result = &mut "x".as_bytes();
        objects.put(key.as_str(), result).await.unwrap();
    }
    store.finish(&second, failure().at(0)).await.unwrap();
    store.delete(id, 0).await.unwrap();
    for key in &keys {
        assert!(objects.get(key).await.is_err(), "{key} is left");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_interrupted_submission_holds_its_key_for_a_minute() {
    let address = nats::address();
    let now_ms = Arc::new(AtomicI64::new(1_000_000));
    let open = async || {
        let now_ms = now_ms.clone();
        let options = Options {
            clock: Arc::new(move || now_ms.load(Ordering::SeqCst)),
            ..Options::new(10)
        };
        JetStreamStore::open(node(&address), options).await.unwrap()
    };
    let submit = async |store: &JetStreamStore| -> Result<PlanId, StoreError> {
        let idempotency = Idempotency {
            key: "k".to_owned(),
            body_sha256: "body".to_owned(),
        };
        let submission = Submission {
            idempotency: Some(idempotency),
            ..submission()
        };
        store.submit(submission).await.map(|answer| answer.plan.id)
    };
    let store = open().await;
    let first = submit(&store).await.unwrap();
    store.close().await;
    // As if the record, which is written last, had never been written.
    let plans = format!("{}-plans", nats::namespace(&address));
    let plans = client(&address).await.get_stream(plans).await.unwrap();
    plans.purge().await.unwrap();

    let store = open().await;
    now_ms.fetch_add(59_000, Ordering::SeqCst);
    assert_eq!(kind(submit(&store).await), Err("key in flight"));
    now_ms.fetch_add(1_000, Ordering::SeqCst);
    let second = submit(&store).await.unwrap();
    assert_ne!(second, first);
    assert_eq!(submit(&store).await.unwrap(), second);
}

/// The only waiting job of an owner, taken by a claimer that then does nothing with it.
async fn held_job(address: &str) -> async_nats::jetstream::Message {
    let jobs = format!("{}-jobs", nats::namespace(address));
    let jobs = client(address).await.get_stream(jobs).await.unwrap();
    let names: Vec<_> = jobs.consumer_names().collect().await;
    let [Ok(lane)] = &names[..] else {
        panic!("one lane has been asked so far: {names:?}")
    };
    let lane: PullConsumer = jobs.get_consumer(lane).await.unwrap();
    let mut batch = lane.fetch().max_messages(1).messages().await.unwrap();
    batch.next().await.unwrap().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_somebody_holds_does_not_keep_the_turn_from_other_owners() {
    let address = nats::address();
    let patient = Settings {
        lease: Duration::from_secs(600),
        ..node(&address)
    };
    let store = super::open_as(patient).await;
    let submit = async |owner: &str| {
        let owned = Submission {
            owner: Some(owner.to_owned()),
            ..submission()
        };
        store.submit(owned).await.unwrap().plan.id
    };
    submit("one").await;
    let lease = store.claim().await.unwrap();
    store.finish(&lease, failure().at(0)).await.unwrap();

    let first = submit("one").await;
    let held = held_job(&address).await;
    assert!(held.subject.ends_with(&first.to_string()));
    let second = submit("other").await;
    let claimed = in_time(store.claim()).await.unwrap();
    assert_eq!(claimed.plan.id, second);
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_that_vanished_from_the_queue_are_put_back_once() {
    let address = nats::address();
    let [one, two, other] = [(); 3].map(|()| super::open(&address));
    let [one, two, other] = [one.await, two.await, other.await];
    let mut plans = Vec::new();
    for _ in 0..3 {
        plans.push(one.submit(submission()).await.unwrap().plan);
    }
    let running = one.claim().await.unwrap();
    let jobs = format!("{}-jobs", nats::namespace(&address));
    let jobs = client(&address).await.get_stream(jobs).await.unwrap();
    jobs.purge().await.unwrap();
    let in_queue = async || jobs.get_info().await.unwrap().state.messages;

    // A job may still be on its way.
    let waiting = &plans[1..];
    let accepted = waiting[0].created_ms;
    other.sweep(accepted + 119_999).await.unwrap();
    assert_eq!(in_queue().await, 0);
    let (by_one, by_two) =
        tokio::join!(one.sweep(accepted + 121_000), two.sweep(accepted + 121_000));
    assert_eq!((by_one.unwrap(), by_two.unwrap()), (0, 0));
    assert_eq!(in_queue().await, 2);

    one.finish(&running, failure().at(0)).await.unwrap();
    for plan in waiting {
        let lease = in_time(two.claim()).await.unwrap();
        assert_eq!((lease.plan.id, lease.attempt), (plan.id, 1));
        two.finish(&lease, failure().at(0)).await.unwrap();
    }
    // The servers take their time to remove what is done.
    eventually(async || in_queue().await == 0).await;
}

/// As after a restore of the queue from another moment than the plans.
#[tokio::test(flavor = "multi_thread")]
async fn a_silent_run_whose_job_vanished_is_done_again() {
    let address = nats::address();
    let [one, two] = [(); 2].map(|()| super::open(&address));
    let [one, two] = [one.await, two.await];
    let plan = one.submit(submission()).await.unwrap().plan;
    let silent = one.claim().await.unwrap();
    let jobs = format!("{}-jobs", nats::namespace(&address));
    let jobs = client(&address).await.get_stream(jobs).await.unwrap();
    jobs.purge().await.unwrap();
    let in_queue = async || jobs.get_info().await.unwrap().state.messages;
    eventually(async || two.get(plan.id).await.unwrap().status == Status::Running).await;

    let now_ms = plan.created_ms;
    // Its own node knows better.
    for later_ms in [0, 119_999] {
        two.sweep(now_ms + later_ms).await.unwrap();
        one.sweep(now_ms + 10 * later_ms).await.unwrap();
        assert_eq!(in_queue().await, 0);
    }
    two.sweep(now_ms + 120_000).await.unwrap();
    assert_eq!(in_queue().await, 1);
    let again = in_time(two.claim()).await.unwrap();
    assert_eq!((again.plan.id, again.attempt), (plan.id, 2));
    let late = one.append(&silent, vec![point(1, None)]).await;
    assert!(matches!(late, Err(StoreError::LeaseLost(id)) if id == plan.id));
    two.finish(&again, failure().at(0)).await.unwrap();
    eventually(async || in_queue().await == 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_whose_document_is_lost_fails_and_does_not_block_the_queue() {
    let address = nats::address();
    let ended: Arc<Mutex<Vec<Plan>>> = Arc::default();
    let tell = Arc::clone(&ended);
    let options = Options {
        on_lost: Arc::new(move |plan| tell.lock().unwrap().push(plan.clone())),
        ..Options::new(10)
    };
    let store = JetStreamStore::open(node(&address), options).await.unwrap();
    let mut ids = Vec::new();
    for document in ["{}".to_owned(), "{}".to_owned(), " ".repeat(600_000)] {
        let submission = Submission {
            scenario: document,
            ..submission()
        };
        ids.push(store.submit(submission).await.unwrap().plan.id);
    }
    let sound = store.submit(submission()).await.unwrap().plan.id;

    let namespace = nats::namespace(&address);
    let client = client(&address).await;
    let documents = client.get_key_value(format!("{namespace}-documents")).await;
    let documents = documents.unwrap();
    let purged = documents.stream.purge();
    let of_the_first = format!("{}{}.>", documents.prefix, ids[0]);
    assert_eq!(purged.filter(of_the_first).await.unwrap().purged, 1);
    let key = format!("{}.scenario", ids[1]);
    documents.delete(&key).await.unwrap();
    let objects = client
        .get_object_store(format!("{namespace}-objects"))
        .await;
    let key = format!("{}.scenario", ids[2]);
    objects.unwrap().delete(&key).await.unwrap();

    assert_eq!(in_time(store.claim()).await.unwrap().plan.id, sound);
    for id in &ids {
        let plan = store.get(*id).await.unwrap();
        assert_eq!(plan.status, Status::Failed);
        assert_eq!(plan.error.as_ref().unwrap().kind, "scenario-lost");
        let told = history(&store, *id).await;
        assert_eq!(told.last(), Some(&Event::End(Status::Failed)));
        assert!(ended.lock().unwrap().contains(&plan));
    }
    let stats = store.stats().await.unwrap();
    assert_eq!((stats.queued, stats.running), (0, 1));
}

/// Removes all steps of a plan from the servers, as if they had never been written.
async fn remove_steps(address: &str, id: PlanId) {
    let namespace = nats::namespace(address);
    let plans = client(address)
        .await
        .get_stream(format!("{namespace}-plans"))
        .await;
    let steps = format!("{namespace}.plans.{id}");
    let purged = plans.unwrap().purge().filter(steps).await;
    assert!(purged.unwrap().purged > 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_interrupted_submission_is_removed_though_nobody_asks_for_its_lane() {
    let address = nats::address();
    let store = super::open(&address).await;
    let submit = async |owner: &str| {
        let owned = Submission {
            owner: Some(owner.to_owned()),
            scenario: " ".repeat(600_000),
            ..submission()
        };
        store.submit(owned).await.unwrap().plan
    };
    let (broken_off, accepted) = (submit("one").await, submit("other").await);
    store.close().await;
    // Its record, which is written last.
    remove_steps(&address, broken_off.id).await;

    let store = super::open(&address).await;
    let namespace = nats::namespace(&address);
    let client = client(&address).await;
    let jobs = client
        .get_stream(format!("{namespace}-jobs"))
        .await
        .unwrap();
    let objects = client
        .get_stream(format!("OBJ_{namespace}-objects"))
        .await
        .unwrap();
    let messages = async || {
        let (jobs, objects) = (
            jobs.get_info().await.unwrap(),
            objects.get_info().await.unwrap(),
        );
        (jobs.state.messages, objects.state.messages)
    };
    let (_, all) = messages().await;
    let seen_ms = accepted.created_ms;
    store.sweep(seen_ms).await.unwrap();
    // It may still be on its way.
    store.sweep(seen_ms + 59_000).await.unwrap();
    assert_eq!(messages().await, (2, all));
    store.sweep(seen_ms + 600_000).await.unwrap();
    assert_eq!(messages().await, (1, all / 2));
    let lease = in_time(store.claim()).await.unwrap();
    assert_eq!(lease.plan.id, accepted.id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_that_is_gone_from_the_servers_is_forgotten() {
    let address = nats::address();
    let options = Options {
        retention: Retention {
            age_ms: Some(1),
            ..Retention::default()
        },
        ..Options::new(10)
    };
    let store = JetStreamStore::open(node(&address), options).await.unwrap();
    let [expired, deleted] = [(); 2].map(|()| store.submit(submission()));
    let [expired, deleted] = [
        expired.await.unwrap().plan.id,
        deleted.await.unwrap().plan.id,
    ];
    store.request_cancel(expired, 0).await.unwrap();
    for id in [expired, deleted] {
        remove_steps(&address, id).await;
    }
    assert_eq!(store.sweep(1_000).await.unwrap(), 0);
    assert_eq!(kind(store.get(expired).await), Err("not found"));
    assert_eq!(kind(store.delete(deleted, 0).await), Err("not found"));
    assert_eq!(kind(store.get(deleted).await), Err("not found"));
    assert_eq!(store.stats().await.unwrap().queued, 0);
}
