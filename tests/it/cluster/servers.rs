//! The servers that the other tests break: what they guarantee when killed and paused.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use async_nats::jetstream;
use async_nats::jetstream::context::CreateStreamErrorKind;

use crate::support::nats::{self, Cluster, NatsServer};
use crate::support::patience::eventually;

async fn client(address: &str) -> jetstream::Context {
    let (hosts, _) = address
        .trim_start_matches("nats://")
        .split_once('/')
        .expect("a namespace");
    let hosts: Vec<_> = hosts.split(',').collect();
    jetstream::new(async_nats::connect(hosts).await.expect("connected"))
}

/// Creates a stream of `config`; retried, because a cluster whose leader changes drops the request.
async fn created(
    context: &jetstream::Context,
    config: jetstream::stream::Config,
) -> jetstream::stream::Stream {
    for _ in 0..6 {
        match context.create_stream(config.clone()).await {
            Err(fault) if fault.kind() == CreateStreamErrorKind::TimedOut => {}
            stream => return stream.unwrap(),
        }
    }
    panic!("no server made the stream");
}

fn stream(address: &str, num_replicas: usize) -> jetstream::stream::Config {
    jetstream::stream::Config {
        name: nats::namespace(address).to_owned(),
        num_replicas,
        ..jetstream::stream::Config::default()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_server_acknowledged_survives_a_kill() {
    let mut server = NatsServer::start();
    let address = server.address();
    let context = client(&address).await;
    let stream = context.create_stream(stream(&address, 1)).await.unwrap();
    let subject = nats::namespace(&address).to_owned();
    for _ in 0..10 {
        let sent = context.publish(subject.clone(), "x".into()).await.unwrap();
        sent.await.unwrap();
    }
    server.kill();
    server.restart();
    assert_eq!(stream.get_info().await.unwrap().state.messages, 10);
    server.pause();
    server.resume();
    assert_eq!(stream.get_info().await.unwrap().state.messages, 10);
}

#[tokio::test(flavor = "multi_thread")]
async fn namespaces_on_the_shared_server_are_isolated() {
    for _ in 0..2 {
        let address = nats::address();
        let context = client(&address).await;
        let mut stream = context.create_stream(stream(&address, 1)).await.unwrap();
        assert_eq!(stream.info().await.unwrap().state.messages, 0);
        let subject = nats::namespace(&address).to_owned();
        let sent = context.publish(subject, "x".into()).await.unwrap();
        assert_eq!(sent.await.unwrap().sequence, 1);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cluster_survives_the_loss_of_its_leader() {
    let mut cluster = Cluster::start().await;
    let address = cluster.address();
    let context = client(&address).await;
    let mut stream = created(&context, stream(&address, 3)).await;
    let subject = nats::namespace(&address).to_owned();
    let info = stream.info().await.unwrap().clone();
    let leader = info.cluster.unwrap().leader.unwrap();
    cluster
        .servers
        .iter_mut()
        .find(|server| server.name() == leader)
        .unwrap()
        .kill();
    eventually(async || {
        let sent = context.publish(subject.clone(), "x".into()).await.unwrap();
        sent.await.is_ok()
    })
    .await;
}
