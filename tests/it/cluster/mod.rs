//! Failures with several servers and several processes.

mod chaos;
mod consumers;
mod credentials;
mod large;
mod nodes;
mod outages;
mod partition;
mod processes;
mod remains;
mod room;
mod servers;
mod vanished;

use std::ops::Deref;
use std::sync::Arc;

use noctule::store::jetstream::{JetStreamStore, Settings};
use noctule::store::{Options, Store};
use tempfile::TempDir;

use crate::support::process::Service;
use crate::support::sse::{Stream, events};
use crate::support::stores::node;

/// A node that is only a store.
async fn open(address: &str) -> Arc<dyn Store> {
    open_as(node(address)).await
}

/// Retried, as the service does: while a cluster creates streams its servers may answer late.
async fn open_as(settings: Settings) -> Arc<dyn Store> {
    let mut opened = JetStreamStore::open(settings.clone(), Options::new(1_000)).await;
    for _ in 0..5 {
        if opened.is_err() {
            opened = JetStreamStore::open(settings.clone(), Options::new(1_000)).await;
        }
    }
    Arc::new(opened.expect("the store opens"))
}

/// A node as a process; killed when dropped.
struct Node {
    service: Option<Service>,
    directory: TempDir,
    arguments: Vec<String>,
}

impl Node {
    /// Answers requests and runs no plans.
    fn api(address: &str, arguments: &[&str]) -> Self {
        Self::start(address, "api", arguments)
    }

    /// Runs plans, one at a time.
    fn worker(address: &str, arguments: &[&str]) -> Self {
        Self::start(address, "worker", arguments)
    }

    fn start(address: &str, role: &str, arguments: &[&str]) -> Self {
        let own = [
            "--store",
            address,
            "--store-lease",
            "2s",
            "--role",
            role,
            "--workers",
            "1",
        ];
        let all = own.iter().chain(arguments);
        let mut node = Self {
            service: None,
            directory: TempDir::new().expect("a temporary directory"),
            arguments: all.map(ToString::to_string).collect(),
        };
        node.restart();
        node
    }

    /// Starts it again with the same arguments.
    fn restart(&mut self) {
        let arguments: Vec<_> = self.arguments.iter().map(String::as_str).collect();
        self.service = Some(Service::start(self.directory.path(), &arguments));
    }

    /// Kills it as a power cut would.
    fn kill(&mut self) {
        self.service.take().expect("it runs").kill();
    }

    /// Asks it to stop and waits until it has.
    async fn leave(&mut self) {
        let service = self.service.take().expect("it runs");
        service.signal("TERM");
        assert!(service.exit().await.success());
    }
}

impl Deref for Node {
    type Target = Service;

    fn deref(&self) -> &Service {
        self.service.as_ref().expect("it runs")
    }
}

/// Waits for the plan's end and checks that its events have exactly one end and no gap.
async fn ends_once(service: &Service, address: &str) {
    let ended = service.ended(address).await;
    assert_eq!(ended["status"], "succeeded", "{ended}");
    let request = service.get(&format!("{address}/events?rate=0"));
    is_whole(&events(&Stream::open(request).await.rest().await), address);
}

/// Exactly one end, in last place, and no gap before it.
fn is_whole(told: &[(u64, String)], address: &str) {
    let ends = told.iter().filter(|(_, name)| name == "end").count();
    assert_eq!(ends, 1, "{address}: {told:?}");
    assert_eq!(told.last().expect("events").1, "end", "{address}");
    let ids: Vec<u64> = told.iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>(), "{address}");
}
