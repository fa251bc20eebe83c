//! Servers that say nothing: what needs them waits, and everything else is answered.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::num::NonZero;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use axum::http::Method;
use futures_util::future::{join, join_all};
use noctule::catalogue::{Changes, Directories, Sharing, Shelf, Source};
use noctule::http;
use parking_lot::{Condvar, Mutex};
use serde_json::json;

use super::{hill, over};
use crate::support::api::{Answer, Api};
use crate::support::patience::{eventually, in_time};
use crate::support::{run, scenario};

/// A shelf whose calls wait until they are let go, and then fail.
#[derive(Debug)]
struct Stalled {
    /// Whether it says at once that it has nothing; files are still taken by nobody.
    knows_it_is_empty: bool,
    state: Mutex<State>,
    let_go: Condvar,
}

#[derive(Debug, Default)]
struct State {
    waiting: usize,
    is_over: bool,
}

impl Stalled {
    fn new(knows_it_is_empty: bool) -> Arc<Self> {
        Arc::new(Self {
            knows_it_is_empty,
            state: Mutex::default(),
            let_go: Condvar::new(),
        })
    }

    fn waiting(&self) -> usize {
        self.state.lock().waiting
    }

    fn let_go(&self) {
        self.state.lock().is_over = true;
        self.let_go.notify_all();
    }

    fn stall<T>(&self) -> io::Result<T> {
        let mut state = self.state.lock();
        state.waiting += 1;
        self.let_go.wait_while(&mut state, |state| !state.is_over);
        state.waiting -= 1;
        Err(io::Error::other("nobody answered"))
    }
}

impl Shelf for Stalled {
    fn changes(&self, _: u64) -> io::Result<Changes> {
        if self.knows_it_is_empty {
            return Ok(Changes::default());
        }
        self.stall()
    }

    fn write(&self, _: &str, _: &str, _: u64) -> io::Result<Option<u64>> {
        self.stall()
    }

    fn erase(&self, _: &str, _: u64) -> io::Result<bool> {
        self.stall()
    }

    fn put(&self, _: &mut dyn Source) -> io::Result<String> {
        self.stall()
    }

    fn fetch(&self, _: &str, _: &mut dyn Write) -> io::Result<bool> {
        self.stall()
    }

    fn files(&self) -> io::Result<BTreeSet<String>> {
        if self.knows_it_is_empty {
            return Ok(BTreeSet::new());
        }
        self.stall()
    }

    fn discard(&self, _: &str) -> io::Result<()> {
        self.stall()
    }
}

/// A service that shares its datasets on `shelf`, and takes bodies that are too long to be read at once.
fn sharing(shelf: Arc<Stalled>) -> Api {
    let mut api = Api::with_catalogue(|cache| {
        Directories::shared(Sharing::new(shelf, cache, Arc::default()), None)
    });
    let mut rules = (*api.state.rules).clone();
    rules.limits.body_bytes = 1 << 20;
    api.state.rules = Arc::new(rules);
    api.router = http::router(api.state.clone());
    api
}

/// Work of each kind that leaves the threads that answer.
async fn all_else_is_answered(api: &Api, plan: &str) {
    let drawn = api.get(&format!("{plan}/result?format=svg")).await;
    assert_eq!(drawn.status, 200, "{drawn:?}");
    let sketch = json!({"type": "FeatureCollection", "features": []});
    let converted = api.post("/scenarios:convert", &sketch).await;
    converted.expect_problem(422, "no-scenario");
    let ground = api.post("/scenarios:ground", &scenario()).await;
    assert_eq!(ground.status, 200, "{ground:?}");
    let mut long = scenario().to_string();
    long.push_str(&" ".repeat(10_000));
    let json = [("content-type", "application/json")];
    let accepted = api.send(Method::POST, "/plans", &json, long).await;
    assert_eq!(accepted.status, 202, "{accepted:?}");
}

/// A plan that has ended.
async fn ended(api: &Api) -> String {
    let plan = api.submit().await;
    run::complete(&*api.store, Vec::new()).await;
    plan
}

async fn put(api: &Api, name: usize) -> Answer {
    let uri = format!("/terrains/hill-{name}");
    api.send(Method::PUT, &uri, &[], hill(100.0)).await
}

fn n_cores() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_that_wait_for_silent_servers_hold_up_no_others() {
    let shelf = Stalled::new(false);
    let api = sharing(shelf.clone());
    let plan = ended(&api).await;
    let ask = async |which: usize| match which % 4 {
        0 => api.get("/terrains").await,
        1 => api.get("/terrains/hill").await,
        2 => api.post("/plans", &over("hill")).await,
        _ => api.delete("/terrains/hill").await,
    };
    let asked = join_all((0..4 * n_cores()).map(ask));
    let others = async {
        eventually(async || shelf.waiting() >= n_cores().min(8)).await;
        all_else_is_answered(&api, &plan).await;
        shelf.let_go();
    };
    let (answers, ()) = join(asked, in_time(others)).await;
    for answer in answers {
        answer.expect_problem(503, "store-unavailable");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn uploads_that_nobody_takes_hold_up_only_further_uploads() {
    let shelf = Stalled::new(true);
    let mut api = sharing(shelf.clone());
    api.state.body_timeout = Duration::from_millis(200);
    api.router = http::router(api.state.clone());
    let plan = ended(&api).await;
    let others = async {
        eventually(async || shelf.waiting() == 4).await;
        let refused = put(&api, 4).await;
        refused.expect_problem(503, "too-many-uploads");
        assert_eq!(api.get("/terrains").await.status, 200);
        let unknown = api.post("/plans", &over("hill")).await;
        unknown.expect_problem(422, "invalid-scenario");
        all_else_is_answered(&api, &plan).await;
        shelf.let_go();
    };
    let uploads = join_all((0..4).map(async |name| put(&api, name).await));
    let (answers, ()) = join(uploads, in_time(others)).await;
    for answer in answers {
        answer.expect_problem(503, "store-unavailable");
    }
}
