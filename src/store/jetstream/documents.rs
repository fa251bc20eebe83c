//! Scenarios and results: beside the steps, so that a step stays small.

use bytes::Bytes;

use super::connect::Servers;
use super::errors::{failed, found};
use super::record::Document;
use crate::job::PlanId;
use crate::store::StoreError;

/// The header of a message that stands for the removal of a document.
const DELETION: &str = "KV-Operation";

/// The longest document that goes into a message; servers accept messages of 1 MiB by default.
const LONGEST: usize = 512 << 10;

impl Document {
    pub(super) fn scenario_key(id: PlanId) -> String {
        format!("{id}.scenario")
    }

    pub(super) fn result_key(id: PlanId, attempt: u64) -> String {
        format!("{id}.result.{attempt}")
    }

    /// Where the accepted scenario of a plan is stored.
    pub(super) fn scenario(id: PlanId, text: &str) -> Self {
        Self {
            key: Self::scenario_key(id),
            large: text.len() > LONGEST,
        }
    }

    /// Where the result of a run is stored; that of a late worker has its own key, and nobody reads it.
    pub(super) fn result(id: PlanId, attempt: u64, text: &str) -> Self {
        Self {
            key: Self::result_key(id, attempt),
            large: text.len() > LONGEST,
        }
    }

    /// The error of a reader when the servers have lost it.
    pub(super) fn missing(&self) -> StoreError {
        StoreError::unavailable(format!("document {} is missing or damaged", self.key))
    }
}

impl Servers {
    pub(super) async fn write(&self, document: &Document, text: &str) -> Result<(), StoreError> {
        self.outlast(|| self.try_to_write(document, text)).await
    }

    async fn try_to_write(&self, document: &Document, text: &str) -> Result<(), StoreError> {
        let what = || format!("document {}", document.key);
        if document.large {
            self.put_object(&document.key, text.as_bytes()).await?;
        } else {
            let text = Bytes::copy_from_slice(text.as_bytes());
            let put = self.documents.put(&document.key, text).await;
            put.map_err(|error| failed(&what(), &error))?;
        }
        Ok(())
    }

    /// `None` when the servers have lost it, or a part of it.
    pub(super) async fn read(&self, document: &Document) -> Result<Option<String>, StoreError> {
        self.outlast(|| self.try_to_read(document)).await
    }

    async fn try_to_read(&self, document: &Document) -> Result<Option<String>, StoreError> {
        let what = || format!("document {}", document.key);
        let bytes = if document.large {
            match self.get_object(&document.key).await? {
                Some(bytes) => bytes,
                None => return Ok(None),
            }
        } else {
            let got = self.documents.get(&document.key).await;
            let bytes = match got.map_err(|error| failed(&what(), &error))? {
                Some(bytes) => bytes,
                None => match self.of_the_leader(document).await? {
                    Some(bytes) => bytes,
                    None => return Ok(None),
                },
            };
            bytes.into()
        };
        // What is no text is not what was written.
        Ok(String::from_utf8(bytes).ok())
    }

    /// A server that is behind the others has not got every document yet; the leader has.
    async fn of_the_leader(&self, document: &Document) -> Result<Option<Bytes>, StoreError> {
        let subject = format!("{}{}", self.documents.prefix, document.key);
        let stream = &self.documents.stream;
        let newest = stream.get_last_raw_message_by_subject(&subject).await;
        let newest = found(newest, || format!("document {}", document.key))?;
        let there = newest.filter(|message| message.headers.get(DELETION).is_none());
        Ok(there.map(|message| message.payload))
    }

    /// Remove all documents of a plan. `objects` are the keys of those that may be in the object store. Nothing is
    /// written for it, so that full servers do it too.
    pub(super) async fn remove_documents(
        &self,
        id: PlanId,
        objects: &[String],
    ) -> Result<(), StoreError> {
        self.purge_documents(id).await?;
        self.remove_objects(id, objects).await
    }

    /// Remove those documents of a plan that are no objects.
    async fn purge_documents(&self, id: PlanId) -> Result<(), StoreError> {
        let subjects = format!("{}{id}.>", self.documents.prefix);
        let purged = self.documents.stream.purge().filter(subjects).await;
        purged.map_err(|error| failed(&documents_of(id), &error))?;
        Ok(())
    }
}

fn documents_of(id: PlanId) -> String {
    format!("documents of plan {id}")
}
