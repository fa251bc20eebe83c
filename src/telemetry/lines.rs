//! Log lines on their way to stderr: queued for a thread of their own, so that nothing waits for whoever reads them.
//!
//! When the reader stops reading, the queue fills up; lines that find no room are dropped and counted.
//!
//! `tracing-appender` 0.2 does nearly the same. But where the queue is full at the end, it gives up after a tenth of a
//! second and prints so to stdout, where our users read the address.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

use prometheus_client::metrics::counter::Counter;

/// Lines that may wait; a line has a few hundred bytes.
const WAITING: usize = 8_192;

/// Lines that are written in one go, as long as so many wait.
const TOGETHER: usize = 256;

/// Pause of the writing thread when nothing waits any more: a thread that sleeps need not be woken for each line, which
/// under load would cost requests more than writing it.
const BREATH: Duration = Duration::from_millis(5);

/// Pause between attempts to queue a request for a flush.
const PAUSE: Duration = Duration::from_millis(5);

/// Takes lines, and never blocks.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    waiting: SyncSender<Message>,
    dropped: Counter,
}

#[derive(Debug)]
enum Message {
    Line(Vec<u8>),
    /// To be answered once everything before it is written.
    Flush(SyncSender<()>),
}

impl Lines {
    /// Lines for `out`; those dropped are counted in `dropped`.
    ///
    /// # Errors
    /// When there can be no thread for it.
    pub(super) fn to(out: impl Write + Send + 'static, dropped: Counter) -> io::Result<Self> {
        Self::few(WAITING, out, dropped)
    }

    fn few(most: usize, out: impl Write + Send + 'static, dropped: Counter) -> io::Result<Self> {
        let (waiting, lines) = sync_channel(most);
        std::thread::Builder::new()
            .name("log-writer".to_owned())
            .spawn(move || write(&lines, out))?;
        Ok(Self { waiting, dropped })
    }

    /// Wait until all lines so far are written, but no longer than `patience`.
    pub(super) fn flush(&self, patience: Duration) {
        let until = Instant::now() + patience;
        let (done, written) = sync_channel(1);
        let mut message = Message::Flush(done);
        while let Err(TrySendError::Full(unsent)) = self.waiting.try_send(message) {
            if Instant::now() > until {
                return;
            }
            message = unsent;
            std::thread::sleep(PAUSE);
        }
        let left = until.saturating_duration_since(Instant::now());
        // If they are not written by then, nobody is going to read them.
        written.recv_timeout(left).ok();
    }
}

/// Each call is a whole line.
impl Write for Lines {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.waiting.try_send(Message::Line(line.to_vec())).is_err() {
            self.dropped.inc();
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What cannot be written is lost, as with a closed terminal.
fn write(lines: &Receiver<Message>, mut out: impl Write) {
    while let Ok(first) = lines.recv() {
        let mut text = Vec::new();
        let mut flushes = Vec::new();
        let mut taken = 0;
        for message in std::iter::once(first).chain(lines.try_iter().take(TOGETHER - 1)) {
            taken += 1;
            match message {
                Message::Line(line) => text.extend(line),
                Message::Flush(done) => flushes.push(done),
            }
        }
        out.write_all(&text).ok();
        out.flush().ok();
        for done in flushes {
            done.send(()).ok();
        }
        if taken < TOGETHER {
            std::thread::sleep(BREATH);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use parking_lot::Mutex;

    use super::*;

    /// Writes only while nobody holds its lock.
    #[derive(Clone, Default)]
    struct Stuck(Arc<Mutex<Vec<u8>>>);

    impl Write for Stuck {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn lines_that_nobody_reads_are_dropped_and_counted_and_hold_up_nothing() {
        const LINES: u64 = 1_000;
        const MOST: usize = 4;
        let (out, dropped) = (Stuck::default(), Counter::default());
        let mut lines = Lines::few(MOST, out.clone(), dropped.clone()).expect("a thread");
        let stuck = out.0.lock();
        for line in 0..LINES {
            let line = format!("{line}\n");
            lines
                .write_all(line.as_bytes())
                .expect("it takes everything");
        }
        lines.flush(Duration::from_millis(1));
        drop(stuck);
        lines.flush(Duration::from_secs(60));
        let written = String::from_utf8(out.0.lock().clone()).expect("UTF-8");
        let written: Vec<u64> = written
            .lines()
            .map(|line| line.parse().expect("whole lines"))
            .collect();
        assert_eq!(written.len() as u64 + dropped.get(), LINES);
        assert!(dropped.get() > LINES / 2, "{}", dropped.get());
        let first: Vec<u64> = (0..LINES).take(MOST).collect();
        assert!(written.starts_with(&first), "the first ones: {written:?}");
        assert!(written.is_sorted(), "{written:?}");
    }

    #[test]
    fn what_was_logged_is_written_once_it_is_flushed() {
        let (out, dropped) = (Stuck::default(), Counter::default());
        let mut lines = Lines::to(out.clone(), dropped.clone()).expect("a thread");
        let expected: Vec<String> = (0..WAITING / 2).map(|line| format!("{line}\n")).collect();
        for line in &expected {
            lines
                .write_all(line.as_bytes())
                .expect("it takes everything");
        }
        lines.flush(Duration::from_secs(60));
        assert_eq!(*out.0.lock(), expected.concat().as_bytes());
        assert_eq!(dropped.get(), 0);
    }
}
