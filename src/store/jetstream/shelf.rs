//! Where the nodes share their datasets: records in a bucket, files in an object store.
//!
//! Deliberately absent: what is in them (`catalogue`). A file is an object of a name that nothing else
//! ever has; chunks of one that was never finished are told by the stream alone, and go by their own name.

use std::collections::BTreeSet;
use std::fmt;
use std::io::{self, Read, Write};
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context as Task, Poll};
use std::time::{Duration, Instant};

use async_nats::Client;
use async_nats::connection::State as Connection;
use async_nats::jetstream::kv::{self, Operation, UpdateErrorKind};
use async_nats::jetstream::object_store::{
    GetErrorKind, InfoErrorKind, ObjectMetadata, ObjectStore,
};
use async_nats::jetstream::stream::Stream;
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE;
use futures_util::{StreamExt as _, TryStreamExt as _};
use tokio::io::{AsyncRead, AsyncReadExt as _, ReadBuf};
use tokio::runtime::Handle;
use uuid::Uuid;

use super::connect::{Servers, connect, maker};
use super::settings::Settings;
use super::trouble::failed;
use crate::catalogue::{Change, Changes, Shelf};
use crate::store::{StoreError, Trouble};

/// Records are read and written so soon, or the servers are away.
const PATIENCE: Duration = Duration::from_secs(10);

/// Some of a file comes in so long, or the servers are away.
const STALL: Duration = Duration::from_secs(10);

/// A file that has not been put by then never is: whoever finds its chunks later may remove them.
const LONGEST_PUT: Duration = Duration::from_secs(30 * 60);

/// A file that has not been fetched by then is asked for again.
const LONGEST_FETCH: Duration = LONGEST_PUT;

/// Bytes in a message; servers take messages of 1 MiB unless told otherwise.
const CHUNK: usize = 256 << 10;

/// What chunks of unfinished files go by.
const UNFINISHED: &str = "unfinished.";

/// Servers that could not be reached a moment ago are taken to be away still.
const RESPITE: Duration = Duration::from_secs(1);

/// Where the nodes of a namespace share their datasets; connected when something is first asked for.
///
/// Its methods block: they may be called from threads that plan or are kept for blocking work, not from
/// tasks.
pub struct JetStreamShelf {
    runtime: Handle,
    settings: Settings,
    opening: Mutex<Opening>,
}

/// How far the connection is.
#[derive(Default)]
struct Opening {
    opened: Option<Arc<Opened>>,
    failed: Option<(Instant, StoreError)>,
}

/// What is there once the servers have been reached; the client comes back to them by itself.
struct Opened {
    client: Client,
    records: kv::Store,
    files: ObjectStore,
    /// The stream of `files`.
    chunks: Stream,
    /// Their bucket.
    bucket: String,
}

impl JetStreamShelf {
    /// On the servers of the settings.
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
        let mut opening = self.opening.lock().unwrap_or_else(PoisonError::into_inner);
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

    /// Have the servers do something, but wait no longer than that.
    fn ask<T, E: From<StoreError>>(
        &self,
        patience: Duration,
        work: impl AsyncFnOnce(&Opened) -> Result<T, E>,
    ) -> Result<T, E> {
        let opened = self.opened()?;
        if opened.client.connection_state() != Connection::Connected {
            return Err(StoreError::unavailable("no NATS server answers").into());
        }
        let done = async { tokio::time::timeout(patience, work(&opened)).await };
        self.runtime.block_on(done).unwrap_or_else(|_| {
            Err(StoreError::unavailable("the NATS servers take too long").into())
        })
    }
}

impl Opened {
    /// Connect, and make what is missing on the servers.
    async fn new(settings: &Settings) -> Result<Self, StoreError> {
        let client = connect(settings).await?;
        let context = Servers::context(&client);
        let make = maker(&context, settings);
        let records = make.bucket("terrains", Duration::ZERO).await?;
        let files = make.objects("terrains").await?;
        let bucket = make.name("terrains");
        let stream = format!("OBJ_{bucket}");
        let chunks = context
            .get_stream(&stream)
            .await
            .map_err(|error| failed(&format!("stream {stream}"), &error))?;
        Ok(Self {
            client,
            records,
            files,
            chunks,
            bucket,
        })
    }

    async fn read_changes(&self, after: u64) -> Result<Changes, StoreError> {
        let what = || format!("records of {}", self.bucket);
        let info = self.records.stream.get_info().await;
        let state = info.map_err(|error| failed(&what(), &error))?.state;
        let mut read = Changes {
            revision: state.last_sequence,
            changes: Vec::new(),
        };
        if state.last_sequence <= after || state.messages == 0 {
            return Ok(read);
        }
        let records = self.records.watch_all_from_revision(after + 1).await;
        let mut records = records.map_err(|error| failed(&what(), &error))?;
        while let Some(record) = records.next().await {
            let record = record.map_err(|error| failed(&what(), &error))?;
            let value = match record.operation {
                Operation::Put => Some(String::from_utf8_lossy(&record.value).into_owned()),
                Operation::Delete | Operation::Purge => None,
            };
            read.changes.push(Change {
                key: record.key,
                value,
                revision: record.revision,
            });
            // To the very end: a record that is written over meanwhile comes later, not twice.
            if record.delta == 0 && record.revision >= state.last_sequence {
                read.revision = record.revision;
                return Ok(read);
            }
        }
        Err(StoreError::unavailable(format!("{} broke off", what())))
    }

    async fn put_file(&self, file: &mut dyn Read) -> Result<String, StoreError> {
        let name = Uuid::now_v7().to_string();
        let object = ObjectMetadata {
            name: name.clone(),
            chunk_size: Some(CHUNK),
            ..ObjectMetadata::default()
        };
        let put = self.files.put(object, &mut Blocking(file)).await;
        put.map_err(|error| failed(&format!("file {name}"), &error))?;
        Ok(name)
    }

    async fn fetch_file(&self, name: &str, to: &mut dyn Write) -> Result<bool, Fetch> {
        let what = || format!("file {name}");
        let object = tokio::time::timeout(STALL, self.files.get(name)).await;
        let mut object = match object.map_err(|_| Fetch::stalled(name))? {
            Ok(object) => object,
            Err(error) if error.kind() == GetErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(Fetch::From(failed(&what(), &error))),
        };
        let mut bytes = vec![0; 1 << 16];
        loop {
            let read = tokio::time::timeout(STALL, object.read(&mut bytes)).await;
            let read = read.map_err(|_| Fetch::stalled(name))?;
            match read.map_err(|error| Fetch::From(failed(&what(), &error)))? {
                0 => return Ok(true),
                length => to.write_all(&bytes[..length]).map_err(Fetch::To)?,
            }
        }
    }

    async fn list_files(&self) -> Result<BTreeSet<String>, StoreError> {
        // Chunks first: those of a file that is finished meanwhile are its own.
        let mut unfinished = self.under(&self.chunks_of("")).await?;
        let mut files = BTreeSet::new();
        // One by one: a list of the client's waits for ever for what another node takes away meanwhile.
        for head in self.under(&self.head_of("")).await? {
            let name = URL_SAFE.decode(&head).ok();
            let Some(name) = name.and_then(|name| String::from_utf8(name).ok()) else {
                continue;
            };
            match self.files.info(&name).await {
                Ok(object) => {
                    unfinished.remove(&object.nuid);
                    files.insert(name);
                }
                Err(error) if error.kind() == InfoErrorKind::NotFound => {}
                Err(error) => return Err(failed(&format!("file {name}"), &error)),
            }
        }
        let unfinished = unfinished.into_iter();
        files.extend(unfinished.map(|chunks| format!("{UNFINISHED}{chunks}")));
        Ok(files)
    }

    /// What follows a prefix in subjects of the stream.
    async fn under(&self, prefix: &str) -> Result<BTreeSet<String>, StoreError> {
        let what = || format!("files of {}", self.bucket);
        let subjects = self.chunks.info_with_subjects(format!("{prefix}>")).await;
        let subjects = subjects.map_err(|error| failed(&what(), &error))?;
        let ends = subjects.try_filter_map(async |(subject, _)| {
            Ok(subject.strip_prefix(prefix).map(str::to_owned))
        });
        let ends = ends.try_collect().await;
        ends.map_err(|error| failed(&what(), &error))
    }

    async fn discard_file(&self, name: &str) -> Result<(), StoreError> {
        if let Some(chunks) = name.strip_prefix(UNFINISHED) {
            return self.purge(self.chunks_of(chunks)).await;
        }
        let object = match self.files.info(name).await {
            Ok(object) => object,
            Err(error) if error.kind() == InfoErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(failed(&format!("file {name}"), &error)),
        };
        // Without its head it is not found any more; chunks that remain are found as unfinished.
        let head = self.head_of(&URL_SAFE.encode(name));
        self.purge(head).await?;
        self.purge(self.chunks_of(&object.nuid)).await
    }

    async fn purge(&self, subject: String) -> Result<(), StoreError> {
        let purged = self.chunks.purge().filter(&subject).await;
        purged.map_err(|error| failed(&subject, &error))?;
        Ok(())
    }

    fn head_of(&self, file: &str) -> String {
        format!("$O.{}.M.{file}", self.bucket)
    }

    fn chunks_of(&self, file: &str) -> String {
        format!("$O.{}.C.{file}", self.bucket)
    }
}

impl fmt::Debug for JetStreamShelf {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "JetStreamShelf({:?})", self.settings.address)
    }
}

impl Shelf for JetStreamShelf {
    fn changes(&self, after: u64) -> io::Result<Changes> {
        let read = self.ask(PATIENCE, async |servers| servers.read_changes(after).await);
        read.map_err(unavailable)
    }

    fn write(&self, key: &str, value: &str, expected: u64) -> io::Result<Option<u64>> {
        let written = self.ask(PATIENCE, async |servers| {
            let value = value.to_owned().into();
            match servers.records.update(key, value, expected).await {
                Ok(revision) => Ok(Some(revision)),
                Err(error) if error.kind() == UpdateErrorKind::WrongLastRevision => Ok(None),
                Err(error) => Err(failed(&format!("record {key}"), &error)),
            }
        });
        written.map_err(unavailable)
    }

    fn erase(&self, key: &str, expected: u64) -> io::Result<bool> {
        let erased = self.ask(PATIENCE, async |servers| {
            let erased = servers.records.delete_expect_revision(key, Some(expected));
            match erased.await {
                Ok(()) => Ok(true),
                Err(error) if error.kind() == UpdateErrorKind::WrongLastRevision => Ok(false),
                Err(error) => Err(failed(&format!("record {key}"), &error)),
            }
        });
        erased.map_err(unavailable)
    }

    fn put(&self, file: &mut dyn Read) -> io::Result<String> {
        let put = self.ask(LONGEST_PUT, async |servers| servers.put_file(file).await);
        put.map_err(unavailable)
    }

    fn fetch(&self, file: &str, to: &mut dyn Write) -> io::Result<bool> {
        let fetched = self.ask(LONGEST_FETCH, async |servers| {
            servers.fetch_file(file, to).await
        });
        fetched.map_err(|error| match error {
            Fetch::From(error) => unavailable(error),
            Fetch::To(error) => error,
        })
    }

    fn files(&self) -> io::Result<BTreeSet<String>> {
        let listed = self.ask(PATIENCE, async |servers| servers.list_files().await);
        listed.map_err(unavailable)
    }

    fn discard(&self, file: &str) -> io::Result<()> {
        let discarded = self.ask(PATIENCE, async |servers| servers.discard_file(file).await);
        discarded.map_err(unavailable)
    }
}

/// Which side of a fetch failed.
enum Fetch {
    From(StoreError),
    To(io::Error),
}

impl From<StoreError> for Fetch {
    fn from(error: StoreError) -> Self {
        Self::From(error)
    }
}

impl Fetch {
    fn stalled(name: &str) -> Self {
        let detail = format!("file {name}: nothing came for {} s", STALL.as_secs());
        Self::From(StoreError::unavailable(detail))
    }
}

/// A file that is read on the thread that waits for it anyway.
struct Blocking<'a>(&'a mut dyn Read);

impl AsyncRead for Blocking<'_> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        _: &mut Task<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let length = self.0.read(buffer.initialize_unfilled())?;
        buffer.advance(length);
        Poll::Ready(Ok(()))
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
