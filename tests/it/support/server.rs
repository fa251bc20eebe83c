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
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("bound");
        let settings = Settings {
            head_timeout: Duration::from_secs(30),
            body_timeout: Duration::from_secs(30),
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
