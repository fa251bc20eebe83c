//! Keys of the real service: creating, reading and reloading them; and no accidental service for strangers.

use std::fs;
use std::path::Path;

use reqwest::StatusCode;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use crate::support::patience::{eventually, in_time};
use crate::support::process::{Service, address_of, run, run_with};
use crate::support::scenario;

/// A new key and its key file entry.
fn new_key(arguments: &[&str]) -> (String, String) {
    let made = run(&[&["key", "new"], arguments].concat(), "");
    let told = String::from_utf8(made.stderr).expect("UTF-8");
    assert_eq!(made.status.code(), Some(0), "{told}");
    let key = told.lines().last().expect("a line").to_owned();
    (key, String::from_utf8(made.stdout).expect("UTF-8"))
}

/// The status of listing plans with a key.
async fn lists(service: &Service, key: &str) -> StatusCode {
    let request = service.get("/plans").bearer_auth(key);
    request.send().await.expect("an answer").status()
}

/// A service whose keys, data and log are in one directory.
struct Guarded {
    directory: tempfile::TempDir,
    service: Service,
}

impl Guarded {
    /// With `entry` in its key file.
    fn new(entry: &str, arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = |name: &str| directory.path().join(name);
        fs::write(path("keys.toml"), entry).expect("written");
        let keys = path("keys.toml");
        let keys = ["--keys-file", keys.to_str().expect("UTF-8")];
        let service = Service::start_on(
            "127.0.0.1:0",
            &path("data"),
            &[&keys, arguments].concat(),
            fs::File::create(path("log")).expect("a file"),
        );
        Self { directory, service }
    }

    /// Replaces the key file and makes the service reload it.
    fn exchange_keys(&self, entries: &str) {
        fs::write(self.directory.path().join("keys.toml"), entries).expect("written");
        self.service.signal("HUP");
    }

    /// Submits a plan with `key`; the plan's address.
    async fn submit(&self, key: &str) -> String {
        let request = self.service.client().post(self.service.url("/plans"));
        let request = request.json(&scenario()).bearer_auth(key);
        address_of(&request.send().await.expect("an answer"))
    }

    /// Waits until the log contains `part`; the log.
    async fn log_with(&self, part: &str) -> String {
        log_with(&self.directory.path().join("log"), part).await
    }
}

/// Waits until the log contains `part`; the log.
async fn log_with(path: &Path, part: &str) -> String {
    let log = || fs::read_to_string(path).expect("a log");
    eventually(async || log().contains(part)).await;
    log()
}

#[test]
fn a_new_key_is_printed_once_and_its_entry_can_be_appended() {
    let (key, entry) = new_key(&[
        "--name",
        "a \"b\"",
        "--scopes",
        "read,metrics",
        "--owner",
        "o",
    ]);
    assert!(key.starts_with("noctule_") && key.len() == 72, "{key}");
    assert!(!entry.contains(&key));
    let more = [
        "--name",
        "b",
        "--expires",
        "2127-01-31T00:00:00Z",
        "--requests-per-second",
        "2",
    ];
    let (other, second) = new_key(&more);
    assert_ne!(key, other);
    let entries: toml::Table = toml::from_str(&(entry + &second)).expect("TOML");
    let entries = entries["key"].as_array().expect("two");
    assert_eq!(entries[0]["name"].as_str(), Some("a \"b\""));
    assert_eq!(
        entries[0]["sha256"].as_str(),
        Some(noctule::digest::sha256_hex(key.as_bytes()).as_str())
    );
    assert_eq!(entries[1]["expires"].as_str(), Some("2127-01-31T00:00:00Z"));

    for arguments in [
        &["--name", ""][..],
        &["--name", "a", "--scopes", "write"],
        &["--name", "a", "--burst", "2"],
        &["--name", "a", "--expires", "soon"],
        &["--name", "a", "--expires", "2020-01-31T00:00:00Z"],
    ] {
        let refused = run(&[&["key", "new"], arguments].concat(), "");
        assert_eq!(refused.status.code(), Some(1), "{arguments:?}");
        assert!(refused.stdout.is_empty(), "{arguments:?}");
    }
}

#[test]
fn a_service_with_no_or_broken_keys_refuses_to_listen_on_every_address() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let data_dir = directory.path().join("data");
    let data_dir = data_dir.to_str().expect("UTF-8");
    let broken = directory.path().join("broken.toml");
    fs::write(&broken, "[[key]]\nname = \"alice\"").expect("written");
    let broken = broken.to_str().expect("UTF-8");
    let serve = ["serve", "--listen", "0.0.0.0:0", "--data-dir", data_dir];
    let (_, entry) = new_key(&["--name", "a"]);
    for (variables, arguments, expected) in [
        (&[][..], &[][..], "--allow-anonymous"),
        (
            &[],
            &["--keys-file", "/nowhere/keys.toml"],
            "/nowhere/keys.toml",
        ),
        (&[], &["--keys-file", broken], "key \"alice\""),
        (&[("NOCTULE_KEYS", "[[key]]")], &[], "key 1 of the file"),
        (
            &[("NOCTULE_KEYS", entry.as_str())],
            &["--keys-file", broken],
            "give one",
        ),
        (
            &[],
            &["--allow-anonymous", "--cors-origins", "https://a.example,*"],
            "--cors-origins is \"https://a.example,*\", must be a list of exact origins such as",
        ),
    ] {
        let refused = run_with(variables, &[&serve[..], arguments].concat(), "");
        let told = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(1), "{told}");
        assert!(told.contains(expected), "{arguments:?}: {told}");
        assert!(refused.stdout.is_empty());
    }
    assert!(
        !Path::new(data_dir).exists(),
        "refused before anything is made"
    );
}

/// Otherwise a page whose host name resolves here could use the service through a browser on this machine.
#[tokio::test]
async fn a_service_without_keys_rejects_host_names_that_others_control() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| directory.path().join(name);
    let (_, entry) = new_key(&["--name", "a"]);
    fs::write(path("keys.toml"), entry).expect("written");
    let keys = path("keys.toml");
    for (arguments, evil, listed) in [
        (&[][..], 421, 421),
        (&["--cors-origins", "https://plans.example:8443"], 421, 200),
        (&["--allow-anonymous"], 200, 200),
        (&["--keys-file", keys.to_str().expect("UTF-8")], 200, 200),
    ] {
        let service = Service::start(&path("data"), arguments);
        for (host, status) in [
            ("localhost:8080", 200),
            ("plans.localhost", 200),
            ("[::1]", 200),
            ("plans.example", listed),
            ("evil.example:8080", evil),
        ] {
            let asked = service.get("/livez").header("host", host);
            let answer = asked.send().await.expect("an answer");
            assert_eq!(answer.status(), status, "{arguments:?} {host}");
            if status == 421 {
                let problem: serde_json::Value = answer.json().await.expect("JSON");
                assert_eq!(problem["type"], "/problems/misdirected-request");
            }
        }
    }
}

#[tokio::test]
async fn an_http_1_1_request_must_name_exactly_one_host() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--allow-anonymous"]);
    for (head, status) in [
        ("GET /livez HTTP/1.1\r\n", "400"),
        ("GET /livez HTTP/1.1\r\nhost: a\r\nhost: a\r\n", "400"),
        ("GET /livez HTTP/1.1\r\nhost: a\r\n", "200"),
        ("GET /livez HTTP/1.0\r\n", "200"),
    ] {
        let mut stream = TcpStream::connect(service.address())
            .await
            .expect("connected");
        let request = format!("{head}connection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut answer = String::new();
        let read = in_time(stream.read_to_string(&mut answer)).await;
        read.expect("an answer");
        assert_eq!(answer.split(' ').nth(1), Some(status), "{head}: {answer}");
        if status == "400" {
            assert!(answer.contains("/problems/invalid-parameter"), "{answer}");
        }
    }
}

#[tokio::test]
async fn with_keys_or_allow_anonymous_it_listens_on_every_address() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| directory.path().join(name);
    let (key, entry) = new_key(&["--name", "a"]);
    fs::write(path("keys.toml"), entry).expect("written");
    let keys = path("keys.toml");
    let keys = ["--keys-file", keys.to_str().expect("UTF-8")];
    for (arguments, anonymous) in [
        (&["--allow-anonymous"][..], StatusCode::OK),
        (&keys, StatusCode::UNAUTHORIZED),
        (
            &[keys[0], keys[1], "--allow-anonymous"],
            StatusCode::UNAUTHORIZED,
        ),
    ] {
        let service = Service::start_on(
            "0.0.0.0:0",
            &path("data"),
            arguments,
            fs::File::create(path("log")).expect("a file"),
        );
        let listed = service.get("/plans").send().await.expect("an answer");
        assert_eq!(listed.status(), anonymous, "{arguments:?}");
        assert_eq!(lists(&service, &key).await, StatusCode::OK);
        assert_eq!(service.bytes("/readyz").await, r#"{"status":"ok"}"#);
    }
}

#[tokio::test]
async fn sighup_reloads_the_keys_and_a_faulty_file_changes_nothing() {
    let (old, old_entry) = new_key(&["--name", "old", "--owner", "alice"]);
    let (new, new_entry) = new_key(&["--name", "new", "--owner", "alice"]);
    let guarded = Guarded::new(&old_entry, &["--workers", "1"]);
    let service = &guarded.service;
    let plan = guarded.submit(&old).await;
    assert_eq!(lists(service, &new).await, StatusCode::UNAUTHORIZED);

    guarded.exchange_keys("[[key]]\nname = \"old\"\n");
    let log = guarded.log_with("the keys stay as they were").await;
    assert!(
        log.contains("key \\\"old\\\"") || log.contains("key \"old\""),
        "{log}"
    );
    assert_eq!(lists(service, &old).await, StatusCode::OK);

    guarded.exchange_keys(&new_entry);
    guarded.log_with("the keys have been read again").await;
    assert_eq!(lists(service, &old).await, StatusCode::UNAUTHORIZED);
    // The new key has the same owner.
    let status = service
        .get(&plan)
        .bearer_auth(&new)
        .send()
        .await
        .expect("an answer");
    assert_eq!(status.status(), StatusCode::OK);
}

#[tokio::test]
async fn neither_keys_nor_tickets_are_logged() {
    let (key, entry) = new_key(&["--name", "alice"]);
    let guarded = Guarded::new(&entry, &["--log", "trace"]);
    let service = &guarded.service;
    let plan = guarded.submit(&key).await;
    let request = service
        .client()
        .post(service.url(&format!("{plan}/tickets")));
    let issued = request.bearer_auth(&key).send().await.expect("an answer");
    let ticket: serde_json::Value = issued.json().await.expect("JSON");
    let events = ticket["events"].as_str().expect("text");
    service.bytes(events).await;
    let with_key = [
        format!("/plans?key={key}"),
        format!("/plans/{key}"),
        format!("/plans/%20{key}?x"),
    ];
    for uri in &with_key {
        let refused = service.get(uri).header("x-request-id", &key).send().await;
        assert_eq!(refused.expect("an answer").status(), 400);
    }
    let path = guarded.directory.path().join("log");
    let log = || fs::read_to_string(&path).expect("a log");
    // Each of the requests has been logged.
    let refused = || log().matches("a key came in a URL").count();
    eventually(async || refused() == with_key.len()).await;
    let log = log();
    assert!(log.contains("alice"), "the key's name is there: {log}");
    let ticket = ticket["ticket"].as_str().expect("text");
    let sum = noctule::digest::sha256_hex(key.as_bytes());
    for secret in [&key["noctule_".len()..], ticket, &sum] {
        assert!(!log.contains(secret), "{log}");
    }
}
