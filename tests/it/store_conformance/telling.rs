//! Webhooks: ends of plans that are due to be sent.

use noctule::job::{Status, Submission};
use noctule::store::Webhook;

use crate::support::plans::{ending, failure, kind, submission};
use crate::support::stores::on_every_backend;

fn with_webhook(url: &str) -> Submission {
    Submission {
        webhook: Some(url.to_owned()),
        ..submission()
    }
}

/// URL and number of tries of each due webhook.
fn told(due: &[Webhook]) -> Vec<(&str, u32)> {
    due.iter()
        .map(|due| (due.url.as_str(), due.tries))
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_webhook_is_due_at_the_end_and_after_a_restart() {
    on_every_backend(10, async |store| {
        let first = store.submit(with_webhook("a")).await.unwrap().plan.id;
        let second = store.submit(with_webhook("b")).await.unwrap().plan.id;
        store.submit(submission()).await.unwrap();
        let lease = store.claim().await.unwrap();
        assert_eq!(store.due_webhooks(i64::MAX, 10).await.unwrap(), []);

        let ended = store
            .finish(&lease, ending(Status::Succeeded).at(12_000))
            .await
            .unwrap();
        assert_eq!(store.due_webhooks(11_999, 10).await.unwrap(), []);
        let due = store.due_webhooks(12_000, 10).await.unwrap();
        assert_eq!(told(&due), [("a", 0)]);
        assert_eq!(due[0].plan, ended);

        // Any kind of end is due; the one due longest comes first.
        store.request_cancel(second, 11_000).await.unwrap();
        store.reopen().await;
        let due = store.due_webhooks(12_000, 10).await.unwrap();
        assert_eq!(told(&due), [("b", 0), ("a", 0)]);
        assert_eq!(due[0].plan.status, Status::Cancelled);
        assert_eq!(
            told(&store.due_webhooks(12_000, 1).await.unwrap()),
            [("b", 0)]
        );

        // The third plan has no webhook.
        let lease = store.claim().await.unwrap();
        store.finish(&lease, failure().at(12_000)).await.unwrap();
        assert_eq!(store.due_webhooks(i64::MAX, 10).await.unwrap().len(), 2);

        store.webhook_tried(first, Some(20_000)).await.unwrap();
        store.webhook_tried(second, None).await.unwrap();
        store.reopen().await;
        assert_eq!(store.due_webhooks(19_999, 10).await.unwrap(), []);
        let due = store.due_webhooks(20_000, 10).await.unwrap();
        assert_eq!(told(&due), [("a", 1)]);
        store.webhook_tried(first, None).await.unwrap();
        store.webhook_tried(first, Some(1)).await.unwrap();
        assert_eq!(store.due_webhooks(i64::MAX, 10).await.unwrap(), []);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn owners_take_turns_with_their_webhooks() {
    on_every_backend(10, async |store| {
        for (owner, url, ended_ms) in [
            ("one", "a", 1),
            ("one", "b", 2),
            ("one", "c", 3),
            ("two", "d", 4),
        ] {
            let submission = Submission {
                owner: Some(owner.to_owned()),
                ..with_webhook(url)
            };
            let id = store.submit(submission).await.unwrap().plan.id;
            store.request_cancel(id, ended_ms).await.unwrap();
        }
        let due = store.due_webhooks(i64::MAX, 2).await.unwrap();
        assert_eq!(told(&due), [("a", 0), ("d", 0)]);
        let due = store.due_webhooks(i64::MAX, 10).await.unwrap();
        assert_eq!(told(&due), [("a", 0), ("d", 0), ("b", 0), ("c", 0)]);
        let due = store.due_webhooks(3, 10).await.unwrap();
        assert_eq!(told(&due), [("a", 0), ("b", 0), ("c", 0)]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rerun_plan_has_one_webhook_and_a_deleted_plan_has_none() {
    on_every_backend(10, async |store| {
        let id = store.submit(with_webhook("a")).await.unwrap().plan.id;
        let lost = store.claim().await.unwrap();
        store.reopen().await;
        let late = store
            .finish(&lost, ending(Status::Succeeded).at(12_000))
            .await;
        assert_eq!(kind(late), Err("lease lost"));
        assert_eq!(store.due_webhooks(i64::MAX, 10).await.unwrap(), []);
        let lease = store.claim().await.unwrap();
        store
            .finish(&lease, ending(Status::Succeeded).at(13_000))
            .await
            .unwrap();
        let due = store.due_webhooks(i64::MAX, 10).await.unwrap();
        assert_eq!(told(&due), [("a", 0)]);
        store.delete(id, 14_000).await.unwrap();
        assert_eq!(store.due_webhooks(i64::MAX, 10).await.unwrap(), []);
        store.webhook_tried(id, None).await.unwrap();
    })
    .await;
}
