//! Cancel against finish: one final state and one `end`, whichever comes first.

use std::sync::Arc;

use noctule::job::{Event, PlanId, Status};
use noctule::store::{Options, Store};
use tokio::task::JoinSet;

use crate::support::api::Api;
use crate::support::plans::{ending, history, submission};
use crate::support::run;
use crate::support::size::size;
use crate::support::stores::{for_every_backend, on_every_backend};

/// Concurrent races.
const LANES: usize = 16;

async fn has_one_end(store: &dyn Store, id: PlanId) {
    let plan = store.get(id).await.expect("it is kept");
    assert!(plan.status.is_final(), "{plan:?}");
    let told = history(store, id).await;
    let ends = told.iter().filter(|event| matches!(event, Event::End(_)));
    assert_eq!(ends.count(), 1, "{told:?}");
    assert_eq!(told.last(), Some(&Event::End(plan.status)));
}

/// How the run ends varies from race to race.
fn finish_with(race: usize) -> Status {
    if race.is_multiple_of(3) {
        Status::Cancelled
    } else {
        Status::Succeeded
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn cancel_and_finish_end_a_plan_once_in_the_store() {
    on_every_backend(1_000, async |store| {
        let mut lanes = JoinSet::new();
        for lane in 0..LANES {
            let store = store.share();
            lanes.spawn(async move {
                for race in (lane..size(250, 5_000)).step_by(LANES) {
                    race_in(&store, race).await;
                }
            });
        }
        lanes.join_all().await;
    })
    .await;
}

async fn race_in(store: &Arc<dyn Store>, race: usize) {
    store.submit(submission()).await.expect("there is room");
    let lease = store.claim().await.expect("somebody is queued");
    let id = lease.plan.id;
    let cancel = {
        let store = store.clone();
        async move { store.request_cancel(id, 1).await }
    };
    let finish = {
        let store = store.clone();
        async move { store.finish(&lease, ending(finish_with(race)).at(2)).await }
    };
    let (cancelled, finished) = if race.is_multiple_of(2) {
        let cancel = tokio::spawn(cancel);
        (tokio::spawn(finish).await, cancel.await)
    } else {
        let finish = tokio::spawn(finish);
        let cancelled = tokio::spawn(cancel).await;
        (finish.await, cancelled)
    };
    cancelled.expect("no panic").expect("the plan is there");
    finished.expect("no panic").expect("the lease holds");
    has_one_end(&**store, id).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cancel_and_finish_end_a_plan_once_over_http() {
    for_every_backend(async |backend| {
        let api = Arc::new(Api::on(backend, Options::new(1_000)).await);
        let mut lanes = JoinSet::new();
        for lane in 0..LANES {
            let api = api.clone();
            lanes.spawn(async move {
                for race in (lane..size(250, 5_000)).step_by(LANES) {
                    api.submit().await;
                    let lease = api.store.claim().await.expect("somebody is queued");
                    let id = lease.plan.id;
                    let finish = {
                        let api = api.clone();
                        async move { run::finish(&*api.store, &lease, finish_with(race)).await }
                    };
                    let finish = tokio::spawn(finish);
                    let path = format!("/plans/{id}/cancel");
                    let cancelled = api.post(&path, &serde_json::Value::Null).await;
                    assert!(
                        cancelled.status == 200 || cancelled.status == 202,
                        "{cancelled:?}"
                    );
                    finish.await.expect("no panic");
                    has_one_end(&*api.store, id).await;
                    let status = api.get(&format!("/plans/{id}")).await.json();
                    assert!(
                        ["succeeded", "cancelled"]
                            .contains(&status["status"].as_str().expect("text"))
                    );
                }
            });
        }
        lanes.join_all().await;
    })
    .await;
}
