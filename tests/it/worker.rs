//! The worker pool: how plans are run, reported, stopped and given back.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use futures_util::FutureExt;
use noctule::export::document::ResultDocument;
use noctule::job::{Event, Failure, PlanId, Status, Submission};
use noctule::planner::StopReason;
use noctule::store::{Clock, Store};
use noctule::telemetry::metrics::Queue;
use noctule::worker::{Engine, Pool, Settings, Unplanned};

use crate::support::engines::{deterministic, endless, engine, incumbent, outcome, point};
use crate::support::faulty_store::FaultyStore;
use crate::support::openmetrics::Reading;
use crate::support::plans::{history, kind, statuses, submission, until};
use crate::support::stores::{Fixture, on_every_backend};

/// Longer than any test takes.
const AGES: Duration = Duration::from_secs(3_600);

fn settings(workers: usize, clock: Clock) -> Settings {
    Settings {
        workers,
        clock,
        instruments: Arc::default(),
    }
}

fn pool(fixture: &Fixture, workers: usize, engine: Engine) -> Pool {
    let clock = fixture.clock();
    Pool::start(fixture.share(), settings(workers, clock), engine)
}

async fn submit(store: &dyn Store, scenario: &str) -> PlanId {
    let submission = Submission {
        scenario: scenario.to_owned(),
        ..submission()
    };
    store.submit(submission).await.unwrap().plan.id
}

async fn ended(store: &dyn Store, id: PlanId) -> Status {
    until(store, id, |plan| plan.status.is_final()).await.status
}

async fn result(store: &dyn Store, id: PlanId) -> ResultDocument {
    let document = store.result(id).await.unwrap().expect("there is a result");
    serde_json::from_str(&document).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_keeps_its_result_and_its_events_in_order() {
    on_every_backend(10, async |store| {
        let pool = pool(store, 1, deterministic(5_000));
        let id = submit(&**store, "{}").await;
        assert_eq!(ended(&**store, id).await, Status::Succeeded);
        let document = result(&**store, id).await;
        let plan = store.get(id).await.unwrap();
        assert_eq!(document.plan_id, Some(id));
        assert_eq!(
            (document.seed, &document.algorithm),
            (plan.seed, &plan.algorithm)
        );
        assert_eq!(document.scenario_sha256.len(), 64);
        assert!((document.timing.queued_ms - 9_000.0).abs() < 1e-9);
        assert_eq!(plan.best_cost, Some(document.cost.total));
        assert_eq!((plan.iteration, plan.evaluations), (5_000, 100_020));
        assert_eq!(plan.stop_reason.as_deref(), Some("iterations"));

        let told = history(&**store, id).await;
        let n = told.len();
        assert_eq!(n, 2 + 5_001 + 1_667 + 2);
        assert_eq!(statuses(&told[..2]), [Status::Queued, Status::Running]);
        assert_eq!(told[n - 1], Event::End(Status::Succeeded));
        let mut iteration = 0;
        let mut improved = false;
        for event in &told[2..n - 2] {
            match event {
                Event::Incumbent(incumbent) => {
                    assert_eq!(
                        (incumbent.iteration, iteration % 3, improved),
                        (iteration, 1, false)
                    );
                    improved = true;
                }
                Event::Convergence(point) => {
                    assert_eq!((point.iteration, improved), (iteration, iteration % 3 == 1));
                    assert_eq!(*point, document.convergence[iteration]);
                    (iteration, improved) = (iteration + 1, false);
                }
                other => panic!("{other:?} in the midst of a run"),
            }
        }
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn events_can_be_read_while_their_run_goes_on() {
    on_every_backend(10, async |store| {
        let (go_on, told_to) = mpsc::channel::<()>();
        let told_to = Mutex::new(told_to);
        let pool = pool(
            store,
            1,
            engine(move |_, observer, _| {
                observer.iteration(&point(4, 480.0));
                observer.incumbent(&incumbent(4, 480.0));
                told_to.lock().unwrap().recv().unwrap();
                Ok(outcome(StopReason::Converged, 470.0, vec![point(5, 470.0)]))
            }),
        );
        let id = submit(&**store, "{}").await;
        let plan = until(&**store, id, |plan| plan.iteration == 4).await;
        assert_eq!(
            (plan.status, plan.best_cost),
            (Status::Running, Some(480.0))
        );
        go_on.send(()).unwrap();
        assert_eq!(ended(&**store, id).await, Status::Succeeded);
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_fails_its_plan_and_no_other() {
    on_every_backend(100, async |store| {
        let pool = pool(
            store,
            2,
            engine(|scenario, observer, _| {
                observer.iteration(&point(0, 480.0));
                match scenario {
                    "panic" => panic!("secret {}", 7),
                    "fail" => Err(Failure {
                        kind: "terrain-missing".to_owned(),
                        detail: "no such terrain".to_owned(),
                    }),
                    _ => Ok(outcome(
                        StopReason::Iterations,
                        470.0,
                        vec![point(0, 470.0)],
                    )),
                }
            }),
        );
        let mut ids = Vec::new();
        for nth in 0..30 {
            ids.push(submit(&**store, ["panic", "fail", "good"][nth % 3]).await);
        }
        for (nth, id) in ids.into_iter().enumerate() {
            let status = ended(&**store, id).await;
            assert_eq!(
                status,
                [Status::Failed, Status::Failed, Status::Succeeded][nth % 3]
            );
            let error = store.get(id).await.unwrap().error;
            let problem = error.as_ref().map(|error| error.kind.as_str());
            assert_eq!(
                problem,
                [Some("planner-panic"), Some("terrain-missing"), None][nth % 3]
            );
            assert!(!error.is_some_and(|error| error.detail.contains("secret")));
            // Events from before the end are kept.
            let told = history(&**store, id).await;
            assert!(matches!(told[2], Event::Convergence(_)));
            assert_eq!((told.len(), &told[4]), (5, &Event::End(status)));
        }
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_that_cannot_run_now_is_retried() {
    on_every_backend(10, async |store| {
        let asked = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&asked);
        let at_last = deterministic(3);
        let pool = pool(
            store,
            1,
            Arc::new(move |scenario, observer, stop| {
                if counted.fetch_add(1, Ordering::Relaxed) < 2 {
                    return Err(Unplanned::NotNow("the ground is away".to_owned()));
                }
                at_last(scenario, observer, stop)
            }),
        );
        let id = submit(&**store, "{}").await;
        assert_eq!(ended(&**store, id).await, Status::Succeeded);
        assert_eq!(asked.load(Ordering::Relaxed), 3);
        let told = history(&**store, id).await;
        let status = [Status::Queued, Status::Running, Status::Succeeded];
        assert_eq!(statuses(&told), status, "it was never given back");
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_that_cannot_run_for_long_does_not_keep_others_from_running() {
    on_every_backend(10, async |store| {
        let others = deterministic(3);
        let pool = pool(
            store,
            1,
            Arc::new(move |scenario, observer, stop| {
                if scenario == "away" {
                    return Err(Unplanned::NotNow("its ground is away".to_owned()));
                }
                others(scenario, observer, stop)
            }),
        );
        let away = [
            submit(&**store, "away").await,
            submit(&**store, "away").await,
        ];
        let other = submit(&**store, "{}").await;
        assert_eq!(ended(&**store, other).await, Status::Succeeded);
        for id in away {
            let plan = store.get(id).await.unwrap();
            assert!(!plan.status.is_final(), "it is still wanted");
        }
        pool.drain(Duration::ZERO).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_that_waits_for_a_retry_can_be_cancelled_and_drained() {
    on_every_backend(10, async |store| {
        let never: Engine = Arc::new(|_, _, _| Err(Unplanned::NotNow("away".to_owned())));
        let settings = settings(2, store.clock());
        let instruments = Arc::clone(&settings.instruments);
        let pool = Pool::start(store.share(), settings, never);
        let [first, second] = [submit(&**store, "{}").await, submit(&**store, "{}").await];
        for id in [first, second] {
            until(&**store, id, |plan| plan.status == Status::Running).await;
        }
        store.request_cancel(first, 0).await.unwrap();
        assert_eq!(ended(&**store, first).await, Status::Cancelled);
        assert_eq!(store.result(first).await.unwrap(), None);
        pool.drain(Duration::ZERO).await;
        let plan = store.get(second).await.unwrap();
        assert_eq!(plan.status, Status::Queued, "for another worker");
        let queue = Queue {
            queued: Some(1),
            running: Some(0),
            oldest_queued_ms: None,
            limit: 10,
            workers: 2,
        };
        let reading = Reading::read(&instruments.metrics.text(queue));
        let cancelled = reading.value("noctule_plans_ended_total{status=\"cancelled\"}");
        assert!(
            (cancelled - 1.0).abs() < 0.5,
            "what was given back to its end"
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_run_keeps_its_best_route() {
    on_every_backend(10, async |store| {
        let pool = pool(store, 1, endless());
        let id = submit(&**store, "{}").await;
        until(&**store, id, |plan| plan.iteration > 3).await;
        store.request_cancel(id, 0).await.unwrap();
        assert_eq!(ended(&**store, id).await, Status::Cancelled);
        let plan = store.get(id).await.unwrap();
        let document = result(&**store, id).await;
        assert_eq!(
            (document.stop_reason.as_deref(), document.feasible),
            (Some("cancelled"), true)
        );
        assert_eq!(plan.best_cost, Some(document.cost.total));
        assert_eq!(plan.stop_reason.as_deref(), Some("cancelled"));
        let told = history(&**store, id).await;
        let last_point = told.iter().rev().find_map(|event| match event {
            Event::Convergence(point) => Some(*point),
            _ => None,
        });
        assert_eq!(last_point, document.convergence.last().copied());
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn deleting_a_running_plan_stops_it_and_frees_its_worker() {
    on_every_backend(10, async |store| {
        let pool = pool(store, 1, endless());
        let first = submit(&**store, "{}").await;
        let second = submit(&**store, "{}").await;
        until(&**store, first, |plan| plan.iteration > 0).await;
        store.delete(first, store.now_ms()).await.unwrap();
        until(&**store, second, |plan| plan.iteration > 0).await;
        assert_eq!(kind(store.get(first).await), Err("gone"));
        pool.drain(Duration::ZERO).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn no_more_plans_run_at_once_than_there_are_workers() {
    on_every_backend(50, async |store| {
        let (running, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let (go_on, told_to) = mpsc::channel::<()>();
        let told_to = Mutex::new(told_to);
        let record = Arc::clone(&most);
        let pool = pool(
            store,
            3,
            engine(move |_, _, _| {
                let now = running.fetch_add(1, Ordering::SeqCst) + 1;
                record.fetch_max(now, Ordering::SeqCst);
                told_to.lock().unwrap().recv().unwrap();
                running.fetch_sub(1, Ordering::SeqCst);
                Ok(outcome(
                    StopReason::Iterations,
                    470.0,
                    vec![point(0, 470.0)],
                ))
            }),
        );
        let mut ids = Vec::new();
        for _ in 0..12 {
            ids.push(submit(&**store, "{}").await);
        }
        until(&**store, ids[2], |plan| plan.status == Status::Running).await;
        store.health().await.unwrap();
        let stats = store.stats().await.unwrap();
        assert_eq!((stats.queued, stats.running), (9, 3));
        for _ in &ids {
            go_on.send(()).unwrap();
        }
        for id in ids {
            assert_eq!(ended(&**store, id).await, Status::Succeeded);
        }
        assert!(most.load(Ordering::SeqCst) <= 3);
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn draining_gives_back_unfinished_plans_and_a_rerun_gives_the_same_result() {
    on_every_backend(10, async |store| {
        let first = pool(store, 2, endless());
        let mut ids = Vec::new();
        for nth in 0..3 {
            ids.push(submit(&**store, &format!("{{\"seed\":{nth}}}")).await);
        }
        for id in &ids[..2] {
            until(&**store, *id, |plan| plan.iteration > 3).await;
        }
        first.drain(Duration::ZERO).await;
        for (place, id) in ids.iter().enumerate() {
            let plan = store.get(*id).await.unwrap();
            assert_eq!(
                (plan.status, plan.queue_position),
                (Status::Queued, Some(place as u64 + 1))
            );
            assert_eq!((plan.iteration, plan.best_cost), (0, None));
            assert_eq!(store.result(*id).await.unwrap(), None);
        }
        store.reopen().await;
        let second = pool(store, 2, deterministic(50));
        let alone = submit(&**store, "{\"seed\":0}").await;
        assert_eq!(ended(&**store, alone).await, Status::Succeeded);
        assert_eq!(ended(&**store, ids[0]).await, Status::Succeeded);
        let results = [
            result(&**store, ids[0]).await,
            result(&**store, alone).await,
        ];
        assert_eq!(without_times(&results[0]), without_times(&results[1]));
        second.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn draining_lets_a_run_end_and_starts_no_other() {
    on_every_backend(10, async |store| {
        let (go_on, told_to) = mpsc::channel::<()>();
        let told_to = Mutex::new(told_to);
        let pool = pool(
            store,
            1,
            engine(move |_, observer, stop| {
                observer.iteration(&point(1, 480.0));
                told_to.lock().unwrap().recv().unwrap();
                assert!(!stop.requested());
                Ok(outcome(
                    StopReason::Iterations,
                    470.0,
                    vec![point(0, 470.0)],
                ))
            }),
        );
        let running = submit(&**store, "{}").await;
        let waiting = submit(&**store, "{}").await;
        until(&**store, running, |plan| plan.iteration == 1).await;
        let mut drained = Box::pin(pool.drain(AGES));
        assert!(drained.as_mut().now_or_never().is_none());
        go_on.send(()).unwrap();
        drained.await;
        assert_eq!(store.get(running).await.unwrap().status, Status::Succeeded);
        assert_eq!(store.get(waiting).await.unwrap().status, Status::Queued);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_idle_pool_drains_and_takes_no_plan() {
    on_every_backend(10, async |store| {
        let pool = pool(store, 4, endless());
        store.health().await.unwrap();
        pool.drain(AGES).await;
        let id = submit(&**store, "{}").await;
        store.health().await.unwrap();
        assert_eq!(store.get(id).await.unwrap().status, Status::Queued);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_pool_stops_its_threads() {
    on_every_backend(10, async |store| {
        let (stopped, heard) = tokio::sync::oneshot::channel::<()>();
        let stopped = Mutex::new(Some(stopped));
        let pool = pool(
            store,
            1,
            engine(move |_, observer, stop| {
                while !stop.requested() {
                    observer.iteration(&point(1, 480.0));
                }
                stopped.lock().unwrap().take().unwrap().send(()).unwrap();
                Ok(outcome(StopReason::Cancelled, 480.0, vec![point(1, 480.0)]))
            }),
        );
        let id = submit(&**store, "{}").await;
        until(&**store, id, |plan| plan.iteration == 1).await;
        drop(pool);
        heard.await.unwrap();
        assert_eq!(store.get(id).await.unwrap().status, Status::Running);
        store.reopen().await;
        assert_eq!(store.get(id).await.unwrap().status, Status::Queued);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn intermittent_store_failures_lose_no_events() {
    on_every_backend(20, async |store| {
        let faulty = Arc::new(FaultyStore::new(store.share()));
        let clock = store.clock();
        let pool = Pool::start(faulty, settings(1, clock), deterministic(2_000));
        for _ in 0..3 {
            let id = submit(&**store, "{}").await;
            assert_eq!(ended(&**store, id).await, Status::Succeeded);
            let told = history(&**store, id).await;
            assert_eq!(told.len(), 2 + 2_001 + 667 + 2);
        }
        pool.drain(AGES).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pool_whose_store_has_closed_still_drains() {
    on_every_backend(10, async |store| {
        let pool = pool(store, 2, endless());
        let id = submit(&**store, "{}").await;
        until(&**store, id, |plan| plan.iteration > 0).await;
        store.close().await;
        pool.drain(Duration::ZERO).await;
        store.reopen().await;
        assert_eq!(store.get(id).await.unwrap().status, Status::Queued);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_number_of_workers_changes_no_result() {
    on_every_backend(50, async |store| {
        let mut runs = Vec::new();
        for workers in [2, 4] {
            let pool = pool(store, workers, deterministic(300));
            let mut ids = Vec::new();
            for nth in 0..20 {
                ids.push(submit(&**store, &format!("{{\"seed\":{nth}}}")).await);
            }
            let mut run = Vec::new();
            for id in ids {
                ended(&**store, id).await;
                let told = history(&**store, id).await;
                let told: Vec<_> = told
                    .into_iter()
                    .filter(|event| matches!(event, Event::Convergence(_) | Event::Incumbent(_)))
                    .collect();
                run.push((without_times(&result(&**store, id).await), told));
            }
            runs.push(run);
            pool.drain(AGES).await;
        }
        assert!(runs[0] == runs[1]);
        assert_ne!(runs[0][0], runs[0][1]);
    })
    .await;
}

/// The result as JSON without its plan's id and its wall times.
fn without_times(document: &ResultDocument) -> String {
    let mut document = document.clone();
    document.plan_id = None;
    document.timing.queued_ms = 0.0;
    document.timing.run_ms = 0.0;
    document.to_json()
}

/// Requests must not wait for a processor while every core plans.
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn planning_runs_at_a_lower_priority() {
    let priority = || rustix::process::getpriority_process(None).unwrap();
    on_every_backend(10, async |store| {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let (planning, seen_there) = (deterministic(10), Arc::clone(&seen));
        let engine: Engine = Arc::new(move |scenario, observer, stop| {
            seen_there.lock().unwrap().push(priority());
            planning(scenario, observer, stop)
        });
        let pool = pool(store, 1, engine);
        for _ in 0..2 {
            let id = submit(&**store, "{}").await;
            assert_eq!(ended(&**store, id).await, Status::Succeeded);
        }
        let lower = (priority() + 5).min(19);
        assert_eq!(*seen.lock().unwrap(), [lower, lower]);
        pool.drain(AGES).await;
    })
    .await;
}
