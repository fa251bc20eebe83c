//! Servers that allow a stream few consumers.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use noctule::job::{PlanId, Status, Submission};
use noctule::store::Store;

use super::open;
use crate::support::nats::NatsServer;
use crate::support::patience::in_time;
use crate::support::plans::{ending, submission};

async fn submit(store: &dyn Store, owner: usize) -> PlanId {
    let theirs = Submission {
        owner: Some(format!("owner {owner}")),
        ..submission()
    };
    store.submit(theirs).await.unwrap().plan.id
}

/// More owners, and readers of more histories at once, than the servers allow consumers by default.
#[tokio::test(flavor = "multi_thread")]
async fn a_default_limit_of_the_servers_stops_nobody() {
    let server = NatsServer::with("limits { default_max_consumers: 3 }", "");
    let address = server.address();
    let store = open(&address).await;
    let mut plans = Vec::new();
    for owner in 0..8 {
        plans.push(submit(&*store, owner).await);
    }
    for _ in &plans {
        let lease = in_time(store.claim()).await.unwrap();
        let end = ending(Status::Succeeded).at(0);
        store.finish(&lease, end).await.unwrap();
    }
    // Another node has no history in memory.
    let other = open(&address).await;
    for id in plans {
        assert!(!other.events(id, 0, 10).await.unwrap().events.is_empty());
    }
}

/// An account's limit cannot be raised: the owners who get no consumer wait, and nobody else does.
#[tokio::test(flavor = "multi_thread")]
async fn an_owner_without_a_consumer_does_not_hold_up_the_others() {
    let account = "accounts { A { users: [{ user: u, password: p }], \
                   jetstream { max_file: 1GB, max_mem: 0, max_consumers: 3 } } }\nno_auth_user: u";
    let server = NatsServer::with("", account);
    let store = open(&server.address()).await;
    for owner in 0..5 {
        submit(&*store, owner).await;
    }
    let mut leases = Vec::new();
    for _ in 0..3 {
        leases.push(in_time(store.claim()).await.unwrap());
    }
    let refused = in_time(store.claim()).await.unwrap_err();
    assert!(refused.to_string().contains("consumers"), "{refused}");
    // Owners are served in turn, so these are the first ones.
    let again = submit(&*store, 0).await;
    let lease = in_time(store.claim()).await.unwrap();
    assert_eq!(lease.plan.id, again);
}
