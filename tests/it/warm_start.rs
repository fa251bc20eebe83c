//! Starting from a known route: a stored plan's, or one given in the document.

use std::sync::Arc;

use noctule::job::Status;
use serde_json::{Value, json};

use crate::support::api::Api;
use crate::support::faulty_store::FaultyStore;
use crate::support::process::{Service, run};
use crate::support::{run as worker, scenario};

/// The small scenario, to be planned from another plan's route.
fn from_plan(id: &str) -> Value {
    let mut document = scenario();
    document["planner"]["warm_start"] = json!({"plan_id": id});
    document
}

fn id_of(address: &str) -> String {
    address.rsplit('/').next().expect("an id").to_owned()
}

#[tokio::test]
async fn a_plan_id_is_replaced_by_that_plans_waypoints() {
    let api = Api::new();
    let first = api.submit().await;
    worker::complete(&*api.store, vec![worker::convergence(0, 0.1)]).await;
    let result = api.get(&format!("{first}/result")).await.json();

    let accepted = api.post("/plans", &from_plan(&id_of(&first))).await;
    assert_eq!(accepted.status, 202, "{accepted:?}");
    let again = accepted.header("location");
    let kept = api.get(&format!("{again}/scenario")).await;
    let start = &kept.json()["planner"]["warm_start"];
    let points = start["waypoints"].as_array().expect("waypoints");
    assert!(start.get("plan_id").is_none(), "{start}");
    assert_eq!(points.len(), 3);
    for (point, delivered) in points
        .iter()
        .zip(result["waypoints"].as_array().expect("some"))
    {
        for axis in ["x", "y", "z"] {
            assert_eq!(point[axis].as_f64(), delivered[axis].as_f64());
        }
    }

    // The accepted document is self-contained: the first plan may be deleted.
    assert_eq!(api.delete(&first).await.status, 204);
    let answer = api.post("/plans", &kept.json()).await;
    assert_eq!(answer.status, 202, "{answer:?}");
    let once_more = answer.header("location");
    let once_more = api.get(&format!("{once_more}/scenario")).await;
    assert_eq!(once_more.body, kept.body);
}

#[tokio::test]
async fn validate_only_also_shows_the_waypoints() {
    let api = Api::new();
    let first = api.submit().await;
    worker::complete(&*api.store, vec![worker::convergence(0, 0.1)]).await;
    let answer = api
        .post("/plans?validate_only=true", &from_plan(&id_of(&first)))
        .await;
    assert_eq!(answer.status, 200, "{answer:?}");
    let start = &answer.json()["scenario"]["planner"]["warm_start"];
    assert_eq!(start["waypoints"].as_array().map(Vec::len), Some(3));
}

#[tokio::test]
async fn a_warm_start_from_a_plan_without_a_route_is_refused() {
    let api = Api::new();
    let deleted = api.submit().await;
    worker::complete(&*api.store, vec![worker::convergence(0, 0.1)]).await;
    assert_eq!(api.delete(&deleted).await.status, 204);
    let failed = api.submit().await;
    let lease = api.store.claim().await.expect("a queued plan");
    worker::fail(&*api.store, &lease).await;
    let running = api.submit().await;
    let lease = api.store.claim().await.expect("a queued plan");
    let queued = api.submit().await;

    let no_such = "no plan has this id";
    let no_route = "that plan has no route yet";
    let no_id = "must be the id of a plan, a UUID in lower case with hyphens";
    let cases = [
        ("01936f2c-7d1a-7c55-9a53-27b1b44c1a10".to_owned(), no_such),
        ("first".to_owned(), no_id),
        (String::new(), no_id),
        (id_of(&queued).to_uppercase(), no_id),
        (id_of(&deleted), no_such),
        (id_of(&failed), no_route),
        (id_of(&running), no_route),
        (id_of(&queued), no_route),
    ];
    for (id, why) in cases {
        for uri in ["/plans", "/plans?validate_only=true"] {
            let answer = api.post(uri, &from_plan(&id)).await;
            let problem = answer.expect_problem(422, "invalid-scenario");
            let fault = json!({
                "pointer": "/planner/warm_start/plan_id",
                "code": "unknown-plan",
                "detail": format!("plan_id is \"{id}\", {why}"),
            });
            assert_eq!(problem["errors"], json!([fault]));
        }
    }

    // All faults are told at once.
    let mut document = from_plan("01936f2c-7d1a-7c55-9a53-27b1b44c1a10");
    document["weights"] = json!({"fuel": -1});
    let answer = api.post("/plans?validate_only=true", &document).await;
    let problem = answer.expect_problem(422, "invalid-scenario");
    let errors = problem["errors"].as_array().expect("a list");
    let pointers: Vec<_> = errors.iter().map(|fault| &fault["pointer"]).collect();
    assert_eq!(pointers, ["/weights/fuel", "/planner/warm_start/plan_id"]);

    // A cancelled plan has the best route so far.
    worker::finish(&*api.store, &lease, Status::Cancelled).await;
    let answer = api.post("/plans", &from_plan(&id_of(&running))).await;
    assert_eq!(answer.status, 202, "{answer:?}");
}

/// Its document could not be read again.
#[tokio::test]
async fn a_route_beyond_what_a_document_may_hold_is_no_start() {
    let api = Api::new();
    let far = api.submit().await;
    let lease = api.store.claim().await.expect("a queued plan");
    let mut result = worker::result(lease.plan.id, "iterations").to_json();
    let height = r#""z":"#;
    let at = result.find(height).expect("a height") + height.len();
    result.insert_str(at, "10000001.0,\"was\":");
    let ended = (Status::Succeeded, "iterations");
    worker::finish_with(&*api.store, &lease, ended, result).await;
    let document = from_plan(&id_of(&far));
    let answer = api.post("/plans?validate_only=true", &document).await;
    let problem = answer.expect_problem(422, "invalid-scenario");
    assert_eq!(problem["errors"][0]["code"], "unknown-plan", "{problem}");
}

#[tokio::test]
async fn an_unavailable_store_is_not_reported_as_a_fault_of_the_document() {
    let api = Api::new();
    let first = api.submit().await;
    worker::complete(&*api.store, vec![worker::convergence(0, 0.1)]).await;
    api.store.close().await;
    api.post("/plans?validate_only=true", &from_plan(&id_of(&first)))
        .await
        .expect_problem(503, "store-unavailable");
}

#[tokio::test]
async fn a_plan_that_is_deleted_while_its_route_is_read_is_unknown() {
    let mut api = Api::new();
    let first = api.submit().await;
    worker::complete(&*api.store, vec![worker::convergence(0, 0.1)]).await;
    api.state.store = Arc::new(FaultyStore::that_deletes(api.store.clone()));
    api.router = noctule::http::router(api.state.clone());
    let refused = api.post("/plans", &from_plan(&id_of(&first))).await;
    let refused = refused.expect_problem(422, "invalid-scenario");
    assert_eq!(refused["errors"][0]["code"], "unknown-plan");
}

#[test]
fn the_command_line_refuses_a_warm_start_by_plan_id() {
    let refused = run(
        &["plan", "-"],
        &from_plan("01936f2c-7d1a-7c55-9a53-27b1b44c1a10").to_string(),
    );
    assert_eq!(refused.status.code(), Some(2));
    assert!(refused.stdout.is_empty());
    let faults = String::from_utf8(refused.stderr).expect("UTF-8");
    for part in [
        "/planner/warm_start/plan_id: plan_id is \"01936f2c-7d1a-7c55-9a53-27b1b44c1a10\"",
        "only the service keeps plans: give waypoints in its place",
        "unknown-plan",
    ] {
        assert!(faults.contains(part), "{part} is not in\n{faults}");
    }
}

/// A plan from the route of another, with a budget too small to find a good route by itself: never worse than
/// its start.
#[tokio::test]
async fn a_search_is_never_worse_than_its_warm_start() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let planned = async |document: &Value| {
        let address = service.submit(document).await;
        let ended = service.ended(&address).await;
        assert_eq!(ended["status"], "succeeded", "{ended}");
        let result = service.bytes(&format!("{address}/result")).await;
        let result: Value = serde_json::from_slice(&result).expect("JSON");
        (id_of(&address), result)
    };
    let (id, good) = planned(&scenario()).await;
    assert_eq!(good["feasible"], true);

    let mut quick = from_plan(&id);
    quick["planner"]["seeding"] = "random".into();
    quick["planner"]["polish"] = false.into();
    quick["planner"]["population"] = 2.into();
    quick["planner"]["iterations"] = 1.into();
    let (_, warm) = planned(&quick).await;
    assert_eq!(warm["feasible"], true);
    let total = |result: &Value| result["cost"]["total"].as_f64().expect("a figure");
    assert!(
        total(&warm) <= total(&good) * (1.0 + 1e-9),
        "{} after {}",
        total(&warm),
        total(&good)
    );

    quick["planner"]["warm_start"] = Value::Null;
    let (_, cold) = planned(&quick).await;
    assert!(
        cold["feasible"] == false || total(&cold) > 1.01 * total(&good),
        "the budget alone finds no such route"
    );
}

/// A route in degrees can start another scenario in degrees if it is near enough for its plane.
#[tokio::test]
async fn a_warm_start_from_a_distant_route_is_refused() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let around = |lat: f64, lon: f64, start: Value| {
        json!({
            "frame": "wgs84",
            "start": {"lat": lat, "lon": lon, "alt": 50},
            "target": {"lat": lat + 0.01, "lon": lon + 0.01, "alt": 50},
            "altitude": {"min": 0, "max": 100},
            "planner": {"population": 4, "iterations": 2, "warm_start": start},
        })
    };
    let first = service.submit(&around(47.4, 8.5, Value::Null)).await;
    service.ended(&first).await;
    let from_it = json!({"plan_id": id_of(&first)});

    for (lat, lon) in [(-33.9, 151.2), (-47.4, -171.5), (53.0, 8.5)] {
        let far = around(lat, lon, from_it.clone());
        let refused = service.post(&far).await;
        assert_eq!(refused.status(), 422, "{lat}, {lon}");
        let problem: Value = refused.json().await.expect("JSON");
        let detail = problem["errors"][0]["detail"].as_str().expect("a text");
        let why = "that plan's route is too far from this scenario's area";
        assert!(detail.ends_with(why), "{detail}");
    }
    let near = service.submit(&around(47.6, 8.5, from_it)).await;
    assert_eq!(service.ended(&near).await["status"], "succeeded");
}
