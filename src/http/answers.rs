//! How much memory long answers take that have not been sent yet, and long documents of which answers are made.
//!
//! A caller needs one connection to ask for hundreds of long results and to take none. Long answers share a room; when
//! there is none left, those whose callers do not take them make place, and otherwise the new one is refused.

use std::collections::HashMap;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::BoxError;
use axum::body::{Body, Bytes, HttpBody};
use axum::response::{IntoResponse, Response};
use hyper::body::{Frame, SizeHint};
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Instant;

use super::problem::{Busy, Problem};

/// Answers up to this length need no room. Longer ones are handed over in pieces of it, since what has been handed over
/// can no longer be let go of.
pub(super) const PIECE: usize = 16 * 1024;

/// A caller must take so many bytes a second on average to keep an answer that others need the room of.
const SLOWEST: f64 = 8.0 * 1024.0;

/// About what a compressor occupies, bytes: its windows and tables.
const COMPRESSOR: u64 = 320 * 1024;

/// An answer of more bytes than this takes the threads that answer some milliseconds to compress.
const LONG: u64 = 64 * 1024;

/// So many of these are compressed at once, else nothing else would be answered.
const COMPRESSORS: usize = 4;

/// Among an answer's extensions, marks one that occupies nothing of its own: it is a part of the program.
#[derive(Debug, Clone, Copy)]
struct Constant;

/// Mark an answer as a part of the program.
pub(super) fn constant(answer: impl IntoResponse) -> Response {
    let mut answer = answer.into_response();
    answer.extensions_mut().insert(Constant);
    answer
}

/// Whether the answer is a part of the program.
pub(super) fn is_constant<B>(answer: &http::Response<B>) -> bool {
    answer.extensions().get::<Constant>().is_some()
}

/// The room for all long answers.
#[derive(Debug, Clone)]
pub struct Answers(Arc<Room>);

#[derive(Debug)]
struct Room {
    free: Arc<Semaphore>,
    bytes: usize,
    /// How many long answers are compressed at once.
    compressors: Arc<Semaphore>,
    /// For so long a caller may take nothing.
    patience: Duration,
    waiting: Mutex<Waiting>,
}

/// The answers that are being sent.
#[derive(Debug, Default)]
struct Waiting {
    answers: HashMap<u64, Arc<Mutex<Rest>>>,
    next: u64,
}

impl Answers {
    /// Room for `bytes`. An answer keeps its part while its caller is behind a fair pace by no more than `patience`.
    #[must_use]
    pub fn new(bytes: usize, patience: Duration) -> Self {
        let bytes = bytes.min(Semaphore::MAX_PERMITS);
        Self(Arc::new(Room {
            free: Arc::new(Semaphore::new(bytes)),
            bytes,
            compressors: Arc::new(Semaphore::new(COMPRESSORS)),
            patience,
            waiting: Mutex::default(),
        }))
    }

    /// Room for one answer that occupies so many bytes.
    pub(super) fn room(&self, bytes: u64) -> Result<Place, Problem> {
        let busy = Problem::Busy(Busy::Answers(self.0.bytes));
        self.place(bytes, None).ok_or(busy)
    }

    /// Room for one answer of so many bytes, of which it occupies `own`, that is compressed as it is sent; `None` where it
    /// has to be sent plain.
    pub(super) fn room_to_compress(&self, bytes: u64, own: u64) -> Option<Place> {
        let compressor = if bytes > LONG {
            Some(self.0.compressor()?)
        } else {
            None
        };
        self.place(own + COMPRESSOR, compressor)
    }

    /// Room for so many bytes out of the store that wait until an answer can be made of them; `None` if these are few,
    /// which need none.
    pub(super) fn room_to_make_one(&self, bytes: usize) -> Result<Option<Place>, Problem> {
        let is_long = bytes > PIECE;
        is_long.then(|| self.room(bytes as u64)).transpose()
    }

    fn place(&self, bytes: u64, compressor: Option<OwnedSemaphorePermit>) -> Option<Place> {
        let bytes = self.0.take(bytes)?;
        let room = self.0.clone();
        Some(Place {
            share: Share { bytes, compressor },
            room,
        })
    }
}

/// Room that has been taken for one answer.
pub(super) struct Place {
    share: Share,
    room: Arc<Room>,
}

/// What one answer has of the room.
#[derive(Debug)]
struct Share {
    #[expect(dead_code, reason = "held")]
    bytes: OwnedSemaphorePermit,
    compressor: Option<OwnedSemaphorePermit>,
}

impl Place {
    /// This body, which keeps the place until it has been sent or nobody takes it.
    pub(super) fn hold<B>(self, body: B) -> Body
    where
        B: HttpBody<Data = Bytes, Error: Into<BoxError>> + Send + 'static,
    {
        let rest = Arc::new(Mutex::new(Rest {
            body: Body::new(body),
            piece: Bytes::new(),
            share: Some(self.share),
            begun: Instant::now(),
        }));
        let mut waiting = self.room.waiting.lock();
        let id = waiting.next;
        waiting.next += 1;
        waiting.answers.insert(id, rest.clone());
        drop(waiting);
        Body::new(Held {
            rest,
            id,
            room: self.room,
        })
    }
}

impl Room {
    /// A share of so many bytes, if there is room or if those who do not read make room. One answer always fits.
    fn take(&self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        let bytes = self.bytes.min(usize::try_from(bytes).ok()?);
        let bytes = u32::try_from(bytes).ok()?;
        let share = || self.free.clone().try_acquire_many_owned(bytes).ok();
        share().or_else(|| {
            self.let_go_of_the_unread(|_| true);
            share()
        })
    }

    /// A compressor, if one is free or if those who do not read what is compressed make it free.
    fn compressor(&self) -> Option<OwnedSemaphorePermit> {
        let one = || self.compressors.clone().try_acquire_owned().ok();
        one().or_else(|| {
            self.let_go_of_the_unread(|share| share.compressor.is_some());
            one()
        })
    }

    /// Let go of those of the answers with such shares that nobody takes.
    fn let_go_of_the_unread(&self, such: impl Fn(&Share) -> bool) {
        let now = Instant::now();
        for rest in self.waiting.lock().answers.values() {
            // One that is locked is being read.
            if let Some(mut rest) = rest.try_lock()
                && rest.share.as_ref().is_some_and(&such)
            {
                rest.let_go_if_unread(now, self.patience);
            }
        }
    }
}

/// What has not been handed over of an answer.
#[derive(Debug)]
struct Rest {
    body: Body,
    /// What the body has given, as far as it has not been handed over.
    piece: Bytes,
    /// `None` once the answer has been let go of.
    share: Option<Share>,
    /// When somebody would have begun who had taken as much at the slowest pace.
    begun: Instant,
}

impl Rest {
    fn let_go_if_unread(&mut self, now: Instant, patience: Duration) {
        if now > self.begun + patience {
            self.body = Body::empty();
            self.piece = Bytes::new();
            self.share = None;
        }
    }

    fn poll(
        &mut self,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if self.share.is_none() {
            return Poll::Ready(Some(Err(axum::Error::new("the answer was not taken"))));
        }
        if self.piece.is_empty() {
            let frame = match ready!(Pin::new(&mut self.body).poll_frame(context)) {
                Some(Ok(frame)) => frame,
                end => return Poll::Ready(end),
            };
            match frame.into_data() {
                Ok(data) => self.piece = data,
                Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
            }
        }
        let length = self.piece.len().min(PIECE);
        // A copy: a part of the whole would keep all of it.
        let piece = Bytes::copy_from_slice(&self.piece.split_to(length));
        if self.piece.is_empty() {
            // Even an empty part would.
            self.piece = Bytes::new();
        }
        let fair = Duration::from_secs_f64(length as f64 / SLOWEST);
        // Whoever is fast now may not stand still for longer later.
        self.begun = Instant::now().min(self.begun + fair);
        Poll::Ready(Some(Ok(Frame::data(piece))))
    }

    /// How much is still to be handed over.
    fn left(&self) -> Option<u64> {
        let of_body = self.body.size_hint().exact()?;
        self.share
            .is_some()
            .then(|| of_body + self.piece.len() as u64)
    }
}

/// The body of a long answer; gives back its share when it is dropped.
struct Held {
    rest: Arc<Mutex<Rest>>,
    id: u64,
    room: Arc<Room>,
}

impl hyper::body::Body for Held {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.rest.lock().poll(context)
    }

    fn is_end_stream(&self) -> bool {
        self.rest.lock().left() == Some(0)
    }

    fn size_hint(&self) -> SizeHint {
        let left = self.rest.lock().left();
        left.map_or_else(SizeHint::default, SizeHint::with_exact)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.room.waiting.lock().answers.remove(&self.id);
    }
}

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt as _;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(40);

    fn held(answers: &Answers, length: usize) -> Option<Body> {
        let place = answers.room(length as u64).ok()?;
        Some(place.hold(Body::from(vec![7; length])))
    }

    fn free(answers: &Answers) -> usize {
        answers.0.free.available_permits()
    }

    async fn next(body: &mut Option<Body>) -> Option<usize> {
        let frame = body.as_mut()?.frame().await?;
        let data = frame.ok()?.into_data().expect("data");
        Some(data.len())
    }

    #[tokio::test]
    async fn a_long_answer_comes_whole_and_gives_back_its_room() {
        let answers = Answers::new(10 * PIECE, PATIENCE);
        let length = 3 * PIECE + 5;
        let whole: Vec<u8> = (0..=250).cycle().take(length).collect();
        let place = answers.room(length as u64).expect("room");
        let held = place.hold(Body::from(whole.clone()));
        assert_eq!(held.size_hint().exact(), Some(length as u64));
        assert_eq!(free(&answers), 10 * PIECE - length);
        let read = held.collect().await.expect("not let go of");
        assert_eq!(read.to_bytes(), whole);
        assert_eq!(free(&answers), 10 * PIECE);
        assert!(answers.0.waiting.lock().answers.is_empty());
    }

    #[tokio::test]
    async fn one_answer_always_fits_and_what_does_not_is_refused() {
        let answers = Answers::new(2 * PIECE, PATIENCE);
        let long = held(&answers, 5 * PIECE).expect("nothing else");
        assert_eq!(free(&answers), 0);
        let refused = answers.room(1).err();
        assert!(matches!(refused, Some(Problem::Busy(Busy::Answers(bytes))) if bytes == 2 * PIECE));
        drop(long);
        assert!(held(&answers, PIECE).is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn answers_that_nobody_takes_make_room_and_others_stay() {
        let answers = Answers::new(10 * PIECE, PATIENCE);
        let [mut read, mut unread] = [(); 2].map(|()| held(&answers, 5 * PIECE));
        tokio::time::sleep(PATIENCE).await;
        assert!(held(&answers, 5 * PIECE).is_none(), "too early");

        assert_eq!(next(&mut read).await, Some(PIECE));
        tokio::time::sleep(Duration::from_secs(1)).await;
        let third = held(&answers, 5 * PIECE);
        assert!(third.is_some() && free(&answers) == 0);
        assert!(!unread.as_ref().is_some_and(HttpBody::is_end_stream));
        assert_eq!(next(&mut unread).await, None, "it breaks off");
        assert_eq!(next(&mut read).await, Some(PIECE));

        // A pace that is too slow does not help for long, and neither does one that was fast.
        for _ in 0..2 {
            assert_eq!(next(&mut read).await, Some(PIECE));
        }
        tokio::time::sleep(PATIENCE + Duration::from_secs(1)).await;
        assert!(held(&answers, 5 * PIECE).is_some());
        assert_eq!(next(&mut read).await, None);
    }
}
