//! `openapi.yaml` is accurate: each route is described and each description has a route. `support::api` checks
//! with every request that responses are as described.

use std::collections::BTreeSet;

use axum::http::Method;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use noctule::job::FailureKind;
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use crate::support::api::Api;
use crate::support::description::{DESCRIPTION, check_schema, resolve};
use crate::support::run;

#[test]
fn the_description_lists_exactly_the_routes() {
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

/// No route falls through to the fallbacks for unknown methods and paths, and routes with an id reach their own handler.
#[tokio::test]
async fn every_described_route_reaches_a_handler() {
    let api = Api::new();
    let nowhere = api.get("/nowhere").await.json();
    let nothing_at = |uri: &str| {
        let detail = nowhere["detail"].as_str().expect("a problem");
        detail.replace("/nowhere", uri)
    };
    assert_ne!(nothing_at("/"), nothing_at("/nowhere"), "the path is told");
    for operation in described() {
        let (method, path) = operation.split_once(' ').expect("a method and a path");
        let method: Method = method.parse().expect("a method");
        let id = "01936f2c-7d1a-7c55-9a53-27b1b44c1a10";
        // Names that exist where others have the same answer as paths without a route.
        let uri = path
            .replace("{id}", id)
            .replace("/scenarios/{name}", "/scenarios/paper-1")
            .replace("/terrains/{name}", "/terrains/nowhere")
            .replace("/page/vendor/{file}", "/page/vendor/three.js")
            .replace("/page/{file}", "/page/main.js")
            .replace("{guide}", "terrain")
            .replace("{slug}", "gone");
        assert!(!uri.contains('{'), "{operation}: {uri}");
        let answer = api.send(method, &uri, &[], "").await;
        assert_ne!(answer.status, 405, "{operation}");
        let text = String::from_utf8_lossy(&answer.body);
        assert!(!text.contains(&nothing_at(&uri)), "{operation}: {text}");
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
fn every_reference_resolves_and_every_component_is_used() {
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
            // Security schemes are referred to by name, not by `$ref`.
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
fn examples_match_their_schemas() {
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

/// Clients that read JSON get the same description.
#[tokio::test]
async fn the_description_is_the_same_as_yaml_and_as_json() {
    let api = Api::new();
    let yaml = api.get("/openapi.yaml").await;
    let yaml: Value = serde_yaml_ng::from_slice(&yaml.body).expect("YAML");
    assert_eq!(api.get("/openapi.json").await.json(), yaml);
    assert_eq!(yaml, *DESCRIPTION);
}

/// Every operation and every schema has an anchor on the page, and every link leads to an anchor.
#[tokio::test]
async fn the_reference_page_is_complete() {
    let answer = Api::new().get("/docs").await;
    let page = std::str::from_utf8(&answer.body).expect("UTF-8");
    let places: BTreeSet<String> = attributes(page, "id").into_iter().collect();
    assert_eq!(
        places.len(),
        attributes(page, "id").len(),
        "an id stands for one place"
    );
    for (path, item) in DESCRIPTION["paths"].as_object().expect("paths") {
        for (method, operation) in item.as_object().expect("an object") {
            if let Some(id) = operation["operationId"].as_str() {
                assert!(places.contains(id), "{method} {path} is not there");
            }
        }
    }
    let schemas = DESCRIPTION["components"]["schemas"].as_object();
    for name in schemas.expect("schemas").keys() {
        assert!(
            places.contains(&format!("schema-{name}")),
            "{name} is not there"
        );
    }
    for link in attributes(page, "href") {
        match link.strip_prefix('#') {
            Some(place) => assert!(places.contains(place), "{link} leads nowhere"),
            None => assert!(link.starts_with('/'), "{link} leads elsewhere"),
        }
    }
    assert!(attributes(page, "src").is_empty(), "nothing is loaded");
}

/// The values of all attributes called `name` in `page`.
fn attributes(page: &str, name: &str) -> Vec<String> {
    let opening = format!(" {name}=\"");
    let parts = page.split(&opening).skip(1);
    let values = parts.map(|part| part.split('"').next().expect("one at least").to_owned());
    values.collect()
}

/// All guides that are described are served, listed by the reference, and have links that lead to a place.
#[tokio::test]
async fn guides_are_served_and_lead_somewhere() {
    let api = Api::new();
    let text = async |path: &str| {
        let answer = api.get(path).await;
        assert_eq!(answer.status, 200, "{path}");
        String::from_utf8(answer.body.to_vec()).expect("UTF-8")
    };
    let mut named: Vec<String> = Vec::new();
    each(&DESCRIPTION, "", &mut |_, node| {
        let words = node["description"].as_str().unwrap_or_default();
        let links = words.split("](").skip(1);
        named.extend(links.filter_map(|link| Some(link.split_once(')')?.0.to_owned())));
    });
    let parameter = &DESCRIPTION["paths"]["/docs/{guide}"]["get"]["parameters"][0];
    let guides = parameter["schema"]["enum"].as_array().expect("a list");
    let listed = attributes(&text("/docs").await, "href");
    let mut links = 0;
    for guide in guides {
        let path = format!("/docs/{}", guide.as_str().expect("a name"));
        assert!(listed.contains(&path), "{path} is not listed");
        let page = text(&path).await;
        let places = attributes(&page, "id");
        let distinct: BTreeSet<&String> = places.iter().collect();
        assert_eq!(distinct.len(), places.len(), "{path}: {places:?}");
        named.extend(attributes(&page, "href").into_iter().map(|link| {
            if link.starts_with('#') {
                format!("{path}{link}")
            } else {
                link
            }
        }));
    }
    for link in named.iter().filter(|link| link.starts_with('/')) {
        let (path, place) = link.split_once('#').unwrap_or((link, ""));
        let page = text(path).await;
        let found = place.is_empty() || attributes(&page, "id").contains(&place.to_owned());
        assert!(found, "{link} leads nowhere");
        links += 1;
    }
    assert!(links > 100, "{links}");
    let elsewhere = |link: &&String| !link.starts_with('/') && !link.starts_with("https://");
    assert_eq!(named.iter().find(elsewhere), None);
    let unknown = api.get("/docs/page").await;
    unknown.expect_problem(404, "not-found");
}

/// Each operation has a call that can be copied: with a body where it takes one, and without places to be filled in
/// that a shell would take for patterns.
#[tokio::test]
async fn calls_of_the_reference_page_are_complete() {
    let answer = Api::new().get("/docs").await;
    let page = std::str::from_utf8(&answer.body).expect("UTF-8");
    let calls: Vec<&str> = page.split("<pre>curl ").skip(1).collect();
    let calls = calls
        .iter()
        .map(|call| call.split("</pre>").next().expect("one at least"));
    let (mut files, mut bodies) = (0, 0);
    for call in calls {
        let url = call.split("&quot;").nth(1).expect("quoted");
        assert!(!url.contains(['{', '}']), "{call}");
        assert!(!call.contains("-d &#39;&#39;"), "{call}");
        files += usize::from(call.contains("--data-binary @FILE"));
        bodies += usize::from(call.contains("-d "));
    }
    assert_eq!((files, bodies), (1, 3));
}

/// The page's policy allows its own style and nothing else.
#[tokio::test]
async fn pages_load_nothing_but_their_own_style() {
    let api = Api::new();
    for path in ["/docs", "/docs/terrain", "/problems/queue-full"] {
        let answer = api.get(path).await;
        let page = std::str::from_utf8(&answer.body).expect("UTF-8");
        let style = page.split("<style>").nth(1).expect("a style");
        let style = style.split("</style>").next().expect("its end");
        let hash = BASE64.encode(Sha256::digest(style));
        let policy = answer.header("content-security-policy");
        let expected = format!("default-src 'none'; style-src 'sha256-{hash}';");
        assert!(policy.starts_with(&expected), "{policy}");
        assert!(
            !page.contains("style=") && !page.contains("<script"),
            "{path}"
        );
    }
}

/// Every failure kind is described and has a problem page; the table in the docs gives the same status.
#[tokio::test]
async fn every_failure_kind_has_a_problem_page_and_is_described() {
    let problems = include_str!("../../docs/PROBLEMS.md");
    let mut told = BTreeSet::new();
    for kind in FailureKind::ALL {
        let api = Api::new();
        let plan = api.submit().await;
        let lease = api.store.claim().await.expect("a queued plan");
        run::fail_for(&*api.store, &lease, kind).await;
        let error = api.get(&plan).await.json()["error"].clone();
        let slug = kind.name();
        assert_eq!(error["type"], format!("/problems/{slug}"));
        let row = format!("| [{slug}](#{slug}) | {} |", error["status"]);
        assert!(problems.contains(&row), "no row {row}");
        let page = api.get(&format!("/problems/{slug}")).await;
        assert_eq!(page.status, 200, "{slug}");
        let page = std::str::from_utf8(&page.body).expect("UTF-8");
        assert!(page.contains(&format!("<h2>{slug}</h2>")), "{page}");
        told.insert(error["type"].clone().to_string());
    }
    let error = &DESCRIPTION["components"]["schemas"]["StatusDocument"]["properties"]["error"];
    let described = error["oneOf"][1]["properties"]["type"]["enum"].as_array();
    let described = described.expect("a list").iter().map(Value::to_string);
    assert_eq!(described.collect::<BTreeSet<_>>(), told);
}

/// The `type` of a problem is a path.
#[tokio::test]
async fn every_problem_type_leads_to_its_page() {
    let problems = include_str!("../../docs/PROBLEMS.md");
    let api = Api::new();
    let types = DESCRIPTION["components"]["schemas"]["Problem"]["properties"]["type"]["enum"]
        .as_array()
        .expect("a list");
    for kind in types.iter().filter_map(Value::as_str) {
        let answer = api.get(kind).await;
        assert_eq!(answer.status, 200, "{kind}");
        let slug = kind.trim_start_matches("/problems/");
        let row = format!("| [{slug}](#{slug}) | ");
        assert!(problems.contains(&row), "no row {row}");
        let page = std::str::from_utf8(&answer.body).expect("UTF-8");
        assert!(page.contains(&format!("<h2>{slug}</h2>")), "{page}");
        let (_, main) = page.split_once("<main>").expect("the section");
        for link in main.split("href=\"").skip(1) {
            let (link, _) = link.split_once('"').expect("an address");
            let address = if link.starts_with('/') {
                link.to_owned()
            } else {
                format!("/problems/{link}")
            };
            let linked = api.get(&address).await;
            assert_eq!(linked.status, 200, "{link} on the page of {slug}");
        }
    }
    let unknown = api.get("/problems/nothing").await;
    unknown.expect_problem(404, "not-found");
}

/// Generated clients take a constant without a type for anything, and integers for 32 bits.
#[test]
fn constants_and_great_integers_say_their_type() {
    let mut n_constants = 0;
    each(&DESCRIPTION, "", &mut |pointer, node| {
        if let Some(constant) = node.get("const") {
            n_constants += 1;
            let kind = if constant.is_boolean() {
                "boolean"
            } else {
                "string"
            };
            assert_eq!(node["type"], kind, "{pointer}");
        }
        let is_great = node["maximum"]
            .as_u64()
            .is_some_and(|maximum| maximum > i32::MAX as u64);
        if node["type"] == "integer" && is_great {
            assert_eq!(node["format"], "int64", "{pointer}");
        }
    });
    assert!(n_constants > 10, "{n_constants}");
}

/// Generated clients send declared defaults, and options of one format are refused by the others.
#[test]
fn options_of_formats_declare_no_default() {
    let parameters = DESCRIPTION["paths"]["/plans/{id}/result"]["get"]["parameters"].as_array();
    let options = parameters
        .expect("a list")
        .iter()
        .filter(|option| option["in"] == "query" && option["name"] != "partial");
    let names: Vec<&str> = options
        .inspect(|option| assert_eq!(option["schema"].get("default"), None, "{option}"))
        .filter_map(|option| option["name"].as_str())
        .collect();
    assert!(
        names.contains(&"altitude") && names.contains(&"format"),
        "{names:?}"
    );
}

/// Calls `look` with every object of the description and where it is.
fn each(node: &Value, pointer: &str, look: &mut impl FnMut(&str, &Value)) {
    match node {
        Value::Object(fields) => {
            // The names of properties are no keywords.
            if !pointer.ends_with("/properties") {
                look(pointer, node);
            }
            for (key, value) in fields.iter().filter(|(key, _)| !key.starts_with("example")) {
                each(value, &format!("{pointer}/{key}"), look);
            }
        }
        Value::Array(items) => {
            for (idx, item) in items.iter().enumerate() {
                each(item, &format!("{pointer}/{idx}"), look);
            }
        }
        _ => {}
    }
}
