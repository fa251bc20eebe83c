//! The bare client: the calls that a plan costs, and nothing else.

use std::time::Instant;

use anyhow::Context as _;
use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull, push};
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::stream::{Config, DiscardPolicy, RetentionPolicy, Stream};
use async_nats::jetstream::{self, Context, kv};
use bytes::Bytes;
use futures_util::stream::{self, StreamExt as _, TryStreamExt as _};
use tokio::task::JoinSet;
use uuid::Uuid;

use super::Took;
use super::work::{CALLERS, NODES, RESULT, SCENARIO, WORKERS};
use crate::store::jetstream::Settings;

/// Bytes of a step, about as many as the store writes for such plans.
const STEP: usize = 900;

#[derive(Clone)]
struct Bare {
    context: Context,
    namespace: String,
    plans: Stream,
    jobs: Stream,
    documents: kv::Store,
}

/// How fast the calls of plans are answered: first those for their acceptance, then those for their runs.
pub(super) async fn measure(settings: Settings, plans: u32) -> anyhow::Result<Took> {
    let bare = Bare::open(&settings).await?;
    let mut readers = JoinSet::new();
    for _ in 0..NODES {
        readers.spawn(bare.clone().read());
    }
    let began = Instant::now();
    stream::iter((0..plans).map(Ok))
        .try_for_each_concurrent(CALLERS, |_| bare.accept())
        .await?;
    let accepting = began.elapsed();
    let config = pull::Config {
        durable_name: Some("lane".to_owned()),
        ack_policy: AckPolicy::Explicit,
        max_ack_pending: 65_536,
        ..pull::Config::default()
    };
    let lane = bare.jobs.create_consumer(config).await?;
    let began = Instant::now();
    let mut workers = JoinSet::new();
    for _ in 0..WORKERS {
        workers.spawn(work(bare.clone(), lane.clone()));
    }
    while let Some(worker) = workers.join_next().await {
        worker??;
    }
    let running = began.elapsed();
    remove(&settings).await?;
    Ok(Took {
        accepting,
        running,
        plans,
    })
}

async fn work(bare: Bare, lane: PullConsumer) -> anyhow::Result<()> {
    while let Some(job) = lane.fetch().max_messages(1).messages().await?.next().await {
        let job = job.map_err(|error| anyhow::anyhow!(error)).context("job")?;
        let id = job
            .subject
            .as_str()
            .rsplit('.')
            .next()
            .unwrap_or_default()
            .to_owned();
        let (started, document) = tokio::join!(
            bare.step(&id, 1),
            bare.documents.get(format!("{id}.scenario"))
        );
        let started = started?;
        document?;
        let result = vec![b'r'; RESULT].into();
        bare.documents.put(format!("{id}.result"), result).await?;
        bare.step(&id, started).await?;
        job.ack().await.map_err(|error| anyhow::anyhow!(error))?;
    }
    Ok(())
}

impl Bare {
    async fn open(settings: &Settings) -> anyhow::Result<Self> {
        let context = context(settings).await?;
        let namespace = settings.address.namespace.clone();
        let stream = |what: &str, retention, discard| Config {
            name: format!("{namespace}-{what}"),
            subjects: vec![format!("{namespace}.{what}.>")],
            retention,
            discard,
            allow_direct: true,
            num_replicas: settings.replicas,
            ..Config::default()
        };
        let plans = stream("plans", RetentionPolicy::Limits, DiscardPolicy::Old);
        let plans = context.create_stream(plans).await?;
        let jobs = stream("jobs", RetentionPolicy::WorkQueue, DiscardPolicy::New);
        let jobs = context.create_stream(jobs).await?;
        let documents = kv::Config {
            bucket: format!("{namespace}-documents"),
            history: 1,
            num_replicas: settings.replicas,
            ..kv::Config::default()
        };
        let documents = context.create_key_value(documents).await?;
        Ok(Self {
            context,
            namespace,
            plans,
            jobs,
            documents,
        })
    }

    async fn accept(&self) -> anyhow::Result<()> {
        let id = Uuid::now_v7();
        let job = PublishMessage::build().message_id(id.to_string());
        let enqueued = async {
            let subject = format!("{}.jobs.lane.{id}", self.namespace);
            self.context.send_publish(subject, job).await?.await
        };
        let document = vec![b's'; SCENARIO].into();
        let written = self.documents.put(format!("{id}.scenario"), document);
        let (enqueued, written) = tokio::join!(enqueued, written);
        enqueued?;
        written?;
        self.step(&id.to_string(), 0).await?;
        Ok(())
    }

    /// Read all steps as they come, which each node does; never ends.
    async fn read(self) -> anyhow::Result<()> {
        let config = push::OrderedConfig {
            deliver_subject: self.context.client().new_inbox(),
            filter_subject: format!("{}.plans.*", self.namespace),
            ..push::OrderedConfig::default()
        };
        let mut steps = self.plans.create_consumer(config).await?.messages().await?;
        while let Some(step) = steps.next().await {
            step?;
        }
        Ok(())
    }

    /// The first step expects no predecessor; for the others the server must check all the same.
    async fn step(&self, id: &str, expected: u64) -> anyhow::Result<u64> {
        let subject = format!("{}.plans.{id}", self.namespace);
        let mut step = PublishMessage::build().payload(Bytes::from(vec![b'p'; STEP]));
        if expected != 1 {
            step = step.expected_last_subject_sequence(expected);
        }
        Ok(self
            .context
            .send_publish(subject, step)
            .await?
            .await?
            .sequence)
    }
}

async fn context(settings: &Settings) -> anyhow::Result<Context> {
    let client = async_nats::connect(&settings.address.servers).await;
    let client =
        client.with_context(|| format!("NATS servers {}", settings.address.servers.join(",")))?;
    Ok(jetstream::new(client))
}

/// Remove all streams and buckets of a namespace.
pub(super) async fn remove(settings: &Settings) -> anyhow::Result<()> {
    let context = context(settings).await?;
    let own = format!("{}-", settings.address.namespace);
    let names: Vec<_> = context.stream_names().try_collect().await?;
    for name in names {
        if name
            .trim_start_matches("KV_")
            .trim_start_matches("OBJ_")
            .starts_with(&own)
        {
            context.delete_stream(&name).await?;
        }
    }
    Ok(())
}
