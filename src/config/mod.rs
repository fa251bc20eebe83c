//! The operator's settings, as plain structs whose parts are passed down.
//!
//! A setting is a field here with its default, and a row in `settings`; its flag, its variable and its key in the file
//! follow from the row. Where several are given, the flag wins, then the variable, then the file. Deliberately absent:
//! what a setting does.

mod address;
mod backend;
mod collector;
mod file;
mod filter;
mod flags;
mod layers;
mod misspelt;
mod origin;
mod print;
mod setting;
mod settings;
mod value;

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

pub use address::Address;
pub use backend::{Backend, Replicas, Role};
pub use collector::{Endpoint, Headers};
pub use filter::Filter;
pub use flags::Flags;
pub use layers::{Loaded, load};
pub use misspelt::misspelt;
pub use origin::Origin;
pub use value::LogFormat;

use crate::scenario::limits::Limits;

/// How the service runs. The defaults are in [`Config::default`].
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Address and port to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Directory for the plans; `None` when none is named and the user has no home.
    pub data_dir: Option<PathBuf>,
    /// Directory of the operator's own datasets; `None` for none.
    pub terrain_dir: Option<PathBuf>,
    /// Plans run concurrently.
    pub workers: usize,
    /// Plans that may wait.
    pub queue: usize,
    /// Time from a signal to the exit.
    pub grace: Duration,
    /// Where plans are kept.
    pub store: Backend,
    /// Credentials of this node for the servers of a shared store; a file as `nsc` writes it.
    pub store_credentials: Option<PathBuf>,
    /// How many copies the servers of a shared store keep.
    pub store_replicas: Replicas,
    /// How long a run belongs to a node after its last renewal.
    pub store_lease: Duration,
    /// What this node does for the others that share its store.
    pub role: Role,
    /// The keys of those who may use the service; `None` when it is open to everybody who can reach it.
    pub keys_file: Option<PathBuf>,
    /// Whether it may be reachable from other machines without keys.
    pub allow_anonymous: bool,
    /// Origins of pages on other sites that may use it.
    pub cors_origins: Vec<Origin>,
    /// The log filter.
    pub log: Filter,
    /// How log lines are written.
    pub log_format: LogFormat,
    /// Where traces are sent; `None` for nowhere.
    pub otlp_endpoint: Option<Endpoint>,
    /// Headers sent with the traces.
    pub otlp_headers: Headers,
    /// Settings of connections and requests.
    pub http: Http,
    /// Settings of webhooks, which notify callers when plans end.
    pub webhook: Webhook,
    /// How long plans are kept.
    pub retention: Retention,
    /// Upper limits on a scenario.
    pub limits: Limits,
}

/// Settings of connections and requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Http {
    /// A request's head must be complete after this; also how long a connection may idle.
    pub head_timeout: Duration,
    /// A request's body must be complete after this; with `head_timeout`, also how long an answer may be left unread.
    pub body_timeout: Duration,
    /// Bytes that the bodies of all requests may take at once.
    pub bodies_bytes: usize,
    /// Bytes that long answers may take at once that have not been sent yet.
    pub answers_bytes: usize,
    /// Connections open at once; more wait in the listener's backlog.
    pub max_connections: usize,
    /// Event streams open at once.
    pub streams: usize,
    /// Event streams open at once of the owner of a key.
    pub streams_per_key: usize,
}

/// Settings of webhooks, which notify callers when plans end.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Webhook {
    /// File with the secret that is shared with receivers; `None` disables webhooks.
    pub secret_file: Option<PathBuf>,
    /// Whether receivers may be outside the public internet, and without TLS.
    pub allow_private: bool,
}

/// How long ended plans are kept: until the first of these limits is reached; 0 for no limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Retention {
    /// Time since the end of a plan.
    pub age: Duration,
    /// Number of ended plans.
    pub plans: u64,
    /// Bytes of their documents and events.
    pub bytes: u64,
    /// Number of events of each plan.
    pub events: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)),
            data_dir: directories::ProjectDirs::from("", "", "noctule")
                .map(|directories| directories.data_dir().to_owned()),
            terrain_dir: None,
            workers: std::thread::available_parallelism().map_or(1, Into::into),
            queue: 1000,
            grace: Duration::from_secs(10),
            store: Backend::default(),
            store_credentials: None,
            store_replicas: Replicas::default(),
            store_lease: Duration::from_secs(30),
            role: Role::default(),
            keys_file: None,
            allow_anonymous: false,
            cors_origins: Vec::new(),
            log: Filter::default(),
            log_format: LogFormat::Text,
            otlp_endpoint: None,
            otlp_headers: Headers::default(),
            http: Http::default(),
            webhook: Webhook::default(),
            retention: Retention::default(),
            limits: Limits::default(),
        }
    }
}

impl Default for Http {
    fn default() -> Self {
        Self {
            head_timeout: Duration::from_secs(30),
            body_timeout: Duration::from_secs(30),
            bodies_bytes: 256 << 20,
            answers_bytes: 256 << 20,
            max_connections: 20_000,
            streams: 10_000,
            streams_per_key: 1_000,
        }
    }
}

impl Default for Retention {
    fn default() -> Self {
        Self {
            age: Duration::from_secs(7 * 24 * 60 * 60),
            plans: 100_000,
            bytes: 10 << 30,
            events: 10_000,
        }
    }
}
