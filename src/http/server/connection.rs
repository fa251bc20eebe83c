//! One connection, from its first bytes to its end.

use std::cell::RefCell;
use std::convert::Infallible;
use std::fmt::Display;
use std::pin::pin;
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use hyper_util::server::graceful::GracefulConnection;
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::task::yield_now;
use tower::Service as _;

use super::socket::Socket;
use super::traffic::Traffic;
use super::unread::Received;
use crate::http::Phase;
use crate::http::phase::stopping;
use crate::http::{answers, head};

/// How long a caller that has connected may take to send the first bytes of a request once the service stops. Bytes that
/// are there already may take a moment to be noticed.
const LAST_REQUESTS: Duration = Duration::from_millis(100);

/// Maximum size of what precedes the body in HTTP/1, including what is read at once with the end of it. A longer head
/// that one read brings whole is refused by [`head`].
pub(super) const HEAD_BYTES: usize = head::MOST_BYTES;

/// In HTTP/2 each header counts 32 bytes more than its text. What is within this and too large after all gets a better
/// answer from [`head`] than from hyper, whose own has no body.
const HTTP2_HEAD_BYTES: u32 = 2 * 64 * 1024;

/// What HTTP/2 takes in of each answer before the system takes it: there it can no longer be let go of.
const HTTP2_UNSENT_BYTES: usize = 4 * answers::PIECE;

/// The first bytes of an HTTP/2 connection, RFC 9113 section 3.4.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// How long a connection may go without traffic.
#[derive(Clone, Copy)]
pub(super) struct Times {
    /// After this, it ends as soon as pending requests are answered.
    pub(super) idle: Duration,
    /// After this, it is closed.
    pub(super) unread: Duration,
}

/// Answer the requests of one connection.
pub(super) async fn answer(
    socket: Socket,
    router: Router,
    mut phase: watch::Receiver<Phase>,
    times: Times,
) {
    let http1 = tokio::select! {
        // Callers that have already sent a request get an answer.
        biased;
        http1 = speaks_http1(&socket.stream) => http1,
        () = sent_nothing_at_the_end(&mut phase) => return,
        () = tokio::time::sleep(times.idle) => {
            tracing::debug!("a connection sent nothing");
            return;
        }
    };
    let traffic = socket.traffic.clone();
    let socket = TokioIo::new(socket);
    let watched = traffic.clone();
    // One for all requests of the connection; it is always ready.
    let router = RefCell::new(router);
    let service = service_fn(move |request: Request<Incoming>| {
        let busy = watched.clone().begin();
        let request = request.map(|body| Received::new(body, watched.clone()));
        let answer = router.borrow_mut().call(request);
        let traffic = watched.clone();
        async move {
            let answer = answer.await?;
            if traffic.is_unread() {
                // Before hyper writes the answer's head, let it find out whether what is left of the body is still to
                // come: if so, the head says that the connection closes, and no caller sends another request on it.
                yield_now().await;
            }
            Ok::<_, Infallible>(busy.answered(answer))
        }
    });
    if http1 {
        let mut builder = http1::Builder::new();
        builder.max_buf_size(HEAD_BYTES);
        // Without HTTP/2's parts: whatever is held here is held by every open stream.
        let connection = builder.serve_connection(socket, service);
        keep(connection, phase, &traffic, times, true).await;
    } else {
        let mut builder = auto::Builder::new(TokioExecutor::new());
        // For callers that begin like HTTP/2 and continue in HTTP/1: few, and `keep` does not tell them apart.
        builder
            .http1()
            .timer(TokioTimer::new())
            .max_buf_size(HEAD_BYTES)
            .header_read_timeout(times.idle);
        builder
            .http2()
            .timer(TokioTimer::new())
            .keep_alive_interval(times.idle)
            .max_header_list_size(HTTP2_HEAD_BYTES)
            .max_send_buf_size(HTTP2_UNSENT_BYTES)
            .max_concurrent_streams(256);
        let connection = builder.serve_connection(socket, service);
        Box::pin(keep(connection, phase, &traffic, times, false)).await;
    }
}

async fn sent_nothing_at_the_end(phase: &mut watch::Receiver<Phase>) {
    stopping(phase).await;
    tokio::time::sleep(LAST_REQUESTS).await;
}

/// Run a connection until it ends, the service stops, or there is no more traffic on it.
async fn keep<C: GracefulConnection<Error: Display>>(
    connection: C,
    mut phase: watch::Receiver<Phase>,
    traffic: &Traffic,
    times: Times,
    http1: bool,
) {
    let mut connection = pin!(connection);
    tokio::select! {
        biased;
        ended = &mut connection => return note(ended),
        () = stopping(&mut phase) => {}
        () = traffic.still_for(times.idle) => {
            // Nothing is left to be sent; at most part of a request's head has been received.
            if http1 && !traffic.is_held_up() {
                tracing::debug!("a connection asked for nothing");
                return;
            }
        }
    }
    connection.as_mut().graceful_shutdown();
    tokio::select! {
        ended = connection => note(ended),
        () = traffic.still_for(times.unread) => {
            tracing::debug!("a connection's answers were not taken");
        }
    }
}

fn note(ended: Result<(), impl Display>) {
    if let Err(error) = ended {
        tracing::debug!(%error, "a connection broke off");
    }
}

/// Whether the first bytes rule out HTTP/2; hyper detects the rest.
///
/// hyper could detect the version by itself, but then it reads the peeked bytes apart from what follows, keeps a buffer
/// twice as large for as long as the connection lives, and room for either version's needs.
async fn speaks_http1(stream: &TcpStream) -> bool {
    let mut first = [0; PREFACE.len()];
    // A failed peek means that a read will fail too.
    let length = stream.peek(&mut first).await.unwrap_or(0);
    !PREFACE.starts_with(&first[..length])
}
