//! The HTTP interface: one table of routes, handlers by resource, one table of problems.
//!
//! Handlers extract, call one thing and convert. Deliberately absent: planning, which happens on the worker's threads
//! (`partial` alone asks the planner how a route would be delivered), and storage, which is behind [`Store`].

mod accept;
mod answers;
pub mod auth;
mod bodies;
mod body;
mod bounds;
mod browser;
mod caller;
mod compression;
mod documents;
mod entity_tags;
mod events;
mod feed;
mod ground;
mod head;
mod header_list;
mod hosts;
mod idempotency;
mod layer;
mod metrics;
mod named;
mod off_thread;
mod pages;
mod params;
mod partial;
mod phase;
mod plans;
mod precondition;
mod prefer;
mod problem;
mod readiness;
mod request_id;
mod retry;
mod sampled;
mod scenarios;
pub mod server;
mod service;
mod shipped;
mod shown;
mod sse;
mod status;
mod terrains;
mod throttle;
mod tickets;
mod time;
mod warm_start;
pub mod webhook;

use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::handler::Handler;
use axum::http::Uri;
use axum::routing::{self, MethodFilter, MethodRouter};
use tokio::sync::watch;
use tower::ServiceBuilder;
use tower::util::{MapRequestLayer, MapResponseLayer};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;

pub use answers::Answers;
pub use bodies::Bodies;
pub use bounds::Bounds;
pub use browser::Origins;
pub use hosts::Hosts;
pub use idempotency::InFlight;
pub use phase::Phase;
pub use readiness::Readiness;
pub use terrains::Terrains;

use crate::scenario::json::Rules;
use crate::store::{Stats, SteadyClock, Store};
use crate::telemetry::Instruments;
use auth::{Access, Gate, Needs, Scope};
use compression::{note_plain, send, shorten_codings, worth_compressing};
use head::HeadCheck;
use layer::Layered;
use problem::Problem;

/// What every handler can access; cheap to clone, since each request does.
#[derive(Clone)]
pub struct AppState(Arc<Parts>);

impl Deref for AppState {
    type Target = Parts;

    fn deref(&self) -> &Parts {
        &self.0
    }
}

/// What the service is made of.
#[derive(Clone)]
pub struct Parts {
    /// Where plans are kept.
    pub store: Arc<dyn Store>,
    /// The rules that scenarios must meet.
    pub rules: Arc<Rules>,
    /// The datasets that scenarios may name, including through `rules`.
    pub terrains: Terrains,
    /// How much may be done at once.
    pub capacity: Capacity,
    /// Idempotency keys that are being worked on.
    pub in_flight: InFlight,
    /// What is proven about plans that are asked for before their end.
    pub bounds: Bounds,
    /// The store's last answer about itself.
    pub readiness: Readiness,
    /// A request's body must be complete after this.
    pub body_timeout: Duration,
    /// How much the bodies of all requests may take.
    pub bodies: Bodies,
    /// How much long answers may take that have not been sent yet.
    pub answers: Answers,
    /// The clock for timestamps and expiry of plans.
    pub clock: Arc<SteadyClock>,
    /// Who may do what.
    pub access: Access,
    /// How ends of plans are reported; `None` when they are not.
    pub webhooks: Option<webhook::Settings>,
    /// Pages of other origins that may use this service.
    pub cors: Origins,
    /// Names that this service answers to.
    pub hosts: Hosts,
    /// The stage of the service between its start and its end.
    pub phase: watch::Receiver<Phase>,
    /// What is reported to the operator.
    pub instruments: Arc<Instruments>,
}

/// How much the service does at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacity {
    /// Plans run at the same time by this node; other nodes of its store may run more.
    pub workers: usize,
    /// Maximum number of waiting plans.
    pub queue: usize,
}

impl Capacity {
    /// Plans run at the same time by all nodes of a store, at least 1: accepted plans are expected to be run by
    /// somebody.
    fn all_workers(self, stats: Option<&Stats>) -> usize {
        let of_all = stats.and_then(|stats| stats.slots);
        of_all.unwrap_or(self.workers).max(1)
    }
}

/// One row of the table of routes.
pub struct Route {
    /// Method of the request.
    pub method: &'static str,
    /// With `{id}` for a plan's id and `{name}` for a dataset's name.
    pub path: &'static str,
    /// What it requires of its caller.
    pub needs: Needs,
    guarded: Box<dyn FnOnce(Layered<Gate>) -> MethodRouter<AppState>>,
}

/// A method by its name, and as the router has it.
type Verb = (&'static str, MethodFilter);

/// All routes, each with what it requires of its caller.
#[must_use]
pub fn routes() -> Vec<Route> {
    use Needs::{Nothing, Ticket};
    const READ: Needs = Needs::Scope(Scope::Read);
    const PLAN: Needs = Needs::Scope(Scope::Plan);
    const METRICS: Needs = Needs::Scope(Scope::Metrics);
    const GET: Verb = ("GET", MethodFilter::GET);
    const POST: Verb = ("POST", MethodFilter::POST);
    const PUT: Verb = ("PUT", MethodFilter::PUT);
    const DELETE: Verb = ("DELETE", MethodFilter::DELETE);
    vec![
        on(POST, "/plans", PLAN, plans::submit),
        on(GET, "/plans", READ, plans::list),
        on(GET, "/plans/{id}", READ, plans::show),
        on(DELETE, "/plans/{id}", PLAN, plans::delete),
        on(POST, "/plans/{id}/cancel", PLAN, plans::cancel),
        on(GET, "/plans/{id}/result", READ, documents::result),
        on(GET, "/plans/{id}/scenario", READ, documents::scenario),
        on(GET, "/plans/{id}/events", Ticket, events::follow),
        on(POST, "/plans/{id}/tickets", READ, tickets::issue),
        on(POST, "/scenarios:convert", PLAN, scenarios::convert),
        on(GET, "/terrains", READ, terrains::list),
        on(GET, "/terrains/{name}", READ, terrains::show),
        // The handler decides who may change a dataset.
        on(PUT, "/terrains/{name}", PLAN, terrains::put),
        on(DELETE, "/terrains/{name}", PLAN, terrains::delete),
        on(
            GET,
            "/terrains/{name}/elevations",
            READ,
            terrains::elevations,
        ),
        on(POST, "/scenarios:ground", READ, ground::sample),
        on(GET, "/scenarios", Nothing, shipped::list),
        on(GET, "/scenarios/{name}", Nothing, shipped::show),
        on(GET, "/algorithms", Nothing, service::algorithms),
        on(GET, "/limits", Nothing, service::limits),
        on(GET, "/version", Nothing, service::version),
        on(GET, "/livez", Nothing, service::livez),
        on(GET, "/readyz", Nothing, service::readyz),
        on(GET, "/metrics", METRICS, metrics::show),
        on(GET, "/openapi.yaml", Nothing, pages::openapi_yaml),
        on(GET, "/openapi.json", Nothing, pages::openapi_json),
        on(GET, "/", Nothing, pages::front::front),
        on(GET, "/page/{file}", Nothing, pages::front::file),
        on(GET, "/page/vendor/{file}", Nothing, pages::front::vendored),
        on(GET, "/docs", Nothing, pages::docs),
        on(GET, "/docs/{guide}", Nothing, pages::guides::guide),
        on(GET, "/problems/{slug}", Nothing, pages::problem),
    ]
}

/// The service: all routes, every refusal a problem, every answer with its request's id.
pub fn router(parts: Parts) -> Router {
    let nowhere = async |uri: Uri| Problem::no_such_resource(&uri);
    assemble(parts, routes(), nowhere)
}

/// A node that only runs plans: the routes for its operators, and none about plans.
pub fn upkeep_router(parts: Parts) -> Router {
    const UPKEEP: [&str; 4] = ["/livez", "/readyz", "/metrics", "/version"];
    let mut routes = routes();
    routes.retain(|route| UPKEEP.contains(&route.path));
    let nowhere = async |uri: Uri| Problem::not_served_here(&uri);
    assemble(parts, routes, nowhere)
}

/// These routes, and the answer where there is none.
fn assemble<T: 'static>(
    parts: Parts,
    routes: Vec<Route>,
    nowhere: impl Handler<T, AppState>,
) -> Router {
    let (access, cors) = (parts.access.clone(), parts.cors.clone());
    let (hosts, answers) = (parts.hosts.clone(), parts.answers.clone());
    let instruments = parts.instruments.clone();
    let router = routes
        .into_iter()
        .fold(Router::new(), |router, route| {
            instruments.metrics.served(route.method, route.path);
            let gate = Gate::new(access.clone(), route.needs);
            router.route(route.path, (route.guarded)(Layered(gate)))
        })
        .method_not_allowed_fallback(async || Problem::MethodNotAllowed)
        .fallback(nowhere)
        .with_state(AppState(Arc::new(parts)));
    wrap(router, &cors, hosts, answers, instruments)
}

/// The layers around every handler.
fn wrap(
    router: Router,
    cors: &Origins,
    hosts: Hosts,
    answers: Answers,
    instruments: Arc<Instruments>,
) -> Router {
    // The outermost first. One stack, because the router boxes each layer it is given anew for each request.
    let layers = ServiceBuilder::new()
        .layer(Layered(request_id::Assign(instruments)))
        .layer(cors.layer())
        .layer(CatchPanicLayer::custom(problem::after_panic))
        .layer(MapResponseLayer::new(move |answer| send(answer, &answers)))
        .layer(MapRequestLayer::new(shorten_codings))
        .layer(CompressionLayer::new().compress_when(worth_compressing()))
        .layer(MapResponseLayer::new(note_plain))
        .layer(Layered(HeadCheck(hosts)));
    router.layer(layers)
}

/// A row. The gate wraps the handler: as a layer of the route it would be one more box allocated for each request.
fn on<H: Handler<T, AppState>, T: 'static>(
    (method, filter): Verb,
    path: &'static str,
    needs: Needs,
    handler: H,
) -> Route {
    Route {
        method,
        path,
        needs,
        guarded: Box::new(move |gate| routing::on(filter, handler.layer(gate))),
    }
}

#[cfg(test)]
mod tests {
    use axum::body::{Body, to_bytes};
    use axum::extract::Request;
    use tower::ServiceExt as _;

    use super::*;

    async fn breaks() -> &'static str {
        panic!("on purpose")
    }

    #[tokio::test]
    async fn a_panic_becomes_a_problem_without_its_message() {
        let broken = Router::new().route("/", routing::get(breaks));
        let request = Request::get("/")
            .header("host", "localhost")
            .header("x-request-id", "caller-1")
            .body(Body::empty());
        let answers = Answers::new(1 << 20, Duration::from_secs(60));
        let (origins, hosts) = (Origins::default(), Hosts::any());
        let answer = wrap(broken, &origins, hosts, answers, Arc::default())
            .oneshot(request.expect("a request"))
            .await
            .expect("an answer");
        assert_eq!(answer.status(), 500);
        assert_eq!(answer.headers()["x-request-id"], "caller-1");
        let body = to_bytes(answer.into_body(), 1000)
            .await
            .expect("a whole body");
        let problem: serde_json::Value = serde_json::from_slice(&body).expect("JSON");
        assert_eq!(problem["type"], "/problems/internal");
        assert_eq!(problem["instance"], "caller-1");
        assert!(!problem.to_string().contains("on purpose"), "{problem}");
    }
}
