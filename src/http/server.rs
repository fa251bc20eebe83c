//! Accept connections, answer them, and let them end.
//!
//! An accept loop of our own because `axum::serve` sets no timer, without which hyper's header
//! timeout never fires.

mod complaints;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use hyper_util::server::graceful::{GracefulShutdown, Watcher};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::Instant;
use tower::ServiceExt as _;

use self::complaints::Complaints;
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

/// What an HTTP/2 connection begins with, RFC 9113 section 3.4.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

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
    let mut complaints = Complaints::default();
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
                    phase.clone(),
                    settings.head_timeout,
                );
                let counted = settings.instruments.metrics.connection();
                tokio::spawn(async move {
                    answer.await;
                    drop((place, counted));
                });
            }
            Err(error) => {
                if let Some(failures) = complaints.count(Instant::now()) {
                    tracing::warn!(%error, failures, "a connection could not be accepted");
                }
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
async fn answer(
    stream: TcpStream,
    router: Router,
    watcher: Watcher,
    mut phase: watch::Receiver<Phase>,
    head_timeout: Duration,
) {
    let http1 = tokio::select! {
        // Who has asked already is answered.
        biased;
        http1 = speaks_http1(&stream) => http1,
        () = stopping(&mut phase) => return,
        () = tokio::time::sleep(head_timeout) => {
            tracing::debug!("a connection sent nothing");
            return;
        }
    };
    drop(phase);
    if http1 {
        let mut builder = http1::Builder::new();
        builder
            .timer(TokioTimer::new())
            .header_read_timeout(head_timeout);
        // Without what the other version needs: whatever is held here, every open stream holds.
        let service = TowerToHyperService::new(router);
        let connection = builder.serve_connection(TokioIo::new(stream), service);
        if let Err(error) = watcher.watch(connection).await {
            tracing::debug!(%error, "a connection broke off");
        }
    } else {
        Box::pin(answer_either(stream, router, watcher, head_timeout)).await;
    }
}

/// Answer the requests of a connection that may be one of HTTP/2.
async fn answer_either(
    stream: TcpStream,
    router: Router,
    watcher: Watcher,
    head_timeout: Duration,
) {
    let begun = Arc::new(AtomicBool::new(false));
    let service = {
        let begun = begun.clone();
        router.map_request(move |request: Request<Incoming>| {
            begun.store(true, Ordering::Relaxed);
            request
        })
    };
    let mut builder = auto::Builder::new(TokioExecutor::new());
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
    tokio::select! {
        ended = watcher.watch(connection.into_owned()) => if let Err(error) = ended {
            tracing::debug!(%error, "a connection broke off");
        },
        () = never_began(&begun, head_timeout) => tracing::debug!("a connection sent no request"),
    }
}

/// Whether the first bytes are the beginning of no HTTP/2; hyper finds out about the rest.
///
/// It could about all, but then reads what it has looked at apart from what follows, keeps a buffer twice as
/// large for as long as the connection lives, and room for what either version needs.
async fn speaks_http1(stream: &TcpStream) -> bool {
    let mut first = [0; PREFACE.len()];
    // What cannot be looked at cannot be read either.
    let length = stream.peek(&mut first).await.unwrap_or(0);
    !PREFACE.starts_with(&first[..length])
}

/// Until it is clear that no first request comes. hyper's own timer starts only after the protocol
/// is known, which a silent caller never lets it be.
async fn never_began(begun: &AtomicBool, head_timeout: Duration) {
    tokio::time::sleep(head_timeout).await;
    if begun.load(Ordering::Relaxed) {
        std::future::pending::<()>().await;
    }
}
