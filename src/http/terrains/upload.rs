//! `PUT /terrains/{name}`: from a file to a dataset.

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::Response;

use super::receive::receive;
use super::{Name, Terrains, check_name, document, etag, json, naming, tagged};
use crate::catalogue::{Checked, Declaration, Entry, Kept, Naming, Room, Staged};
use crate::http::AppState;
use crate::http::caller::Caller;
use crate::http::off_thread::Place;
use crate::http::params::{self, Params};
use crate::http::problem::Problem;
use crate::terrain::dem::Format;
use crate::worker::sweep_datasets;

/// Maximum length of the name that an uploader gives to a file.
const MAX_FILENAME_CHARS: usize = 200;

/// `PUT /terrains/{name}`.
pub(in crate::http) async fn put(
    State(state): State<AppState>,
    caller: Caller,
    Name(name): Name,
    uri: Uri,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let said = Said::read(&name, &uri)?;
    let naming = naming(&state, name, &caller, &headers);
    // Checked first, so that no long body is sent in vain.
    permit(&state, naming.clone()).await?;
    let (staged, place) = receive(&state, &caller, &headers, body).await?;
    let checked = check(&state.terrains, &caller, staged, said).await?;
    let (kept, entry) = keep(&state, &place, checked, naming).await?;
    let answer = answer(&state, entry).await?;
    Ok(match kept {
        Kept::Created => created(answer, &uri),
        Kept::Replaced | Kept::Unchanged => answer,
    })
}

/// What its uploader states about a file.
struct Said {
    /// `None` to detect it from the file.
    format: Option<Format>,
    declaration: Declaration,
}

impl Said {
    fn read(name: &str, uri: &Uri) -> Result<Self, Problem> {
        let params = Params::read(uri, &["crs", "format", "filename"])?;
        check_name(name)?;
        let filename = params.text("filename").unwrap_or(name);
        if filename.chars().count() > MAX_FILENAME_CHARS {
            let allowed = format!("at most {MAX_FILENAME_CHARS} characters");
            return Err(params::refused("filename", filename, &allowed));
        }
        Ok(Self {
            format: params.text("format").map(read_format).transpose()?,
            declaration: Declaration {
                crs: params.text("crs").map(str::to_owned),
                filename: Some(filename.to_owned()),
            },
        })
    }
}

fn read_format(name: &str) -> Result<Format, Problem> {
    let found = document::FORMATS.iter().find(|(known, _)| *known == name);
    let format = found.map(|(_, format)| *format);
    let names = || document::FORMATS.map(|(known, _)| known).join(", ");
    format.ok_or_else(|| params::refused("format", name, &format!("one of {}", names())))
}

async fn permit(state: &AppState, naming: Naming) -> Result<(), Problem> {
    let room = room(state);
    state
        .terrains
        .ask(move |catalogue| catalogue.permit(&naming, room))
        .await
}

fn room(state: &AppState) -> Room {
    let limits = state.rules.limits;
    Room {
        bytes: limits.terrains_bytes,
        datasets: limits.terrains,
    }
}

/// Read the file through. There are few uploads, so each waits for its turn however long that takes.
async fn check(
    terrains: &Terrains,
    caller: &Caller,
    staged: Staged,
    said: Said,
) -> Result<Checked, Problem> {
    let turn = terrains.checks.next(caller).await;
    let check = move || staged.check(said.format, said.declaration);
    Ok(turn.run(check).await??)
}

/// Store it under its name, which sends it to servers where nodes share datasets.
async fn keep(
    state: &AppState,
    place: &Place,
    checked: Checked,
    naming: Naming,
) -> Result<(Kept, Entry), Problem> {
    let sha256 = checked.sha256().to_owned();
    let room = room(state);
    // What was deleted a moment ago must not take room.
    if let Err(error) = sweep_datasets(&*state.store, &state.terrains.catalogue).await {
        tracing::debug!(%error, "datasets were not swept before an upload");
    }
    let catalogue = state.terrains.catalogue.clone();
    let keep = move || catalogue.keep(checked, &naming, room);
    let (kept, entry) = place.run(keep).await??;
    tracing::info!(name = entry.name, sha256, ?kept, "a dataset was uploaded");
    Ok((kept, entry))
}

/// Answers with what was kept.
async fn answer(state: &AppState, entry: Entry) -> Result<Response, Problem> {
    let content = entry.sha256.as_deref().map(etag);
    let document = document(state, entry).await?;
    Ok(tagged(json(document), content))
}

fn created(mut answer: Response, uri: &Uri) -> Response {
    *answer.status_mut() = StatusCode::CREATED;
    let location = HeaderValue::from_str(uri.path()).expect("a path is visible ASCII");
    answer.headers_mut().insert(header::LOCATION, location);
    answer
}
