//! kill -9 during work: every accepted plan is done, once, and finished plans keep their results.

use std::collections::BTreeMap;

use futures_util::future::join_all;

use crate::support::lives::a_plan;
use crate::support::sse::{Stream, events};
use crate::support::stores::{Place, for_every_backend};

#[tokio::test]
async fn no_accepted_plan_is_lost_or_done_twice() {
    for_every_backend(async |backend| {
        let place = Place::new(backend);
        let service = place.serve(&["--workers", "2"]);
        let addresses = join_all((0..50).map(|seed| {
            let service = &service;
            async move { service.submit(&a_plan(50, 100, seed)).await }
        }))
        .await;

        // The queue runs in order, so about a third is done by now.
        service.ended(&oldest(&addresses, 17)).await;
        let mut finished = BTreeMap::new();
        for address in &addresses {
            let answer = service
                .get(&format!("{address}/result"))
                .send()
                .await
                .expect("an answer");
            if answer.status() == 200 {
                finished.insert(address, answer.bytes().await.expect("a whole body"));
            }
        }
        assert!(
            (1..50).contains(&finished.len()),
            "{} were done",
            finished.len()
        );
        service.kill();

        let service = place.serve(&["--workers", "2"]);
        for address in &addresses {
            assert_eq!(
                service.ended(address).await["status"],
                "succeeded",
                "{address}"
            );
            let told = events(
                &Stream::open(service.get(&format!("{address}/events?rate=0")))
                    .await
                    .rest()
                    .await,
            );
            assert_eq!(
                told.iter().filter(|(_, name)| name == "end").count(),
                1,
                "{address}"
            );
            assert_eq!(told.last().expect("events").1, "end", "{address}");
            assert!(told.is_sorted_by(|a, b| a.0 < b.0), "{address}");
        }
        for (address, before) in finished {
            assert_eq!(
                service.bytes(&format!("{address}/result")).await,
                before,
                "{address}"
            );
        }
    })
    .await;
}

/// The `n`th plan that was accepted; ids sort by time.
fn oldest(addresses: &[String], n: usize) -> String {
    let mut sorted = addresses.to_vec();
    sorted.sort();
    sorted.swap_remove(n)
}
