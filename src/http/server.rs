//! Accept connections, answer them, and let them end.
//!
//! An accept loop of our own because `axum::serve` sets no timer, without which hyper's header
//! timeout never fires.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::server::graceful::{GracefulShutdown, Watcher};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tower::ServiceExt as _;

use super::Phase;
use super::phase::stopping;
use crate::telemetry::Instruments;

/// How connections are kept.
#[derive(Debug, Clone)]
pub struct Settings {
    /// A request's head must be complete after this; also how long a connection may idle.
    pub head_timeout: Duration,
    /// Connections open at once; more wait in the listener's backlog.
    pub max_connections: usize,
    /// At the end, open connections may finish their answers for so long.
    pub patience: Duration,
    /// Connections are counted there.
    pub instruments: Arc<Instruments>,
}

/// Pause after a failed accept, such as when file descriptors run out.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Answer on `listener` until the phase is [`Phase::Stopping`], then let open connections finish
/// their answers.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    mut phase: watch::Receiver<Phase>,
    settings: Settings,
) {
    let connections = GracefulShutdown::new();
    let places = Arc::new(Semaphore::new(settings.max_connections));
    loop {
        let arrival = tokio::select! {
            arrival = accept(&listener, &places) => arrival,
            () = stopping(&mut phase) => break,
        };
        match arrival {
            Ok((stream, place)) => {
                let answer = answer(
                    stream,
                    router.clone(),
                    connections.watcher(),
                    settings.head_timeout,
                );
                let counted = settings.instruments.metrics.connection();
                tokio::spawn(async move {
                    answer.await;
                    drop((place, counted));
                });
            }
            Err(error) => {
                tracing::warn!(%error, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
    drop(listener);
    if tokio::time::timeout(settings.patience, connections.shutdown())
        .await
        .is_err()
    {
        tracing::warn!("some connections did not end in time");
    }
}

async fn accept(
    listener: &TcpListener,
    places: &Arc<Semaphore>,
) -> io::Result<(TcpStream, OwnedSemaphorePermit)> {
    let place = places.clone().acquire_owned().await;
    let (stream, _) = listener.accept().await?;
    stream.set_nodelay(true)?;
    Ok((stream, place.expect("the semaphore is never closed")))
}

/// Answer the requests of one connection.
async fn answer(stream: TcpStream, router: Router, watcher: Watcher, head_timeout: Duration) {
    let begun = Arc::new(AtomicBool::new(false));
    let service = {
        let begun = begun.clone();
        router.map_request(move |request: Request<Incoming>| {
            begun.store(true, Ordering::Relaxed);
            request.map(axum::body::Body::new)
        })
    };
    let mut builder = Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(head_timeout);
    builder
        .http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(head_timeout)
        .max_concurrent_streams(256);
    let connection =
        builder.serve_connection(TokioIo::new(stream), TowerToHyperService::new(service));
    let connection = watcher.watch(connection.into_owned());
    tokio::select! {
        ended = connection => if let Err(error) = ended {
            tracing::debug!(%error, "a connection broke off");
        },
        () = never_began(&begun, head_timeout) => tracing::debug!("a connection sent no request"),
    }
}

/// Until it is clear that no first request comes. hyper's own timer starts only after the protocol
/// is known, which a silent caller never lets it be.
async fn never_began(begun: &AtomicBool, head_timeout: Duration) {
    tokio::time::sleep(head_timeout).await;
    if begun.load(Ordering::Relaxed) {
        std::future::pending::<()>().await;
    }
}
