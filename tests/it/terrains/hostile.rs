//! Unusable files, and bodies that are too long or break off: each gets a problem and leaves nothing behind.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::http::Method;
use bytes::Bytes;
use flate2::Compression;
use flate2::write::GzEncoder;
use futures_util::StreamExt as _;
use futures_util::future::join_all;
use futures_util::stream;
use noctule::catalogue::Directories;
use noctule::http;
use noctule::scenario::limits::Limits;
use serde_json::json;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use super::{hill, jacksboro, kept, over, put, put_with};
use crate::support::api::Api;
use crate::support::elevations::{ascii_grid, write_tiff};
use crate::support::gzip::packed;
use crate::support::patience::{PATIENCE, eventually, in_time};
use crate::support::process::Service;
use crate::support::server::Server;

/// A service that limits datasets to `terrain_bytes`.
fn with_limit(terrain_bytes: u64) -> Api {
    with_limits(|limits| limits.terrain_bytes = terrain_bytes)
}

fn with_limits(set: impl FnOnce(&mut Limits)) -> Api {
    limited(Api::new(), set)
}

fn limited(mut api: Api, set: impl FnOnce(&mut Limits)) -> Api {
    let mut rules = (*api.state.rules).clone();
    set(&mut rules.limits);
    api.state.rules = Arc::new(rules);
    api.router = http::router(api.state.clone());
    api
}

fn tiff(size: [u32; 2]) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_tiff(&mut bytes, size, [-85.0, 37.0], 0.001, |_, _| 300).expect("to memory");
    bytes
}

/// Replaces the value of a tag, which must be a number in the first directory.
fn with_tag(mut bytes: Vec<u8>, tag: u16, value: u32) -> Vec<u8> {
    let place = (0..13)
        .map(|idx| 10 + 12 * idx)
        .find(|place| bytes[*place..*place + 2] == tag.to_le_bytes());
    let place = place.expect("the tag is there") + 8;
    bytes[place..place + 4].copy_from_slice(&value.to_le_bytes());
    bytes
}

/// A description, the query of the upload, and its body.
type Case = (&'static str, &'static str, Vec<u8>);

/// Files that are not usable elevations.
fn hostile() -> Vec<Case> {
    let whole = jacksboro();
    let mut damaged = whole.clone();
    let length = damaged.len();
    for byte in &mut damaged[length / 2..length / 2 + 4096] {
        *byte ^= 0x5a;
    }
    let text = hill(10.0);
    vec![
        ("nothing", "", Vec::new()),
        (
            "a letter",
            "",
            b"Dear aunt, the hills here are high.".to_vec(),
        ),
        (
            "a picture",
            "",
            [&b"\x89PNG\r\n\x1a\n"[..], &[0; 4000]].concat(),
        ),
        ("a page", "", b"<!doctype html><title>404</title>".to_vec()),
        ("a head alone", "", whole[..8].to_vec()),
        ("cut in its directory", "", whole[..200].to_vec()),
        ("cut in its middle", "", whole[..length / 2].to_vec()),
        ("cut before its end", "", whole[..length - 1].to_vec()),
        ("damaged", "", damaged),
        ("far too wide", "", with_tag(tiff([8, 8]), 256, u32::MAX)),
        ("far too high", "", with_tag(tiff([8, 8]), 257, 1 << 20)),
        (
            "samples elsewhere",
            "",
            with_tag(tiff([8, 8]), 273, u32::MAX - 8),
        ),
        (
            "a directory in itself",
            "",
            with_tag(tiff([8, 8]), 34735, 8),
        ),
        ("unknown packing", "", with_tag(tiff([8, 8]), 259, 40_000)),
        (
            "half of its text",
            "",
            text.as_bytes()[..text.len() / 2].to_vec(),
        ),
        (
            "more text than it says",
            "",
            (text.clone() + "1 2 3\n").into_bytes(),
        ),
        (
            "gaps alone",
            "",
            ascii_grid([3, 2], [-85.0, 36.0], 0.01, |_, _| -9999.0).into_bytes(),
        ),
        (
            "words for numbers",
            "",
            text.replacen("30", "xy", 1).into_bytes(),
        ),
        (
            "no number",
            "",
            text.replacen(" 3", " nan3", 1).into_bytes(),
        ),
        (
            "a text of endless columns",
            "",
            text.replacen("ncols 41", "ncols 99999999999", 1)
                .into_bytes(),
        ),
        (
            "heights of nowhere",
            "",
            text.replacen("\n3", "\n99993", 2).into_bytes(),
        ),
        ("said to be a tile", "?format=hgt", whole.clone()),
        ("said to be text", "?format=asc", whole.clone()),
        ("said to be elsewhere", "?crs=EPSG:32616", whole.clone()),
        ("nowhere", "?crs=EPSG:1", text.clone().into_bytes()),
        ("not a system", "?crs=WGS84", text.clone().into_bytes()),
        ("a tile without its place", "", vec![0; 2 * 1201 * 1201]),
        (
            "a tile of another place",
            "?filename=N95W085.hgt",
            vec![0; 2 * 1201 * 1201],
        ),
    ]
}

#[tokio::test]
async fn unusable_files_are_refused_and_leave_nothing_behind() {
    let api = Api::new();
    for (what, query, body) in hostile() {
        let answer = put(&api, &format!("/terrains/hostile{query}"), body).await;
        let problem = answer.expect_problem(422, "invalid-terrain");
        let detail = problem["detail"].as_str().expect("text");
        assert!(
            !detail.is_empty() && !detail.contains(".part"),
            "{what}: {detail}"
        );
        assert_eq!(kept(&api.uploads()), [0, 0, 0], "{what}");
    }
    for query in ["?format=png", "?force", "?crs=a&crs=b"] {
        let answer = put(&api, &format!("/terrains/hostile{query}"), jacksboro()).await;
        answer.expect_problem(400, "invalid-parameter");
    }
    api.get("/terrains/hostile")
        .await
        .expect_problem(404, "not-found");
    // An existing dataset stays as it was.
    put(&api, "/terrains/hill", hill(1.0)).await;
    put(&api, "/terrains/hill", b"no more hill".to_vec())
        .await
        .expect_problem(422, "invalid-terrain");
    assert_eq!(api.get("/terrains/hill").await.json()["max"], 301.0);
    assert_eq!(kept(&api.uploads()), [2, 1, 0]);
}

#[tokio::test]
async fn the_upload_limit_holds_in_every_transfer_and_content_coding() {
    let text = hill(1.0).into_bytes();
    let api = with_limit(text.len() as u64);
    let chunks = |bytes: &[u8]| {
        let chunks: Vec<_> = bytes
            .chunks(1000)
            .map(|chunk| Ok::<_, std::io::Error>(bytes::Bytes::copy_from_slice(chunk)))
            .collect();
        axum::body::Body::from_stream(futures_util::stream::iter(chunks))
    };
    let longer = [&text[..], b"\n"].concat();
    for (body, status) in [(&text, 201), (&longer, 413)] {
        let put_it = async |body: axum::body::Body, headers: &[(&str, &str)]| {
            let answer = api
                .send(axum::http::Method::PUT, "/terrains/hill", headers, body)
                .await;
            assert_eq!(answer.status, status);
            api.delete("/terrains/hill").await;
        };
        put_it(body.clone().into(), &[]).await;
        put_it(chunks(body), &[]).await;
        put_it(packed(body).into(), &[("content-encoding", "gzip")]).await;
        put_it(chunks(&packed(body)), &[("content-encoding", "gzip")]).await;
    }
    assert_eq!(kept(&api.uploads())[1..], [0, 0]);
    // A length announced beyond the limit.
    let length = [("content-length", "99999999")];
    let answer = put_with(&api, "/terrains/hill", &length, text.clone()).await;
    let problem = answer.expect_problem(413, "body-too-large");
    assert!(
        problem["detail"]
            .as_str()
            .expect("text")
            .contains("terrain_bytes")
    );
    // A bomb is unpacked no further than the limit.
    let bomb = packed(&vec![b' '; 20 << 20]);
    let gzip = [("content-encoding", "gzip")];
    let answer = put_with(&api, "/terrains/hill", &gzip, bomb).await;
    answer.expect_problem(413, "body-too-large");
    for broken in [&packed(&text)[..500], b"no gzip"] {
        let answer = put_with(&api, "/terrains/hill", &gzip, broken).await;
        answer.expect_problem(400, "invalid-gzip");
    }
    let answer = put_with(&api, "/terrains/hill", &[("content-encoding", "br")], text).await;
    answer.expect_problem(415, "unsupported-media-type");
    assert_eq!(kept(&api.uploads())[1..], [0, 0]);
}

#[tokio::test]
async fn an_upload_that_breaks_off_or_has_a_wrong_length_leaves_nothing_behind() {
    let api = Api::new();
    let server = Server::start(&api).await;
    let file = jacksboro();
    let head = |length: usize| {
        format!("PUT /terrains/cut HTTP/1.1\r\nhost: localhost\r\ncontent-length: {length}\r\n\r\n")
            .into_bytes()
    };
    let short = [head(file.len()), file[..file.len() / 2].to_vec()].concat();
    let long = [head(file.len() / 2), file.clone()].concat();
    let chunk = [
        b"PUT /terrains/cut HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n1000\r\n"
            .to_vec(),
        file[..0x800].to_vec(),
    ]
    .concat();
    for (sent, status) in [(short, None), (long, Some("422")), (chunk, None)] {
        let mut stream = TcpStream::connect(server.address).await.expect("connected");
        stream.write_all(&sent).await.expect("sent");
        stream.shutdown().await.expect("no more");
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer).await;
        let answer = String::from_utf8_lossy(&answer).into_owned();
        if let Some(status) = status {
            assert!(
                answer.starts_with(&format!("HTTP/1.1 {status}")),
                "{answer}"
            );
        }
        nothing_comes_in(&api).await;
        assert_eq!(kept(&api.uploads()), [0, 0, 0]);
    }
}

/// A lost connection is noticed a little later.
async fn nothing_comes_in(api: &Api) {
    eventually(async || kept(&api.uploads())[2] == 0).await;
}

#[tokio::test]
async fn a_stalled_or_trickling_upload_is_given_up() {
    let mut api = Api::new();
    api.state.body_timeout = std::time::Duration::from_millis(200);
    api.router = http::router(api.state.clone());
    let file = bytes::Bytes::from(jacksboro());
    let half = file.slice(..file.len() / 2);
    let stalls = futures_util::StreamExt::chain(
        futures_util::stream::iter([Ok::<_, std::io::Error>(half)]),
        futures_util::stream::pending(),
    );
    let body = axum::body::Body::from_stream(stalls);
    let answer = api
        .send(axum::http::Method::PUT, "/terrains/slow", &[], body)
        .await;
    answer.expect_problem(408, "request-timeout");
    // A body that trickles just enough to seem alive.
    let drips = futures_util::stream::unfold((), async |()| {
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        Some((
            Ok::<_, std::io::Error>(bytes::Bytes::from_static(b"1 ")),
            (),
        ))
    });
    let body = axum::body::Body::from_stream(Box::pin(drips));
    let answer = api
        .send(axum::http::Method::PUT, "/terrains/slow", &[], body)
        .await;
    answer.expect_problem(408, "request-timeout");
    nothing_comes_in(&api).await;
}

/// The system may be able to read it again, so nobody is told that the dataset is at fault.
#[tokio::test]
async fn a_file_that_cannot_be_read_now_is_not_called_invalid() {
    let api = Api::new();
    let kept = put(&api, "/terrains/hill", hill(100.0)).await.json();
    let sum = kept["sha256"].as_str().expect("text");
    let file = api.uploads().join("content").join(sum);
    let aside = file.with_extension("aside");
    std::fs::rename(&file, &aside).expect("renamed");
    std::os::unix::fs::symlink(&file, &file).expect("a loop");
    let answer = api.get("/terrains/hill/elevations").await;
    answer.expect_problem(503, "store-unavailable");
    let answer = api.post("/plans", &over("hill")).await;
    answer.expect_problem(503, "store-unavailable");
    std::fs::remove_file(&file).expect("removed");
    std::fs::rename(&aside, &file).expect("renamed");
    let answer = api.post("/plans", &over("hill")).await;
    assert_eq!(answer.status, 202, "{answer:?}");
}

/// It would keep its place for ever.
#[tokio::test]
async fn a_packed_upload_that_unpacks_to_nothing_ends_at_the_limit() {
    let mut api = Api::new();
    let mut rules = (*api.state.rules).clone();
    rules.limits.terrain_bytes = 100_000;
    api.state.rules = rules.into();
    api.router = http::router(api.state.clone());
    let nothing = GzEncoder::new(Vec::new(), Compression::default());
    let nothing = nothing.finish().expect("to memory").repeat(100);
    let nothing = Bytes::from(nothing);
    let sent = stream::repeat_with(move || Ok::<_, std::io::Error>(nothing.clone()));
    let packed = [("content-encoding", "gzip")];
    let answer = api.send(
        Method::PUT,
        "/terrains/empty",
        &packed,
        Body::from_stream(sent),
    );
    let answer = in_time(answer).await;
    answer.expect_problem(413, "body-too-large");
    nothing_comes_in(&api).await;
}

/// As many as may arrive at once.
#[tokio::test]
async fn stalled_uploads_do_not_block_other_requests() {
    let mut api = Api::new();
    api.state.body_timeout = PATIENCE;
    api.router = http::router(api.state.clone());
    let stall = async |name| {
        let begins = stream::iter([Ok::<_, std::io::Error>(Bytes::from_static(b"ncols 41"))]);
        let body = Body::from_stream(begins.chain(stream::pending()));
        let uri = format!("/terrains/{name}");
        api.send(Method::PUT, &uri, &[], body).await
    };
    let others = async {
        eventually(async || begun(&api.uploads()) == 4).await;
        assert_eq!(api.get("/terrains").await.status, 200);
        let sketch = json!({"type": "FeatureCollection", "features": []});
        let answer = api.post("/scenarios:convert", &sketch).await;
        answer.expect_problem(422, "no-scenario");
    };
    tokio::select! {
        answers = join_all(["a", "b", "c", "d"].map(stall)) => panic!("nothing ended: {answers:?}"),
        () = in_time(others) => {}
    }
}

/// The number of uploads with data on disk.
fn begun(uploads: &Path) -> usize {
    let coming = std::fs::read_dir(uploads.join("incoming")).expect("it is there");
    let lengths = coming.map(|entry| {
        entry
            .and_then(|entry| entry.metadata())
            .map(|file| file.len())
    });
    lengths
        .filter(|length| length.as_ref().is_ok_and(|bytes| *bytes > 0))
        .count()
}

#[tokio::test]
async fn a_full_disk_refuses_the_upload_and_the_service_goes_on() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start_on_a_small_disk(directory.path(), "size=3m");
    let upload = async |body: Vec<u8>| {
        let request = service.request(reqwest::Method::PUT, "/terrains/plain");
        request.body(body).send().await.expect("an answer")
    };
    let answer = upload(tiff([2000, 1000])).await;
    assert_eq!(answer.status(), 503);
    let problem: serde_json::Value = answer.json().await.expect("JSON");
    assert_eq!(problem["type"], "/problems/store-unavailable");
    assert!(
        problem["detail"].as_str().expect("text").contains("full"),
        "{problem}"
    );
    let uploads = service.seen(&directory.path().join("terrains"));
    // Only the dataset that ships with the program.
    assert_eq!(kept(&uploads), [2, 1, 0]);
    assert_eq!(upload(tiff([200, 100])).await.status(), 201);
}

/// All datasets together have a limit, too. Content that is there already needs no more room, whatever its name.
#[tokio::test]
async fn datasets_beyond_the_room_for_all_are_refused_and_leave_nothing() {
    let (first, second) = (hill(100.0), hill(250.0));
    let room = (first.len() + second.len() - 1) as u64;
    let api = with_limits(|limits| limits.terrains_bytes = room);
    let answer = put(&api, "/terrains/first", first.clone()).await;
    assert_eq!(answer.status, 201, "{answer:?}");
    let refused = put(&api, "/terrains/second", second.clone()).await;
    let problem = refused.expect_problem(413, "terrains-full");
    let detail = problem["detail"].as_str().expect("text");
    assert!(
        detail.contains("terrains_bytes") && detail.contains(&room.to_string()),
        "{detail}"
    );
    assert_eq!(kept(&api.uploads()), [2, 1, 0]);

    for (name, status) in [("first", 200), ("again", 201)] {
        let answer = put(&api, &format!("/terrains/{name}"), first.clone()).await;
        assert_eq!(answer.status, status, "{answer:?}");
    }
    // The old content of a name stays for plans that may be about to be accepted.
    let refused = put(&api, "/terrains/again", second).await;
    refused.expect_problem(413, "terrains-full");
    assert_eq!(kept(&api.uploads()), [2, 2, 0]);

    // What was lost from the disk may be sent again: it has its room.
    let content = std::fs::read_dir(api.uploads().join("content")).expect("it is there");
    let files = content.map(|entry| entry.expect("it is there").path());
    for file in files.filter(|file| file.extension().is_none()) {
        std::fs::remove_file(file).expect("it was there");
    }
    assert_eq!(kept(&api.uploads()), [1, 2, 0]);
    let answer = put(&api, "/terrains/first", first).await;
    assert_eq!(answer.status, 200, "{answer:?}");
    assert_eq!(kept(&api.uploads()), [2, 2, 0]);
}

/// Names are limited too: neither new content nor a new name for the old one is kept beyond them.
#[tokio::test]
async fn datasets_beyond_their_number_are_refused_and_leave_nothing() {
    let api = with_limits(|limits| limits.terrains = 2);
    let (first, second, third) = (hill(100.0), hill(250.0), hill(300.0));
    for (name, file, status) in [
        ("first", &first, 201),
        ("second", &second, 201),
        ("first", &first, 200),
    ] {
        let answer = put(&api, &format!("/terrains/{name}"), file.clone()).await;
        assert_eq!(answer.status, status, "{answer:?}");
    }
    for file in [third, first] {
        let refused = put(&api, "/terrains/third", file.clone()).await;
        let problem = refused.expect_problem(413, "terrains-full");
        let detail = problem["detail"].as_str().expect("text");
        assert!(detail.contains("2, the limit terrains of"), "{detail}");
        assert_eq!(kept(&api.uploads()), [4, 2, 0]);
    }
    let answer = put(&api, "/terrains/second", hill(300.0)).await;
    assert_eq!(answer.status, 200, "it may be replaced: {answer:?}");
    assert_eq!(api.delete("/terrains/second").await.status, 204);
    let answer = put(&api, "/terrains/third", second).await;
    assert_eq!(answer.status, 201, "{answer:?}");
}

/// A deleted dataset leaves its room at once, unless a plan was planned over it.
#[tokio::test]
async fn a_deleted_dataset_leaves_its_room_once_no_plan_needs_it() {
    let (first, second) = (hill(100.0), hill(250.0));
    let room = first.len().max(second.len()) as u64;
    let limit = |limits: &mut Limits| limits.terrains_bytes = room;
    let api = limited(Api::new(), limit);
    for file in [&first, &second] {
        let answer = put(&api, "/terrains/hill", file.clone()).await;
        assert_eq!(answer.status, 201, "{answer:?}");
        assert_eq!(api.delete("/terrains/hill").await.status, 204);
    }
    assert_eq!(kept(&api.uploads()), [2, 0, 0]);

    // Here nothing is kept for having been used lately.
    let impatient = |uploads| Directories::with_grace(uploads, None, Duration::ZERO);
    let api = limited(Api::with_catalogue(impatient), limit);
    put(&api, "/terrains/hill", first).await;
    let submitted = api.post("/plans", &over("hill")).await;
    let plan = submitted.header("location");
    let cancel = format!("{plan}/cancel");
    let cancelled = api.send(Method::POST, &cancel, &[], "").await.json();
    assert_eq!(cancelled["status"], "cancelled", "{cancelled}");
    assert_eq!(api.delete("/terrains/hill").await.status, 204);
    let refused = put(&api, "/terrains/other", second.clone()).await;
    refused.expect_problem(413, "terrains-full");
    let scenario = api.get(&format!("{plan}/scenario")).await.json();
    let valid = api.post("/plans?validate_only=true", &scenario).await;
    assert_eq!(valid.status, 200, "{valid:?}");
    assert_eq!(api.delete(plan).await.status, 204);
    let answer = put(&api, "/terrains/other", second).await;
    assert_eq!(answer.status, 201, "{answer:?}");
    assert_eq!(kept(&api.uploads()), [2, 1, 0]);
}
