//! A caller's socket that reports how much is taken from it, and explains what was wrong with an unreadable request.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::Sleep;

use super::refused_by_hyper;
use super::traffic::Traffic;
use crate::telemetry::Instruments;

/// For how long a caller is heard that is still sending what is not read.
const LINGERING: Duration = Duration::from_secs(5);

/// Data written to it counts as traffic once the system has taken it.
pub(super) struct Socket {
    pub(super) stream: TcpStream,
    pub(super) traffic: Arc<Traffic>,
    instruments: Arc<Instruments>,
    /// What remains to be sent in place of hyper's last write.
    instead: Vec<u8>,
    /// The end of the time for which it reads what comes after the last answer.
    lingering: Option<Pin<Box<Sleep>>>,
}

impl Socket {
    pub(super) fn new(
        stream: TcpStream,
        reader_patience: Duration,
        instruments: Arc<Instruments>,
    ) -> Self {
        Self {
            stream,
            traffic: Arc::new(Traffic::new(reader_patience)),
            instruments,
            instead: Vec::new(),
            lingering: None,
        }
    }

    /// Whether something else is sent in place of `bytes`, which then count as written.
    fn is_explained(&mut self, bytes: &[u8]) -> bool {
        let Some(explained) = refused_by_hyper::explained(bytes, &self.instruments) else {
            return false;
        };
        self.instead = explained;
        self.traffic.leave_unread();
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

    /// Read and forget what the caller is still sending, so that it comes to read its answer.
    fn poll_linger(&mut self, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let sleep = || Box::pin(tokio::time::sleep(LINGERING));
        let until = self.lingering.get_or_insert_with(sleep);
        let mut scrap = [0; 4096];
        loop {
            if until.as_mut().poll(context).is_ready() {
                return Poll::Ready(Ok(()));
            }
            let mut buffer = ReadBuf::new(&mut scrap);
            let read = Pin::new(&mut self.stream).poll_read(context, &mut buffer);
            let has_ended = ready!(read).is_err() || buffer.filled().is_empty();
            if has_ended {
                return Poll::Ready(Ok(()));
            }
        }
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
        if self.is_explained(bytes) {
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
            && self.is_explained(bytes)
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
        ready!(Pin::new(&mut self.stream).poll_shutdown(context))?;
        if self.traffic.is_unread() {
            return self.poll_linger(context);
        }
        Poll::Ready(Ok(()))
    }
}
