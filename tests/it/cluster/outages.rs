//! Servers that are killed, paused and restarted beneath an open store.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::time::{Duration, Instant};

use futures_util::TryStreamExt as _;
use noctule::config::Address;
use noctule::job::{Event, Idempotency, Status, Submission};
use noctule::store::jetstream::Settings;
use noctule::store::{Store, StoreError};
use tempfile::TempDir;

use super::{open, open_as};
use crate::support::lives::{a_run_of, running};
use crate::support::nats::{Cluster, NatsServer};
use crate::support::patience::{eventually, in_time};
use crate::support::plans::{
    ending, failure, history, history_to_its_end, kind, point, statuses, submission, until,
};
use crate::support::process::Service;
use crate::support::stores::node;

/// Longer than it takes until a silent server counts as gone.
const SILENCE: Duration = Duration::from_secs(13);

/// Waits until the store is healthy.
async fn until_sound(store: &dyn Store) {
    eventually(async || store.health().await.is_ok()).await;
}

/// Where the search was, for a convergence point.
fn iteration(event: &Event) -> Option<usize> {
    match event {
        Event::Convergence(point) => Some(point.iteration),
        _ => None,
    }
}

/// Retries a step, as a worker does, until a leading server answers.
async fn persist<T, F>(step: impl Fn() -> F) -> T
where
    F: Future<Output = Result<T, StoreError>>,
{
    let done = async {
        loop {
            match step().await {
                Err(StoreError::Unavailable { .. }) => {
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
                done => return done.unwrap(),
            }
        }
    };
    in_time(done).await
}

#[tokio::test(flavor = "multi_thread")]
async fn after_a_server_restart_nothing_is_lost_and_work_goes_on() {
    let mut server = NatsServer::start();
    let address = server.address();
    let (store, follower) = tokio::join!(open(&address), open(&address));
    let running = store.submit(submission()).await.unwrap().plan.id;
    let waiting = store.submit(submission()).await.unwrap().plan.id;
    let lease = store.claim().await.unwrap();
    store.append(&lease, vec![point(1, None)]).await.unwrap();

    server.kill();
    eventually(async || store.health().await.is_err()).await;
    assert_eq!(kind(store.submit(submission()).await), Err("unavailable"));
    // Known plans can still be read.
    assert_eq!(follower.get(running).await.unwrap().status, Status::Running);
    server.restart();
    until_sound(&*store).await;
    until_sound(&*follower).await;

    store.append(&lease, vec![point(2, None)]).await.unwrap();
    store
        .finish(&lease, ending(Status::Succeeded).at(0))
        .await
        .unwrap();
    until(&*follower, running, |plan| plan.status == Status::Succeeded).await;
    let told = history_to_its_end(&*follower, running).await;
    assert_eq!(told.last(), Some(&Event::End(Status::Succeeded)));
    assert_eq!(told, history(&*store, running).await);
    assert_eq!(store.claim().await.unwrap().plan.id, waiting);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_silent_server_is_reported_and_the_store_recovers_with_it() {
    let server = NatsServer::start();
    let store = open(&server.address()).await;
    let id = store.submit(submission()).await.unwrap().plan.id;
    server.pause();
    // It may answer once more before the store notices.
    let noticed = async {
        let mut health = store.health().await;
        while health.is_ok() {
            health = store.health().await;
        }
        health
    };
    assert_eq!(kind(in_time(noticed).await), Err("unavailable"));
    server.resume();
    until_sound(&*store).await;
    assert_eq!(store.claim().await.unwrap().plan.id, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_stops_in_time_while_no_server_answers() {
    let server = NatsServer::start();
    let directory = TempDir::new().unwrap();
    let arguments = ["--store", &server.address(), "--grace", "4"];
    let node = Service::start(directory.path(), &arguments);
    let address = node.submit(&a_run_of(3_600_000)).await;
    running(&node, &address).await;
    server.pause();
    let begun = Instant::now();
    node.signal("TERM");
    assert!(node.exit().await.success());
    // A node that retried, or that waited until the silent server counts as gone, would still be running.
    assert!(begun.elapsed() < SILENCE, "{:?}", begun.elapsed());
    server.resume();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_store_recovers_from_a_long_silence_without_traffic() {
    let server = NatsServer::start();
    let store = open(&server.address()).await;
    let id = store.submit(submission()).await.unwrap().plan.id;
    server.pause();
    tokio::time::sleep(SILENCE).await;
    server.resume();
    until_sound(&*store).await;
    assert_eq!(store.claim().await.unwrap().plan.id, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_webhook_stays_with_its_sender_until_the_attempt_is_recorded() {
    let mut server = NatsServer::start();
    let address = server.address();
    let (store, follower) = tokio::join!(open(&address), open(&address));
    let with_webhook = Submission {
        webhook: Some("https://hooks.example/".to_owned()),
        ..submission()
    };
    let id = store.submit(with_webhook).await.unwrap().plan.id;
    store.request_cancel(id, 0).await.unwrap();
    until(&*follower, id, |plan| plan.status == Status::Cancelled).await;
    let due = async |node: &dyn Store| node.due_webhooks(i64::MAX, 10).await.unwrap().len();
    assert_eq!(due(&*store).await, 1);

    server.kill();
    let tried = store.webhook_tried(id, Some(0)).await;
    assert_eq!(kind(tried), Err("unavailable"));
    server.restart();
    until_sound(&*store).await;
    until_sound(&*follower).await;
    assert_eq!(due(&*follower).await, 0);
    persist(|| store.webhook_tried(id, Some(0))).await;
    assert_eq!(due(&*follower).await, 1);
}

/// What is sent to a silent server is done when it can be heard again.
#[tokio::test(flavor = "multi_thread")]
async fn an_end_whose_answer_was_lost_is_answered_again() {
    let server = NatsServer::start();
    let store = open(&server.address()).await;
    let id = store.submit(submission()).await.unwrap().plan.id;
    let lease = store.claim().await.unwrap();
    let end = failure().after(vec![point(1, None)], 0);
    server.pause();
    assert_eq!(
        kind(store.finish(&lease, end.clone()).await),
        Err("unavailable")
    );
    server.resume();
    until(&*store, id, |plan| plan.status == Status::Failed).await;

    let other = ending(Status::Succeeded).at(0);
    let plan = persist(|| store.finish(&lease, end.clone())).await;
    assert_eq!(plan, store.get(id).await.unwrap());
    assert_eq!(history(&*store, id).await.len(), 2 + 1 + 2);
    for later in [end, other] {
        assert_eq!(kind(store.finish(&lease, later).await), Err("lease lost"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_survives_the_loss_of_the_leader() {
    let mut cluster = Cluster::start().await;
    let address = cluster.address();
    let settings = || Settings {
        replicas: 3,
        ..node(&address)
    };
    let (store, follower) = tokio::join!(open_as(settings()), open_as(settings()));
    let id = store.submit(submission()).await.unwrap().plan.id;
    // The leader of the queue's consumer may still be in election.
    let lease = persist(|| store.claim()).await;
    for round in 0..2 {
        persist(|| store.append(&lease, vec![point(2 * round, None)])).await;
        let leader = cluster.leader(&address).await;
        cluster.servers[leader].kill();
        persist(|| store.append(&lease, vec![point(2 * round + 1, None)])).await;
        cluster.servers[leader].restart();
        until_sound(&*store).await;
    }
    let end = ending(Status::Succeeded).after(vec![point(4, None)], 0);
    persist(|| store.finish(&lease, end.clone())).await;
    until(&*follower, id, |plan| plan.status == Status::Succeeded).await;
    let told = history_to_its_end(&*follower, id).await;
    // A claim during the election may have been given up: the plan has been queued and claimed again since.
    let begun = told.len() - (1 + 5 + 2);
    assert_eq!(
        statuses(&told[begun..]),
        [Status::Running, Status::Succeeded]
    );
    let points = told[begun + 1..].iter().take(5).map(iteration);
    assert_eq!(points.collect::<Vec<_>>(), [0, 1, 2, 3, 4].map(Some));
    assert_eq!(told, history(&*store, id).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_submission_during_an_election_is_accepted_after_it() {
    let mut cluster = Cluster::start().await;
    let all = Address::read(&cluster.address()).unwrap();
    for stream in ["jobs", "keys", "documents"] {
        let name = match stream {
            "jobs" => format!("{}-jobs", all.namespace),
            bucket => format!("KV_{}-{bucket}", all.namespace),
        };
        let settings = |address: &Address| Settings {
            replicas: 3,
            ..node(&address.to_string())
        };
        drop(open_as(settings(&all)).await);
        let leader = cluster.leader_of(&name).await;
        // Through a server that stays up.
        let other = &cluster.servers[(leader + 1) % 3];
        let store = open_as(settings(&Address {
            servers: vec![format!("nats://{}", other.host())],
            ..all.clone()
        }))
        .await;
        cluster.servers[leader].kill();
        let submitted = store
            .submit(Submission {
                idempotency: Some(Idempotency {
                    key: stream.to_owned(),
                    body_sha256: String::new(),
                }),
                ..submission()
            })
            .await
            .unwrap();
        assert!(!submitted.replayed, "{stream}");
        cluster.servers[leader].restart();
    }
    let store = open_as(node(&all.to_string())).await;
    // The server it reads from may be the one that came back last.
    eventually(async || store.stats().await.unwrap().queued == 3).await;
}

/// Replicas of each stream of a namespace, by name.
async fn copies(address: &str) -> Vec<(String, usize)> {
    let servers = Address::read(address).unwrap();
    let client = async_nats::connect(&servers.servers).await.unwrap();
    let context = async_nats::jetstream::new(client);
    let all: Vec<_> = context.streams().try_collect().await.unwrap();
    let mut copies: Vec<_> = all
        .into_iter()
        .map(|stream| (stream.config.name, stream.config.num_replicas))
        .filter(|(name, _)| name.contains(&servers.namespace))
        .collect();
    copies.sort_unstable();
    copies
}

#[tokio::test(flavor = "multi_thread")]
async fn opening_with_more_replicas_adds_copies_and_with_fewer_removes_none() {
    let cluster = Cluster::start().await;
    let address = cluster.address();
    let with = |replicas| Settings {
        replicas,
        ..node(&address)
    };
    let one = open_as(with(1)).await;
    let id = one.submit(submission()).await.unwrap().plan.id;
    let names: Vec<_> = copies(&address).await;
    assert!(names.len() >= 7, "{names:?}");
    assert!(names.iter().all(|(_, copies)| *copies == 1), "{names:?}");
    drop(one);
    for replicas in [3, 1] {
        let store = open_as(with(replicas)).await;
        let of_three = copies(&address).await;
        assert_eq!(of_three.len(), names.len());
        assert!(
            of_three.iter().all(|(_, copies)| *copies == 3),
            "{of_three:?}"
        );
        assert_eq!(store.get(id).await.unwrap().status, Status::Queued);
    }
}
