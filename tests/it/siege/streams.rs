//! Event readers: cut anywhere, many at once, and one that never reads.

use std::net::SocketAddr;
use std::time::Duration;

use futures_util::future::join_all;
use http_body_util::BodyExt as _;
use noctule::job::{Event, Status};
use noctule::store::Options;
use reqwest::Client;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use super::Dice;
use super::still::Http2;
use crate::support::api::Api;
use crate::support::lives::{a_plan, a_run_of};
use crate::support::patience::{eventually, in_time};
use crate::support::process::Service;
use crate::support::run;
use crate::support::server::Server;
use crate::support::size::size;
use crate::support::sse::{Stream, events};
use crate::support::stores::{Backend, for_every_backend};

/// A plan on a real port whose run the test controls.
struct Plan {
    api: Api,
    server: Server,
    address: String,
    client: Client,
}

impl Plan {
    async fn new() -> Self {
        Self::over(Api::new()).await
    }

    async fn on(backend: Backend) -> Self {
        Self::over(Api::on(backend, Options::new(10)).await).await
    }

    async fn over(api: Api) -> Self {
        let server = Server::start(&api).await;
        Self::at(server, api).await
    }

    async fn at(server: Server, api: Api) -> Self {
        Self {
            server,
            address: api.submit().await,
            client: Client::builder().no_proxy().build().expect("a client"),
            api,
        }
    }

    /// Runs the plan for `n` iterations, in batches of 20.
    async fn run(&self, n: usize) {
        let lease = self.api.store.claim().await.expect("it is queued");
        for first in (0..n).step_by(20) {
            let told = (first..n.min(first + 20)).flat_map(|iteration| {
                let elapsed_ms = iteration as f64 * 10.0;
                let better = iteration.is_multiple_of(3);
                better
                    .then(|| run::incumbent(iteration, elapsed_ms))
                    .into_iter()
                    .chain([run::convergence(iteration, elapsed_ms)])
            });
            let told: Vec<Event> = told.collect();
            self.api
                .store
                .append(&lease, told)
                .await
                .expect("the lease holds");
        }
        run::finish(&*self.api.store, &lease, Status::Succeeded).await;
    }

    /// Reads after event `after` until the end or until `bytes` have arrived, then drops the connection.
    async fn read(&self, query: &str, after: u64, bytes: usize) -> Vec<Told> {
        let request = self
            .client
            .get(self.server.url(&format!("{}/events{query}", self.address)))
            .header("last-event-id", after);
        let mut answer = request.send().await.expect("an answer");
        assert_eq!(answer.status(), 200);
        let mut text = Vec::new();
        while text.len() < bytes
            && let Some(chunk) = answer.chunk().await.expect("an unbroken stream")
        {
            text.extend_from_slice(&chunk);
        }
        text.truncate(bytes);
        told(&text)
    }
}

/// The id and name of an event.
type Told = (u64, String);

/// The complete events of a stream that may have been cut anywhere.
fn told(text: &[u8]) -> Vec<Told> {
    let whole = text
        .windows(2)
        .rposition(|pair| pair == b"\n\n")
        .map_or(0, |end| end + 1);
    let text = std::str::from_utf8(&text[..whole]).expect("UTF-8");
    let mut told = Vec::new();
    for block in text.split("\n\n") {
        if let Some((id, rest)) = block
            .trim_start()
            .strip_prefix("id: ")
            .and_then(|rest| rest.split_once('\n'))
        {
            let name = rest
                .lines()
                .next()
                .and_then(|line| line.strip_prefix("event: "));
            told.push((
                id.parse().expect("a number"),
                name.expect("a name").to_owned(),
            ));
        }
    }
    told
}

/// All events read over `cuts` connections, each cut at a random byte, and a final one.
async fn read_with_cuts(plan: &Plan, query: &str, cuts: usize, dice: &mut Dice) -> Vec<Told> {
    let mut all: Vec<Told> = Vec::new();
    for cut in 0..=cuts {
        let bytes = if cut < cuts {
            dice.below(900)
        } else {
            usize::MAX
        };
        let after = all.last().map_or(0, |(id, _)| *id);
        if all.last().is_some_and(|(_, name)| name == "end") {
            break;
        }
        all.extend(plan.read(query, after, bytes).await);
    }
    all
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_cut_a_hundred_times_loses_and_repeats_nothing() {
    for_every_backend(async |backend| {
        let plan = Plan::on(backend).await;
        let mut dice = Dice::new(7);
        let (live, ()) = tokio::join!(
            read_with_cuts(&plan, "?rate=0", 100, &mut dice),
            plan.run(600)
        );
        let ids: Vec<u64> = live.iter().map(|(id, _)| *id).collect();
        assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>());
        assert_eq!(live.iter().filter(|(_, name)| name == "end").count(), 1);
        assert_eq!(live, plan.read("?rate=0", 0, usize::MAX).await);

        // A thinned stream has the same events wherever it is cut.
        let whole = plan.read("?rate=20", 0, usize::MAX).await;
        assert!(whole.len() < live.len() / 2, "{} events", whole.len());
        for _ in 0..10 {
            assert_eq!(
                read_with_cuts(&plan, "?rate=20", 10, &mut dice).await,
                whole
            );
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn five_hundred_readers_see_every_incumbent_and_one_end() {
    for_every_backend(async |backend| {
        let plan = Plan::on(backend).await;
        let readers = join_all((0..500).map(|_| plan.read("?rate=0", 0, usize::MAX)));
        let all = async { tokio::join!(readers, plan.run(60)).0 };
        for told in in_time(all).await {
            let count = |wanted: &str| told.iter().filter(|(_, name)| name == wanted).count();
            assert_eq!(
                (count("incumbent"), count("convergence"), count("end")),
                (20, 60, 1)
            );
            assert!(told.is_sorted_by(|a, b| a.0 < b.0));
        }
    })
    .await;
}

/// A reader that has requested all events of a plan and reads none.
async fn stall(service: SocketAddr, plan: &str) -> TcpStream {
    let mut stalled = TcpStream::connect(service).await.expect("connected");
    let request = format!(
        "GET {plan}/events?rate=0 HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n"
    );
    stalled.write_all(request.as_bytes()).await.expect("sent");
    stalled
}

/// What it receives once it reads.
async fn rest(stalled: &mut TcpStream) -> String {
    let mut text = Vec::new();
    let rest = in_time(stalled.read_to_end(&mut text)).await;
    rest.expect("an unbroken stream");
    String::from_utf8(text).expect("UTF-8")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stalled_reader_delays_no_other_and_loses_nothing() {
    let plan = Plan::new().await;
    let mut stalled = stall(plan.server.address, &plan.address).await;

    // More than the buffers of a connection hold; nobody waits for the stalled reader.
    let all = async { tokio::join!(plan.read("?rate=0", 0, usize::MAX), plan.run(20_000)).0 };
    let others = in_time(all).await;
    assert_eq!(others.last().map(|(_, name)| name.as_str()), Some("end"));

    let text = rest(&mut stalled).await;
    assert_eq!(
        text.matches("\nevent: end\n").count(),
        1,
        "the reader gets everything after all"
    );
    assert_eq!(
        text.matches("\nevent: incumbent\n").count(),
        20_000_usize.div_ceil(3)
    );
}

/// Its place is another's then, and it can go on where it was.
#[tokio::test(flavor = "multi_thread")]
async fn a_stream_of_which_nothing_is_taken_is_ended() {
    let api = Api::new();
    let server = Server::with_patience(&api, Duration::from_secs(1)).await;
    let plan = Plan::at(server, api).await;
    plan.run(20_000).await;
    let mut stalled = stall(plan.server.address, &plan.address).await;
    let mut connection = Http2::new(plan.server.address, 1).await;
    let events = plan.server.url(&format!("{}/events", plan.address));
    let unread = connection.get(events).await;
    assert_eq!(unread.status(), 200);

    eventually(async || {
        let metrics = plan.api.get("/metrics").await.body;
        let metrics = String::from_utf8_lossy(&metrics).into_owned();
        metrics.contains("\nnoctule_http_event_streams 0\n")
    })
    .await;
    let arrived = rest(&mut stalled).await;
    assert!(arrived.contains("\nevent: convergence\n"));
    assert!(!arrived.contains("\nevent: end\n"));
    unread.collect().await.expect_err("it was cut off");
    drop(connection);
    assert_eq!(
        plan.read("?rate=0", 26_000, usize::MAX)
            .await
            .last()
            .expect("events")
            .1,
        "end"
    );
}

/// Alongside readers that follow a run from beginning to end; at full size it lasts a minute.
#[tokio::test(flavor = "multi_thread")]
async fn a_reader_stalled_for_a_whole_run_delays_no_other_and_loses_nothing() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1"]);
    let plan = service.submit(&a_run_of(size(1_000, 60_000))).await;
    let mut stalled = stall(service.address(), &plan).await;
    let others = (0..20).map(async |_| {
        let request = service.get(&format!("{plan}/events?rate=0"));
        events(&Stream::open(request).await.rest().await)
    });
    let others = in_time(join_all(others)).await;
    assert_eq!(service.ended(&plan).await["stop_reason"], "time-limit");
    for told in &others {
        let ids: Vec<u64> = told.iter().map(|(id, _)| *id).collect();
        assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>());
        assert_eq!(told.last().expect("events").1, "end");
    }
    let text = rest(&mut stalled).await;
    assert_eq!(text.matches("\nevent: ").count(), others[0].len());
    assert_eq!(text.matches("\nevent: end\n").count(), 1);
}

/// Routes of 200 waypoints: an incumbent takes 14 KB.
#[tokio::test(flavor = "multi_thread")]
async fn stalled_readers_of_long_routes_hold_little_memory() {
    const STALLED: usize = 100;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1"]);
    let mut document = a_plan(10, 400, 7);
    document["planner"]["waypoints"] = 200.into();
    document["planner"]["seeding"] = "random".into();
    document["planner"]["polish"] = false.into();
    let plan = service.submit(&document).await;
    service.ended(&plan).await;
    let read = Stream::open(service.get(&format!("{plan}/events?rate=0"))).await;
    let told = events(&read.rest().await);
    let ids: Vec<u64> = told.iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>());
    let incumbents = told.iter().filter(|(_, name)| name == "incumbent");
    assert!(incumbents.count() > 100);

    // As many at once as take each connection to the database, and what those keep.
    let full = (0..16).map(async |_| {
        let request = service.get(&format!("{plan}/events?rate=0"));
        events(&Stream::open(request).await.rest().await).len()
    });
    assert_eq!(in_time(join_all(full)).await, [told.len(); 16]);

    let before = service.peak_rss_kib();
    let mut stalled = Vec::new();
    for _ in 0..STALLED {
        let reader = stall(service.address(), &plan).await;
        // More has come than what every stream begins with: the first page has been read.
        eventually(async || {
            let peeked = reader.peek(&mut [0; 4096]).await;
            peeked.expect("an open stream") == 4096
        })
        .await;
        stalled.push(reader);
    }
    let grown = service.peak_rss_kib() - before;
    assert!(grown < STALLED as u64 * 150, "{grown} KiB more");
    let text = rest(&mut stalled[0]).await;
    assert_eq!(text.matches("\nevent: ").count(), told.len());
}
