//! Servers without room for anything more: plans can still be removed, and make room.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use async_nats::jetstream::stream;
use futures_util::StreamExt as _;
use noctule::job::{PlanId, Status, Submission};
use noctule::store::jetstream::JetStreamStore;
use noctule::store::{Options, Retention, Store, StoreError, Trouble, wall_clock};

use crate::support::nats::{NatsServer, client, namespace};
use crate::support::patience::in_time;
use crate::support::plans::{ending, kind, point, submission};
use crate::support::stores::node;

const ROOM: usize = 8 << 20;

/// Longer than a message, so that it becomes an object.
const LARGE: usize = 600_000;

/// Stores messages of somebody else's until no message is taken, however short.
async fn fill(address: &str) {
    let client = client(address).await;
    let config = stream::Config {
        name: "others".to_owned(),
        ..stream::Config::default()
    };
    client.get_or_create_stream(config).await.unwrap();
    for bytes in [100_000, 1] {
        while let Ok(sent) = client.publish("others", vec![0; bytes].into()).await
            && sent.await.is_ok()
        {}
    }
}

/// Number of messages with documents of a plan.
async fn left(address: &str, id: PlanId) -> usize {
    let client = client(address).await;
    let namespace = namespace(address);
    let documents = client.get_key_value(format!("{namespace}-documents")).await;
    let documents = documents.unwrap();
    let of_plan = format!("{}{id}.>", documents.prefix);
    let messages = documents.stream.info_with_subjects(of_plan).await.unwrap();
    let chunks = client.get_stream(format!("OBJ_{namespace}-objects")).await;
    let chunks = chunks
        .unwrap()
        .info_with_subjects("$O.*.C.>")
        .await
        .unwrap();
    messages.count().await + chunks.count().await
}

fn trouble<T>(answer: Result<T, StoreError>) -> Option<Trouble> {
    match answer.err()? {
        StoreError::Unavailable { trouble, .. } => Some(trouble),
        _ => None,
    }
}

async fn submit(store: &JetStreamStore, bytes: usize) -> PlanId {
    let sized = Submission {
        scenario: " ".repeat(bytes),
        ..submission()
    };
    store.submit(sized).await.unwrap().plan.id
}

#[tokio::test(flavor = "multi_thread")]
async fn plans_can_be_deleted_from_full_servers_and_make_room() {
    let server = NatsServer::with_room(ROOM);
    let address = server.address();
    let now_ms = wall_clock();
    let options = Options::new(100);
    let store = JetStreamStore::open(node(&address), options).await.unwrap();
    let running = submit(&store, 10_000).await;
    let lease = in_time(store.claim()).await.unwrap();
    for iteration in 0..400 {
        let points = vec![point(iteration, None); 4];
        store.append(&lease, points).await.unwrap();
    }
    let waiting = submit(&store, 300_000).await;
    let large = submit(&store, LARGE).await;
    let stays = submit(&store, 2).await;
    fill(&address).await;
    assert_eq!(
        trouble(store.submit(submission()).await),
        Some(Trouble::Full)
    );
    assert_eq!(trouble(store.health().await), Some(Trouble::Full));
    let cancelled = store.request_cancel(stays, 0).await;
    assert_eq!(trouble(cancelled), Some(Trouble::Full));

    for id in [large, waiting, running] {
        store.delete(id, now_ms()).await.unwrap();
        assert_eq!(kind(store.get(id).await), Err("gone"));
        assert_eq!(left(&address, id).await, 0);
        fill(&address).await;
    }
    let told = store.append(&lease, vec![point(1, None)]).await;
    assert_eq!(kind(told), Err("lease lost"));
    assert_eq!(store.get(stays).await.unwrap().status, Status::Queued);
}

#[tokio::test(flavor = "multi_thread")]
async fn expired_plans_are_swept_from_full_servers() {
    let server = NatsServer::with_room(ROOM);
    let address = server.address();
    let options = Options {
        retention: Retention {
            age_ms: Some(1),
            ..Retention::default()
        },
        ..Options::new(100)
    };
    let store = JetStreamStore::open(node(&address), options).await.unwrap();
    // Those that free little are the first to go.
    for bytes in [2, 2, 300_000] {
        submit(&store, bytes).await;
        let lease = in_time(store.claim()).await.unwrap();
        let end = ending(Status::Succeeded).at(0);
        store.finish(&lease, end).await.unwrap();
    }
    fill(&address).await;
    let sweep = async || store.sweep(1_000).await.unwrap();
    let first = sweep().await;
    assert!(first >= 1);
    assert_eq!(first + sweep().await, 3);
    submit(&store, 2).await;
}

/// Number of messages that make up the large documents, and number of those documents that have parts.
async fn large(address: &str) -> (u64, usize) {
    let client = client(address).await;
    let objects = format!("OBJ_{}-objects", namespace(address));
    let objects = client.get_stream(objects).await.unwrap();
    let parts = objects.info_with_subjects("$O.*.C.>").await.unwrap();
    let documents = parts.count().await;
    (objects.get_info().await.unwrap().state.messages, documents)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_refused_for_want_of_room_takes_up_none() {
    let server = NatsServer::with_room(ROOM);
    let address = server.address();
    let options = Options::new(100);
    let store = JetStreamStore::open(node(&address), options).await.unwrap();
    let mut accepted = Vec::new();
    for _ in 0..2 {
        accepted.push(submit(&store, 3 << 20).await);
    }
    let before = large(&address).await;
    assert_eq!(before.1, 2);
    // A part of it fits.
    let third = Submission {
        scenario: " ".repeat(3 << 20),
        ..submission()
    };
    assert_eq!(trouble(store.submit(third).await), Some(Trouble::Full));
    assert_eq!(large(&address).await, before);
    let jobs = format!("{}-jobs", namespace(&address));
    let mut jobs = client(&address).await.get_stream(jobs).await.unwrap();
    assert_eq!(jobs.info().await.unwrap().state.messages, 2);
    for id in accepted {
        store.delete(id, 0).await.unwrap();
    }
    assert_eq!(large(&address).await, (0, 0));
}
