//! Whether there is still any traffic on a connection.
//!
//! A caller who asks for nothing, never completes a request's head, or takes nothing of what it asked for, holds a
//! connection and whatever waits to be sent on it. hyper detects only the first two, only for HTTP/1, and starts a
//! timer for each request.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::response::Response;
use hyper::body::{Frame, SizeHint};
use parking_lot::{Mutex, MutexGuard};
use tokio::time::Instant;

/// Among an answer's extensions, marks one that may stand still for as long as it likes.
#[derive(Debug, Clone, Copy)]
pub(in crate::http) struct MayStandStill;

/// Minimum number of bytes sent that count as traffic: more than HTTP/2's pings and acknowledgements, which continue
/// while nobody asks for anything.
const WORTH_NOTING: usize = 1024;

/// The traffic on one connection.
#[derive(Debug)]
pub(super) struct Traffic(Mutex<State>);

#[derive(Debug)]
struct State {
    /// Requests being worked on, and answers that may stand still.
    busy: usize,
    /// Time of the last traffic.
    moved: Instant,
    /// Bytes sent since then.
    unnoted: usize,
    /// Whether data is waiting that the caller does not take.
    held_up: bool,
    /// Whether something that the caller sends is not read.
    unread: bool,
}

impl Traffic {
    pub(super) fn new() -> Self {
        Self(Mutex::new(State {
            busy: 0,
            moved: Instant::now(),
            unnoted: 0,
            held_up: false,
            unread: false,
        }))
    }

    /// A request has come. The connection counts as active until it is answered.
    pub(super) fn begin(self: Arc<Self>) -> Busy {
        self.state().busy += 1;
        Busy(self)
    }

    /// The caller has taken this many bytes.
    pub(super) fn sent(&self, bytes: usize) {
        let mut state = self.state();
        state.held_up = false;
        state.unnoted += bytes;
        if state.unnoted >= WORTH_NOTING {
            state.note();
        }
    }

    /// The caller does not take the next data for now.
    pub(super) fn hold_up(&self) {
        self.state().held_up = true;
    }

    /// Whether data is waiting that the caller does not take.
    pub(super) fn is_held_up(&self) -> bool {
        self.state().held_up
    }

    /// Part of what the caller sends is not read.
    pub(super) fn leave_unread(&self) {
        self.state().unread = true;
    }

    /// Whether the caller may still be sending what is not read.
    pub(super) fn is_unread(&self) -> bool {
        self.state().unread
    }

    /// Returns once there has been no traffic for `time`, counted from now at the earliest.
    pub(super) async fn still_for(&self, time: Duration) {
        let mut due = Instant::now() + time;
        loop {
            tokio::time::sleep_until(due).await;
            let now = Instant::now();
            due = self.state().moved(now) + time;
            if due <= now {
                return;
            }
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock()
    }
}

impl State {
    fn note(&mut self) {
        self.moved = Instant::now();
        self.unnoted = 0;
    }

    fn moved(&self, now: Instant) -> Instant {
        if self.busy > 0 { now } else { self.moved }
    }
}

/// Keeps a connection from counting as idle.
#[derive(Debug)]
pub(super) struct Busy(Arc<Traffic>);

impl Busy {
    /// The request is answered with this.
    pub(super) fn answered(self, answer: Response) -> Response<Answer> {
        let may_stand_still = answer.extensions().get::<MayStandStill>().is_some();
        let busy = may_stand_still.then_some(self);
        answer.map(|body| Answer { body, _busy: busy })
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.busy -= 1;
        state.note();
    }
}

/// The body of an answer.
pub(super) struct Answer {
    body: Body,
    /// Held by an answer that may stand still.
    _busy: Option<Busy>,
}

impl hyper::body::Body for Answer {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: Duration = Duration::from_secs(30);

    /// Seconds until `traffic` has been idle for [`TIME`].
    async fn still_after_s(traffic: &Traffic) -> u64 {
        let begin = Instant::now();
        traffic.still_for(TIME).await;
        begin.elapsed().as_secs()
    }

    #[tokio::test(start_paused = true)]
    async fn only_data_worth_noting_resets_the_idle_time() {
        let traffic = Arc::new(Traffic::new());
        assert_eq!(still_after_s(&traffic).await, 30, "nobody asks");
        assert_eq!(still_after_s(&traffic).await, 30, "from now on");

        for (bytes, expected, what) in [(WORTH_NOTING, 50, "an answer"), (17, 30, "a ping")] {
            let later = async {
                tokio::time::sleep(Duration::from_secs(20)).await;
                traffic.sent(bytes);
            };
            let (still, ()) = tokio::join!(still_after_s(&traffic), later);
            assert_eq!(still, expected, "{what}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_is_active_until_answered_and_a_stream_until_it_ends() {
        let traffic = Arc::new(Traffic::new());
        let after = async |held: Box<dyn Send>| {
            tokio::time::sleep(Duration::from_secs(100)).await;
            drop(held);
        };
        let request = traffic.clone().begin();
        let (still, ()) = tokio::join!(still_after_s(&traffic), after(Box::new(request)));
        assert_eq!(still, 130);

        let answer = traffic.clone().begin().answered(Response::default());
        let (still, ()) = tokio::join!(still_after_s(&traffic), after(Box::new(answer)));
        assert_eq!(still, 30, "nobody reads it");

        let mut stream = Response::default();
        stream.extensions_mut().insert(MayStandStill);
        let stream = traffic.clone().begin().answered(stream);
        let (still, ()) = tokio::join!(still_after_s(&traffic), after(Box::new(stream)));
        assert_eq!(still, 130);
    }
}
