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
        let (set_by_ms, passed_ms) = (Arc::default(), Arc::default());
        let clock = clock(wall_clock()(), &set_by_ms, &passed_ms);
        Self {
            api: Api::by_clock(backend, clock, options()).await,
            set_by_ms,
            passed_ms,
        }
    }

    /// Another process over the same store, which begins `off_ms` later by a clock that is set by `set_by_ms`.
    async fn started_again(self, off_ms: i64, set_by_ms: i64) -> Self {
        let begin_ms = wall_clock()() + self.passed_ms.load(Ordering::SeqCst) + off_ms;
        let (set_by_ms, passed_ms) = (Arc::new(AtomicI64::new(set_by_ms)), Arc::default());
        let clock = clock(begin_ms, &set_by_ms, &passed_ms);
        Self {
            api: self.api.reopened_by(clock, options()).await,
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

/// A week.
fn options() -> Options {
    let retention = Retention {
        age_ms: Some(7 * DAY_MS),
        ..Retention::default()
    };
    Options {
        retention,
        ..Options::new(10)
    }
}

/// Of a process that begins at `begin_ms`, by a wall clock that is off by `set_by_ms`.
fn clock(
    begin_ms: i64,
    set_by_ms: &Arc<AtomicI64>,
    passed_ms: &Arc<AtomicI64>,
) -> Arc<SteadyClock> {
    let (set_by, passing) = (set_by_ms.clone(), passed_ms.clone());
    let passed = passed_ms.clone();
    let wall = move || begin_ms + passing.load(Ordering::SeqCst) + set_by.load(Ordering::SeqCst);
    SteadyClock::beside(Arc::new(wall), move || {
        Duration::from_millis(passed.load(Ordering::SeqCst).unsigned_abs())
    })
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

/// A service with an ended plan, submitted with the key `first`, and a deleted one: their addresses.
async fn with_plans(backend: Backend) -> (Service, String, String) {
    let service = Service::on(backend).await;
    let first = service.post("first").await.header("location").to_owned();
    run::complete(&*service.api.store, Vec::new()).await;
    let deleted = service.api.submit().await;
    service.api.delete(&deleted).await;
    (service, first, deleted)
}

#[tokio::test]
async fn a_start_with_a_fast_clock_neither_forgets_nor_expires_anything() {
    let (service, first, deleted) = with_plans(Backend::Sqlite).await;
    let service = service.started_again(60_000, 8 * DAY_MS).await;
    let api = &service.api;
    for minutes in [0, 1, 58] {
        service.pass(60_000 * minutes);
        service.sweep().await;
        assert_eq!(api.get(&first).await.status, 200);
        assert_eq!(service.post("first").await.header("location"), first);
        api.get(&deleted).await.expect_problem(410, "gone");
        assert_eq!(api.get("/readyz").await.status, 200);
    }
    // Another start by the same clock is no surer of it.
    let service = service.started_again(0, 8 * DAY_MS).await;
    let api = &service.api;
    service.sweep().await;
    assert_eq!(api.get(&first).await.status, 200);
    // It is set, and nothing is in doubt any more.
    service.set_by(0);
    service.sweep().await;
    assert_eq!(api.get(&first).await.status, 200);
    assert_eq!(api.get("/readyz").await.json(), json!({"status": "ok"}));
    service.pass(8 * DAY_MS);
    service.sweep().await;
    api.get(&first).await.expect_problem(410, "gone");
}

#[tokio::test]
async fn after_a_long_pause_plans_expire_within_an_hour() {
    let (service, first, deleted) = with_plans(Backend::Sqlite).await;
    let service = service.started_again(8 * DAY_MS, 0).await;
    service.sweep().await;
    assert_eq!(service.api.get(&first).await.status, 200);
    service.pass(60 * 60 * 1_000);
    service.sweep().await;
    service.api.get(&first).await.expect_problem(410, "gone");
    service
        .api
        .get(&deleted)
        .await
        .expect_problem(404, "not-found");
    assert_ne!(service.post("first").await.header("location"), first);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_start_before_the_clock_is_set_goes_on_from_the_newest_record() {
    for_every_backend(async |backend| {
        let (service, first, _) = with_plans(backend).await;
        let service = service.started_again(2 * DAY_MS, -800 * DAY_MS).await;
        let api = &service.api;
        let warning = api.get("/readyz").await.json()["warnings"][0].to_string();
        assert!(warning.contains("behind the newest record"), "{warning}");
        let second = service.post("second").await.header("location").to_owned();
        run::complete(&*api.store, Vec::new()).await;
        let created = async |plan: &str| {
            let document = api.get(plan).await.json();
            document["created_at"].as_str().expect("a time").to_owned()
        };
        assert!(created(&first).await <= created(&second).await);
        let newest = &api.get("/plans").await.json()["plans"][0]["id"];
        assert_eq!(
            format!("/plans/{}", newest.as_str().expect("an id")),
            second
        );
        // The time comes, and is right at once.
        service.set_by(0);
        assert_eq!(api.get("/readyz").await.json(), json!({"status": "ok"}));
        let third = service.post("third").await.header("location").to_owned();
        let now_ms = jiff::Timestamp::from_millisecond(wall_clock()() + DAY_MS).expect("a time");
        assert!(created(&third).await > now_ms.to_string());
        service.sweep().await;
        assert_eq!(api.get(&second).await.status, 200);
    })
    .await;
}

/// What was checked by a fast clock, but bears no time of it, says nothing.
#[tokio::test]
async fn a_clock_that_was_fast_for_a_while_is_believed_once_it_is_set() {
    let (service, first, _) = with_plans(Backend::Sqlite).await;
    let service = service.started_again(60_000, 3_650 * DAY_MS).await;
    assert_eq!(service.api.get("/readyz").await.status, 200);
    let service = service.started_again(60_000, 0).await;
    assert_eq!(
        service.api.get("/readyz").await.json(),
        json!({"status": "ok"})
    );
    service.sweep().await;
    assert_eq!(service.api.get(&first).await.status, 200);
}
