//! A service on a real port, for tests that need a connection.

use std::net::SocketAddr;
use std::time::Duration;

use noctule::http::server::{self, Settings};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

use super::api::Api;

/// Serves an [`Api`] until its phase is `Stopping`.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    pub(crate) serving: JoinHandle<()>,
}

impl Server {
    /// On a free port.
    pub(crate) async fn start(api: &Api) -> Self {
        Self::with_patience(api, Duration::from_secs(30)).await
    }

    /// With this time for a head, a body, and a reader who takes nothing.
    pub(crate) async fn with_patience(api: &Api, time: Duration) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("bound");
        let settings = Settings {
            head_timeout: time,
            body_timeout: time,
            reader_patience: time,
            max_connections: 20_000,
            patience: Duration::from_secs(5),
            instruments: api.state.instruments.clone(),
        };
        let serving = server::serve(
            listener,
            api.router.clone(),
            api.state.phase.clone(),
            settings,
        );
        Self {
            address,
            serving: tokio::spawn(serving),
        }
    }

    /// The full URL of `path`.
    pub(crate) fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }
}
