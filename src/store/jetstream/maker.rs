//! The streams and buckets on the servers, created where missing and brought to the wanted configuration.

use std::collections::HashMap;
use std::error::Error;
use std::time::Duration;

use async_nats::jetstream::object_store::ObjectStore;
use async_nats::jetstream::stream::{Config, StorageType, Stream};
use async_nats::jetstream::{Context, kv, object_store};
use tokio::time::{sleep, timeout};

use super::bucket::Bucket;
use super::errors::failed;
use super::lane::Version;
use super::settings::Settings;
use crate::store::StoreError;

/// From this version on, servers allow a stream a thousand consumers unless it says how many.
const LIMITING_SERVER: &str = "2.15.0";

/// How many consumers each stream may have: there is one for every owner and size of plans, and readers that break off
/// leave theirs behind for a while.
const MOST_CONSUMERS: i32 = 100_000;

/// How often it is looked whether a change that is not answered yet has been made all the same.
const LOOK: Duration = Duration::from_millis(100);

/// How long it is waited for the answer whether something is there, when asking again costs nothing.
const SOON: Duration = Duration::from_secs(1);

/// Creates what is missing on the servers.
pub(super) struct Maker<'a> {
    pub(super) context: &'a Context,
    pub(super) namespace: &'a str,
    replicas: usize,
}

impl<'a> Maker<'a> {
    /// For the namespace in the settings.
    pub(super) fn new(context: &'a Context, settings: &'a Settings) -> Self {
        Self {
            context,
            namespace: &settings.address.namespace,
            replicas: settings.replicas,
        }
    }

    pub(super) fn name(&self, what: &str) -> String {
        format!("{}-{what}", self.namespace)
    }

    /// Create a stream, or bring an existing one to the wanted configuration; never to fewer replicas.
    pub(super) async fn stream(&self, wanted: Config) -> Result<Stream, StoreError> {
        let name = self.name(&wanted.name);
        let what = || format!("stream {name}");
        let mut config = Config {
            subjects: vec![format!("{}.{}.>", self.namespace, wanted.name)],
            name: name.clone(),
            storage: StorageType::File,
            num_replicas: self.replicas,
            metadata: HashMap::new(),
            ..wanted
        };
        let find = || self.context.get_stream(&name);
        let make = self.context.create_stream(config.clone());
        let mut stream = found_or_made(&what(), find, make).await?;
        let info = stream
            .info()
            .await
            .map_err(|error| failed(&what(), &error))?;
        let there = &info.config;
        if there.num_replicas > self.replicas {
            tracing::warn!(
                stream = name,
                replicas = there.num_replicas,
                "more replicas than asked for"
            );
            config.num_replicas = there.num_replicas;
        }
        config.max_consumers = there.max_consumers;
        self.adjust(there, &config, |one| {
            (
                one.num_replicas,
                one.max_messages,
                one.max_messages_per_subject,
                one.retention,
                one.discard,
            )
        })
        .await?;
        self.admit(&config).await;
        Ok(stream)
    }

    pub(super) async fn bucket(
        &self,
        what: &str,
        max_age: Duration,
    ) -> Result<kv::Store, StoreError> {
        let config = kv::Config {
            bucket: self.name(what),
            history: 1,
            max_age,
            num_replicas: self.replicas,
            ..kv::Config::default()
        };
        let what = format!("bucket {}", config.bucket);
        let name = config.bucket.clone();
        let find = || self.context.get_key_value(&name);
        let make = self.context.create_key_value(config);
        let there = found_or_made(&what, find, make).await?;
        self.suit(&there.stream).await?;
        Ok(there)
    }

    pub(super) async fn objects(&self, what: &str) -> Result<ObjectStore, StoreError> {
        let config = object_store::Config {
            bucket: self.name(what),
            num_replicas: self.replicas,
            ..object_store::Config::default()
        };
        let what = format!("object store {}", config.bucket);
        let bucket = config.bucket.clone();
        let find = || self.context.get_object_store(&bucket);
        let make = self.context.create_object_store(config);
        let there = found_or_made(&what, find, make).await?;
        self.suit(&self.beneath(bucket).await?.stream).await?;
        Ok(there)
    }

    /// What underlies the object store of this name.
    pub(super) async fn beneath(&self, name: String) -> Result<Bucket, StoreError> {
        let stream = format!("OBJ_{name}");
        let found = self.context.get_stream(&stream).await;
        let stream = found.map_err(|error| failed(&format!("stream {stream}"), &error))?;
        Ok(Bucket { name, stream })
    }

    /// Bring the stream underlying a bucket to the wanted number of replicas; never to fewer.
    async fn suit(&self, beneath: &Stream) -> Result<(), StoreError> {
        let there = &beneath.cached_info().config;
        let config = Config {
            num_replicas: there.num_replicas.max(self.replicas),
            ..there.clone()
        };
        self.adjust(there, &config, |one| one.num_replicas).await?;
        self.admit(&config).await;
        Ok(())
    }

    /// Let a stream have more consumers than the servers' default. An account may allow fewer; the store does with
    /// these.
    async fn admit(&self, there: &Config) {
        let limiting = Version::read(LIMITING_SERVER).expect("it is one");
        let version = Version::read(&self.context.client().server_info().version);
        if there.max_consumers > 0 || version.is_none_or(|version| version < limiting) {
            return;
        }
        let admitting = Config {
            max_consumers: MOST_CONSUMERS,
            ..there.clone()
        };
        let adjusted = self
            .adjust(there, &admitting, |one| one.max_consumers)
            .await;
        if let Err(error) = adjusted {
            tracing::warn!(%error, stream = there.name, "no more consumers than the servers' default");
        }
    }

    /// Bring a stream from one configuration to the wanted one, if they differ in the `part` that matters. When two nodes
    /// do so at once, the servers may answer only one of them: the other sees that it is done.
    async fn adjust<T: PartialEq>(
        &self,
        there: &Config,
        wanted: &Config,
        part: impl Fn(&Config) -> T,
    ) -> Result<(), StoreError> {
        if part(there) == part(wanted) {
            return Ok(());
        }
        let what = || format!("stream {}", wanted.name);
        let is_done = async {
            loop {
                sleep(LOOK).await;
                let found = timeout(SOON, self.context.get_stream(&wanted.name)).await;
                if let Ok(Ok(stream)) = found
                    && part(&stream.cached_info().config) == part(wanted)
                {
                    return;
                }
            }
        };
        tokio::select! {
            updated = self.context.update_stream(wanted) => {
                updated.map_err(|error| failed(&what(), &error)).map(drop)
            }
            () = is_done => Ok(()),
        }
    }
}

/// What is there, or else what is made. Another node may make it at the same moment, and change at once what this one
/// would not; the servers may leave this one without an answer then.
async fn found_or_made<T, Found, NotFound, NotMade>(
    what: &str,
    find: impl Fn() -> Found,
    make: impl Future<Output = Result<T, NotMade>>,
) -> Result<T, StoreError>
where
    Found: Future<Output = Result<T, NotFound>>,
    NotMade: Error + 'static,
{
    // Of what is just being made the servers may say nothing at all.
    let find_soon = || timeout(SOON, find());
    if let Ok(Ok(there)) = find_soon().await {
        return Ok(there);
    }
    let found_meanwhile = async {
        loop {
            sleep(LOOK).await;
            if let Ok(Ok(there)) = find_soon().await {
                return there;
            }
        }
    };
    let made = tokio::select! {
        made = make => made,
        there = found_meanwhile => return Ok(there),
    };
    match made {
        Ok(made) => Ok(made),
        Err(error) => find().await.map_err(|_| failed(what, &error)),
    }
}
