//! Webhooks: a plan's end is sent to a receiver, signed, retried until received, and across restarts.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, Method, StatusCode, Uri};
use noctule::digest::sha256_hex;
use noctule::http::webhook::{Secrets, Sender, Settings};
use noctule::job::Submission;
use noctule::store::wall_clock;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;

use crate::support::api::{Answer, Api};
use crate::support::description::check_schema;
use crate::support::faulty_store::FaultyStore;
use crate::support::patience::{eventually, in_time};
use crate::support::plans::submission;
use crate::support::process::{Service, address_of};
use crate::support::run;
use crate::support::scenario;

const SECRET: &str = "whsec_MDEyMzQ1Njc4OWFiY2RlZjAxMjM0NTY3ODlhYmNkZWY=";

fn settings(allow_private: bool) -> Settings {
    Settings {
        secrets: Secrets::read(SECRET).expect("a secret"),
        allow_private,
    }
}

fn sender(api: &Api, allow_private: bool) -> Sender {
    Sender::start(
        api.store.clone(),
        settings(allow_private),
        wall_clock(),
        api.state.instruments.clone(),
    )
}

/// A received message.
struct Message {
    uri: Uri,
    headers: HashMap<String, String>,
    body: String,
}

/// Answers with the given statuses in turn, then with 204; passes on what it receives.
struct Receiver {
    url: String,
    messages: mpsc::UnboundedReceiver<Message>,
}

type Heard = (
    mpsc::UnboundedSender<Message>,
    Arc<std::sync::Mutex<std::vec::IntoIter<u16>>>,
);

async fn hear(
    State((messages, statuses)): State<Heard>,
    uri: Uri,
    headers: HeaderMap,
    body: Bytes,
) -> (StatusCode, [(&'static str, &'static str); 1]) {
    let headers = headers
        .iter()
        .map(|(name, value)| {
            let value = value.to_str().expect("visible ASCII").to_owned();
            (name.to_string(), value)
        })
        .collect();
    let body = String::from_utf8(body.to_vec()).expect("UTF-8");
    // A finished test no longer listens.
    let _ = messages.send(Message { uri, headers, body });
    let status = statuses.lock().expect("no panic").next().unwrap_or(204);
    let status = StatusCode::from_u16(status).expect("a status");
    (status, [("location", "/elsewhere")])
}

impl Receiver {
    async fn new(statuses: &[u16]) -> Self {
        let (sender, messages) = mpsc::unbounded_channel();
        let statuses = Arc::new(std::sync::Mutex::new(Vec::from(statuses).into_iter()));
        let router = Router::new().fallback(hear).with_state((sender, statuses));
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("bound");
        tokio::spawn(async move { axum_serve(listener, router).await });
        Self {
            url: format!("http://{address}/hook?x=1"),
            messages,
        }
    }

    async fn next(&mut self) -> Message {
        let next = in_time(self.messages.recv()).await;
        next.expect("the receiver lives")
    }
}

/// The service's own server, with a phase that never changes.
async fn axum_serve(listener: TcpListener, router: Router) {
    let (_phase, watched) = tokio::sync::watch::channel(noctule::http::Phase::Serving);
    let settings = noctule::http::server::Settings {
        head_timeout: Duration::from_secs(30),
        body_timeout: Duration::from_secs(30),
        reader_patience: Duration::from_secs(30),
        max_connections: 10,
        patience: Duration::ZERO,
        instruments: Arc::default(),
    };
    noctule::http::server::serve(listener, router, watched, settings).await;
}

/// The signature computed independently, as a receiver would: HMAC (RFC 2104) by hand.
fn signature(message: &Message) -> String {
    use base64::Engine as _;
    let id = &message.headers["webhook-id"];
    let timestamp = &message.headers["webhook-timestamp"];
    let signed = format!("{id}.{timestamp}.{}", message.body);
    let mut key = b"0123456789abcdef0123456789abcdef".to_vec();
    key.resize(64, 0);
    let padded = |pad: u8| key.iter().map(|byte| byte ^ pad).collect::<Vec<u8>>();
    let sum = |bytes: &[u8]| {
        let digits = sha256_hex(bytes);
        (0..32)
            .map(|n| u8::from_str_radix(&digits[2 * n..2 * n + 2], 16).expect("digits"))
            .collect::<Vec<u8>>()
    };
    let inner = sum(&[padded(0x36), signed.into_bytes()].concat());
    let outer = sum(&[padded(0x5c), inner].concat());
    let coded = base64::engine::general_purpose::STANDARD.encode(outer);
    format!("v1,{coded}")
}

/// Panics unless the message is about `plan`, well-formed and correctly signed; the plan's document.
#[track_caller]
fn check(message: &Message, plan: &str) -> Value {
    assert_eq!(message.uri, "/hook?x=1");
    assert_eq!(message.headers["content-type"], "application/json");
    assert_eq!(format!("/plans/{}", message.headers["webhook-id"]), plan);
    assert_eq!(message.headers["webhook-signature"], signature(message));
    let document: Value = serde_json::from_str(&message.body).expect("JSON");
    let schema = json!({"$ref": "#/components/schemas/Webhook"});
    check_schema(&schema, &document, "a webhook");
    assert_eq!(document["timestamp"], document["data"]["finished_at"]);
    document["data"].clone()
}

async fn submit(api: &Api, url: &str) -> Answer {
    let headers = [
        ("content-type", "application/json"),
        ("noctule-webhook", url),
    ];
    let body = scenario().to_string();
    api.send(Method::POST, "/plans", &headers, body).await
}

/// Submits a plan with `url` as its webhook; the plan's address.
async fn accepted(api: &Api, url: &str) -> String {
    submit(api, url).await.header("location").to_owned()
}

/// A plan of `owner` that has ended, and whose webhook is due.
async fn ended(api: &Api, owner: &str, url: &str, at_ms: i64) {
    let submission = Submission {
        owner: Some(owner.to_owned()),
        webhook: Some(url.to_owned()),
        ..submission()
    };
    let accepted = api.store.submit(submission).await.expect("accepted");
    let cancelled = api.store.request_cancel(accepted.plan.id, at_ms).await;
    cancelled.expect("it waited");
}

#[tokio::test]
async fn receivers_that_do_not_answer_hold_up_their_owner_alone() {
    let api = Api::with_webhooks(settings(true));
    // Connections are made, and nobody takes them.
    let silent = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let url = format!("http://{}/", silent.local_addr().expect("bound"));
    for owner in ["slow", "slower"] {
        for at_ms in 0..200 {
            ended(&api, owner, &url, at_ms).await;
        }
    }
    let _sender = sender(&api, true);
    // Their tries have begun.
    let mut taken = Vec::new();
    for _ in 0..80 {
        taken.push(in_time(silent.accept()).await.expect("a connection"));
    }
    let mut receiver = Receiver::new(&[]).await;
    ended(&api, "quick", &receiver.url, 1_000).await;
    let heard = receiver.next().await;
    assert_eq!(heard.headers["webhook-signature"], signature(&heard));
}

#[tokio::test]
async fn a_webhook_is_sent_once_and_signed() {
    let api = Api::with_webhooks(settings(true));
    let mut receiver = Receiver::new(&[]).await;
    let plan = accepted(&api, &receiver.url).await;
    let _sender = sender(&api, true);
    run::complete(&*api.store, Vec::new()).await;
    let told = check(&receiver.next().await, &plan);
    assert_eq!(told, api.get(&plan).await.json());
    // The next message is about the other plan's end, so nothing came in between.
    let other = accepted(&api, &receiver.url).await;
    api.send(Method::POST, &format!("{other}/cancel"), &[], "")
        .await;
    let told = check(&receiver.next().await, &other);
    assert_eq!(told["status"], "cancelled");
    api.submit().await;
    run::complete(&*api.store, Vec::new()).await;
    // Nothing is told of a plan that asked for no webhook: next comes the end of a later one that did.
    let last = accepted(&api, &receiver.url).await;
    run::complete(&*api.store, Vec::new()).await;
    check(&receiver.next().await, &last);
    eventually(async || {
        let due = api.store.due_webhooks(i64::MAX, 10).await;
        due.expect("it is open").is_empty()
    })
    .await;
    assert!(receiver.messages.try_recv().is_err());
}

#[tokio::test]
async fn a_webhook_address_without_a_path_is_called() {
    let mut receiver = Receiver::new(&[]).await;
    let api = Api::with_webhooks(settings(true));
    let _sender = sender(&api, true);
    let url = receiver.url.replace("/hook?", "?");
    assert_eq!(submit(&api, &url).await.status, 202);
    run::complete(&*api.store, Vec::new()).await;
    assert_eq!(receiver.next().await.uri, "/?x=1");
}

#[tokio::test]
async fn a_failed_webhook_is_retried_and_redirects_are_not_followed() {
    let api = Api::with_webhooks(settings(true));
    let mut receiver = Receiver::new(&[307]).await;
    let plan = accepted(&api, &receiver.url).await;
    run::complete(&*api.store, Vec::new()).await;
    let _sender = sender(&api, true);
    let first = receiver.next().await;
    check(&first, &plan);
    let second = receiver.next().await;
    check(&second, &plan);
    assert_eq!(first.body, second.body);
    assert_eq!(first.headers["webhook-id"], second.headers["webhook-id"]);
    let at = |message: &Message| -> i64 {
        message.headers["webhook-timestamp"]
            .parse()
            .expect("seconds")
    };
    assert!(at(&second) - at(&first) >= 3, "after a pause");
}

#[tokio::test]
async fn a_webhook_answered_with_410_is_not_retried() {
    let api = Api::with_webhooks(settings(true));
    let mut receiver = Receiver::new(&[410]).await;
    submit(&api, &receiver.url).await;
    run::complete(&*api.store, Vec::new()).await;
    let _sender = sender(&api, true);
    receiver.next().await;
    nothing_is_due(&api).await;
}

async fn nothing_is_due(api: &Api) {
    eventually(async || {
        let due = api.store.due_webhooks(i64::MAX, 10).await;
        due.expect("readable").is_empty()
    })
    .await;
}

#[tokio::test]
async fn a_webhook_whose_record_fails_is_not_sent_twice() {
    let api = Api::with_webhooks(settings(true));
    let mut receiver = Receiver::new(&[]).await;
    submit(&api, &receiver.url).await;
    run::complete(&*api.store, Vec::new()).await;
    let faulty = Arc::new(FaultyStore::new(api.store.clone()));
    let _sender = Sender::start(
        faulty,
        settings(true),
        wall_clock(),
        api.state.instruments.clone(),
    );
    receiver.next().await;
    nothing_is_due(&api).await;
    assert!(receiver.messages.try_recv().is_err(), "it was told twice");
}

#[tokio::test]
async fn a_webhook_whose_record_panics_is_sent_again() {
    let api = Api::with_webhooks(settings(true));
    let mut receiver = Receiver::new(&[]).await;
    let plan = accepted(&api, &receiver.url).await;
    run::complete(&*api.store, Vec::new()).await;
    let broken = Arc::new(FaultyStore::that_panics(api.store.clone()));
    let _sender = Sender::start(
        broken,
        settings(true),
        wall_clock(),
        api.state.instruments.clone(),
    );
    for _ in 0..2 {
        check(&receiver.next().await, &plan);
    }
    nothing_is_due(&api).await;
}

#[tokio::test]
async fn private_receivers_are_not_called() {
    let mut receiver = Receiver::new(&[]).await;
    // Accepted while private addresses were allowed, one by host name, and due when they no longer are.
    let api = Api::with_webhooks(settings(true));
    let port = receiver
        .url
        .split([':', '/'])
        .nth(4)
        .expect("a port")
        .to_owned();
    for url in [receiver.url.clone(), format!("https://localhost:{port}/")] {
        assert_eq!(submit(&api, &url).await.status, 202, "{url}");
        run::complete(&*api.store, Vec::new()).await;
    }
    let _sender = sender(&api, false);
    eventually(async || {
        let due = api.store.due_webhooks(i64::MAX, 10).await;
        let due = due.expect("readable");
        due.len() == 2 && due.iter().all(|webhook| webhook.tries == 1)
    })
    .await;
    let metrics = api.get("/metrics").await;
    let metrics = String::from_utf8_lossy(&metrics.body);
    for series in ["{outcome=\"failed\"} 2\n", "{outcome=\"given-up\"} 0\n"] {
        let line = format!("noctule_webhook_tries_total{series}");
        assert!(metrics.contains(&line), "{metrics}");
    }
    assert!(receiver.messages.try_recv().is_err());
}

#[tokio::test]
async fn webhook_addresses_are_checked_before_a_plan_is_accepted() {
    let off = Api::new();
    let refused = submit(&off, "https://hooks.example/").await;
    let problem = refused.expect_problem(400, "invalid-parameter");
    assert_eq!(problem["parameter"], "noctule-webhook");
    let api = Api::with_webhooks(settings(false));
    for url in [
        "http://hooks.example/",
        "https://127.0.0.1/",
        "https://[fe80::1]/",
        "hooks",
        "",
    ] {
        let refused = submit(&api, url).await;
        let problem = refused.expect_problem(400, "invalid-parameter");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(
            detail.contains("an https address of a public host"),
            "{detail}"
        );
    }
    let private = Api::with_webhooks(settings(true));
    let refused = submit(&private, "http://user@hooks.example/").await;
    let problem = refused.expect_problem(400, "invalid-parameter");
    let detail = problem["detail"].as_str().expect("a text");
    assert!(detail.contains("an http or https address,"), "{detail}");
    assert_eq!(submit(&api, "https://hooks.example/").await.status, 202);
}

/// A service process in `directory` that sends webhooks.
fn start(directory: &Path, variables: &[(&str, &str)]) -> Service {
    let secret = directory.join("secret");
    std::fs::write(&secret, SECRET).expect("written");
    let arguments = [
        "--workers",
        "1",
        "--webhook-allow-private",
        "--webhook-secret-file",
        secret.to_str().expect("UTF-8"),
    ];
    Service::start_with(variables, &directory.join("data"), &arguments)
}

/// Submits a plan with `url` as its webhook; the plan's address.
async fn submit_to(service: &Service, url: &str) -> String {
    let request = service.client().post(service.url("/plans"));
    let request = request.json(&scenario()).header("noctule-webhook", url);
    address_of(&request.send().await.expect("an answer"))
}

#[tokio::test]
async fn a_pending_webhook_survives_a_restart() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut receiver = Receiver::new(&[500]).await;
    let service = start(directory.path(), &[]);
    let plan = submit_to(&service, &receiver.url).await;
    check(&receiver.next().await, &plan);
    service.kill();
    let service = start(directory.path(), &[]);
    let told = check(&receiver.next().await, &plan);
    assert_eq!(told["status"], "succeeded");
    drop(service);
}

#[tokio::test]
async fn a_webhook_on_its_way_arrives_before_the_service_ends() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let url = format!("http://{}/", listener.local_addr().expect("bound"));
    let service = start(directory.path(), &[]);
    submit_to(&service, &url).await;
    let (mut connection, _) = in_time(listener.accept()).await.expect("a connection");
    service.signal("TERM");
    // Nobody else is to be answered any more.
    let refuses = async || TcpStream::connect(service.address()).await.is_err();
    eventually(refuses).await;
    let answer = b"HTTP/1.1 204 No Content\r\nconnection: close\r\n\r\n";
    connection
        .write_all(answer)
        .await
        .expect("it still listens");
    assert!(service.exit().await.success());

    let service = start(directory.path(), &[]);
    let plan = submit_to(&service, &url).await;
    let (mut connection, _) = in_time(listener.accept()).await.expect("a connection");
    let (_, id) = plan.rsplit_once('/').expect("a path");
    let mut message = String::new();
    let whole = async {
        while !message.contains(id) {
            let mut part = [0; 4096];
            let length = connection.read(&mut part).await.expect("readable");
            assert!(length > 0, "the first plan's end is told again: {message}");
            message.push_str(std::str::from_utf8(&part[..length]).expect("UTF-8"));
        }
    };
    in_time(whole).await;
}

#[tokio::test]
async fn tls_certificates_are_checked_against_the_trusted_authorities() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let port = listener.local_addr().expect("bound").port();
    let acceptor = acceptor();
    let accept = async || {
        let (stream, _) = listener.accept().await.expect("a connection");
        acceptor.accept(stream).await
    };

    // The receiver's certificate is from an unknown authority.
    let service = start(directory.path(), &[]);
    let url = format!("https://localhost:{port}/hook?x=1");
    let plan = submit_to(&service, &url).await;
    let refused = accept().await.expect_err("nothing is said to a stranger");
    assert!(refused.to_string().contains("UnknownCA"), "{refused}");
    service.kill();

    let authority = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/fixtures/tls/ca.pem");
    let _service = start(directory.path(), &[("SSL_CERT_FILE", authority)]);
    let stream = accept().await.expect("a handshake");
    let (sender, mut messages) = mpsc::unbounded_channel();
    let statuses = Arc::new(std::sync::Mutex::new(vec![].into_iter()));
    let router = Router::new().fallback(hear).with_state((sender, statuses));
    let service = hyper_util::service::TowerToHyperService::new(router);
    let connection = hyper::server::conn::http1::Builder::new()
        .serve_connection(hyper_util::rt::TokioIo::new(stream), service);
    tokio::spawn(async move { connection.await.is_ok() });
    let message = in_time(messages.recv()).await;
    check(&message.expect("a message"), &plan);
}

/// For a receiver named localhost.
fn acceptor() -> tokio_rustls::TlsAcceptor {
    use tokio_rustls::rustls::pki_types::pem::PemObject as _;
    use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
    use tokio_rustls::rustls::{ServerConfig, crypto::ring};

    let certificate = CertificateDer::from_pem_slice(include_bytes!("fixtures/tls/localhost.pem"));
    let key = PrivateKeyDer::from_pem_slice(include_bytes!("fixtures/tls/localhost.key"));
    let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .expect("ring has the default versions")
        .with_no_client_auth()
        .with_single_cert(vec![certificate.expect("PEM")], key.expect("PEM"));
    Arc::new(config.expect("a certificate and its key")).into()
}
