//! Example scenarios that come with the program.

use std::sync::LazyLock;

use axum::Json;
use axum::extract::Path;
use axum::http::{Uri, header};
use axum::response::Response;
use serde::Serialize;
use serde_json::Value;

use super::answers::constant;
use super::params::NoParams;
use super::problem::Problem;

/// Name and document, in the order in which they are listed.
static SHIPPED: [(&str, &str); 6] = [
    (
        "jacksboro-wgs84",
        include_str!("../../scenarios/jacksboro-wgs84.json"),
    ),
    ("jacksboro", include_str!("../../scenarios/jacksboro.json")),
    ("paper-1", include_str!("../../scenarios/paper-1.json")),
    ("paper-2", include_str!("../../scenarios/paper-2.json")),
    ("paper-3", include_str!("../../scenarios/paper-3.json")),
    ("paper-4", include_str!("../../scenarios/paper-4.json")),
];

/// The list of scenarios.
#[derive(Clone, Serialize)]
pub(super) struct ScenariosDocument {
    scenarios: Vec<Entry>,
}

/// One of them, with what is needed to choose.
#[derive(Clone, Serialize)]
struct Entry {
    name: &'static str,
    title: String,
    frame: String,
    threats: usize,
    href: String,
}

impl Entry {
    fn of(name: &'static str, text: &str) -> Self {
        let document: Value = serde_json::from_str(text).expect("well-formed, as its test says");
        let text =
            |field: &str, default: &str| document[field].as_str().unwrap_or(default).to_owned();
        Self {
            name,
            title: text("name", name),
            frame: text("frame", "local"),
            threats: document["threats"].as_array().map_or(0, Vec::len),
            href: format!("/scenarios/{name}"),
        }
    }
}

/// `GET /scenarios`.
pub(super) async fn list(_: NoParams) -> Result<Json<ScenariosDocument>, Problem> {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        SHIPPED
            .iter()
            .map(|(name, text)| Entry::of(name, text))
            .collect()
    });
    Ok(Json(ScenariosDocument {
        scenarios: ENTRIES.clone(),
    }))
}

/// `GET /scenarios/{name}`: a document that can be posted.
pub(super) async fn show(
    uri: Uri,
    name: Option<Path<String>>,
    _: NoParams,
) -> Result<Response, Problem> {
    let wanted = name.map(|Path(name)| name).unwrap_or_default();
    let Some((_, text)) = SHIPPED.iter().find(|(name, _)| *name == wanted) else {
        return Err(Problem::no_such_resource(&uri));
    };
    let media_type = [(header::CONTENT_TYPE, "application/json")];
    Ok(constant((media_type, *text)))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;
    use std::sync::Arc;

    use super::*;
    use crate::catalogue::Mounted;
    use crate::planner;
    use crate::scenario::json;
    use crate::scenario::limits::Limits;

    #[test]
    fn every_shipped_scenario_is_served_and_valid() {
        let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let files = fs::read_dir(directory).expect("it is there");
        let there: BTreeSet<String> = files
            .map(|entry| entry.expect("listed").file_name())
            .filter_map(|name| Some(name.to_str()?.strip_suffix(".json")?.to_owned()))
            .collect();
        let served = SHIPPED.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(there, served);
        let ground = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/terrain");
        let ground = Mounted::open(&ground).expect("it is there");
        let rules = planner::rules(Limits::default()).with_datasets(Arc::new(ground));
        for (name, text) in SHIPPED {
            let read = json::read(text.as_bytes(), &rules, 0);
            assert!(read.is_ok(), "{name}");
            assert!(!Entry::of(name, text).title.is_empty(), "{name}");
        }
    }
}
