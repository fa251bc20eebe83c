//! Documents that are too long for a message: in an object store, cut into chunks.
//!
//! The servers deliver an object by themselves, as fast as they can. Where that yields nothing whole, the leader of the
//! stream is asked for each part: only it can tell a document that is lost from one that a server has not got yet.
//!
//! Objects are not written by the client, whose chunks have random names that only the head tells: those of an object
//! that was never finished could not be found again. Here they begin with the name of the object, and so with the plan.

use std::collections::HashMap;
use std::io;

use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::object_store::{GetErrorKind, InfoErrorKind, ObjectInfo, ObjectOptions};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE;
use bytes::Bytes;
use sha2::{Digest as _, Sha256};
use tokio::io::AsyncReadExt as _;
use tokio::time::timeout;
use uuid::Uuid;

use super::connect::{PATIENCE, Servers};
use super::errors::{failed, found};
use crate::job::PlanId;
use crate::store::StoreError;

/// Bytes in a chunk; servers accept messages of 1 MiB by default.
const CHUNK: usize = 128 << 10;

impl Servers {
    /// Store an object in place of the one that had this name; nothing is left of one that is refused.
    pub(super) async fn put_object(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let before = self.head(key).await.ok().flatten();
        let nuid = format!("{key}.{}", Uuid::new_v4().simple());
        let put = self.put_parts(key, &nuid, bytes).await;
        let useless = match &put {
            Ok(()) => before.map(|before| before.nuid),
            Err(_) => Some(nuid),
        };
        if let Some(nuid) = useless
            && let Err(error) = self.bucket.purge(self.bucket.chunks_of(&nuid)).await
        {
            tracing::debug!(%error, key, "parts of a document are left until its plan is removed");
        }
        put
    }

    /// The head comes last: without it there is no object.
    async fn put_parts(&self, key: &str, nuid: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let chunks = self.bucket.chunks_of(nuid);
        for chunk in bytes.chunks(CHUNK) {
            let chunk = PublishMessage::build().payload(Bytes::copy_from_slice(chunk));
            self.publish_part(key, chunks.clone(), chunk).await?;
        }
        let head = ObjectInfo {
            name: key.to_owned(),
            description: None,
            metadata: HashMap::new(),
            headers: None,
            options: Some(ObjectOptions {
                link: None,
                max_chunk_size: Some(CHUNK),
            }),
            bucket: self.bucket.name.clone(),
            nuid: nuid.to_owned(),
            size: bytes.len(),
            chunks: bytes.len().div_ceil(CHUNK),
            modified: None,
            digest: Some(digest(bytes)),
            deleted: false,
        };
        let head = serde_json::to_vec(&head).map_err(|error| failed(&document(key), &error))?;
        let head = PublishMessage::build()
            .header("Nats-Rollup", "sub")
            .payload(head.into());
        self.publish_part(key, self.bucket.head_of(key), head).await
    }

    async fn publish_part(
        &self,
        key: &str,
        subject: String,
        part: PublishMessage,
    ) -> Result<(), StoreError> {
        let written = self.publish(subject, part).await;
        written
            .map(drop)
            .map_err(|error| failed(&document(key), &error))
    }

    /// Remove objects of a plan, and what there is of unfinished ones. This writes nothing: full servers do it too.
    pub(super) async fn remove_objects(
        &self,
        id: PlanId,
        keys: &[String],
    ) -> Result<(), StoreError> {
        if keys.is_empty() {
            return Ok(());
        }
        let bucket = &self.bucket;
        bucket.purge(bucket.chunks_of(&format!("{id}.>"))).await?;
        for key in keys {
            let Some(object) = self.head(key).await? else {
                continue;
            };
            // Earlier versions gave them other names.
            if !object.nuid.starts_with(key.as_str()) {
                bucket.purge(bucket.chunks_of(&object.nuid)).await?;
            }
            bucket.purge(bucket.head_of(key)).await?;
        }
        Ok(())
    }

    async fn head(&self, key: &str) -> Result<Option<ObjectInfo>, StoreError> {
        match self.objects.info(key).await {
            Ok(object) => Ok(Some(object)),
            Err(error) if error.kind() == InfoErrorKind::NotFound => Ok(None),
            Err(error) => Err(failed(&document(key), &error)),
        }
    }

    /// `None` when the servers have lost it, or a part of it.
    pub(super) async fn get_object(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        match self.delivered(key).await? {
            Some(bytes) => Ok(Some(bytes)),
            None => self.object_of_the_leader(key).await,
        }
    }

    /// `None` when what is delivered is not whole. An object whose chunks are gone would be waited for in vain.
    async fn delivered(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let mut object = match self.objects.get(key).await {
            Ok(object) => object,
            Err(error) => {
                return match error.kind() {
                    // The latter may be a head that cannot be read.
                    GetErrorKind::NotFound | GetErrorKind::Other => Ok(None),
                    _ => Err(failed(&document(key), &error)),
                };
            }
        };
        let mut bytes = Vec::with_capacity(object.info().size);
        loop {
            let Ok(read) = timeout(PATIENCE, object.read_buf(&mut bytes)).await else {
                return Ok(None);
            };
            match read {
                Ok(0) => return Ok(Some(bytes)),
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::InvalidData => return Ok(None),
                Err(error) => return Err(failed(&document(key), &error)),
            }
        }
    }

    /// The object as the leader of its stream has it; `None` when it is not whole there.
    async fn object_of_the_leader(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let stream = &self.bucket.stream;
        let head = self.bucket.head_of(key);
        let head = stream.get_last_raw_message_by_subject(&head).await;
        let Some(head) = found(head, || document(key))? else {
            return Ok(None);
        };
        let Ok(object) = serde_json::from_slice::<ObjectInfo>(&head.payload) else {
            return Ok(None);
        };
        let subject = self.bucket.chunks_of(&object.nuid);
        let mut bytes = Vec::with_capacity(object.size);
        let mut next = 0;
        for _ in 0..object.chunks {
            let chunk = stream
                .get_first_raw_message_by_subject(&subject, next)
                .await;
            let Some(chunk) = found(chunk, || document(key))? else {
                return Ok(None);
            };
            next = chunk.sequence + 1;
            bytes.extend_from_slice(&chunk.payload);
        }
        let is_whole = !object.deleted && object.digest == Some(digest(&bytes));
        Ok(is_whole.then_some(bytes))
    }
}

/// A checksum as heads have it.
fn digest(bytes: &[u8]) -> String {
    format!("SHA-256={}", URL_SAFE.encode(Sha256::digest(bytes)))
}

fn document(key: &str) -> String {
    format!("document {key}")
}
