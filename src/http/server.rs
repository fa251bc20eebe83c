//! Accepts connections until the service stops; `connection` answers them.
//!
//! An accept loop of our own because `axum::serve` lets a caller hold an idle connection for ever.

mod connection;
mod refused_by_hyper;
mod repeated_failures;
mod socket;
pub(super) mod traffic;
mod unread;

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::Instant;

use self::connection::{Times, answer};
use self::repeated_failures::RepeatedFailures;
use self::socket::Socket;
use super::Phase;
use super::phase::stopping;
use crate::telemetry::Instruments;

/// How connections are handled.
#[derive(Debug, Clone)]
pub struct Settings {
    /// A request's head must be complete after this; also how long a connection may idle.
    pub head_timeout: Duration,
    /// After that, a caller that still does not take an answer is cut off after this time too.
    pub body_timeout: Duration,
    /// For so long the readers of a connection's event streams may take nothing; see [`READER_PATIENCE`].
    pub reader_patience: Duration,
    /// Connections open at once; more wait in the listener's backlog.
    pub max_connections: usize,
    /// At shutdown, how long open connections may take to finish their answers.
    pub patience: Duration,
    /// Where connections are counted.
    pub instruments: Arc<Instruments>,
}

/// For so long a service lets readers of event streams take nothing: much longer than the pauses of a slow one, who is
/// sent something every 15 seconds.
pub const READER_PATIENCE: Duration = Duration::from_secs(5 * 60);

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
    let n_places = u32::try_from(settings.max_connections).unwrap_or(u32::MAX);
    let places = Arc::new(Semaphore::new(n_places as usize));
    let times = Times {
        idle: settings.head_timeout,
        unread: settings.body_timeout,
    };
    let mut failures_to_accept = RepeatedFailures::default();
    let begin = |(stream, place): (TcpStream, OwnedSemaphorePermit), phase| {
        let instruments = settings.instruments.clone();
        let socket = Socket::new(stream, settings.reader_patience, instruments);
        let answer = answer(socket, router.clone(), phase, times);
        let counted = settings.instruments.metrics.connection();
        tokio::spawn(async move {
            answer.await;
            drop((place, counted));
        });
    };
    loop {
        let arrival = tokio::select! {
            arrival = accept(&listener, &places) => arrival,
            () = stopping(&mut phase) => break,
        };
        match arrival {
            Ok(arrived) => begin(arrived, phase.clone()),
            Err(error) => {
                if let Some(failures) = failures_to_accept.count(Instant::now()) {
                    tracing::warn!(%error, failures, "a connection could not be accepted");
                }
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
    for arrived in last_arrivals(listener, &places) {
        begin(arrived, phase.clone());
    }
    // Each connection returns its place when it ends.
    let all_ended = places.acquire_many(n_places);
    if tokio::time::timeout(settings.patience, all_ended)
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

/// The connections in the backlog of a listener that is given up, which would be reset with it. An error ends them like
/// an empty backlog.
fn last_arrivals(
    listener: TcpListener,
    places: &Arc<Semaphore>,
) -> impl Iterator<Item = (TcpStream, OwnedSemaphorePermit)> {
    // Asked without tokio, which knows of an arrival only after its next look at all sockets.
    let listener = listener.into_std();
    std::iter::from_fn(move || {
        let place = places.clone().try_acquire_owned().ok()?;
        let (stream, _) = listener.as_ref().ok()?.accept().ok()?;
        stream.set_nonblocking(true).ok()?;
        stream.set_nodelay(true).ok()?;
        Some((TcpStream::from_std(stream).ok()?, place))
    })
}
