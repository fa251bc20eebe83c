//! Documents that are too long for a message: in an object store, cut into chunks.
//!
//! The servers deliver an object by themselves, as fast as they can. Where that yields nothing whole, the leader of the
//! stream is asked for each part: only it can tell a document that is lost from one that a server has not got yet.

use async_nats::jetstream::object_store::{GetErrorKind, ObjectInfo};
use async_nats::jetstream::stream::LastRawMessageErrorKind;
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE;
use sha2::{Digest as _, Sha256};
use std::io;
use tokio::io::AsyncReadExt as _;
use tokio::time::timeout;

use super::connect::{PATIENCE, Servers};
use super::errors::failed;
use crate::store::StoreError;

impl Servers {
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
        let head = match self
            .chunks
            .get_last_raw_message_by_subject(&self.head_of(key))
            .await
        {
            Ok(head) => head,
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => {
                return Ok(None);
            }
            Err(error) => return Err(failed(&document(key), &error)),
        };
        let Ok(object) = serde_json::from_slice::<ObjectInfo>(&head.payload) else {
            return Ok(None);
        };
        let subject = self.chunks_of(&object.nuid);
        let mut bytes = Vec::with_capacity(object.size);
        let mut next = 0;
        for _ in 0..object.chunks {
            let chunk = match self
                .chunks
                .get_first_raw_message_by_subject(&subject, next)
                .await
            {
                Ok(chunk) => chunk,
                Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => {
                    return Ok(None);
                }
                Err(error) => return Err(failed(&document(key), &error)),
            };
            next = chunk.sequence + 1;
            bytes.extend_from_slice(&chunk.payload);
        }
        let is_whole = !object.deleted && object.digest == Some(digest(&bytes));
        Ok(is_whole.then_some(bytes))
    }

    /// The subject of an object's head.
    fn head_of(&self, key: &str) -> String {
        format!("$O.{}-objects.M.{}", self.namespace, URL_SAFE.encode(key))
    }

    /// The subject of an object's chunks.
    fn chunks_of(&self, nuid: &str) -> String {
        format!("$O.{}-objects.C.{nuid}", self.namespace)
    }
}

/// A checksum as heads have it.
fn digest(bytes: &[u8]) -> String {
    format!("SHA-256={}", URL_SAFE.encode(Sha256::digest(bytes)))
}

fn document(key: &str) -> String {
    format!("document {key}")
}
