//! Which nodes exist, and what they can do.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use async_nats::jetstream::kv::Operation;
use futures_util::StreamExt as _;
use serde::{Deserialize, Serialize};

use super::JetStream;
use super::connect::ALIVE;
use super::errors::failed;
use crate::store::StoreError;

/// What a node announces about itself.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Node {
    /// Version of its program; it runs no plans of newer ones.
    engine_version: String,
    /// Plans that it runs at a time.
    slots: usize,
}

impl JetStream {
    /// Announce this node. A small durable write, like any other.
    pub(super) async fn announce(&self) -> Result<(), StoreError> {
        let node = Node {
            engine_version: env!("CARGO_PKG_VERSION").to_owned(),
            slots: self.settings.slots,
        };
        let node = serde_json::to_vec(&node).map_err(|error| failed("this node", &error))?;
        let said = self
            .servers
            .nodes
            .put(self.node.to_string(), node.into())
            .await;
        said.map_err(|error| failed("this node", &error))?;
        Ok(())
    }

    /// Keep announcing this node, and count the announcements of others.
    pub(super) async fn keep_announcing(self: Arc<Self>) {
        loop {
            if let Err(error) = self.count_nodes().await {
                tracing::debug!(%error, "nodes were not counted");
            }
            tokio::time::sleep(self.next_announcement()).await;
            if let Err(error) = self.look_at_streams().await {
                tracing::debug!(%error, "not all streams are there");
            }
            if let Err(error) = self.announce().await {
                tracing::debug!(%error, "this node was not announced");
            } else if let Err(error) = self.compare_clocks().await {
                tracing::debug!(%error, "the clock was not compared with the servers'");
            }
        }
    }

    /// See how far this node's clock is to be relied on, once the plans are known.
    pub(super) async fn judge_clock(&self) -> Result<(), StoreError> {
        self.options.has_seen(self.view.known().newest_ms());
        self.servers.outlast(|| self.compare_clocks()).await
    }

    /// Compare this node's clock with the time at which the servers wrote its announcement, just now.
    pub(super) async fn compare_clocks(&self) -> Result<(), StoreError> {
        let now_ms = (self.options.clock)();
        let entry = self.servers.nodes.entry(self.node.to_string()).await;
        let Some(entry) = entry.map_err(|error| failed("this node", &error))? else {
            return Ok(());
        };
        let written_ms = entry.created.unix_timestamp_nanos() / 1_000_000;
        let written_ms = i64::try_from(written_ms).unwrap_or(i64::MAX);
        let was_apart = self.apart_ms().is_some();
        let ahead_ms = now_ms.saturating_sub(written_ms);
        self.ahead_ms.store(ahead_ms, Ordering::Relaxed);
        match (was_apart, self.apart_ms().is_some()) {
            (false, true) => tracing::warn!(
                ahead_ms,
                "the clock is not that of the servers; nothing is removed for its age"
            ),
            (true, false) => tracing::info!(ahead_ms, "the clock is that of the servers again"),
            _ => {}
        }
        Ok(())
    }

    /// How far this node's clock is ahead of the servers', while that is further than allowed.
    pub(super) fn apart_ms(&self) -> Option<i64> {
        let ahead_ms = self.ahead_ms.load(Ordering::Relaxed);
        let most = self.options.most_apart_ms?;
        (ahead_ms.saturating_abs() > most).then_some(ahead_ms)
    }

    /// The time by which things expire when it is `now_ms` here: none does by a clock that may be wrong.
    pub(super) fn expiry_ms_at(&self, now_ms: i64) -> i64 {
        if self.apart_ms().is_some() {
            i64::MIN
        } else {
            self.options.expiry_ms(now_ms)
        }
    }

    /// The time by which things expire now.
    pub(super) fn expiry_ms(&self) -> i64 {
        self.expiry_ms_at((self.options.clock)())
    }

    /// Nodes that were started together do not all announce themselves at once.
    fn next_announcement(&self) -> Duration {
        let spread = Duration::from_millis(u64::from(self.node.as_bytes()[15]) * 4);
        ALIVE / 4 + spread
    }

    pub(super) async fn count_nodes(&self) -> Result<(), StoreError> {
        let what = "the other nodes";
        let announced = &self.servers.nodes;
        let names = announced.keys().await;
        let mut names = names.map_err(|error| failed(what, &error))?;
        let (mut slots, mut nodes) = (0, 0);
        while let Some(name) = names.next().await {
            let name = name.map_err(|error| failed(what, &error))?;
            let entry = announced.entry(name).await;
            let entry = entry.map_err(|error| failed(what, &error))?;
            let Some(entry) = entry.filter(|entry| entry.operation == Operation::Put) else {
                continue;
            };
            if let Ok(node) = serde_json::from_slice::<Node>(&entry.value) {
                slots += node.slots;
                nodes += 1;
            }
        }
        self.all_slots
            .store(slots.max(self.settings.slots), Ordering::Relaxed);
        tracing::debug!(nodes, slots, "nodes were counted");
        Ok(())
    }

    /// Plans that all nodes together run at a time, as far as is known.
    pub(super) fn slots(&self) -> usize {
        self.all_slots.load(Ordering::Relaxed).max(1)
    }

    /// Withdraw this node's announcement.
    pub(super) async fn take_leave(&self) {
        if let Err(error) = self.servers.nodes.purge(self.node.to_string()).await {
            tracing::debug!(%error, "this node is missed only after a while");
        }
    }
}
