//! A jumping wall clock: nothing is forgotten or expires because of it, and `/readyz` reports it.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use axum::http::Method;
use noctule::store::{Options, Retention, SteadyClock, wall_clock};
use serde_json::json;

use crate::support::api::{Answer, Api};
use crate::support::run;
use crate::support::scenario;
use crate::support::stores::{Backend, for_every_backend};

const DAY_MS: i64 = 24 * 60 * 60 * 1_000;

/// A service whose wall clock and elapsed time are set by the test.
struct Service {
    api: Api,
    set_by_ms: Arc<AtomicI64>,
    passed_ms: Arc<AtomicI64>,
}

impl Service {
    /// Keeps plans for a week.
    async fn on(backend: Backend) -> Self {
        let (set_by_ms, passed_ms) = (Arc::new(AtomicI64::new(0)), Arc::new(AtomicI64::new(0)));
        let (set_by, passing) = (set_by_ms.clone(), passed_ms.clone());
        let passed = passed_ms.clone();
        let begin_ms = wall_clock()();
        let wall =
            move || begin_ms + passing.load(Ordering::SeqCst) + set_by.load(Ordering::SeqCst);
        let clock = SteadyClock::beside(Arc::new(wall), move || {
            Duration::from_millis(passed.load(Ordering::SeqCst).unsigned_abs())
        });
        let retention = Retention {
            age_ms: Some(7 * DAY_MS),
            ..Retention::default()
        };
        let options = Options {
            retention,
            ..Options::new(10)
        };
        Self {
            api: Api::by_clock(backend, clock, options).await,
            set_by_ms,
            passed_ms,
        }
    }

    /// Moves the wall clock by `ms`, as an operator would.
    fn set_by(&self, ms: i64) {
        self.set_by_ms.store(ms, Ordering::SeqCst);
    }

    fn pass(&self, ms: i64) {
        self.passed_ms.fetch_add(ms, Ordering::SeqCst);
    }

    async fn post(&self, key: &str) -> Answer {
        let headers = [
            ("content-type", "application/json"),
            ("idempotency-key", key),
        ];
        let body = scenario().to_string();
        self.api.send(Method::POST, "/plans", &headers, body).await
    }

    /// One pass of the sweeper.
    async fn sweep(&self) {
        let now_ms = self.api.state.clock.now_ms();
        self.api.store.sweep(now_ms).await.expect("open");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_clock_jump_neither_forgets_nor_expires_anything() {
    for_every_backend(async |backend| {
        let service = Service::on(backend).await;
        let api = &service.api;
        let first = service.post("first").await.header("location").to_owned();
        run::complete(&*api.store, Vec::new()).await;
        let deleted = api.submit().await;
        api.delete(&deleted).await;
        for jump_ms in [30 * DAY_MS, -30 * DAY_MS] {
            service.set_by(jump_ms);
            service.sweep().await;
            assert_eq!(api.get(&first).await.status, 200, "by {jump_ms} ms");
            assert_eq!(service.post("first").await.header("location"), first);
            // A deletion during the jump must not evict older tombstones.
            api.delete(&api.submit().await).await;
            api.get(&deleted).await.expect_problem(410, "gone");

            let meanwhile = service.post(&jump_ms.to_string()).await;
            let meanwhile = meanwhile.header("location").to_owned();
            run::complete(&*api.store, Vec::new()).await;
            service.set_by(0);
            service.sweep().await;
            assert_eq!(api.get(&meanwhile).await.status, 200, "by {jump_ms} ms");
        }
        // What is due expires all the same, wherever the wall clock stands.
        service.set_by(-30 * DAY_MS);
        service.pass(60_000);
        service.sweep().await;
        assert_eq!(api.get(&first).await.status, 200);
        service.set_by(0);
        service.pass(8 * DAY_MS);
        service.sweep().await;
        api.get(&first).await.expect_problem(410, "gone");
    })
    .await;
}

#[tokio::test]
async fn a_clock_jump_is_reported_and_the_service_stays_ready() {
    let service = Service::on(Backend::Sqlite).await;
    let sound = service.api.get("/readyz").await.json();
    assert_eq!(sound, json!({"status": "ok"}));
    service.set_by(-7_200_000);
    let answer = service.api.get("/readyz").await;
    assert_eq!(answer.status, 200);
    let warning = answer.json()["warnings"][0].to_string();
    assert!(warning.contains("-7200000 ms"), "{warning}");
    // After an hour without another jump the new time is accepted.
    service.pass(60 * 60 * 1_000);
    assert_eq!(service.api.get("/readyz").await.json(), sound);
}
