//! Datasets shared by several nodes, on real servers.

use std::collections::BTreeSet;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use noctule::catalogue::{Catalogue, Directories, Sharing, Shelf};
use noctule::config::Address;
use noctule::http;
use noctule::job::Status;
use noctule::planner;
use noctule::scenario::json;
use noctule::store::jetstream::{JetStreamShelf, JetStreamStore, Settings};
use noctule::store::{Options, wall_clock};
use noctule::worker::{self, Engine, Pool, Unplanned};
use reqwest::Method;
use serde_json::Value;
use tokio::task::spawn_blocking;

use super::{hill, over, put, put_with};
use crate::support::api::{Answer, Api};
use crate::support::nats::{self, Cluster, NatsServer, namespace};
use crate::support::patience::{PATIENCE, eventually, in_time};
use crate::support::plans::until;
use crate::support::process::Service;

fn settings(address: &str, replicas: usize) -> Settings {
    Settings {
        address: Address::read(address).expect("an address"),
        credentials: None,
        replicas,
        lease: Duration::from_secs(2),
        slots: 0,
    }
}

fn shelf(address: &str) -> Arc<dyn Shelf> {
    Arc::new(JetStreamShelf::new(settings(address, 1)))
}

/// A node with shared datasets; content is removed as soon as nothing refers to it.
struct Node {
    api: Api,
    catalogue: Arc<dyn Catalogue>,
    cache: PathBuf,
}

impl Node {
    fn new(address: &str) -> Self {
        Self::over(shelf(address), Duration::ZERO)
    }

    fn over(shelf: Arc<dyn Shelf>, grace: Duration) -> Self {
        let api = Api::with_catalogue(|cache| {
            let sharing = Sharing::new(shelf, cache, Arc::default()).with_grace(grace);
            Directories::shared(sharing, None)
        });
        Self {
            catalogue: api.state.terrains.catalogue.clone(),
            cache: api.uploads(),
            api,
        }
    }

    /// The files in its cache.
    fn copies(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.cache.join("content")).expect("it is there");
        entries
            .map(|entry| entry.expect("it is there").path())
            .collect()
    }

    async fn sweep(&self, used: BTreeSet<String>) -> usize {
        let catalogue = self.catalogue.clone();
        let swept = spawn_blocking(move || catalogue.sweep(&used)).await;
        swept.expect("no panic").expect("it can be reached")
    }

    async fn validate(&self, name: &str) -> Value {
        let answer = self
            .api
            .post("/plans?validate_only=true", &over(name))
            .await;
        assert_eq!(answer.status, 200, "{answer:?}");
        answer.json()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dataset_uploaded_to_one_node_is_used_by_every_node() {
    let address = nats::address();
    let (a, b) = (Node::new(&address), Node::new(&address));
    assert_eq!(
        a.api.get("/terrains").await.json()["terrains"],
        Value::Array(Vec::new())
    );
    let uploaded = put(&a.api, "/terrains/hill", hill(100.0)).await;
    assert_eq!(uploaded.status, 201);
    for path in ["/terrains", "/terrains/hill", "/terrains/hill/elevations"] {
        let (here, there) = (a.api.get(path).await, b.api.get(path).await);
        assert_eq!(here.json(), there.json(), "{path}");
    }
    let accepted = b.validate("hill").await;
    assert_eq!(
        accepted["scenario"]["terrain"]["sha256"],
        uploaded.json()["sha256"]
    );

    // Every node knows at once what the name refers to.
    let again = put_with(
        &b.api,
        "/terrains/hill",
        &[("if-none-match", "*")],
        hill(1.0),
    )
    .await;
    again.expect_problem(412, "precondition-failed");
    let tag = uploaded.header("etag");
    let replaced = put_with(&b.api, "/terrains/hill", &[("if-match", tag)], hill(50.0)).await;
    assert_eq!(replaced.status, 200);
    let late = put_with(&a.api, "/terrains/hill", &[("if-match", tag)], hill(25.0)).await;
    late.expect_problem(412, "precondition-failed");
    // An accepted document keeps its ground on every node as long as its plan is kept.
    for node in [&a, &b] {
        let answer = node
            .api
            .post("/plans?validate_only=true", &accepted["scenario"])
            .await;
        assert_eq!(answer.status, 200, "{answer:?}");
    }
    let sha256 = uploaded.json()["sha256"].as_str().expect("text").to_owned();
    assert_eq!(a.sweep(BTreeSet::from([sha256])).await, 0);
    let swept = tokio::join!(a.sweep(BTreeSet::new()), b.sweep(BTreeSet::new()));
    assert_eq!(swept.0 + swept.1, 1);
    let answer = a
        .api
        .post("/plans?validate_only=true", &accepted["scenario"])
        .await;
    answer.expect_problem(422, "invalid-scenario");
    assert_eq!(b.api.delete("/terrains/hill").await.status, 204);
    a.api
        .get("/terrains/hill")
        .await
        .expect_problem(404, "not-found");
    a.sweep(BTreeSet::new()).await;
    assert_eq!(files(&address).await, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn nodes_that_sweep_concurrently_do_not_block_each_other() {
    let address = nats::address();
    let (a, b) = (Node::new(&address), Node::new(&address));
    for height in 1..=20 {
        let hill = hill(f64::from(height));
        assert_eq!(put(&a.api, "/terrains/hill", hill).await.status, 201);
        assert_eq!(b.api.delete("/terrains/hill").await.status, 204);
        tokio::join!(a.sweep(BTreeSet::new()), b.sweep(BTreeSet::new()));
    }
    a.sweep(BTreeSet::new()).await;
    assert_eq!(files(&address).await, 0);
}

/// The number of files on the servers, complete or not.
async fn files(address: &str) -> usize {
    let shelf = shelf(address);
    let files = spawn_blocking(move || shelf.files()).await;
    files.expect("no panic").expect("it can be reached").len()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_cached_copy_is_fetched_again() {
    let address = nats::address();
    let (a, b) = (Node::new(&address), Node::new(&address));
    put(&a.api, "/terrains/hill", hill(100.0)).await;
    let elevations = a.api.get("/terrains/hill/elevations").await.json();
    assert_eq!(
        b.api.get("/terrains/hill/elevations").await.json(),
        elevations
    );
    let copies = b.copies();
    std::fs::write(&copies[0], hill(200.0)).expect("written");
    assert_eq!(
        b.api.get("/terrains/hill/elevations").await.json(),
        elevations
    );
    assert_eq!(
        std::fs::read_to_string(&copies[0]).expect("read"),
        hill(100.0)
    );
}

/// A file of more than one message, and larger than one message's buffer on the servers.
#[tokio::test(flavor = "multi_thread")]
async fn files_of_many_chunks_arrive_complete() {
    let address = nats::address();
    let shelf = shelf(&address);
    let moved = spawn_blocking(move || {
        let bytes: Vec<u8> = (0..9_000_001_u32)
            .map(|i| (i / 251).to_le_bytes()[0])
            .collect();
        let file = shelf.put(&mut Cursor::new(&bytes)).expect("put");
        let mut came = Vec::new();
        assert!(shelf.fetch(&file, &mut came).expect("fetched"));
        assert!(came == bytes, "{} bytes came", came.len());
        let empty = shelf.put(&mut io::empty()).expect("put");
        assert!(shelf.fetch(&empty, &mut came).expect("fetched"));
        assert_eq!(came.len(), bytes.len());
        assert!(!shelf.fetch("nothing", &mut came).expect("answered"));
        // A writer that fails reports its own error.
        let mut full = [0; 1000];
        let error = shelf
            .fetch(&file, &mut &mut full[..])
            .expect_err("it is full");
        assert_eq!(error.kind(), io::ErrorKind::WriteZero);
        assert_eq!(
            shelf.files().expect("listed"),
            BTreeSet::from([file.clone(), empty])
        );
        shelf.discard(&file).expect("discarded");
        shelf.discard(&file).expect("discarded already");
        assert!(!shelf.fetch(&file, &mut came).expect("answered"));
        assert_eq!(shelf.files().expect("listed").len(), 1);
    });
    moved.await.expect("no panic");
}

/// Breaks off after this many bytes.
struct Broken(usize);

impl Read for Broken {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.0 == 0 {
            return Err(io::Error::other("broken"));
        }
        let length = buffer.len().min(self.0);
        buffer[..length].fill(7);
        self.0 -= length;
        Ok(length)
    }
}

impl Seek for Broken {
    fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
        Ok(0)
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_interrupted_upload_is_invisible_and_swept() {
    let address = nats::address();
    let node = Node::new(&address);
    put(&node.api, "/terrains/hill", hill(100.0)).await;
    let own = shelf(&address);
    let broken = spawn_blocking(move || own.put(&mut Broken(1 << 20))).await;
    let error = broken.expect("no panic").expect_err("it broke");
    assert_eq!(error.to_string(), "broken");
    // A file whose process was killed before it got a name.
    let own = shelf(&address);
    let lost = spawn_blocking(move || own.put(&mut Cursor::new("whole"))).await;
    lost.expect("no panic").expect("put");
    assert_eq!(files(&address).await, 3);
    assert_eq!(node.sweep(BTreeSet::new()).await, 0);
    assert_eq!(files(&address).await, 1);
    node.validate("hill").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn while_the_servers_are_away_requests_are_refused_and_nothing_is_lost() {
    let mut server = NatsServer::start();
    let address = server.address();
    let (a, b) = (Node::new(&address), Node::new(&address));
    let uploaded = put(&a.api, "/terrains/hill", hill(100.0)).await;
    let sha256 = uploaded.json()["sha256"].as_str().expect("text").to_owned();
    server.kill();
    // A pinned file in the cache needs no server; everything else is refused as unavailable, not as gone.
    let catalogue = a.catalogue.clone();
    let pinned = sha256.clone();
    let found = spawn_blocking(move || catalogue.find("hill", Some(&pinned))).await;
    assert_eq!(found.expect("no panic").expect("a copy").sha256, sha256);
    for node in [&a, &b] {
        let refused = [
            put(&node.api, "/terrains/hill", hill(50.0)).await,
            node.api.get("/terrains").await,
            node.api.get("/terrains/hill/elevations").await,
            node.api.delete("/terrains/hill").await,
            node.api.post("/plans", &over("hill")).await,
        ];
        for answer in refused {
            answer.expect_problem(503, "store-unavailable");
        }
        assert_eq!(node.api.get("/metrics").await.status, 200);
    }
    server.restart();
    eventually(async || b.api.get("/terrains").await.status == 200).await;
    assert_eq!(
        b.validate("hill").await["scenario"]["terrain"]["sha256"],
        sha256
    );
}

impl Node {
    /// Also shares its plans.
    async fn with_store(mut self, address: &str, slots: usize) -> Self {
        let settings = Settings {
            slots,
            ..settings(address, 1)
        };
        let store = JetStreamStore::open(settings, Options::new(100)).await;
        let store = Arc::new(store.expect("it can be reached"));
        self.api.store = store.clone();
        self.api.state.store = store;
        self.api.router = http::router(self.api.state.clone());
        self
    }

    /// Runs plans as the service does.
    fn work(&self) -> Pool {
        let rules = self.api.state.rules.clone();
        let engine: Engine = Arc::new(move |document, observer, stop| {
            let scenario = json::read_accepted(document, &rules);
            let away = |unread: json::Unread| Unplanned::NotNow(unread.to_string());
            Ok(planner::plan(&scenario.map_err(away)?, observer, stop))
        });
        let settings = worker::Settings {
            workers: 1,
            clock: wall_clock(),
            instruments: Arc::default(),
        };
        Pool::start(self.api.store.clone(), settings, engine)
    }

    /// Waits until this node knows that `plans` queued or running plans use the dataset.
    async fn until_in_use(&self, path: &str, plans: u64) {
        eventually(async || self.api.get(path).await.json()["in_use"] == plans).await;
    }

    async fn ended(&self, plan: &str) -> Value {
        eventually(async || {
            let status = self.api.get(plan).await.json();
            ["succeeded", "failed"].contains(&status["status"].as_str().expect("text"))
        })
        .await;
        self.api.get(plan).await.json()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_plans_over_content_uploaded_elsewhere_and_since_replaced() {
    let address = nats::address();
    let a = Node::new(&address).with_store(&address, 0).await;
    let b = Node::new(&address).with_store(&address, 1).await;
    put(&a.api, "/terrains/hill", hill(100.0)).await;
    let answer = a.api.post("/plans", &over("hill")).await;
    assert_eq!(answer.status, 202, "{answer:?}");
    let plan = answer.header("location").to_owned();
    b.until_in_use("/terrains/hill", 1).await;
    let problem = b.api.delete("/terrains/hill").await;
    assert_eq!(problem.expect_problem(409, "terrain-in-use")["plans"], 1);
    // The name moves on; the plan's content stays although two nodes sweep.
    assert_eq!(put(&b.api, "/terrains/hill", hill(50.0)).await.status, 200);
    for node in [&a, &b] {
        let uses = node.api.store.datasets_in_use().await.expect("it is open");
        let used: BTreeSet<String> = uses.into_iter().map(|used| used.sha256).collect();
        assert_eq!((used.len(), node.sweep(used).await), (1, 0));
    }
    let pool = b.work();
    let status = a.ended(&plan).await;
    assert_eq!(status["status"], "succeeded", "{status}");
    for format in ["svg", "geojson"] {
        let answer = a.api.get(&format!("{plan}/result?format={format}")).await;
        assert_eq!(answer.status, 200, "{answer:?}");
    }
    assert_eq!(b.copies().len(), 2);
    pool.drain(PATIENCE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_waits_until_its_ground_is_available() {
    let mut server = NatsServer::start();
    let (datasets, plans) = (server.address(), nats::address());
    let a = Node::new(&datasets).with_store(&plans, 0).await;
    let b = Node::new(&datasets).with_store(&plans, 1).await;
    put(&a.api, "/terrains/hill", hill(100.0)).await;
    let answer = a.api.post("/plans", &over("hill")).await;
    let plan = answer.header("location").to_owned();
    server.kill();
    let pool = b.work();
    let id = plan.rsplit('/').next().and_then(|id| id.parse().ok());
    let id = id.expect("an id");
    until(&*a.api.store, id, |plan| plan.status == Status::Running).await;
    server.restart();
    let status = a.ended(&plan).await;
    assert_eq!(status["status"], "succeeded", "{status}");
    pool.drain(PATIENCE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn processes_share_the_datasets_uploaded_to_one_of_them() {
    let address = nats::address();
    let directories = [(); 2].map(|()| tempfile::tempdir().expect("a temporary directory"));
    let start = |node: usize, role: &str| {
        let arguments = ["--store", &address, "--role", role, "--workers", "1"];
        Service::start(directories[node].path(), &arguments)
    };
    let (front, worker) = (start(0, "api"), start(1, "worker"));
    // A new service starts with one dataset, however many nodes start.
    let shipped: Value = of(&front, "/terrains").await;
    assert_eq!(shipped["terrains"][0]["name"], "jacksboro");
    let upload = front.request(Method::PUT, "/terrains/hill");
    let uploaded = upload.body(hill(100.0)).send().await.expect("an answer");
    assert_eq!(uploaded.status(), 201);
    let plan = front.submit(&over("hill")).await;
    let status = front.ended(&plan).await;
    assert_eq!(status["status"], "succeeded", "{status}");
    let metrics = worker.bytes("/metrics").await;
    let metrics = std::str::from_utf8(&metrics).expect("UTF-8");
    let fetched = "noctule_terrain_fetches_total{outcome=\"fetched\"} 1";
    assert!(metrics.lines().any(|line| line == fetched), "{metrics}");
    // A node that joins later finds everything and does not add the shipped dataset again.
    let deleted = front.request(Method::DELETE, "/terrains/jacksboro");
    assert_eq!(deleted.send().await.expect("an answer").status(), 204);
    drop(front);
    let front = start(0, "all");
    let known: Value = of(&front, "/terrains").await;
    let known = known["terrains"].as_array().expect("a list");
    assert_eq!(known.len(), 1);
    assert_eq!(known[0]["name"], "hill");
}

async fn of(service: &Service, path: &str) -> Value {
    serde_json::from_slice(&service.bytes(path).await).expect("JSON")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_killed_during_an_upload_leaves_nothing_visible() {
    let address = nats::address();
    let directories = [(); 2].map(|()| tempfile::tempdir().expect("a temporary directory"));
    let start = |node: usize| Service::start(directories[node].path(), &["--store", &address]);
    let (a, b) = (start(0), start(1));
    let before = b.bytes("/terrains").await;
    // Large enough to be caught in the middle of the upload.
    let request = a.request(Method::PUT, "/terrains/sea?filename=N36W085.hgt");
    let upload = tokio::spawn(request.body(vec![0; 2 * 3601 * 3601]).send());
    let own = shelf(&address);
    let is_there = spawn_blocking(move || {
        let until = Instant::now() + PATIENCE;
        while own.files().expect("it can be reached").len() < 2 {
            assert!(Instant::now() < until, "it never comes");
        }
    });
    is_there.await.expect("it comes");
    a.kill();
    assert!(upload.await.expect("no panic").is_err(), "it was too quick");
    assert_eq!(b.bytes("/terrains").await, before);
    // Its chunks are removed after a while, which is short for this node.
    let impatient = Node::new(&address);
    impatient.sweep(BTreeSet::new()).await;
    assert_eq!(files(&address).await, 1);
    let a = start(0);
    let upload = a.request(Method::PUT, "/terrains/sea?filename=N36W085.hgt");
    let upload = upload.body(vec![0; 2 * 3601 * 3601]).send().await;
    assert_eq!(upload.expect("an answer").status(), 201);
    assert!(of(&b, "/terrains/sea/elevations").await["elevations"].is_array());
}

/// With three replicas of everything, a change acknowledged by one server is visible through all.
#[tokio::test(flavor = "multi_thread")]
async fn a_changed_name_is_visible_at_once_on_every_node() {
    let cluster = Cluster::start().await;
    let address = cluster.address();
    let mut nodes = Vec::new();
    for _ in 0..3 {
        let shelf = Arc::new(JetStreamShelf::new(settings(&address, 3)));
        nodes.push(Node::over(shelf, Duration::from_secs(600)));
    }
    for round in 0_u8..12 {
        let height = 10.0 * f64::from(round);
        let [here, there] = [0, 1].map(|i| &nodes[usize::from(round + i) % 3]);
        let uploaded = put(&here.api, "/terrains/hill", hill(height)).await;
        assert!(uploaded.status.is_success(), "{uploaded:?}");
        let accepted = there.validate("hill").await;
        assert_eq!(
            accepted["scenario"]["terrain"]["sha256"],
            uploaded.json()["sha256"],
            "round {round}"
        );
    }
}

/// Refused requests are retried, as any caller would; every answer must be correct.
#[tokio::test(flavor = "multi_thread")]
async fn names_stay_consistent_when_servers_are_lost() {
    let mut cluster = Cluster::start().await;
    let address = cluster.address();
    let nodes = [(); 2].map(|()| {
        let shelf = Arc::new(JetStreamShelf::new(settings(&address, 3)));
        Node::over(shelf, Duration::from_secs(600))
    });
    put(&nodes[0].api, "/terrains/hill", hill(1.0)).await;
    let streams = ["KV", "OBJ"].map(|kind| format!("{kind}_{}-terrains", namespace(&address)));
    for round in 0_u8..4 {
        let [here, there] = [0, 1].map(|i| &nodes[usize::from(round + i) % 2].api);
        let leader = cluster.leader_of(&streams[usize::from(round / 2)]).await;
        cluster.servers[leader].kill();
        let height = 10.0 + f64::from(round);
        let uploaded = answered(async || put(here, "/terrains/hill", hill(height)).await).await;
        assert!(uploaded.status.is_success(), "{uploaded:?}");
        let known = answered(async || there.get("/terrains/hill").await).await;
        assert_eq!(
            known.json()["sha256"],
            uploaded.json()["sha256"],
            "round {round}"
        );
        let deleted = answered(async || there.delete("/terrains/hill").await).await;
        assert!([204, 404].contains(&deleted.status.as_u16()), "{deleted:?}");
        let gone = answered(async || here.get("/terrains/hill").await).await;
        assert_eq!(gone.status, 404, "round {round}");
        cluster.servers[leader].restart();
    }
}

/// Retries until the store is available; the response.
async fn answered(ask: impl AsyncFn() -> Answer) -> Answer {
    in_time(async {
        loop {
            let answer = ask().await;
            if answer.status != 503 {
                return answer;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    })
    .await
}

#[tokio::test(flavor = "multi_thread")]
async fn cached_copies_are_counted_in_the_metrics() {
    let address = nats::address();
    let (a, b) = (Node::new(&address), Node::new(&address));
    put(&a.api, "/terrains/hill", hill(100.0)).await;
    b.validate("hill").await;
    let text = b.api.get("/metrics").await;
    let text = std::str::from_utf8(&text.body).expect("UTF-8").to_owned();
    let length = hill(100.0).len();
    for line in [
        "noctule_terrains 1.0".to_owned(),
        format!("noctule_terrain_bytes {length}.0"),
        format!("noctule_terrain_cache_bytes {length}.0"),
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
}
