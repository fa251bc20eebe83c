//! Event streams over a real connection: order, resumption, thinning, the end.

use axum::http::StatusCode;
use futures_util::future::join_all;
use noctule::http::Phase;
use noctule::job::{Event, Status};
use noctule::store::Options;
use reqwest::{Client, RequestBuilder};
use serde_json::Value;

use crate::support::api::Api;
use crate::support::patience::in_time;
use crate::support::run;
use crate::support::server::Server;
use crate::support::sse::{Block, Stream, events};
use crate::support::stores::{Backend, for_every_backend};

/// 60 iterations of 10 ms, every third of which finds a better route.
fn a_run() -> Vec<Event> {
    (0..60)
        .flat_map(|iteration: usize| {
            let elapsed_ms = iteration as f64 * 10.0;
            let better = iteration
                .is_multiple_of(3)
                .then(|| run::incumbent(iteration, elapsed_ms));
            better
                .into_iter()
                .chain([run::convergence(iteration, elapsed_ms)])
        })
        .collect()
}

struct Followed {
    api: Api,
    server: Server,
    address: String,
    client: Client,
}

impl Followed {
    async fn new() -> Self {
        Self::over(Api::new()).await
    }

    async fn on(backend: Backend) -> Self {
        Self::over(Api::on(backend, Options::new(10)).await).await
    }

    async fn over(api: Api) -> Self {
        Self {
            server: Server::start(&api).await,
            address: api.submit().await,
            client: Client::builder().no_proxy().build().expect("a client"),
            api,
        }
    }

    fn events(&self, query: &str) -> RequestBuilder {
        self.client
            .get(self.server.url(&format!("{}/events{query}", self.address)))
    }

    async fn read(&self, query: &str) -> Vec<Block> {
        Stream::open(self.events(query)).await.rest().await
    }
}

#[tokio::test]
async fn a_stream_delivers_the_whole_plan_and_ends_once() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let mut live = Stream::open(plan.events("?rate=0")).await;
        let Some(Block::Event { id: 1, name, data }) = live.next().await else {
            panic!("no first event")
        };
        assert_eq!(
            (name.as_str(), &data["status"]),
            ("status", &Value::from("queued"))
        );

        let reader = tokio::spawn(live.rest());
        run::complete(&*plan.api.store, a_run()).await;
        let live = reader.await.expect("read");

        let names: Vec<String> = events(&live).into_iter().map(|(_, name)| name).collect();
        assert_eq!(names[0], "status", "running");
        assert_eq!(
            names.iter().filter(|name| *name == "convergence").count(),
            60
        );
        assert_eq!(names.iter().filter(|name| *name == "incumbent").count(), 20);
        assert_eq!(names[names.len() - 2..], ["status", "end"]);
        assert_eq!(names.iter().filter(|name| *name == "end").count(), 1);
        let Some(Block::Event { data: end, .. }) = live.last() else {
            panic!("no end")
        };
        assert_eq!(end["status"], "succeeded");
        assert_eq!(end["result"], format!("{}/result", plan.address));

        let again = plan.read("?rate=0").await;
        assert_eq!(again[1..], live, "the same when it is read afterwards");
        let ids: Vec<u64> = events(&again).into_iter().map(|(id, _)| id).collect();
        assert!(ids.is_sorted_by(|a, b| a < b), "{ids:?}");
    })
    .await;
}

/// Where a plan was in the queue when it was accepted is of no use to those who ask later.
#[tokio::test]
async fn a_new_reader_of_a_queued_plan_sees_where_it_is_in_the_queue_now() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let second = Followed {
            address: plan.api.submit().await,
            ..plan
        };
        let first_event = async || {
            let mut stream = Stream::open(second.events("?rate=0")).await;
            let Some(Block::Event { id, name, data }) = stream.next().await else {
                panic!("no first event")
            };
            assert_eq!((id, name.as_str()), (1, "status"));
            data
        };
        let shown = first_event().await;
        assert_eq!(shown["queue_position"], 2, "{shown}");
        second.api.store.claim().await.expect("the first plan");
        let shown = first_event().await;
        let record = second.api.get(&second.address).await.json();
        assert_eq!(shown["queue_position"], 1, "{shown}");
        assert_eq!(shown, record);
        // Once it is running, that is the second event, and the first one says how it began.
        second.api.store.claim().await.expect("the second plan");
        let shown = first_event().await;
        assert_eq!(shown["status"], "queued", "{shown}");
    })
    .await;
}

#[tokio::test]
async fn a_cut_stream_resumes_at_every_event_without_loss_or_repeat() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        run::complete(&*plan.api.store, a_run()).await;
        for rate in ["0", "10", "3"] {
            let whole = plan.read(&format!("?rate={rate}")).await;
            let ids: Vec<u64> = events(&whole).into_iter().map(|(id, _)| id).collect();
            let resumed = join_all(ids.iter().enumerate().map(async |(position, id)| {
                let by_header = plan.events(&format!("?rate={rate}&last_event_id=0"));
                let by_header = by_header.header("last-event-id", id.to_string());
                let by_query = plan.events(&format!("?rate={rate}&last_event_id={id}"));
                let rest = &whole[position + 1..];
                if rest.is_empty() {
                    for request in [by_header, by_query] {
                        let answer = request.send().await.expect("an answer");
                        assert_eq!(answer.status(), StatusCode::NO_CONTENT, "all has been told");
                    }
                } else {
                    assert_eq!(
                        Stream::open(by_header).await.rest().await,
                        rest,
                        "after {id} at {rate} Hz"
                    );
                    assert_eq!(
                        Stream::open(by_query).await.rest().await,
                        rest,
                        "after {id} at {rate} Hz"
                    );
                }
            }));
            assert_eq!(resumed.await.len(), ids.len());
        }
        let beyond = plan
            .events("?last_event_id=1000000")
            .send()
            .await
            .expect("an answer");
        assert_eq!(beyond.status(), StatusCode::NO_CONTENT);
        // An empty header, as sent before the first event, is ignored.
        let fresh = plan.events("?rate=0").header("last-event-id", "");
        let fresh = Stream::open(fresh).await.rest().await;
        assert_eq!(fresh, plan.read("?rate=0").await);
        // The header takes precedence, but the query must still be valid.
        let mistaken = plan
            .events("?last_event_id=1.5")
            .header("last-event-id", "1")
            .send()
            .await
            .expect("an answer");
        assert_eq!(mistaken.status(), StatusCode::BAD_REQUEST);
    })
    .await;
}

#[tokio::test]
async fn a_live_stream_that_is_cut_resumes_without_loss() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let store = &plan.api.store;
        let lease = store.claim().await.expect("a queued plan");
        let mut read = Vec::new();
        let mut last = 0;
        // Each connection reads one event and is dropped; events in between are not lost.
        for event in a_run() {
            store
                .append(&lease, vec![event])
                .await
                .expect("the lease holds");
            let request = plan
                .events("?rate=0")
                .header("last-event-id", last.to_string());
            let Some(block) = Stream::open(request).await.next().await else {
                panic!("no event")
            };
            last = events(std::slice::from_ref(&block))[0].0;
            read.push(block);
        }
        run::finish(&**store, &lease, Status::Succeeded).await;
        read.extend(
            Stream::open(
                plan.events("?rate=0")
                    .header("last-event-id", last.to_string()),
            )
            .await
            .rest()
            .await,
        );
        assert_eq!(read, plan.read("?rate=0").await);
    })
    .await;
}

/// As after a restore from an older backup: no reader waits for events that will never come.
#[tokio::test]
async fn an_unknown_last_event_id_starts_from_the_beginning() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let store = &plan.api.store;
        let lease = store.claim().await.expect("a queued plan");
        let first_never_told = 3;
        let mut streams = Vec::new();
        for id in [first_never_told, 1_000] {
            let request = plan.events(&format!("?last_event_id={id}"));
            let mut ahead = Stream::open(request).await;
            let first = in_time(ahead.next()).await.expect("a status");
            assert_eq!(events(&[first]), [(1, "status".to_owned())], "after {id}");
            streams.push(ahead);
        }
        // Event 2 is the newest, so it is not repeated.
        let newest = Stream::open(plan.events("?last_event_id=2")).await;
        run::finish(&**store, &lease, Status::Succeeded).await;
        let whole = plan.read("").await;
        for ahead in streams {
            assert_eq!(in_time(ahead.rest()).await, whole[1..]);
        }
        assert_eq!(in_time(newest.rest()).await, whole[2..]);
    })
    .await;
}

#[tokio::test]
async fn a_rate_thins_the_curve_but_keeps_the_last_route() {
    let plan = Followed::new().await;
    run::complete(&*plan.api.store, a_run()).await;
    let whole = plan.read("?rate=0").await;
    for (rate, windows) in [("10", 6), ("5", 3), ("1", 1)] {
        let thinned = plan.read(&format!("?rate={rate}")).await;
        let count = |name: &str| {
            events(&thinned)
                .iter()
                .filter(|(_, kind)| kind == name)
                .count()
        };
        assert_eq!(count("convergence"), windows, "{rate} Hz");
        assert_eq!(count("incumbent"), windows, "{rate} Hz");
        assert_eq!(count("status"), 3);
        assert_eq!(count("end"), 1);
        assert!(thinned.iter().all(|block| whole.contains(block)));
        let last = |blocks: &[Block]| {
            let mut incumbents = events(blocks)
                .into_iter()
                .filter(|(_, name)| name == "incumbent");
            incumbents.next_back()
        };
        assert_eq!(last(&thinned), last(&whole));
    }
}

#[tokio::test]
async fn a_throttled_event_is_sent_when_the_run_pauses() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let store = &plan.api.store;
        let mut stream = Stream::open(plan.events("?rate=20")).await;
        let lease = store.claim().await.expect("a queued plan");
        let points = vec![
            run::incumbent(1, 10.0),
            run::convergence(1, 10.0),
            run::convergence(2, 20.0),
        ];
        store.append(&lease, points).await.expect("the lease holds");
        let mut names = Vec::new();
        for _ in 0..4 {
            // Without another event, time closes the window.
            let block = stream.next().await.expect("open");
            names.push(events(&[block])[0].1.clone());
        }
        assert_eq!(names, ["status", "status", "incumbent", "convergence"]);
    })
    .await;
}

#[tokio::test]
async fn ndjson_lines_carry_the_same_events() {
    let plan = Followed::new().await;
    run::complete(&*plan.api.store, a_run()).await;
    let request = plan.events("").header("accept", "application/x-ndjson");
    let answer = request.send().await.expect("an answer");
    assert_eq!(answer.headers()["content-type"], "application/x-ndjson");
    assert_eq!(answer.headers()["vary"], "accept");
    let lines: Vec<Block> = answer
        .text()
        .await
        .expect("text")
        .lines()
        .map(|line| {
            let mut line: Value = serde_json::from_str(line).expect("JSON");
            Block::Event {
                id: line["id"].as_u64().expect("a number"),
                name: line["event"].as_str().expect("a name").to_owned(),
                data: line["data"].take(),
            }
        })
        .collect();
    assert_eq!(lines, plan.read("").await);
}

#[tokio::test]
async fn the_end_event_of_a_plan_without_a_route_names_no_result() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let lease = plan.api.store.claim().await.expect("a queued plan");
        run::fail(&*plan.api.store, &lease).await;
        let Some(Block::Event { name, data, .. }) = plan.read("").await.pop() else {
            panic!("no end")
        };
        assert_eq!(name, "end");
        assert_eq!(
            data,
            serde_json::json!({"status": "failed", "result": null})
        );

        let plan = Followed::on(backend).await;
        plan.api
            .store
            .request_cancel(id_of(&plan.address), 0)
            .await
            .expect("queued");
        let Some(Block::Event { data, .. }) = plan.read("").await.pop() else {
            panic!("no end")
        };
        assert_eq!(
            data,
            serde_json::json!({"status": "cancelled", "result": null})
        );
    })
    .await;
}

fn id_of(address: &str) -> noctule::job::PlanId {
    address
        .trim_start_matches("/plans/")
        .parse()
        .expect("an id")
}

#[tokio::test]
async fn a_stream_of_a_deleted_plan_ends_as_cancelled() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let mut stream = Stream::open(plan.events("")).await;
        stream.next().await.expect("the first status");
        plan.api.delete(&plan.address).await;
        let rest = stream.rest().await;
        let ends = |block: &&Block| matches!(block, Block::Event { name, .. } if name == "end");
        assert_eq!(rest.iter().filter(ends).count(), 1, "{rest:?}");
        let Some(Block::Event { data, .. }) = rest.last() else {
            panic!("no end: {rest:?}")
        };
        let cancelled = serde_json::json!({"status": "cancelled", "result": null});
        assert_eq!(*data, cancelled);
        plan.api
            .get(&format!("{}/events", plan.address))
            .await
            .expect_problem(410, "gone");
    })
    .await;
}

#[tokio::test]
async fn the_end_of_a_deleted_plan_has_the_next_id_for_every_reader() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let mut ahead = Stream::open(plan.events("?last_event_id=1000")).await;
        ahead.next().await.expect("the first status");
        plan.api.delete(&plan.address).await;
        let rest = events(&in_time(ahead.rest()).await);
        let (last, name) = rest.last().expect("an end");
        assert_eq!(name, "end");
        assert!(*last <= 3, "{rest:?}");
    })
    .await;
}

/// The ids of all events, in order; those that a gap names count as read.
fn accounted(blocks: &[Block]) -> Vec<u64> {
    let mut ids = Vec::new();
    for block in blocks {
        match block {
            Block::Event { name, data, .. } if name == "gap" => {
                let id = |name| data[name].as_u64().expect("an id");
                ids.extend(id("from")..=id("to"));
            }
            Block::Event { id, .. } => ids.push(*id),
            _ => {}
        }
    }
    ids
}

#[tokio::test]
async fn a_reader_who_is_behind_when_the_plan_is_deleted_is_told_what_it_missed_and_the_end() {
    for_every_backend(async |backend| {
        for ended in [false, true] {
            let plan = Followed::on(backend).await;
            let store = &*plan.api.store;
            let mut stream = Stream::open(plan.events("?rate=0")).await;
            let mut blocks = vec![stream.next().await.expect("the first status")];
            let lease = store.claim().await.expect("a queued plan");
            let many = (0..50).flat_map(|_| a_run()).collect();
            store.append(&lease, many).await.expect("held");
            if ended {
                run::finish(store, &lease, Status::Succeeded).await;
            }
            plan.api.delete(&plan.address).await;
            blocks.extend(in_time(stream.rest()).await);

            let ids = accounted(&blocks);
            let last = *ids.last().expect("an end");
            assert_eq!(ids, (1..=last).collect::<Vec<_>>(), "{blocks:?}");
            let Some(Block::Event { name, data, .. }) = blocks.last() else {
                panic!("{blocks:?}")
            };
            let status = if ended { "succeeded" } else { "cancelled" };
            assert_eq!((name.as_str(), &data["status"]), ("end", &status.into()));
            assert!(last > 50, "{last} events");
        }
    })
    .await;
}

#[tokio::test]
async fn streams_end_when_the_service_stops() {
    let plan = Followed::new().await;
    let mut streams = Vec::new();
    for _ in 0..50 {
        let mut stream = Stream::open(plan.events("")).await;
        stream.next().await.expect("the first status");
        streams.push(stream);
    }
    plan.api.phase.send_replace(Phase::Stopping);
    for stream in streams {
        assert_eq!(
            stream.rest().await,
            [Block::Comment("the service is shutting down".to_owned())]
        );
    }
    plan.server.serving.await.expect("the server ends");
}

/// Few of their events are given out at once.
#[tokio::test]
async fn a_reader_of_long_routes_is_given_the_end_when_the_service_stops() {
    let api = Api::new();
    let address = api.submit().await;
    let long = |iteration| {
        let mut event = run::incumbent(iteration, iteration as f64);
        if let Event::Incumbent(incumbent) = &mut event {
            incumbent.waypoints = vec![incumbent.waypoints[0]; 202];
        }
        event
    };
    run::complete(&*api.store, (0..500).map(long).collect()).await;
    api.phase.send_replace(Phase::Stopping);
    let told = api.get(&format!("{address}/events?rate=0")).await.body;
    let told = String::from_utf8_lossy(&told);
    assert_eq!(told.matches("\nevent: incumbent\n").count(), 500);
    assert_eq!(told.matches("\nevent: end\n").count(), 1);
}

#[tokio::test]
async fn many_readers_of_one_plan_read_the_same_events() {
    for_every_backend(async |backend| {
        let plan = Followed::on(backend).await;
        let streams = join_all((0..50).map(|_| Stream::open(plan.events("?rate=0")))).await;
        let readers: Vec<_> = streams
            .into_iter()
            .map(|stream| tokio::spawn(stream.rest()))
            .collect();
        run::complete(&*plan.api.store, a_run()).await;
        let expected = plan.read("?rate=0").await;
        for reader in readers {
            assert_eq!(reader.await.expect("read"), expected);
        }
    })
    .await;
}

/// A plan whose first `forgotten` events are no longer kept, with `forgotten` and its last id.
async fn with_a_forgotten_beginning(backend: Backend) -> (Followed, u64, u64) {
    let options = Options {
        events_kept: 20,
        ..Options::new(10)
    };
    let plan = Followed::over(Api::on(backend, options).await).await;
    let lease = plan.api.store.claim().await.expect("a queued plan");
    for event in a_run() {
        let store = &plan.api.store;
        store.append(&lease, vec![event]).await.expect("held");
    }
    run::finish(&*plan.api.store, &lease, Status::Succeeded).await;
    let id = lease.plan.id;
    let page = plan.api.store.events(id, 0, 1_000).await.expect("there");
    let last = page.events.last().expect("an end").id;
    assert!(page.forgotten > 10);
    (plan, page.forgotten, last)
}

#[tokio::test]
async fn a_reader_who_asks_for_forgotten_events_gets_a_gap_event() {
    for_every_backend(async |backend| {
        let (plan, forgotten, last) = with_a_forgotten_beginning(backend).await;
        for after in [1, 2, forgotten - 1] {
            let blocks = plan.read(&format!("?rate=0&last_event_id={after}")).await;
            let Block::Event { id, name, data } = &blocks[0] else {
                panic!("{blocks:?}")
            };
            assert_eq!((*id, name.as_str()), (forgotten, "gap"));
            let missing = serde_json::json!({"from": after + 1, "to": forgotten});
            assert_eq!(*data, missing);
            let ids: Vec<u64> = events(&blocks).into_iter().map(|(id, _)| id).collect();
            assert_eq!(ids, (forgotten..=last).collect::<Vec<_>>());
        }
        // A reader who has read that far misses nothing.
        let blocks = plan
            .read(&format!("?rate=0&last_event_id={forgotten}"))
            .await;
        assert_eq!(events(&blocks)[0].0, forgotten + 1);
        assert!(events(&blocks).iter().all(|(_, name)| name != "gap"));
    })
    .await;
}

#[tokio::test]
async fn a_new_reader_of_a_truncated_history_starts_with_the_current_status() {
    for_every_backend(async |backend| {
        let (plan, forgotten, last) = with_a_forgotten_beginning(backend).await;
        let blocks = plan.read("?rate=0").await;
        let Block::Event { id, name, data } = &blocks[0] else {
            panic!("{blocks:?}")
        };
        assert_eq!((*id, name.as_str()), (forgotten, "status"));
        assert_eq!(data["status"], "succeeded");
        let ids: Vec<u64> = events(&blocks).into_iter().map(|(id, _)| id).collect();
        assert_eq!(ids, (forgotten..=last).collect::<Vec<_>>());
    })
    .await;
}
