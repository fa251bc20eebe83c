//! What lies beneath an object store: a stream with a message for each object's head and each of its chunks. The client
//! has no way to remove one without the other.

use async_nats::jetstream::stream::Stream;
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE;

use super::errors::failed;
use crate::store::StoreError;

/// An object store's name, and its stream.
#[derive(Debug, Clone)]
pub(super) struct Bucket {
    pub(super) name: String,
    pub(super) stream: Stream,
}

impl Bucket {
    /// The subject of an object's head; the beginning of all of them for an empty name.
    pub(super) fn head_of(&self, object: &str) -> String {
        format!("$O.{}.M.{}", self.name, URL_SAFE.encode(object))
    }

    /// The subject of the chunks that a head names; the beginning of all of them for an empty name.
    pub(super) fn chunks_of(&self, nuid: &str) -> String {
        format!("$O.{}.C.{nuid}", self.name)
    }

    /// Remove what has this subject. This writes nothing: full servers do it too.
    pub(super) async fn purge(&self, subject: String) -> Result<(), StoreError> {
        let purged = self.stream.purge().filter(&subject).await;
        purged.map_err(|error| failed(&subject, &error))?;
        Ok(())
    }
}
