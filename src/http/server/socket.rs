//! A caller's socket that reports how much is taken from it, and explains what was wrong with an unreadable request.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

use super::refused_by_hyper;
use super::traffic::Traffic;
use crate::telemetry::Instruments;

/// Data written to it counts as traffic once the system has taken it.
pub(super) struct Socket {
    pub(super) stream: TcpStream,
    pub(super) traffic: Arc<Traffic>,
    instruments: Arc<Instruments>,
    /// What remains to be sent in place of hyper's last write.
    instead: Vec<u8>,
}

impl Socket {
    pub(super) fn new(stream: TcpStream, instruments: Arc<Instruments>) -> Self {
        Self {
            stream,
            traffic: Arc::new(Traffic::new()),
            instruments,
            instead: Vec::new(),
        }
    }

    /// Whether something else is sent in place of `bytes`, which then count as written.
    fn is_told_better(&mut self, bytes: &[u8]) -> bool {
        let Some(told) = refused_by_hyper::told_better(bytes, &self.instruments) else {
            return false;
        };
        self.instead = told;
        true
    }

    fn poll_instead(&mut self, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        while !self.instead.is_empty() {
            let stream = Pin::new(&mut self.stream);
            let written = ready!(stream.poll_write(context, &self.instead))?;
            if written == 0 {
                return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
            }
            self.instead.drain(..written);
        }
        Poll::Ready(Ok(()))
    }

    fn counted(&self, written: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        match &written {
            Poll::Ready(Ok(bytes)) => self.traffic.sent(*bytes),
            Poll::Ready(Err(_)) => {}
            Poll::Pending => self.traffic.hold_up(),
        }
        written
    }
}

impl AsyncRead for Socket {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Socket {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_instead(context))?;
        if self.is_told_better(bytes) {
            return self.counted(Poll::Ready(Ok(bytes.len())));
        }
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.counted(written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_instead(context))?;
        if let [bytes] = slices
            && self.is_told_better(bytes)
        {
            return self.counted(Poll::Ready(Ok(bytes.len())));
        }
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, slices);
        self.counted(written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_instead(context))?;
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_instead(context))?;
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
