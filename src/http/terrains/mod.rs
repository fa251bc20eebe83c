//! Datasets: upload, list, show, delete, sample.
//!
//! Every dataset may be used in anybody's plans; only its uploader may change a name. Files are read and written on
//! threads of their own, few at a time. Where nodes share datasets, all of this may wait for servers, so none of it
//! takes a place from work that computes.

mod count;
mod document;
mod elevations;
mod receive;
mod upload;

use std::sync::Arc;

use axum::Json;
use axum::extract::{FromRequestParts, Path, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

pub(super) use elevations::elevations;
pub(super) use receive::SLOWEST;
pub(super) use upload::put;

use count::Count;
use document::TerrainDocument;

use super::caller::Caller;
use super::entity_tags::{EntityTags, opaque};
use super::off_thread::Places;
use super::params::{self, NoParams};
use super::problem::{Busy, Problem};
use super::{AppState, named, off_thread};
use crate::catalogue::{Catalogue, CatalogueError, Claim, Entry, Expected, Naming, Tally};
use crate::digest::sha256_hex;
use crate::store::DatasetUse;
use crate::terrain::is_dataset_name;

/// Uploads at the same time, until they are kept; further ones wait, as long as a body may pause.
const UPLOADS: usize = 4;
/// Uploads whose files are read through at the same time.
const CHECKS: usize = 2;
/// Requests that may read from datasets at the same time.
const READS: usize = 4;
/// Requests that may ask for names and records at the same time.
const RECORDS: usize = 16;

/// The datasets, and limits on concurrent work with them.
#[derive(Clone)]
pub struct Terrains {
    /// Where they are kept.
    pub catalogue: Arc<dyn Catalogue>,
    uploads: Places,
    checks: Places,
    reads: Places,
    records: Places,
    count: Count,
}

impl Terrains {
    /// The datasets of a catalogue.
    #[must_use]
    pub fn new(catalogue: Arc<dyn Catalogue>) -> Self {
        Self {
            catalogue,
            uploads: Places::new(UPLOADS, Busy::Datasets),
            checks: Places::new(CHECKS, Busy::Datasets),
            reads: Places::new(READS, Busy::Datasets),
            records: Places::new(RECORDS, Busy::Datasets),
            count: Count::new(),
        }
    }

    /// Use the catalogue on a thread that may block.
    async fn ask<T: Send + 'static>(
        &self,
        work: impl FnOnce(&dyn Catalogue) -> Result<T, CatalogueError> + Send + 'static,
    ) -> Result<T, Problem> {
        let catalogue = self.catalogue.clone();
        // Short work, of which there is room for much: nobody's turn matters.
        let records = self
            .records
            .run(&Caller::ANYBODY, move || work(&*catalogue));
        Ok(records.await??)
    }

    /// How many there are, or were a while ago, see [`Count::ask`].
    pub(super) async fn tally(&self) -> Tally {
        let catalogue = self.catalogue.clone();
        self.count.ask(move || catalogue.tally()).await
    }

    /// Do work that reads from datasets, once few enough others do.
    pub(super) async fn read<T: Send + 'static>(
        &self,
        caller: &Caller,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.reads.run(caller, work).await
    }

    /// Do work with a scenario for a caller: like other computing, unless that may need a dataset.
    pub(super) async fn over<D: AsRef<[u8]> + Send + 'static, T: Send + 'static>(
        &self,
        caller: &Caller,
        document: D,
        work: impl FnOnce(&D) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let reads_files = named::may_name(document.as_ref(), named::DATASET);
        let work = move || work(&document);
        if reads_files {
            self.read(caller, work).await
        } else {
            off_thread::run(caller, work).await
        }
    }
}

/// The `{name}` of the path. An invalid name refers to no dataset.
pub(super) struct Name(String);

impl<S: Send + Sync> FromRequestParts<S> for Name {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        match Path::<String>::from_request_parts(parts, state).await {
            Ok(Path(name)) => Ok(Self(name)),
            Err(_) => Err(Problem::no_such_resource(&parts.uri)),
        }
    }
}

/// What the caller does to a name, and on which condition.
fn naming(state: &AppState, name: String, caller: &Caller, headers: &HeaderMap) -> Naming {
    Naming {
        name,
        by: Claim {
            owner: caller.owner.clone(),
            over_all: caller.sees_all,
        },
        now_ms: state.clock.now_ms(),
        expected: expected(headers),
    }
}

/// Distinguishes an invalid dataset name from one that does not exist.
fn check_name(name: &str) -> Result<(), Problem> {
    if is_dataset_name(name) {
        return Ok(());
    }
    let allowed = "1 to 64 lower-case letters, digits, - and _, the first a letter or a digit";
    Err(params::refused("name", name, allowed))
}

/// The conditions in `If-Match` and `If-None-Match`.
fn expected(headers: &HeaderMap) -> Expected {
    let matching = EntityTags::of(headers, header::IF_MATCH);
    let known = EntityTags::known(headers);
    match (matching, known) {
        (_, Some(known)) if known.iter().any(|tag| tag == "*") => Expected::Nothing,
        (Some(matching), _) => Expected::OneOf(matching.iter().map(content_of).collect()),
        (None, Some(known)) => Expected::NoneOf(known.iter().map(opaque).map(content_of).collect()),
        (None, None) => Expected::Anything,
    }
}

/// The content's sum from the entity tag of a content or of a document; names change only with the content.
fn content_of(tag: &str) -> String {
    let tag = tag.trim_matches('"');
    let content = tag.split_once(OF).map_or(tag, |(content, _)| content);
    content.to_owned()
}

/// The list.
#[derive(Serialize)]
struct TerrainsDocument {
    terrains: Vec<TerrainDocument>,
}

/// `GET /terrains`.
pub(super) async fn list(State(state): State<AppState>, _: NoParams) -> Result<Response, Problem> {
    let entries = state.terrains.ask(|catalogue| catalogue.list()).await?;
    let uses = state.store.datasets_in_use().await?;
    let terrains = entries.into_iter();
    let terrains = terrains
        .map(|entry| {
            let active = active(&uses, entry.sha256.as_deref());
            TerrainDocument::new(entry, active)
        })
        .collect();
    Ok(Json(TerrainsDocument { terrains }).into_response())
}

fn active(uses: &[DatasetUse], sha256: Option<&str>) -> u64 {
    let used = uses.iter().find(|used| Some(&*used.sha256) == sha256);
    used.map_or(0, |used| used.active)
}

/// `GET /terrains/{name}`.
pub(super) async fn show(
    State(state): State<AppState>,
    caller: Caller,
    Name(name): Name,
    _: NoParams,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let catalogue = state.terrains.catalogue.clone();
    let entry = state
        .terrains
        .read(&caller, move || catalogue.entry(&name))
        .await??;
    let content = entry.sha256.clone();
    let document = document(&state, entry).await?;
    let tag = content.map(|content| document_etag(&content, &document));
    let known = tag
        .as_ref()
        .zip(EntityTags::known(&headers))
        .is_some_and(|(tag, known)| known.contain(tag));
    Ok(if known {
        tagged(StatusCode::NOT_MODIFIED.into_response(), tag)
    } else {
        tagged(json(document), tag)
    })
}

/// The current document of a dataset, as it is sent.
async fn document(state: &AppState, entry: Entry) -> Result<String, Problem> {
    let uses = state.store.datasets_in_use().await?;
    let active = active(&uses, entry.sha256.as_deref());
    let document = TerrainDocument::new(entry, active);
    Ok(serde_json::to_string(&document).expect("every map key is a string"))
}

fn json(document: String) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], document).into_response()
}

fn tagged(mut answer: Response, tag: Option<HeaderValue>) -> Response {
    let headers = answer.headers_mut();
    headers.extend(tag.map(|tag| (header::ETAG, tag)));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    answer
}

/// In a document's entity tag, separates the content's sum from that of the document.
const OF: char = '.';

/// The entity tag of a document. It begins with its content's sum, so that it can serve as the condition for replacing
/// or deleting a dataset; the rest changes with everything else in the document, such as how many plans need it.
fn document_etag(sha256: &str, document: &str) -> HeaderValue {
    let of_document = sha256_hex(document.as_bytes());
    etag(&format!("{sha256}{OF}{}", &of_document[..16]))
}

/// The entity tag of a content.
fn etag(sha256: &str) -> HeaderValue {
    HeaderValue::from_str(&format!("\"{sha256}\"")).expect("digits and quotes are visible ASCII")
}

/// `DELETE /terrains/{name}`.
pub(super) async fn delete(
    State(state): State<AppState>,
    caller: Caller,
    Name(name): Name,
    _: NoParams,
    headers: HeaderMap,
) -> Result<StatusCode, Problem> {
    check_name(&name)?;
    let naming = naming(&state, name, &caller, &headers);
    let asked = naming.clone();
    let removed = state
        .terrains
        .ask(move |catalogue| match catalogue.removable(&asked) {
            Err(CatalogueError::Unknown { .. }) => Ok(None),
            found => found.map(Some),
        })
        .await?;
    // Whoever repeats the request got no answer the first time.
    let Some(sha256) = removed else {
        return Ok(StatusCode::NO_CONTENT);
    };
    let plans = active(&state.store.datasets_in_use().await?, Some(&sha256));
    if plans > 0 {
        let name = naming.name;
        return Err(Problem::TerrainInUse { name, plans });
    }
    state
        .terrains
        .ask(move |catalogue| match catalogue.remove(&naming) {
            Err(CatalogueError::Unknown { .. }) => Ok(()),
            removed => removed,
        })
        .await?;
    Ok(StatusCode::NO_CONTENT)
}
