//! A connection between a node and a server that can be cut without either end being notified.

use std::net::SocketAddr;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinHandle;

/// Carries bytes while it is whole. While it is cut, bytes wait and new connections are closed.
pub(crate) struct Wire {
    near: SocketAddr,
    whole: watch::Sender<bool>,
    carrying: JoinHandle<()>,
}

impl Wire {
    /// A wire to a host and port.
    pub(crate) async fn to(far: String) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let near = listener.local_addr().expect("it has one");
        let whole = watch::Sender::new(true);
        let carrying = tokio::spawn(carry(listener, far, whole.subscribe()));
        Self {
            near,
            whole,
            carrying,
        }
    }

    /// The end to connect to.
    pub(crate) fn host(&self) -> String {
        self.near.to_string()
    }

    pub(crate) fn cut(&self) {
        self.whole.send_replace(false);
    }

    pub(crate) fn mend(&self) {
        self.whole.send_replace(true);
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        self.carrying.abort();
    }
}

async fn carry(listener: TcpListener, far: String, whole: watch::Receiver<bool>) {
    while let Ok((near, _)) = listener.accept().await {
        if !*whole.borrow() {
            continue;
        }
        let Ok(far) = TcpStream::connect(&far).await else {
            continue;
        };
        let (from_near, to_near) = near.into_split();
        let (from_far, to_far) = far.into_split();
        tokio::spawn(pump(from_near, to_far, whole.clone()));
        tokio::spawn(pump(from_far, to_near, whole.clone()));
    }
}

async fn pump(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, mut whole: watch::Receiver<bool>) {
    let mut bytes = vec![0; 64 << 10];
    while let Ok(count @ 1..) = from.read(&mut bytes).await {
        if whole.wait_for(|whole| *whole).await.is_err()
            || to.write_all(&bytes[..count]).await.is_err()
        {
            return;
        }
    }
}
