//! The requests to the servers behind each shelf operation.

use std::collections::BTreeSet;
use std::io::{self, SeekFrom, Write};
use std::pin::Pin;
use std::task::{Context as Task, Poll};
use std::time::Duration;

use async_nats::Client;
use async_nats::connection::State as Connection;
use async_nats::jetstream::kv::{self, Operation};
use async_nats::jetstream::object_store::{
    GetErrorKind, InfoErrorKind, ObjectMetadata, ObjectStore,
};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE;
use futures_util::{StreamExt as _, TryStreamExt as _};
use tokio::io::{AsyncRead, AsyncReadExt as _, ReadBuf};
use tokio::time::timeout;
use uuid::Uuid;

use super::Failure;
use crate::catalogue::{Change, Changes, Source};
use crate::store::StoreError;
use crate::store::jetstream::bucket::Bucket;
use crate::store::jetstream::connect::{Servers, connect};
use crate::store::jetstream::election::outlast;
use crate::store::jetstream::errors::{failed, is_outrun, passes};
use crate::store::jetstream::maker::Maker;
use crate::store::jetstream::settings::Settings;

/// If no part of a file arrives for this long, the servers are considered away.
const STALL: Duration = Duration::from_secs(10);

/// Bytes in a message; servers accept messages of 1 MiB by default.
const CHUNK: usize = 256 << 10;

/// Name prefix for chunks of unfinished files.
const UNFINISHED: &str = "unfinished.";

/// What exists once the servers have been reached; the client reconnects by itself.
pub(super) struct Opened {
    client: Client,
    records: kv::Store,
    files: ObjectStore,
    /// What underlies `files`.
    bucket: Bucket,
}

impl Opened {
    /// Connect, and create what is missing on the servers.
    pub(super) async fn new(settings: &Settings) -> Result<Self, StoreError> {
        let client = connect(settings).await?;
        let context = Servers::context(&client);
        let make = Maker::new(&context, settings);
        outlast(passes, async || Box::pin(Self::made(&client, &make)).await).await
    }

    async fn made(client: &Client, make: &Maker<'_>) -> Result<Self, StoreError> {
        Ok(Self {
            client: client.clone(),
            records: make.bucket("terrains", Duration::ZERO).await?,
            files: make.objects("terrains").await?,
            bucket: make.beneath(make.name("terrains")).await?,
        })
    }

    pub(super) fn is_connected(&self) -> bool {
        self.client.connection_state() == Connection::Connected
    }

    pub(super) async fn changes(&self, after: u64) -> Result<Changes, StoreError> {
        let what = || format!("records of {}", self.bucket.name);
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
            // Read to the very end: a record overwritten meanwhile comes later, not twice.
            if record.delta == 0 && record.revision >= state.last_sequence {
                read.revision = record.revision;
                return Ok(read);
            }
        }
        Err(StoreError::unavailable(format!("{} broke off", what())))
    }

    /// The revision of this write; `None` when another writer was faster.
    pub(super) async fn write(
        &self,
        key: &str,
        value: &str,
        expected: u64,
    ) -> Result<Option<u64>, StoreError> {
        let written = self.records.update(key, value.to_owned().into(), expected);
        match written.await {
            Ok(revision) => Ok(Some(revision)),
            Err(error) if is_outrun(&error) => Ok(None),
            Err(error) => Err(failed(&format!("record {key}"), &error)),
        }
    }

    /// `None` when another writer was faster.
    pub(super) async fn erase(&self, key: &str, expected: u64) -> Result<Option<()>, StoreError> {
        let erased = self.records.delete_expect_revision(key, Some(expected));
        match erased.await {
            Ok(()) => Ok(Some(())),
            Err(error) if is_outrun(&error) => Ok(None),
            Err(error) => Err(failed(&format!("record {key}"), &error)),
        }
    }

    /// The revision of a write after `expected` with exactly this content, or of a removal for `None`: perhaps our own
    /// write whose answer was lost.
    pub(super) async fn said_already(
        &self,
        key: &str,
        value: Option<&str>,
        expected: u64,
    ) -> Result<Option<u64>, StoreError> {
        let since = self.changes(expected).await?.changes;
        let last = since.into_iter().find(|change| change.key == key);
        Ok(last
            .filter(|change| change.value.as_deref() == value)
            .map(|change| change.revision))
    }

    pub(super) async fn put(&self, file: &mut dyn Source) -> Result<String, Failure> {
        file.seek(SeekFrom::Start(0)).map_err(Failure::File)?;
        let mut file = Blocking { file, failed: None };
        let name = Uuid::now_v7().to_string();
        let object = ObjectMetadata {
            name: name.clone(),
            chunk_size: Some(CHUNK),
            ..ObjectMetadata::default()
        };
        let put = self.files.put(object, &mut file).await;
        match (put, file.failed) {
            (_, Some(unread)) => Err(Failure::File(unread)),
            (Err(error), None) => Err(failed(&format!("file {name}"), &error).into()),
            (Ok(_), None) => Ok(name),
        }
    }

    pub(super) async fn fetch(&self, name: &str, to: &mut dyn Write) -> Result<bool, Failure> {
        let what = || format!("file {name}");
        let object = timeout(STALL, self.files.get(name)).await;
        let mut object = match object.map_err(|_| stalled(name))? {
            Ok(object) => object,
            Err(error) if error.kind() == GetErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(failed(&what(), &error).into()),
        };
        let mut bytes = vec![0; 1 << 16];
        loop {
            let read = timeout(STALL, object.read(&mut bytes)).await;
            let read = read.map_err(|_| stalled(name))?;
            match read.map_err(|error| failed(&what(), &error))? {
                0 => return Ok(true),
                length => to.write_all(&bytes[..length]).map_err(Failure::File)?,
            }
        }
    }

    pub(super) async fn files(&self) -> Result<BTreeSet<String>, StoreError> {
        // Chunks first: those of a file that is finished meanwhile then belong to it.
        let mut unfinished = self.under(&self.bucket.chunks_of("")).await?;
        let mut files = BTreeSet::new();
        // One by one: the client's own listing waits for ever for entries that another node removes meanwhile.
        for head in self.under(&self.bucket.head_of("")).await? {
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

    /// The rest of each of the stream's subjects with this prefix.
    async fn under(&self, prefix: &str) -> Result<BTreeSet<String>, StoreError> {
        let what = || format!("files of {}", self.bucket.name);
        let subjects = self
            .bucket
            .stream
            .info_with_subjects(format!("{prefix}>"))
            .await;
        let subjects = subjects.map_err(|error| failed(&what(), &error))?;
        let ends = subjects.try_filter_map(async |(subject, _)| {
            Ok(subject.strip_prefix(prefix).map(str::to_owned))
        });
        let ends = ends.try_collect().await;
        ends.map_err(|error| failed(&what(), &error))
    }

    pub(super) async fn discard(&self, name: &str) -> Result<(), StoreError> {
        if let Some(chunks) = name.strip_prefix(UNFINISHED) {
            return self.bucket.purge(self.bucket.chunks_of(chunks)).await;
        }
        let object = match self.files.info(name).await {
            Ok(object) => object,
            Err(error) if error.kind() == InfoErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(failed(&format!("file {name}"), &error)),
        };
        // Without its head the file is no longer found; remaining chunks are found as unfinished.
        self.bucket.purge(self.bucket.head_of(name)).await?;
        let chunks = self.bucket.chunks_of(&object.nuid);
        self.bucket.purge(chunks).await
    }
}

fn stalled(name: &str) -> StoreError {
    let patience = STALL.as_secs();
    StoreError::unavailable(format!("file {name}: nothing came for {patience} s"))
}

/// A file read on a thread that may block anyway.
struct Blocking<'a> {
    file: &'a mut dyn Source,
    failed: Option<io::Error>,
}

impl AsyncRead for Blocking<'_> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        _: &mut Task<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match self.file.read(buffer.initialize_unfilled()) {
            Ok(length) => {
                buffer.advance(length);
                Poll::Ready(Ok(()))
            }
            Err(error) => {
                let kind = error.kind();
                self.failed = Some(error);
                Poll::Ready(Err(kind.into()))
            }
        }
    }
}
