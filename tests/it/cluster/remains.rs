//! What interrupted work leaves on the servers, and how it is cleaned up.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use async_nats::jetstream::Context;
use noctule::config::Address;
use noctule::job::{Idempotency, PlanId, Submission};
use noctule::store::jetstream::JetStreamStore;
use noctule::store::{Options, Store, StoreError};

use crate::support::nats;
use crate::support::plans::{failure, kind, submission};
use crate::support::stores::node;

/// A client that is not a node.
async fn client(address: &str) -> Context {
    let servers = Address::read(address).unwrap().servers;
    async_nats::jetstream::new(async_nats::connect(servers).await.unwrap())
}

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
