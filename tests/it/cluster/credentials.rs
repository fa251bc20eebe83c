//! Servers that do not let a node in, and credentials that are not there.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use noctule::store::jetstream::{JetStreamStore, Settings};
use noctule::store::{Options, StoreError, Trouble};
use tempfile::TempDir;

use crate::support::nats::{self, NatsServer};
use crate::support::process::Service;
use crate::support::stores::node;

async fn refusal(settings: Settings) -> (Trouble, String) {
    match JetStreamStore::open(settings, Options::new(10)).await {
        Err(StoreError::Unavailable { trouble, detail }) => (trouble, detail),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it is open"),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_the_servers_do_not_let_in_says_so() {
    let server = NatsServer::with_password("secret");
    let address = server.address();
    let (trouble, detail) = refusal(node(&address)).await;
    assert_eq!(trouble, Trouble::Forbidden, "{detail}");
    let directory = TempDir::new().unwrap();
    let service = Service::start(directory.path(), &["--store", &address]);
    let told = service.until_ready(503).await;
    assert!(told.contains("refuse the credentials"), "{told}");
}

#[tokio::test(flavor = "multi_thread")]
async fn credentials_that_cannot_be_read_are_reported() {
    let directory = TempDir::new().unwrap();
    let broken = directory.path().join("broken.creds");
    std::fs::write(&broken, "a letter to my aunt").unwrap();
    for file in [broken, directory.path().join("missing.creds")] {
        let settings = Settings {
            credentials: Some(file.clone()),
            ..node(&nats::address())
        };
        let (trouble, detail) = refusal(settings).await;
        assert_eq!(trouble, Trouble::NoCredentials, "{detail}");
        assert!(detail.contains(file.to_str().unwrap()), "{detail}");
    }
}
