//! Repeated submissions, quotas, and lists by owner.

use futures_util::future::join_all;
use noctule::job::{Idempotency, Submission};
use noctule::store::{IDEMPOTENCY_MS, ListQuery};

use crate::support::plans::{kind, submission};
use crate::support::stores::on_every_backend;

fn of(owner: &str) -> Submission {
    Submission {
        owner: Some(owner.to_owned()),
        ..submission()
    }
}

fn with_key(submission: Submission, key: &str, body: &str) -> Submission {
    let idempotency = Idempotency {
        key: key.to_owned(),
        body_sha256: body.to_owned(),
    };
    Submission {
        idempotency: Some(idempotency),
        ..submission
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_key_and_body_get_the_same_plan() {
    on_every_backend(1, async |store| {
        let first = with_key(submission(), "k", "body");
        let again = || with_key(submission(), "k", "body");
        let tries = join_all(
            (0..100).map(|nth| store.submit(if nth == 50 { first.clone() } else { again() })),
        )
        .await;
        // A full queue does not refuse a repetition.
        let answers: Vec<_> = tries.into_iter().map(Result::unwrap).collect();
        assert_eq!(answers.iter().filter(|answer| !answer.replayed).count(), 1);
        let id = answers[0].plan.id;
        assert!(answers.iter().all(|answer| answer.plan.id == id));
        assert_eq!(store.stats().await.unwrap().queued, 1);

        let other_body = with_key(submission(), "k", "another body");
        let other_owner = with_key(of("alice"), "k", "another body");
        let repeated = async |submission: &Submission| {
            let idempotency = submission.idempotency.as_ref().expect("it has a key");
            store.repeated(submission.owner.as_ref(), idempotency).await
        };
        let found = repeated(&again()).await.unwrap();
        assert_eq!(found, Some(store.get(id).await.unwrap()));
        assert_eq!(kind(repeated(&other_body).await), Err("key reused"));
        assert_eq!(repeated(&other_owner).await.unwrap(), None);
        assert_eq!(kind(store.submit(other_body).await), Err("key reused"));
        assert_eq!(kind(store.submit(other_owner).await), Err("queue full"));

        // A repetition returns the plan's current state, also after reopening.
        let lease = store.claim().await.unwrap();
        assert_eq!(lease.plan.id, id);
        store.reopen().await;
        let replay = store.submit(again()).await.unwrap();
        assert!(replay.replayed && replay.plan == store.get(id).await.unwrap());

        store.delete(id, store.now_ms()).await.unwrap();
        assert_eq!(kind(store.submit(again()).await), Err("gone"));
        let idempotency = again().idempotency.expect("it has a key");
        let repeated = store.repeated(None, &idempotency).await;
        assert_eq!(kind(repeated), Err("gone"));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_idempotency_key_is_remembered_for_a_day() {
    on_every_backend(10, async |store| {
        let again = || with_key(submission(), "k", "body");
        let first = store.submit(again()).await.unwrap().plan.id;
        store.pass_ms(IDEMPOTENCY_MS - 1);
        store.sweep(store.now_ms()).await.unwrap();
        assert_eq!(store.submit(again()).await.unwrap().plan.id, first);
        store.pass_ms(1);
        let second = store.submit(again()).await.unwrap();
        assert!(!second.replayed && second.plan.id != first);
        assert!(store.submit(again()).await.unwrap().replayed);
        store.pass_ms(IDEMPOTENCY_MS);
        store.sweep(store.now_ms()).await.unwrap();
        assert!(!store.submit(again()).await.unwrap().replayed);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_submission_leaves_its_key_free() {
    on_every_backend(1, async |store| {
        store.submit(submission()).await.unwrap();
        let keyed = || with_key(submission(), "k", "body");
        assert_eq!(kind(store.submit(keyed()).await), Err("queue full"));
        store.claim().await.unwrap();
        assert!(!store.submit(keyed()).await.unwrap().replayed);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_owner_cannot_exceed_its_quota_of_active_plans() {
    on_every_backend(100, async |store| {
        let limited = |owner: &str| Submission {
            quota: Some(2),
            ..of(owner)
        };
        let tries = join_all((0..10).map(|_| store.submit(limited("alice")))).await;
        assert_eq!(tries.iter().filter(|answer| answer.is_ok()).count(), 2);
        assert_eq!(kind(store.submit(limited("bob")).await), Ok(()));
        // A running plan counts, an ended one does not.
        let lease = store.claim().await.unwrap();
        assert_eq!(
            kind(store.submit(limited("alice")).await),
            Err("quota reached")
        );
        store.request_cancel(lease.plan.id, 0).await.unwrap();
        store.release(&lease).await.unwrap();
        assert_eq!(kind(store.submit(limited("alice")).await), Ok(()));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn plans_can_be_listed_by_owner() {
    on_every_backend(100, async |store| {
        for owner in ["alice", "bob", "alice"] {
            store.submit(of(owner)).await.unwrap();
        }
        store.submit(submission()).await.unwrap();
        let owners = async |owner: Option<&str>| {
            let query = ListQuery {
                owner: owner.map(ToOwned::to_owned),
                limit: 10,
                ..ListQuery::default()
            };
            let plans = store.list(query).await.unwrap();
            plans.into_iter().map(|plan| plan.owner).collect::<Vec<_>>()
        };
        let alice = Some("alice".to_owned());
        let bob = Some("bob".to_owned());
        assert_eq!(
            owners(None).await,
            [None, alice.clone(), bob, alice.clone()]
        );
        assert_eq!(owners(Some("alice")).await, [alice.clone(), alice]);
        assert_eq!(owners(Some("carol")).await, []);
    })
    .await;
}
