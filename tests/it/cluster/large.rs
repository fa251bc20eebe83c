//! Documents that are too long for a message, and are kept in parts.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::time::Duration;

use async_nats::jetstream;
use futures_util::StreamExt as _;
use noctule::config::Address;
use noctule::job::{PlanId, Status, Submission};
use noctule::store::Store;
use noctule::store::jetstream::Settings;

use super::{open, open_as};
use crate::support::nats::{self, namespace};
use crate::support::patience::in_time;
use crate::support::plans::{history, kind, statuses, submission, until};
use crate::support::stores::node;

/// Longer than a message, in several parts.
const LARGE: usize = 600_000;

async fn submit_large(store: &dyn Store) -> PlanId {
    let large = Submission {
        scenario: " ".repeat(LARGE),
        ..submission()
    };
    store.submit(large).await.unwrap().plan.id
}

/// The stream that has the parts of all large documents.
async fn parts(address: &str) -> jetstream::stream::Stream {
    let servers = Address::read(address).unwrap().servers;
    let client = jetstream::new(async_nats::connect(servers).await.unwrap());
    let name = format!("OBJ_{}-objects", namespace(address));
    client.get_stream(name).await.unwrap()
}

/// The subjects of the parts that are there.
async fn subjects(parts: &jetstream::stream::Stream) -> Vec<String> {
    let there = parts.info_with_subjects("$O.*.C.>").await.unwrap();
    there.map(|subject| subject.unwrap().0).collect().await
}

/// The only large plan fails, and the next is claimed.
async fn fails_and_the_next_is_run(store: &dyn Store, lost: PlanId) {
    let sound = store.submit(submission()).await.unwrap().plan.id;
    assert_eq!(in_time(store.claim()).await.unwrap().plan.id, sound);
    let plan = store.get(lost).await.unwrap();
    assert_eq!(plan.status, Status::Failed);
    assert_eq!(plan.error.unwrap().kind, "scenario-lost");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_document_without_its_parts_is_not_waited_for() {
    let address = nats::address();
    let store = open(&address).await;
    let lost = submit_large(&*store).await;
    let purged = parts(&address).await.purge().filter("$O.*.C.>").await;
    assert!(purged.unwrap().purged > 1);
    let read = in_time(store.scenario(lost)).await;
    assert_eq!(kind(read), Err("scenario lost"));
    fails_and_the_next_is_run(&*store, lost).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_whose_document_lacks_a_part_fails_and_does_not_block_the_queue() {
    let address = nats::address();
    let store = open(&address).await;
    let lost = submit_large(&*store).await;
    let parts = parts(&address).await;
    let [subject] = &subjects(&parts).await[..] else {
        panic!("one document has been written")
    };
    let part = parts.get_first_raw_message_by_subject(subject, 0).await;
    parts.delete_message(part.unwrap().sequence).await.unwrap();
    fails_and_the_next_is_run(&*store, lost).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_keeps_its_lease_while_it_reads_a_document() {
    let address = nats::address();
    // Shorter than the time for which the parts are waited for.
    let settings = || Settings {
        lease: Duration::from_secs(3),
        ..node(&address)
    };
    let (one, other) = tokio::join!(open_as(settings()), open_as(settings()));
    let lost = submit_large(&*one).await;
    let purged = parts(&address).await.purge().filter("$O.*.C.>").await;
    assert!(purged.unwrap().purged > 1);
    let claims = [&one, &other].map(|node| {
        let node = node.clone();
        tokio::spawn(async move { node.claim().await })
    });
    in_time(until(&*one, lost, |plan| plan.status.is_final())).await;
    let told = history(&*one, lost).await;
    let expected = [Status::Queued, Status::Running, Status::Failed];
    assert_eq!(statuses(&told), expected);
    claims.iter().for_each(tokio::task::JoinHandle::abort);
}
