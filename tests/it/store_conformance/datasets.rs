//! Which datasets the kept plans use.

use noctule::job::Submission;
use noctule::store::{DatasetUse, Store};

use crate::support::plans::{failure, submission};
use crate::support::stores::on_every_backend;

fn over(dataset: &str, owner: &str) -> Submission {
    Submission {
        dataset: Some(dataset.to_owned()),
        owner: Some(owner.to_owned()),
        ..submission()
    }
}

async fn uses(store: &dyn Store) -> Vec<(String, u64, u64)> {
    let uses = store.datasets_in_use().await.unwrap().into_iter();
    uses.map(
        |DatasetUse {
             sha256,
             active,
             plans,
         }| (sha256, active, plans),
    )
    .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dataset_is_in_use_while_a_plan_over_it_is_kept() {
    on_every_backend(10, async |store| {
        assert_eq!(uses(&**store).await, []);
        store.submit(submission()).await.unwrap();
        let first = store.submit(over("b", "alice")).await.unwrap().plan.id;
        let second = store.submit(over("b", "bob")).await.unwrap().plan.id;
        store.submit(over("a", "bob")).await.unwrap();
        let named = |name: &str, active, plans| (name.to_owned(), active, plans);
        assert_eq!(uses(&**store).await, [named("a", 1, 1), named("b", 2, 2)]);

        // A running plan counts as active, an ended one does not, however it ended.
        let lease = store.claim().await.unwrap();
        store.finish(&lease, failure().at(0)).await.unwrap();
        let lease = store.claim().await.unwrap();
        assert_eq!(lease.plan.id, first);
        assert_eq!(uses(&**store).await, [named("a", 1, 1), named("b", 2, 2)]);
        store.finish(&lease, failure().at(0)).await.unwrap();
        store.request_cancel(second, 0).await.unwrap();
        assert_eq!(uses(&**store).await, [named("a", 1, 1), named("b", 0, 2)]);

        store.reopen().await;
        for (id, left) in [(first, 1), (second, 0)] {
            store.delete(id, 0).await.unwrap();
            let found = uses(&**store).await;
            let of_b = found.iter().find(|(name, ..)| name == "b");
            assert_eq!(of_b.map_or(0, |(_, _, plans)| *plans), left);
        }
    })
    .await;
}
