//! A problem's explanation for people.

use super::{A_PLACE_S, Busy, Problem};
use crate::http::auth::TooMany;
use crate::http::head::MOST_HEADERS;
use crate::http::prefer::MAX_WAIT_S;
use crate::http::shown::Shown;
use crate::http::terrains::SLOWEST;
use crate::scenario::json::MORE_FAULTS;
use crate::store::{Tombstone, Trouble};

impl Problem {
    /// For people: what happened in this case, and what would help.
    #[expect(clippy::too_many_lines, reason = "one table")]
    pub(super) fn detail(&self) -> String {
        match self {
            Self::InvalidJson {
                line,
                column,
                pointer,
                detail,
            } if pointer.is_empty() => {
                format!("line {line}, column {column}: {detail}")
            }
            Self::InvalidJson {
                line,
                column,
                pointer,
                detail,
            } => {
                format!("line {line}, column {column}, at {pointer}: {detail}")
            }
            Self::Malformed => "its first line, a header or the length of its body cannot be read, see RFC 9112".to_owned(),
            Self::HeadTooLarge(limit) => {
                format!("request line and headers together may have {limit} bytes, and there may be {MOST_HEADERS} headers")
            }
            Self::BodyIncomplete => "the connection ended before the body did".to_owned(),
            Self::BodyUnreadable => "the chunks that the body comes in cannot be read, see RFC 9112 section 7.1".to_owned(),
            Self::UnsupportedTransferCoding(found) => {
                format!("transfer-encoding is {found}; send the body plain or chunked, and name gzip in content-encoding")
            }
            Self::BodyNotGzip(detail) => format!("content-encoding is gzip, but: {detail}"),
            Self::InvalidParameter { detail, .. }
            | Self::NoGeodeticFrame(detail)
            | Self::Infeasible(detail)
            | Self::Unflyable(detail)
            | Self::InvalidXml(detail)
            | Self::InvalidTerrain(detail)
            | Self::NoGround(detail)
            | Self::PreconditionFailed(detail)
            | Self::NoScenario { detail, .. } => detail.clone(),
            Self::KeyInUrl => {
                "URLs are written down on their way: send the key as Authorization: Bearer, and replace this one".to_owned()
            }
            Self::Misdirected(host) => {
                format!("this service has no keys and answers as localhost or by its address alone, not as {host}; its operator can say otherwise")
            }
            Self::Unauthorized(why) => why.detail().to_owned(),
            Self::Forbidden(scope) => format!("the key lacks the scope {}", scope.name()),
            Self::RateLimited { retry_after_s } => {
                format!("the key has asked more often than it may; try again in {retry_after_s} s")
            }
            Self::TooManyStreams(TooMany { limit, most }) => {
                let whose = match *limit {
                    "streams_per_key" => " of the key's owner",
                    _ => "",
                };
                format!("{most} event streams{whose} are open, the limit {limit} of GET /limits; close one, or wait")
            }
            Self::NoSuchResource(path) => {
                format!("nothing is at {path}; GET /docs lists what is")
            }
            Self::NotServedHere(path) => {
                format!("this node runs plans and serves none, so nothing is at {path}; nodes of the role api or all serve them")
            }
            Self::NoSuchPlan(id) => format!("there is no plan {id}"),
            Self::NoSuchTerrain(name) => {
                format!("there is no dataset {:?}; GET /terrains lists what there is", name.as_str())
            }
            Self::TerrainInUse { name, plans: 1 } => {
                format!("a plan over {name} is queued or running; it can be deleted when that has ended")
            }
            Self::TerrainInUse { name, plans } => {
                format!("{plans} plans over {name} are queued or running; it can be deleted when they have ended")
            }
            Self::TerrainMounted(name) => {
                format!("{name} is a file in the directory that the service was started with, which is only read; take another name")
            }
            Self::TerrainOwned(name) => {
                format!("{name} was not uploaded by the key's owner; only who uploaded it, and keys with the scope admin, may replace or delete it")
            }
            Self::TerrainTooLarge(limit) => {
                format!("the dataset is longer than {limit} bytes, the limit terrain_bytes of GET /limits")
            }
            Self::TerrainsFull(room) => {
                format!("with this dataset, all uploaded ones would be longer than {room} bytes, the limit terrains_bytes of GET /limits; delete some first")
            }
            Self::TooManyTerrains(most) => {
                format!("there are as many datasets as may be, or more replaced and deleted ones than that are still kept: {most}, the limit terrains of GET /limits; delete some first")
            }
            Self::UploadStalled(limit) => {
                let limit = limit.as_secs_f64();
                let slowest = SLOWEST / 1024.0;
                format!("nothing came for {limit} s, or less than {slowest} KiB a second on the whole")
            }
            Self::TooManyUploads(most) => {
                format!("{most} datasets are being uploaded, as many as may be; try again in {A_PLACE_S} s")
            }
            Self::Busy(what) => {
                let what = match what {
                    Busy::Cores => "other requests keep every core busy".to_owned(),
                    Busy::Datasets => "as many requests as may be wait for datasets".to_owned(),
                    Busy::Bodies(most) => format!("the bodies of other requests take what they may, {most} bytes"),
                    Busy::Answers(most) => format!("answers that are being made or have not been read yet take what they may, {most} bytes"),
                };
                format!("{what}; try again in {A_PLACE_S} s")
            }
            Self::MethodNotAllowed => {
                "the header Allow lists the methods of this resource".to_owned()
            }
            Self::NotAcceptable { asked, available } => {
                format!("asked for {asked}; available: {}", available.join(", "))
            }
            Self::BodyTooSlow(limit) => {
                format!("the body was not complete after {} s", limit.as_secs_f64())
            }
            Self::NotReady {
                id,
                status,
                partial: true,
                ..
            } => format!(
                "plan {id} is {} and has no route yet; GET /plans/{id}/events tells of each",
                status.name()
            ),
            Self::NotReady { id, status, .. } => format!(
                "plan {id} is {}; GET /plans/{id} with Prefer: wait={MAX_WAIT_S} waits for it",
                status.name()
            ),
            Self::NoResult {
                id,
                failure: Some(failure),
                ..
            } => format!("plan {id} failed: {}", failure.detail),
            Self::NoResult {
                id,
                status,
                failure: None,
            } => {
                format!("plan {id} was {} before it had a route", status.name())
            }
            Self::ScenarioLost(id) => {
                format!("the scenario of plan {id} is no longer in the store, and formats that need it cannot be written; a result is still available as json, and other plans are not affected")
            }
            Self::Gone(Tombstone { id, expired, .. }) if *expired => {
                format!("plan {id} was kept as long as the service keeps plans, and removed")
            }
            Self::Gone(Tombstone { id, .. }) => format!("plan {id} was deleted"),
            Self::IdempotencyInFlight => {
                "a request with this Idempotency-Key has not been accepted yet; try again for its plan".to_owned()
            }
            Self::IdempotencyKeyReused => {
                "a request with this Idempotency-Key had another body; take a new key for a new request".to_owned()
            }
            Self::QuotaReached { active, quota, retry_after_s } => {
                format!("{active} plans of the key's owner are queued or running, the key's quota is {quota}; try again in {retry_after_s} s")
            }
            Self::BodyTooLarge(limit) => {
                format!(
                    "the body is longer than {limit} bytes, the limit body_bytes of GET /limits"
                )
            }
            Self::UnsupportedMediaType { found, allowed } => {
                unsupported_media_type(found.as_ref(), allowed)
            }
            Self::UnsupportedCoding(found) => {
                format!("content-encoding is {found}; send the body as it is, or as gzip")
            }
            Self::InvalidScenario(faults) => match &faults[..] {
                [_] => "1 fault; see errors".to_owned(),
                [listed @ .., last] if last.code == MORE_FAULTS => {
                    format!("more than {} faults; see errors", listed.len())
                }
                all => format!("{} faults; see errors", all.len()),
            },
            Self::Internal => {
                "a defect of the service; its log has more under this request's id".to_owned()
            }
            Self::Draining { retry_after_s } => {
                format!("no new plans are taken; try again in {retry_after_s} s")
            }
            Self::QueueFull {
                queued,
                retry_after_s,
            } => {
                format!("{queued} plans wait, the limit; try again in {retry_after_s} s")
            }
            Self::StoreUnavailable(trouble) => {
                let why = match trouble {
                    Some(Trouble::Full) => "the disk of the store is full",
                    Some(Trouble::ReadOnly) => "the data directory cannot be written",
                    Some(Trouble::Damaged) => "the store's file is damaged",
                    Some(Trouble::Moved) => "the store's file was moved or replaced",
                    Some(Trouble::Newer) => "the store was written by a newer version",
                    Some(Trouble::Vanished) => {
                        "what the store keeps on the NATS servers is missing there"
                    }
                    Some(Trouble::NoCredentials) => {
                        "the credentials for the NATS servers cannot be read"
                    }
                    Some(Trouble::Forbidden) => "the NATS servers refuse the credentials",
                    Some(Trouble::Other) => "the store does not answer",
                    None => "another process uses the data directory",
                };
                format!("{why}; plans are taken again when that is mended, the service's log says more")
            }
        }
    }
}

fn unsupported_media_type(found: Option<&Shown>, allowed: &str) -> String {
    match found {
        None => format!("no content-type was sent; send {allowed}"),
        Some(found)
            if found
                .as_str()
                .starts_with("application/x-www-form-urlencoded") =>
        {
            format!(
                "content-type is {found}, which curl -d sends by itself; add -H 'content-type: application/json'"
            )
        }
        Some(found) => format!("content-type is {found}; send {allowed} in UTF-8"),
    }
}
