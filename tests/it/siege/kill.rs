//! kill -9 repeatedly while plans come in: every accepted plan is done, once, and finished plans keep their results.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use bytes::Bytes;
use tokio::time::Instant;

use super::Dice;
use crate::support::lives::a_plan;
use crate::support::process::Service;
use crate::support::size::size;
use crate::support::sse::{Stream, events};
use crate::support::stores::{Place, for_every_backend};

/// Each kill comes at most this many milliseconds after the start.
const LIFE_MS: usize = 400;

/// A plan that loses five workers fails, so before every fourth kill all plans are left to end.
const KILLS_OF_A_PLAN: usize = 4;

/// What the caller knows.
#[derive(Default)]
struct Known {
    accepted: Vec<String>,
    finished: BTreeMap<String, Bytes>,
}

impl Known {
    /// Submits plans until `enough` have been accepted.
    async fn post(&mut self, service: &Service, enough: usize) {
        while self.accepted.len() < enough {
            let plan = a_plan(50, 100, self.accepted.len());
            self.accepted.push(service.submit(&plan).await);
        }
    }

    /// Submits plans until there are `enough`, then looks for results.
    async fn grow(&mut self, service: &Service, enough: usize) {
        self.post(service, enough).await;
        self.collect(service).await;
        std::future::pending::<()>().await;
    }

    /// Keeps the results that there are.
    async fn collect(&mut self, service: &Service) {
        for address in &self.accepted {
            if self.finished.contains_key(address) {
                continue;
            }
            let request = service.get(&format!("{address}/result"));
            let answer = request.send().await.expect("an answer");
            if answer.status() == 200 {
                let result = answer.bytes().await.expect("a whole body");
                self.finished.insert(address.clone(), result);
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn kills_at_random_points_lose_nothing_and_repeat_nothing() {
    for_every_backend(async |backend| {
        let (n_kills, n_plans): (usize, usize) = size((10, 60), (100, 200));
        let place = Place::new(backend);
        let mut dice = Dice::new(1);
        let mut known = Known::default();
        for kill in 1..=n_kills {
            let service = place.serve(&["--workers", "2"]);
            if kill.is_multiple_of(KILLS_OF_A_PLAN) {
                for address in &known.accepted {
                    service.ended(address).await;
                }
                known.collect(&service).await;
            }
            // The kill comes at a random time and may cut any request.
            let point = Instant::now() + Duration::from_millis(dice.below(LIFE_MS) as u64);
            let enough = n_plans * kill / n_kills;
            let _ = tokio::time::timeout_at(point, known.grow(&service, enough)).await;
            service.kill();
        }
        let service = place.serve(&["--workers", "2"]);
        // Those that there was no time for between the kills.
        known.post(&service, n_plans).await;
        let (accepted, finished) = (known.accepted, known.finished);
        assert_eq!(accepted.iter().collect::<BTreeSet<_>>().len(), n_plans);
        for address in &accepted {
            let ended = service.ended(address).await;
            assert_eq!(ended["status"], "succeeded", "{address}");
            let request = service.get(&format!("{address}/events?rate=0"));
            let told = events(&Stream::open(request).await.rest().await);
            let ends = told.iter().filter(|(_, name)| name == "end").count();
            assert_eq!(ends, 1, "{address}");
            assert_eq!(told.last().expect("events").1, "end", "{address}");
            let ids: Vec<u64> = told.iter().map(|(id, _)| *id).collect();
            assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>(), "{address}");
        }
        assert!(!finished.is_empty(), "no kill followed a result");
        for (address, before) in finished {
            let after = service.bytes(&format!("{address}/result")).await;
            assert_eq!(after, before, "{address}");
        }
    })
    .await;
}
