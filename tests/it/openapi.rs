//! `openapi.yaml` is true: each route is described and each description has a route. That answers
//! are as described is checked with every request of `support::api`.

use std::collections::BTreeSet;

use axum::http::Method;
use serde_json::Value;

use crate::support::api::Api;
use crate::support::description::{DESCRIPTION, check_schema, resolve};

#[test]
fn routes_and_descriptions_are_the_same() {
    let routed: BTreeSet<String> = noctule::http::routes()
        .iter()
        .map(|route| format!("{} {}", route.method, route.path))
        .collect();
    assert_eq!(described(), routed);
}

fn described() -> BTreeSet<String> {
    let paths = DESCRIPTION["paths"].as_object().expect("paths");
    paths
        .iter()
        .flat_map(|(path, item)| {
            let operations = item
                .as_object()
                .expect("an object")
                .keys()
                .filter(|key| *key != "parameters");
            operations.map(move |method| format!("{} {path}", method.to_uppercase()))
        })
        .collect()
}

/// Each route answers with its own handler's statuses, not with the fallbacks'.
#[tokio::test]
async fn every_described_route_is_there() {
    let api = Api::new();
    for operation in described() {
        let (method, path) = operation.split_once(' ').expect("a method and a path");
        let method: Method = method.parse().expect("a method");
        let id = "01936f2c-7d1a-7c55-9a53-27b1b44c1a10";
        let answer = api.send(method, &path.replace("{id}", id), &[], "").await;
        assert_ne!(answer.status, 405, "{operation}");
        if path.contains("{id}") {
            assert_eq!(
                answer.json()["detail"],
                format!("there is no plan {id}"),
                "{operation}"
            );
        }
    }
}

#[test]
fn every_reference_leads_somewhere_and_every_component_is_used() {
    let mut used = BTreeSet::new();
    references(&DESCRIPTION, &mut used);
    let mut defined = BTreeSet::new();
    for (kind, components) in DESCRIPTION["components"].as_object().expect("components") {
        for name in components.as_object().expect("an object").keys() {
            defined.insert(format!("#/components/{kind}/{name}"));
        }
    }
    assert_eq!(used, defined);
}

fn references(node: &Value, found: &mut BTreeSet<String>) {
    match node {
        Value::Object(members) => {
            if let Some(Value::String(reference)) = members.get("$ref") {
                found.insert(reference.clone());
            }
            // Schemes are named where the others are referred to.
            let schemes = members.get("security").and_then(Value::as_array);
            for scheme in schemes.into_iter().flatten().filter_map(Value::as_object) {
                let scheme = scheme
                    .keys()
                    .map(|name| format!("#/components/securitySchemes/{name}"));
                found.extend(scheme);
            }
            members
                .values()
                .for_each(|member| references(member, found));
        }
        Value::Array(items) => items.iter().for_each(|item| references(item, found)),
        _ => {}
    }
}

#[test]
fn examples_are_as_their_schemas_say() {
    let mut examples = 0;
    let bodies = DESCRIPTION["paths"]
        .as_object()
        .expect("paths")
        .values()
        .flat_map(|item| item.as_object().expect("an object").values())
        .filter_map(|operation| operation.get("requestBody"));
    let answers = DESCRIPTION["paths"]
        .as_object()
        .expect("paths")
        .values()
        .flat_map(|item| item.as_object().expect("an object").values())
        .filter_map(|operation| operation["responses"].as_object())
        .flat_map(|responses| responses.values())
        .filter(|response| response.get("content").is_some());
    let responses = DESCRIPTION["components"]["responses"]
        .as_object()
        .expect("responses");
    for holder in bodies.chain(answers).chain(responses.values()) {
        for media in resolve(holder)["content"]
            .as_object()
            .expect("content")
            .values()
        {
            let named = media.get("examples").and_then(Value::as_object);
            let named = named
                .into_iter()
                .flat_map(|examples| examples.values().map(|example| &example["value"]));
            let lone = media.get("example").filter(|example| !example.is_string());
            for example in named.chain(lone) {
                check_schema(&media["schema"], example, "an example");
                examples += 1;
            }
        }
    }
    assert!(examples > 5, "{examples} examples");
}

#[tokio::test]
async fn example_scenarios_are_accepted() {
    let api = Api::new();
    let body =
        &DESCRIPTION["paths"]["/plans"]["post"]["requestBody"]["content"]["application/json"];
    for example in body["examples"].as_object().expect("examples").values() {
        assert_eq!(api.post("/plans", &example["value"]).await.status, 202);
    }
}

#[test]
fn problem_types_are_documented() {
    let page = include_str!("../../docs/PROBLEMS.md");
    let types =
        DESCRIPTION["components"]["schemas"]["Problem"]["properties"]["type"]["enum"].as_array();
    for slug in types.expect("a list").iter().filter_map(Value::as_str) {
        let heading = format!("## {}\n", slug.trim_start_matches("/problems/"));
        assert!(
            page.contains(&heading),
            "docs/PROBLEMS.md has no section {heading}"
        );
    }
}
