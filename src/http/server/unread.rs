//! A request's body that its connection knows not to have been read to the end.
//!
//! To close a connection on which data has come that nobody read makes the system tell the caller that it is broken,
//! and a caller who is still sending then never reads the answer that explains why (RFC 9112 section 9.6).

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use axum::body::Bytes;
use hyper::body::{Body, Frame, Incoming, SizeHint};

use super::traffic::Traffic;

/// The body of a request.
pub(super) struct Received {
    body: Incoming,
    ended: bool,
    traffic: Arc<Traffic>,
}

impl Received {
    pub(super) fn new(body: Incoming, traffic: Arc<Traffic>) -> Self {
        Self {
            body,
            ended: false,
            traffic,
        }
    }
}

impl Body for Received {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        let frame = ready!(Pin::new(&mut self.body).poll_frame(context));
        self.ended |= frame.is_none();
        Poll::Ready(frame)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for Received {
    fn drop(&mut self) {
        if !self.ended && !self.body.is_end_stream() {
            self.traffic.leave_unread();
        }
    }
}
