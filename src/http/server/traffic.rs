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
use parking_lot::Mutex;
use tokio::time::Instant;

/// Among an answer's extensions, marks one that may have nothing to say for as long as it likes: it keeps its connection
/// while the caller takes what is said now and then.
#[derive(Debug, Clone, Copy)]
pub(in crate::http) struct MayStandStill;

/// Minimum number of bytes sent that count as traffic: more than HTTP/2's pings and acknowledgements, which continue
/// while nobody asks for anything.
const WORTH_NOTING: usize = 1024;

/// The traffic on one connection.
#[derive(Debug)]
pub(super) struct Traffic {
    /// How long the readers of answers that may stand still may take nothing.
    reader_patience: Duration,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// Requests being worked on.
    busy: usize,
    /// Answers that may stand still.
    readers: usize,
    /// When one of these was last asked for more.
    asked: Instant,
    /// When the caller last took anything.
    taken: Instant,
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
    pub(super) fn new(reader_patience: Duration) -> Self {
        let now = Instant::now();
        Self {
            reader_patience,
            state: Mutex::new(State {
                busy: 0,
                readers: 0,
                asked: now,
                taken: now,
                moved: now,
                unnoted: 0,
                held_up: false,
                unread: false,
            }),
        }
    }

    /// A request has come. The connection counts as active until it is answered.
    pub(super) fn begin(self: Arc<Self>) -> Busy {
        self.state.lock().busy += 1;
        Busy(self)
    }

    /// The caller has taken this many bytes.
    pub(super) fn sent(&self, bytes: usize) {
        let mut state = self.state.lock();
        state.held_up = false;
        state.taken = Instant::now();
        state.unnoted += bytes;
        if state.unnoted >= WORTH_NOTING {
            state.note();
        }
    }

    /// The caller does not take the next data for now.
    pub(super) fn hold_up(&self) {
        self.state.lock().held_up = true;
    }

    /// Whether data is waiting that the caller does not take.
    pub(super) fn is_held_up(&self) -> bool {
        self.state.lock().held_up
    }

    /// Part of what the caller sends is not read.
    pub(super) fn leave_unread(&self) {
        self.state.lock().unread = true;
    }

    /// Whether the caller may still be sending what is not read.
    pub(super) fn is_unread(&self) -> bool {
        self.state.lock().unread
    }

    /// Returns once there has been no traffic for `time`, counted from now at the earliest.
    pub(super) async fn still_for(&self, time: Duration) {
        let mut due = Instant::now() + time;
        loop {
            tokio::time::sleep_until(due).await;
            let now = Instant::now();
            due = self.state.lock().moved(now, self.reader_patience) + time;
            if due <= now {
                return;
            }
        }
    }
}

impl State {
    fn note(&mut self) {
        self.moved = Instant::now();
        self.unnoted = 0;
    }

    /// When there was last any traffic, at `now`.
    fn moved(&self, now: Instant, reader_patience: Duration) -> Instant {
        if self.busy > 0 || self.is_read(now, reader_patience) {
            now
        } else {
            self.moved
        }
    }

    /// Whether somebody takes what the answers say that may stand still. The system still accepts some data when nobody
    /// reads it, and HTTP/1 asks for more even when it does not; HTTP/2 asks only when the caller has room.
    fn is_read(&self, now: Instant, reader_patience: Duration) -> bool {
        let sign = if self.held_up { self.taken } else { self.asked };
        self.readers > 0 && now.duration_since(sign) < reader_patience
    }
}

/// Keeps a connection from counting as idle.
#[derive(Debug)]
pub(super) struct Busy(Arc<Traffic>);

impl Busy {
    /// The request is answered with this.
    pub(super) fn answered(self, answer: Response) -> Response<Answer> {
        let may_stand_still = answer.extensions().get::<MayStandStill>().is_some();
        let reader = may_stand_still.then(|| Reader::new(self.0.clone()));
        answer.map(|body| Answer { body, reader })
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        let mut state = self.0.state.lock();
        state.busy -= 1;
        state.note();
    }
}

/// Who reads an answer that may stand still.
struct Reader(Arc<Traffic>);

impl Reader {
    fn new(traffic: Arc<Traffic>) -> Self {
        traffic.state.lock().readers += 1;
        let reader = Self(traffic);
        reader.asks();
        reader
    }

    fn asks(&self) {
        self.0.state.lock().asked = Instant::now();
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        let mut state = self.0.state.lock();
        state.readers -= 1;
        state.note();
    }
}

/// The body of an answer.
pub(super) struct Answer {
    body: Body,
    reader: Option<Reader>,
}

impl hyper::body::Body for Answer {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if let Some(reader) = &self.reader {
            reader.asks();
        }
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
    const PATIENCE: Duration = Duration::from_secs(300);

    /// Seconds until `traffic` has been idle for [`TIME`].
    async fn still_after_s(traffic: &Traffic) -> u64 {
        let begin = Instant::now();
        traffic.still_for(TIME).await;
        begin.elapsed().as_secs()
    }

    #[tokio::test(start_paused = true)]
    async fn only_data_worth_noting_resets_the_idle_time() {
        let traffic = Arc::new(Traffic::new(PATIENCE));
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
        let traffic = Arc::new(Traffic::new(PATIENCE));
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

        let stream = traffic.clone().begin().answered(stream());
        let (still, ()) = tokio::join!(still_after_s(&traffic), after(Box::new(stream)));
        assert_eq!(still, 130);
    }

    /// An answer that may stand still.
    fn stream() -> Response {
        let mut stream = Response::default();
        stream.extensions_mut().insert(MayStandStill);
        stream
    }

    #[tokio::test(start_paused = true)]
    async fn a_stream_that_nobody_reads_is_active_for_as_long_as_readers_may_pause() {
        let traffic = Arc::new(Traffic::new(PATIENCE));
        let mut stream = traffic.clone().begin().answered(stream()).into_body();
        assert_eq!(still_after_s(&traffic).await, 300);

        let mut asks = || {
            let context = &mut Context::from_waker(std::task::Waker::noop());
            let _ = hyper::body::Body::poll_frame(Pin::new(&mut stream), context);
        };
        let reads = async {
            for _ in 0..100 {
                tokio::time::sleep(Duration::from_secs(15)).await;
                asks();
            }
        };
        let (still, ()) = tokio::join!(still_after_s(&traffic), reads);
        assert_eq!(still, 1_800);

        // What is said is not taken, though HTTP/1 goes on asking.
        traffic.sent(WORTH_NOTING);
        traffic.hold_up();
        let asked = async {
            for _ in 0..100 {
                tokio::time::sleep(Duration::from_secs(15)).await;
                asks();
            }
        };
        let still = tokio::select! {
            still = still_after_s(&traffic) => still,
            () = asked => 0,
        };
        assert_eq!(still, 300);
    }
}
