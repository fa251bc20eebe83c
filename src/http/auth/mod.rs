//! Who the caller is, and what they may do.
//!
//! One gate before each route that is not public: it takes the caller's key or ticket, and puts a `Caller` into the
//! request. Whose plan is whose is decided there and in the store, not here. Deliberately absent: names of people,
//! passwords, sessions, any key in readable form.

mod allowance;
mod gate;
mod key_file;
mod keys;
mod new_key;
mod rate;
mod scope;
mod streams;
mod ticket;

use std::sync::Arc;
use std::time::Duration;

use axum::http::Uri;
use jiff::Timestamp;
use tokio::sync::watch;

pub use keys::{Key, Keys, KeysError};
pub use new_key::key as fresh_key;
pub use rate::Rate;
pub use scope::{Needs, Scope};

pub(super) use allowance::Allowance;
pub(super) use gate::Gate;
pub(super) use keys::{Digest, holds_a_key};
pub(super) use streams::{Permit, TooMany};

use super::caller::Caller;
use super::params::brings_a_key;
use super::problem::Problem;
use crate::config;
use crate::job::{Owner, PlanId};
use crate::store::Clock;
use rate::Buckets;
use streams::Streams;

/// How often a stream checks whether its key has expired.
const EXPIRY_LOOK: Duration = Duration::from_secs(60);

/// The keys in force, and what their holders are using.
#[derive(Clone)]
pub struct Access(Arc<Inner>);

struct Inner {
    keys: watch::Sender<Option<Arc<Keys>>>,
    buckets: Buckets,
    streams: Arc<Streams>,
    settings: Settings,
    /// Decides whether keys and tickets have expired.
    clock: Clock,
}

/// Limits on callers apart from those in their keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Event streams open at once.
    pub streams: usize,
    /// Event streams open at once per key owner.
    pub streams_per_key: usize,
    /// How long a ticket opens streams.
    pub ticket_life: Duration,
}

/// Why a caller is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unauthorized {
    /// Neither a key nor a ticket came.
    Nothing,
    /// What was sent is not a valid key.
    NoKey,
    /// The key was valid once.
    Expired,
    /// What was sent is not a valid ticket for this plan.
    NoTicket,
}

impl Unauthorized {
    /// For people.
    pub(super) fn detail(self) -> &'static str {
        match self {
            Self::Nothing => "no key was sent; send one as Authorization: Bearer",
            Self::NoKey => "what was sent is no key of this service",
            Self::Expired => "the key has expired; ask the operator for a new one",
            Self::NoTicket => {
                "what was sent is no ticket for this plan, or its time is over; POST /plans/{id}/tickets gives one"
            }
        }
    }
}

impl Access {
    /// With these keys, which expire by this clock; without any, everybody may do everything.
    #[must_use]
    pub fn new(keys: Option<Keys>, settings: Settings, clock: Clock) -> Self {
        Self(Arc::new(Inner {
            keys: watch::Sender::new(keys.map(Arc::new)),
            buckets: Buckets::default(),
            streams: Streams::new(settings.streams, settings.streams_per_key),
            settings,
            clock,
        }))
    }

    fn now(&self) -> Timestamp {
        Timestamp::from_millisecond((self.0.clock)()).unwrap_or(Timestamp::MAX)
    }

    /// Put these keys in force. Whatever was opened with other keys ends.
    pub fn replace(&self, keys: Keys) {
        self.0.buckets.keep(&keys.names());
        self.0.keys.send_replace(Some(Arc::new(keys)));
    }

    /// Whether keys are required.
    #[must_use]
    pub fn is_guarded(&self) -> bool {
        self.0.keys.borrow().is_some()
    }

    /// The limits on callers.
    #[must_use]
    pub fn settings(&self) -> Settings {
        self.0.settings
    }

    /// A ticket for the plan's events, and when it expires.
    pub(super) fn ticket(
        &self,
        plan: PlanId,
        caller: &Caller,
    ) -> Result<(String, Timestamp), Unauthorized> {
        let keys = self.0.keys.borrow().clone();
        let key = match (caller.key, &keys) {
            // The key may have been withdrawn since the caller was admitted.
            (Some(key), Some(keys)) => Some(keys.with_digest(&key).ok_or(Unauthorized::NoKey)?),
            _ => None,
        };
        let life = self.0.settings.ticket_life;
        let until = self.now().checked_add(life).unwrap_or(Timestamp::MAX);
        let until = key
            .and_then(|key| key.expires)
            .map_or(until, |end| end.min(until));
        Ok((ticket::issue(plan, key, until.as_millisecond()), until))
    }

    /// Permission to open one more stream.
    pub(super) fn open_stream(&self, owner: Option<&Owner>) -> Result<Permit, TooMany> {
        self.0.streams.open(owner.cloned())
    }

    /// Resolves when the key is withdrawn, expires or no longer has this scope; never for callers without a key.
    pub(super) async fn withdrawn(&self, key: Option<Digest>, scope: Scope) {
        match key {
            // Boxed so that streams without a key need no room for this.
            Some(key) => Box::pin(self.withdrawn_from(key, scope)).await,
            None => std::future::pending().await,
        }
    }

    async fn withdrawn_from(&self, key: Digest, scope: Scope) {
        let mut keys = self.0.keys.subscribe();
        loop {
            let now = self.now();
            let holds = keys.borrow_and_update().as_ref().is_some_and(|keys| {
                let key = keys.with_digest(&key);
                key.is_some_and(|key| !key.has_expired(now) && key.may(scope))
            });
            if !holds {
                return;
            }
            tokio::select! {
                _ = keys.changed() => {}
                () = tokio::time::sleep(EXPIRY_LOOK) => {}
            }
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        let config::Http {
            streams,
            streams_per_key,
            ..
        } = config::Http::default();
        Self {
            streams,
            streams_per_key,
            ticket_life: Duration::from_secs(600),
        }
    }
}

/// Checked on every route: proxies, browsers and logs record addresses, so a key in one has been given away.
pub(super) fn refuse_key_in_url(uri: &Uri) -> Result<(), Problem> {
    if brings_a_key(uri) {
        tracing::warn!(
            "a key came in a URL and may have been written down on its way; withdraw it"
        );
        return Err(Problem::KeyInUrl);
    }
    Ok(())
}
