//! Streams and buckets that vanish beneath an open store.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::Arc;
use std::time::Duration;

use noctule::config::Address;
use noctule::job::{PlanId, Status};
use noctule::store::jetstream::{JetStreamStore, Settings};
use noctule::store::reopening::{Open, Reopening};
use noctule::store::{Options, Store, StoreError, Trouble};
use tokio::runtime::Handle;

use crate::support::nats::{self, Cluster, NatsServer, namespace};
use crate::support::patience::{eventually, in_time};
use crate::support::plans::{failure, kind, submission};
use crate::support::stores::node;

/// A store as the service has it.
async fn reopening(settings: Settings) -> Reopening {
    let runtime = Handle::current();
    let open: Open = Arc::new(move |_| {
        let opened = JetStreamStore::open(settings.clone(), Options::new(100));
        Ok(Arc::new(runtime.block_on(opened)?))
    });
    let store = Reopening::start(open).await;
    eventually(async || store.health().await.is_ok()).await;
    store
}

/// Plans are accepted and run.
async fn works(store: &Reopening) -> PlanId {
    let id = store.submit(submission()).await.unwrap().plan.id;
    let lease = in_time(store.claim()).await.unwrap();
    assert_eq!(lease.plan.id, id);
    store.finish(&lease, failure().at(0)).await.unwrap();
    id
}

#[tokio::test(flavor = "multi_thread")]
async fn servers_that_lost_everything_take_plans_again() {
    let mut server = NatsServer::start();
    let store = reopening(node(&server.address())).await;
    let lost = works(&store).await;
    server.kill();
    server.empty();
    server.restart();
    // Nobody asks about the store's health.
    eventually(async || kind(store.get(lost).await) == Err("not found")).await;
    eventually(async || store.health().await.is_ok()).await;
    works(&store).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_or_bucket_that_was_removed_is_reported_and_made_again() {
    let address = nats::address();
    let store = reopening(node(&address)).await;
    let servers = Address::read(&address).unwrap().servers;
    let client = async_nats::connect(servers).await.unwrap();
    let client = async_nats::jetstream::new(client);
    let namespace = namespace(&address);
    for (before, name) in [
        ("", "plans"),
        ("", "jobs"),
        ("KV_", "documents"),
        ("OBJ_", "objects"),
        ("KV_", "keys"),
        ("KV_", "tellers"),
    ] {
        let stream = format!("{before}{namespace}-{name}");
        client.delete_stream(&stream).await.unwrap();
        let Err(StoreError::Unavailable { trouble, detail }) = store.health().await else {
            panic!("{name} is not missed")
        };
        assert_eq!(trouble, Trouble::Vanished, "{name}: {detail}");
        eventually(async || store.health().await.is_ok()).await;
        client.get_stream(&stream).await.unwrap();
        works(&store).await;
    }
}

/// Remove a stream from the servers.
async fn remove(address: &str, name: &str) {
    let servers = Address::read(address).unwrap().servers;
    let client = async_nats::connect(servers).await.unwrap();
    let stream = format!("{}-{name}", namespace(address));
    let client = async_nats::jetstream::new(client);
    client.delete_stream(&stream).await.unwrap();
}

/// The store notices that a stream has vanished, and is opened again.
async fn notices(store: &Reopening) {
    let missed = store.health().await;
    let Err(StoreError::Unavailable { trouble, .. }) = missed else {
        panic!("nothing is missed")
    };
    assert_eq!(trouble, Trouble::Vanished);
    eventually(async || store.health().await.is_ok()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_that_another_node_has_made_again_is_read_anew() {
    let address = nats::address();
    let [one, other] = [
        reopening(node(&address)).await,
        reopening(node(&address)).await,
    ];
    let lost = works(&one).await;
    eventually(async || other.get(lost).await.is_ok()).await;
    remove(&address, "plans").await;
    notices(&one).await;
    eventually(async || {
        let ready = other.health().await.is_ok();
        ready && kind(other.get(lost).await) == Err("not found")
    })
    .await;
    let id = one.submit(submission()).await.unwrap().plan.id;
    assert_eq!(in_time(other.claim()).await.unwrap().plan.id, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_whose_job_has_vanished_is_given_back_and_run_again() {
    let address = nats::address();
    let store = reopening(node(&address)).await;
    let plan = store.submit(submission()).await.unwrap().plan;
    let lease = in_time(store.claim()).await.unwrap();
    remove(&address, "jobs").await;
    notices(&store).await;
    let late = store.finish(&lease, failure().at(0)).await;
    assert_eq!(kind(late), Err("lease lost"));
    assert_eq!(store.get(plan.id).await.unwrap().status, Status::Queued);
    store.sweep(plan.created_ms + 121_000).await.unwrap();
    let again = in_time(store.claim()).await.unwrap();
    assert_eq!((again.plan.id, again.attempt), (plan.id, 2));
}

#[tokio::test(flavor = "multi_thread")]
async fn removing_a_plan_of_a_former_queue_leaves_the_jobs_of_others() {
    let address = nats::address();
    let store = reopening(node(&address)).await;
    let former = store.submit(submission()).await.unwrap().plan.id;
    remove(&address, "jobs").await;
    notices(&store).await;
    // It has the place that the former had.
    let id = store.submit(submission()).await.unwrap().plan.id;
    store.delete(former, 0).await.unwrap();
    assert_eq!(in_time(store.claim()).await.unwrap().plan.id, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_is_not_ready_without_the_server_that_keeps_the_queue() {
    let mut cluster = Cluster::start().await;
    // Announcements, and everything but the queue, may be on other servers.
    let (store, queue, address) = loop {
        let address = cluster.address();
        let settings = Settings {
            replicas: 1,
            ..node(&address)
        };
        let store = reopening(settings).await;
        let namespace = namespace(&address);
        let queue = cluster.leader_of(&format!("{namespace}-jobs")).await;
        let nodes = cluster.leader_of(&format!("KV_{namespace}-nodes")).await;
        if queue != nodes {
            break (store, queue, address);
        }
    };
    cluster.servers[queue].kill();
    // Other streams may be on that server too, and one of them is named.
    let queue_is_missed = async || match store.health().await {
        Err(error) => error
            .to_string()
            .contains(&format!("{}-", namespace(&address))),
        Ok(()) => false,
    };
    let missed = tokio::time::timeout(Duration::from_secs(90), eventually(queue_is_missed));
    missed.await.expect("the queue is missed");
    cluster.servers[queue].restart();
    eventually(async || store.health().await.is_ok()).await;
    works(&store).await;
}
