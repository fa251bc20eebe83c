//! The connection, and what the store keeps on the servers.

use std::time::Duration;

use async_nats::connection::State as Connection;
use async_nats::jetstream::context::PublishError;
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::object_store::ObjectStore;
use async_nats::jetstream::publish::PublishAck;
use async_nats::jetstream::stream::{Config, DiscardPolicy, No, Purge, RetentionPolicy, Stream};
use async_nats::jetstream::{self, Context, kv};
use async_nats::{Client, ConnectErrorKind, ConnectOptions, Event};

use super::bucket::Bucket;
use super::election::{Election, outlast};
use super::errors::{failed, failed_by, passes};
use super::lane::Version;
use super::maker::Maker;
use super::settings::Settings;
use crate::job::PlanId;
use crate::store::{IDEMPOTENCY_MS, Options, StoreError, Trouble};

/// The oldest server version that provides what the store promises.
const OLDEST_SERVER: &str = "2.12.0";

/// A server that does not answer for this long is considered lost.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// Room in the stream for jobs beyond the queue's limit: those being run.
const RUNNING: i64 = 4_096;

/// What the servers write for a limit that is not set.
const UNLIMITED: i64 = -1;

/// How long a node counts as alive after its last announcement.
pub(super) const ALIVE: Duration = Duration::from_secs(30);

/// How long a node has to deliver one webhook.
pub(super) const TELLING: Duration = Duration::from_secs(120);

/// All that the store keeps on the servers.
pub(super) struct Servers {
    pub(super) client: Client,
    pub(super) context: Context,
    pub(super) namespace: String,
    /// Steps of plans' lives, by plan.
    pub(super) plans: Stream,
    /// The queue.
    pub(super) jobs: Stream,
    /// Documents, by plan.
    pub(super) documents: kv::Store,
    /// Documents that are too long for a message.
    pub(super) objects: ObjectStore,
    /// What underlies `objects`.
    pub(super) bucket: Bucket,
    /// Idempotency keys.
    pub(super) keys: kv::Store,
    /// Which nodes there are.
    pub(super) nodes: kv::Store,
    /// Which node delivers which webhook.
    pub(super) tellers: kv::Store,
}

/// Connect as the settings say.
///
/// # Errors
/// [`StoreError::Unavailable`].
pub(super) async fn connect(settings: &Settings) -> Result<Client, StoreError> {
    let mut options = ConnectOptions::new()
        .name(concat!("noctule ", env!("CARGO_PKG_VERSION")))
        .connection_timeout(PATIENCE)
        .ping_interval(PATIENCE)
        .request_timeout(Some(PATIENCE))
        // A reader that falls behind is caught up from the stream; it must not cause other readers to lose answers.
        .subscription_capacity(65_536)
        .reconnect_delay_callback(|tries| {
            let longest = Duration::from_secs(2);
            let exponent = u32::try_from(tries.min(8)).unwrap_or(8);
            longest.min(Duration::from_millis(10) * 2_u32.pow(exponent))
        })
        .event_callback(|event| async move {
            match event {
                Event::Connected => tracing::debug!("a NATS server answers"),
                event => tracing::warn!(%event, "the connection to the NATS servers"),
            }
        });
    if let Some(file) = &settings.credentials {
        options = options.credentials_file(file).await.map_err(|error| {
            let what = format!("credentials {}", file.display());
            failed_by(Trouble::NoCredentials, &what, &error)
        })?;
    }
    let servers = settings.address.servers.join(",");
    let client = options
        .connect(&settings.address.servers)
        .await
        .map_err(|error| {
            let what = format!("NATS servers {servers}");
            match error.kind() {
                ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication => {
                    failed_by(Trouble::Forbidden, &what, &error)
                }
                _ => failed(&what, &error),
            }
        })?;
    check_version(&client.server_info().version)?;
    Ok(client)
}

fn check_version(version: &str) -> Result<(), StoreError> {
    let oldest = Version::read(OLDEST_SERVER).expect("it is one");
    if Version::read(version).is_some_and(|version| version >= oldest) {
        return Ok(());
    }
    Err(StoreError::unavailable(format!(
        "the NATS server is of version {version}; the store needs {OLDEST_SERVER} or newer"
    )))
}

impl Servers {
    pub(super) async fn open(settings: &Settings, options: &Options) -> Result<Self, StoreError> {
        let client = connect(settings).await?;
        let context = Self::context(&client);
        context
            .query_account()
            .await
            .map_err(|error| failed("JetStream of the NATS server", &error))?;
        let make = Maker::new(&context, settings);
        let made = outlast(passes, async || {
            Box::pin(Self::made(&client, &make, options)).await
        });
        made.await
    }

    async fn made(
        client: &Client,
        make: &Maker<'_>,
        options: &Options,
    ) -> Result<Self, StoreError> {
        let kept = Duration::from_millis(IDEMPOTENCY_MS.cast_unsigned()) * 2;
        Ok(Self {
            plans: make.stream(plans(options)).await?,
            jobs: make.stream(jobs(options)).await?,
            documents: make.bucket("documents", Duration::ZERO).await?,
            objects: make.objects("objects").await?,
            bucket: make.beneath(make.name("objects")).await?,
            keys: make.bucket("keys", kept).await?,
            nodes: make.bucket("nodes", ALIVE).await?,
            tellers: make.bucket("tellers", TELLING).await?,
            client: client.clone(),
            context: make.context.clone(),
            namespace: make.namespace.to_owned(),
        })
    }

    /// `JetStream` over a connection.
    pub(super) fn context(client: &Client) -> Context {
        let mut context = jetstream::new(client.clone());
        context.set_timeout(PATIENCE);
        context
    }

    /// Write a message; returns what the servers acknowledge.
    pub(super) async fn publish(
        &self,
        subject: String,
        message: PublishMessage,
    ) -> Result<PublishAck, PublishError> {
        self.context.send_publish(subject, message).await?.await
    }

    /// A removal of a plan's steps: of all, unless it is narrowed.
    pub(super) fn purge_steps(&self, id: PlanId) -> Purge<No, No> {
        self.plans.purge().filter(self.subject_of(id))
    }

    pub(super) fn subject_of(&self, id: PlanId) -> String {
        format!("{}.plans.{id}", self.namespace)
    }

    pub(super) fn is_connected(&self) -> bool {
        self.client.connection_state() == Connection::Connected
    }

    /// Retry idempotent work while the servers refuse it with an error that passes with an election. Unlike the
    /// free [`outlast`] it can be awaited on any thread.
    ///
    /// # Errors
    /// The last error of `work`.
    pub(super) async fn outlast<T, F>(&self, work: impl Fn() -> F) -> Result<T, StoreError>
    where
        F: Future<Output = Result<T, StoreError>>,
    {
        let mut election = Election::perhaps();
        loop {
            let done = work().await;
            let passes = matches!(&done, Err(error) if self.is_connected() && passes(error));
            if !passes || !election.goes_on().await {
                return done;
            }
        }
    }
}

/// Steps of plans' lives, as many per plan as its readers are promised.
fn plans(options: &Options) -> Config {
    Config {
        name: "plans".to_owned(),
        max_messages: UNLIMITED,
        max_messages_per_subject: i64::try_from(options.events_kept).unwrap_or(UNLIMITED),
        allow_direct: true,
        ..Config::default()
    }
}

/// The queue: no longer than its limit; each job stays until it is acknowledged.
fn jobs(options: &Options) -> Config {
    let limit = i64::try_from(options.queue_limit).unwrap_or(i64::MAX);
    Config {
        name: "jobs".to_owned(),
        retention: RetentionPolicy::WorkQueue,
        discard: DiscardPolicy::New,
        max_messages: limit.saturating_add(RUNNING),
        max_messages_per_subject: UNLIMITED,
        ..Config::default()
    }
}

/// The plan id in the subject of a step or job: its last part.
pub(super) fn plan_of(subject: &str) -> Option<PlanId> {
    let (_, id) = subject.rsplit_once('.')?;
    PlanId::parse_str(id).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_that_is_too_old_is_refused() {
        assert!(check_version("2.12.0").is_ok());
        assert!(check_version("2.15.1-RC.2").is_ok());
        let refusal = check_version("2.9.10").expect_err("it is too old");
        assert!(refusal.to_string().contains("version 2.9.10"), "{refusal}");
        assert!(check_version("").is_err());
    }
}
