//! The service without a socket, over a store of its own. Every response is checked against `openapi.yaml`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, Method, Request, StatusCode};
use bytes::Bytes;
use http_body_util::BodyExt as _;
use noctule::catalogue::Directories;
use noctule::config::Origin;
use noctule::http::auth::{Access, Keys, Settings};
use noctule::http::webhook;
use noctule::http::{
    self, Answers, Bodies, Bounds, Capacity, Hosts, InFlight, Origins, Parts, Phase, Readiness,
    Terrains,
};
use noctule::planner;
use noctule::scenario::limits::Limits;
use noctule::store::measured::MeasuredStore;
use noctule::store::sqlite::SqliteStore;
use noctule::store::{Options, SteadyClock, Store, wall_clock};
use noctule::telemetry::Instruments;
use serde_json::Value;
use tokio::sync::watch;
use tower::ServiceExt as _;

use super::description;
use super::stores::{Backend, Place};

/// A service whose only worker is the test.
pub(crate) struct Api {
    pub(crate) store: Arc<dyn Store>,
    pub(crate) state: Parts,
    pub(crate) router: Router,
    pub(crate) phase: watch::Sender<Phase>,
    uploads: PathBuf,
    place: Place,
}

/// A complete response.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: StatusCode,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Bytes,
}

impl Api {
    /// With room for a thousand plans.
    pub(crate) fn new() -> Self {
        Self::with_queue(1000)
    }

    /// With room for `queue` plans.
    pub(crate) fn with_queue(queue: usize) -> Self {
        Self::with_store(Options::new(queue as u64))
    }

    /// Over a store with these options.
    pub(crate) fn with_store(options: Options) -> Self {
        Self::made(
            options,
            Access::new(None, Settings::default(), wall_clock()),
            &[],
        )
    }

    /// Over a store of the given kind.
    pub(crate) async fn on(backend: Backend, options: Options) -> Self {
        Self::at(Place::new(backend), options).await
    }

    async fn at(place: Place, options: Options) -> Self {
        let queue = options.queue_limit;
        let store = place.open(options).await.expect("nobody else uses it");
        let access = Access::new(None, Settings::default(), wall_clock());
        Self::over(store, place, queue, access, &[])
    }

    /// Over a store of the given kind, on the given clock.
    pub(crate) async fn by_clock(
        backend: Backend,
        clock: Arc<SteadyClock>,
        options: Options,
    ) -> Self {
        Self::on(backend, options.by(&clock)).await.told_by(clock)
    }

    /// Another process over the same store, on the given clock.
    pub(crate) async fn reopened_by(self, clock: Arc<SteadyClock>, options: Options) -> Self {
        self.store.close().await;
        let place = self.place;
        drop((self.store, self.state, self.router));
        Self::at(place, options.by(&clock)).await.told_by(clock)
    }

    fn told_by(mut self, clock: Arc<SteadyClock>) -> Self {
        self.state.clock = clock;
        self.router = http::router(self.state.clone());
        self
    }

    /// For callers with keys only.
    pub(crate) fn with_keys(keys: &str) -> Self {
        Self::with_access(keys, Settings::default())
    }

    /// The same with other access settings.
    pub(crate) fn with_access(keys: &str, settings: Settings) -> Self {
        let keys = Keys::read(keys).expect("keys");
        Self::made(
            Options::new(1000),
            Access::new(Some(keys), settings, wall_clock()),
            &[],
        )
    }

    /// Open to pages of these origins.
    pub(crate) fn with_origins(origins: &[&str]) -> Self {
        let access = Access::new(None, Settings::default(), wall_clock());
        Self::made(Options::new(1000), access, origins)
    }

    /// Sends webhooks.
    pub(crate) fn with_webhooks(settings: webhook::Settings) -> Self {
        let mut api = Self::new();
        api.state.webhooks = Some(settings);
        api.router = http::router(api.state.clone());
        api
    }

    /// With another catalogue of datasets: the function is given the directory for uploads.
    pub(crate) fn with_catalogue(open: impl FnOnce(PathBuf) -> Directories) -> Self {
        let mut api = Self::new();
        // A separate directory: the first one is in use.
        let catalogue = Arc::new(open(api.place.path().join("more")));
        catalogue.reach();
        let rules = (*api.state.rules).clone().with_datasets(catalogue.clone());
        api.state.rules = Arc::new(rules);
        api.state.terrains = Terrains::new(catalogue);
        api.uploads = api.place.path().join("more");
        api.router = http::router(api.state.clone());
        api
    }

    /// The directory of uploads.
    pub(crate) fn uploads(&self) -> PathBuf {
        self.uploads.clone()
    }

    /// The directory of the store.
    pub(crate) fn data_dir(&self) -> &Path {
        self.place.path()
    }

    fn made(options: Options, access: Access, origins: &[&str]) -> Self {
        let place = Place::new(Backend::Sqlite);
        let queue = options.queue_limit;
        let store = SqliteStore::open(place.path(), options).expect("a fresh store");
        Self::over(Arc::new(store), place, queue, access, origins)
    }

    fn over(
        store: Arc<dyn Store>,
        place: Place,
        queue: u64,
        access: Access,
        origins: &[&str],
    ) -> Self {
        let queue = usize::try_from(queue).expect("a small number");
        let instruments = Arc::new(Instruments::default());
        let store = Arc::new(MeasuredStore::new(store, instruments.clone()));
        let origins = origins.iter().map(|text| Origin::read(text));
        let origins: Option<Vec<Origin>> = origins.collect();
        let (phase, watched) = watch::channel(Phase::Serving);
        let uploads = place.path().join("terrains");
        let catalogue = Arc::new(Directories::new(uploads.clone(), None));
        catalogue.reach();
        let limits = Limits {
            body_bytes: 4096,
            ..Limits::default()
        };
        let state = Parts {
            store: store.clone(),
            rules: Arc::new(planner::rules(limits).with_datasets(catalogue.clone())),
            terrains: Terrains::new(catalogue),
            capacity: Capacity { workers: 2, queue },
            in_flight: InFlight::default(),
            bounds: Bounds::default(),
            readiness: Readiness::default(),
            clock: SteadyClock::following(wall_clock()),
            body_timeout: Duration::from_secs(30),
            bodies: Bodies::new(256 << 20, limits.body_bytes),
            answers: Answers::new(256 << 20, Duration::from_secs(40)),
            access,
            webhooks: None,
            cors: Origins::new(&origins.expect("origins")),
            hosts: Hosts::any(),
            phase: watched,
            instruments,
        };
        Self {
            router: http::router(state.clone()),
            store,
            state,
            phase,
            uploads,
            place,
        }
    }

    /// Sends a request with `(name, value)` pairs as headers.
    pub(crate) async fn send(
        &self,
        method: Method,
        uri: &str,
        headers: &[(&str, &str)],
        body: impl Into<Body>,
    ) -> Answer {
        let request = headers
            .iter()
            .fold(
                Request::builder()
                    .method(method.clone())
                    .uri(uri)
                    .header("host", "localhost"),
                |request, (name, value)| request.header(*name, *value),
            )
            .body(body.into())
            .expect("a request");
        let path = request.uri().path().to_owned();
        let response = self
            .router
            .clone()
            .oneshot(request)
            .await
            .expect("never fails");
        let (head, body) = response.into_parts();
        let body = body.collect().await.expect("a whole body").to_bytes();
        description::check(&method, &path, head.status, &head.headers, &body);
        Answer {
            status: head.status,
            headers: head.headers,
            body,
        }
    }

    pub(crate) async fn get(&self, uri: &str) -> Answer {
        self.send(Method::GET, uri, &[], Body::empty()).await
    }

    pub(crate) async fn get_with(&self, uri: &str, headers: &[(&str, &str)]) -> Answer {
        self.send(Method::GET, uri, headers, Body::empty()).await
    }

    pub(crate) async fn post(&self, uri: &str, document: &Value) -> Answer {
        let headers = [("content-type", "application/json")];
        self.send(Method::POST, uri, &headers, document.to_string())
            .await
    }

    pub(crate) async fn delete(&self, uri: &str) -> Answer {
        self.send(Method::DELETE, uri, &[], Body::empty()).await
    }

    /// Submits the small scenario; the plan's address.
    pub(crate) async fn submit(&self) -> String {
        let answer = self.post("/plans", &super::scenario()).await;
        assert_eq!(answer.status, 202, "{answer:?}");
        answer.header("location").to_owned()
    }
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }

    pub(crate) fn header(&self, name: &str) -> &str {
        let value = self
            .headers
            .get(name)
            .unwrap_or_else(|| panic!("no {name} in {:?}", self.headers));
        value.to_str().expect("visible ASCII")
    }

    /// Panics unless the response is a problem of that kind.
    #[track_caller]
    pub(crate) fn expect_problem(&self, status: u16, slug: &str) -> Value {
        assert_eq!(self.status, status, "{self:?}");
        assert_eq!(self.header("content-type"), "application/problem+json");
        let problem = self.json();
        assert_eq!(problem["type"], format!("/problems/{slug}"));
        assert_eq!(problem["status"], status);
        assert_eq!(problem["instance"], self.header("x-request-id"));
        problem
    }
}
