//! Where the nodes share their datasets: records in a bucket, files in an object store.
//!
//! Deliberately absent: what is in them (`catalogue`). Every file is an object with a name that is never reused; chunks
//! of an unfinished file appear in the stream alone, and are identified by their own name.

mod opened;

use std::collections::BTreeSet;
use std::fmt;
use std::io::{self, Write};
use std::mem;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tokio::runtime::Handle;

use self::opened::Opened;
use super::election::outlast;
use super::errors::{is_vanished, passes};
use super::settings::Settings;
use crate::catalogue::{Changes, Shelf, Source};
use crate::store::{StoreError, Trouble};

/// If records are not read or written within this time, the servers are considered away.
const PATIENCE: Duration = Duration::from_secs(20);

/// A file not stored within this time never will be: whoever finds its chunks later may remove them.
const LONGEST_PUT: Duration = Duration::from_secs(30 * 60);

/// A file not fetched within this time is requested again.
const LONGEST_FETCH: Duration = LONGEST_PUT;

/// Servers that could not be reached less than this ago are assumed to be still away.
const RESPITE: Duration = Duration::from_secs(1);

/// Where the nodes of a namespace share their datasets; connected when something is first asked for.
///
/// Its methods block: call them from planning threads or threads for blocking work, not from tasks.
pub struct JetStreamShelf {
    runtime: Handle,
    settings: Settings,
    opening: Mutex<Opening>,
}

/// The state of the connection.
#[derive(Default)]
struct Opening {
    opened: Option<Arc<Opened>>,
    failed: Option<(Instant, StoreError)>,
}

impl JetStreamShelf {
    /// On the servers in the settings.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            runtime: Handle::current(),
            settings,
            opening: Mutex::default(),
        }
    }

    fn opened(&self) -> Result<Arc<Opened>, StoreError> {
        let mut opening = self.opening.lock();
        if let Some(opened) = &opening.opened {
            return Ok(opened.clone());
        }
        if let Some((failed, error)) = &opening.failed
            && failed.elapsed() < RESPITE
        {
            return Err(error.clone());
        }
        match self.runtime.block_on(Opened::new(&self.settings)) {
            Ok(opened) => Ok(opening.opened.insert(Arc::new(opened)).clone()),
            Err(error) => {
                opening.failed = Some((Instant::now(), error.clone()));
                Err(error)
            }
        }
    }

    /// Ask the servers for something, with this time limit; retry during an election.
    fn ask<T, E: Into<Failure>>(
        &self,
        patience: Duration,
        mut work: impl AsyncFnMut(&Opened) -> Result<T, E>,
    ) -> io::Result<T> {
        self.once(patience, async |servers| {
            let passes =
                |failure: &Failure| matches!(failure, Failure::Servers(error) if passes(error));
            outlast(passes, async || work(servers).await.map_err(Into::into)).await
        })
    }

    fn once<T>(
        &self,
        patience: Duration,
        work: impl AsyncFnOnce(&Opened) -> Result<T, Failure>,
    ) -> io::Result<T> {
        let opened = self.opened().map_err(unavailable)?;
        if !opened.is_connected() {
            return Err(unavailable(StoreError::unavailable(
                "no NATS server answers",
            )));
        }
        let done = async { tokio::time::timeout(patience, work(&opened)).await };
        let done = self.runtime.block_on(done).unwrap_or_else(|_| {
            let late = StoreError::unavailable("the NATS servers take too long");
            Err(late.into())
        });
        if matches!(&done, Err(Failure::Servers(error)) if is_vanished(error)) {
            // They are made again when something is asked for next.
            self.opening.lock().opened = None;
        }
        done.map_err(|failure| match failure {
            Failure::Servers(error) => unavailable(error),
            Failure::File(error) => error,
        })
    }
}

impl fmt::Debug for JetStreamShelf {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "JetStreamShelf({:?})", self.settings.address)
    }
}

impl Shelf for JetStreamShelf {
    fn changes(&self, after: u64) -> io::Result<Changes> {
        self.ask(PATIENCE, async |servers| servers.changes(after).await)
    }

    fn write(&self, key: &str, value: &str, expected: u64) -> io::Result<Option<u64>> {
        let mut asked = false;
        self.ask(PATIENCE, async |servers| {
            let again = mem::replace(&mut asked, true);
            let written = servers.write(key, value, expected).await;
            match written {
                Ok(None) if again => servers.said_already(key, Some(value), expected).await,
                written => written,
            }
        })
    }

    fn erase(&self, key: &str, expected: u64) -> io::Result<bool> {
        let mut asked = false;
        let erased = self.ask(PATIENCE, async |servers| {
            let again = mem::replace(&mut asked, true);
            let erased = servers.erase(key, expected).await;
            match erased {
                Ok(None) if again => {
                    let said = servers.said_already(key, None, expected).await;
                    said.map(|revision| revision.map(drop))
                }
                erased => erased,
            }
        });
        Ok(erased?.is_some())
    }

    fn put(&self, file: &mut dyn Source) -> io::Result<String> {
        self.ask(LONGEST_PUT, async |servers| servers.put(file).await)
    }

    fn fetch(&self, file: &str, to: &mut dyn Write) -> io::Result<bool> {
        // What has been written already cannot be taken back.
        self.once(LONGEST_FETCH, async |servers| servers.fetch(file, to).await)
    }

    fn files(&self) -> io::Result<BTreeSet<String>> {
        self.ask(PATIENCE, async |servers| servers.files().await)
    }

    fn discard(&self, file: &str) -> io::Result<()> {
        self.ask(PATIENCE, async |servers| servers.discard(file).await)
    }
}

/// Which side failed.
enum Failure {
    Servers(StoreError),
    /// Reading or writing the local file failed.
    File(io::Error),
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        Self::Servers(error)
    }
}

fn unavailable(error: StoreError) -> io::Error {
    let kind = match &error {
        StoreError::Unavailable {
            trouble: Trouble::Full,
            ..
        } => io::ErrorKind::StorageFull,
        _ => io::ErrorKind::Other,
    };
    io::Error::new(kind, error)
}
