//! The body of an upload: written to disk as it arrives, never held in memory; limits on length and slowness.

use std::io::Write as _;
use std::time::Duration;

use axum::body::Body;
use axum::http::HeaderMap;
use bytes::Bytes;
use flate2::write::MultiGzDecoder;
use futures_util::StreamExt as _;
use tokio::sync::mpsc;
use tokio::task::spawn_blocking;
use tokio::time::Instant;

use crate::catalogue::Staged;
use crate::http::AppState;
use crate::http::body::{Coding, announced_length, broken_off};
use crate::http::caller::Caller;
use crate::http::off_thread::Place;
use crate::http::problem::Problem;

/// Minimum average bytes a second: a slower sender would hold a place for nothing.
pub(in crate::http) const SLOWEST: f64 = 8.0 * 1024.0;

/// A packed file may be longer than plain by a sixteenth and this, in bytes; what is sent beyond that packs nothing.
const WRAPPING: u64 = 1024;

/// Capacity of the channel from the connection to the disk.
const PIECES: usize = 4;

/// Messages to the writing thread.
enum Piece {
    Bytes(Bytes),
    End,
}

/// The whole body, once received, as a file, and its place among the uploads.
pub(super) async fn receive(
    state: &AppState,
    caller: &Caller,
    headers: &HeaderMap,
    body: Body,
) -> Result<(Staged, Place), Problem> {
    let (limit, timeout) = (state.rules.limits.terrain_bytes, state.body_timeout);
    let coding = Coding::of(headers)?;
    if announced_length(headers).is_some_and(|length| length > limit) {
        return Err(Problem::TerrainTooLarge(limit));
    }
    let place = state.terrains.uploads.take(caller, timeout).await;
    let place = place.ok_or(Problem::TooManyUploads(super::UPLOADS))?;
    let staged = state.terrains.ask(move |catalogue| catalogue.stage(limit));
    let sink = Sink::new(staged.await?, coding);
    let (pieces, coming) = mpsc::channel(PIECES);
    let span = tracing::Span::current();
    // It mostly waits for its caller, so it must not take one of the per-core places for work.
    let writing = spawn_blocking(move || span.in_scope(|| write(sink, coming)));
    let sent = send(body, &pieces, (limit, timeout)).await;
    // An upload that was cut off never sends its end marker, and is removed.
    drop(pieces);
    let written = writing.await.unwrap_or(Err(Problem::Internal));
    sent?;
    Ok((written?, place))
}

/// Pass the body on, piece by piece.
async fn send(
    body: Body,
    pieces: &mpsc::Sender<Piece>,
    (limit, timeout): (u64, Duration),
) -> Result<(), Problem> {
    let longest = limit.saturating_add(limit / 16 + WRAPPING);
    let mut frames = body.into_data_stream();
    let mut since = Instant::now();
    let mut received = 0;
    loop {
        let at_this_pace = since + timeout + Duration::from_secs_f64(received as f64 / SLOWEST);
        let deadline = (Instant::now() + timeout).min(at_this_pace);
        let piece = match tokio::time::timeout_at(deadline, frames.next()).await {
            Err(_) => return Err(Problem::UploadStalled(timeout)),
            Ok(None) => Piece::End,
            Ok(Some(Ok(bytes))) => {
                received += bytes.len();
                if received as u64 > longest {
                    return Err(Problem::TerrainTooLarge(limit));
                }
                Piece::Bytes(bytes)
            }
            Ok(Some(Err(error))) => return Err(broken_off(&error)),
        };
        let is_end = matches!(piece, Piece::End);
        let handed = Instant::now();
        // The writer stops listening when it has failed, and reports why.
        if pieces.send(piece).await.is_err() || is_end {
            return Ok(());
        }
        // Time spent on the disk does not count against the caller.
        since += handed.elapsed();
    }
}

/// Where the bytes are written.
enum Sink {
    Plain(Staged),
    Gzip(Box<MultiGzDecoder<Staged>>),
}

impl Sink {
    fn new(staged: Staged, coding: Coding) -> Self {
        match coding {
            Coding::Plain => Self::Plain(staged),
            Coding::Gzip => Self::Gzip(Box::new(MultiGzDecoder::new(staged))),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Problem> {
        let written = match self {
            Self::Plain(staged) => staged.write_all(bytes),
            Self::Gzip(decoder) => decoder.write_all(bytes),
        };
        written.map_err(|error| self.problem(&error))
    }

    fn finish(mut self) -> Result<Staged, Problem> {
        let finished = match &mut self {
            Self::Plain(_) => Ok(()),
            Self::Gzip(decoder) => decoder.try_finish(),
        };
        finished.map_err(|error| self.problem(&error))?;
        match self {
            Self::Plain(staged) => Ok(staged),
            Self::Gzip(decoder) => decoder.finish().map_err(|error| gzip(&error)),
        }
    }

    fn problem(&mut self, error: &std::io::Error) -> Problem {
        let staged = match self {
            Self::Plain(staged) => staged,
            Self::Gzip(decoder) => decoder.get_mut(),
        };
        let failure = staged.failure();
        failure.map_or_else(|| gzip(error), Problem::from)
    }
}

fn gzip(error: &std::io::Error) -> Problem {
    Problem::BodyNotGzip(error.to_string())
}

fn write(mut sink: Sink, mut coming: mpsc::Receiver<Piece>) -> Result<Staged, Problem> {
    loop {
        match coming.blocking_recv() {
            Some(Piece::Bytes(bytes)) => sink.write(&bytes)?,
            Some(Piece::End) => return sink.finish(),
            None => return Err(Problem::BodyIncomplete),
        }
    }
}
