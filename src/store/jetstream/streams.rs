//! Whether all streams are there to be read and written, each with a server that leads it.

use async_nats::jetstream::stream::Stream;
use futures_util::future::try_join_all;

use super::JetStream;
use super::connect::Servers;
use super::errors::{failed, is_vanished};
use crate::store::{StoreError, Trouble};

impl JetStream {
    /// Ask for each stream; the store is of no use any more once one has vanished.
    pub(super) async fn look_at_streams(&self) -> Result<(), StoreError> {
        let looked = self.servers.look_at_streams().await;
        if let Err(error) = &looked {
            self.heed_vanished(error);
        }
        looked
    }

    /// Have the store opened again if this error says that a stream has vanished; true when so.
    pub(super) fn heed_vanished(&self, error: &StoreError) -> bool {
        let vanished = is_vanished(error);
        if vanished {
            self.vanished.send_replace(true);
        }
        vanished
    }
}

impl Servers {
    async fn look_at_streams(&self) -> Result<(), StoreError> {
        let streams = [
            &self.plans,
            &self.jobs,
            &self.documents.stream,
            &self.bucket.stream,
            &self.keys.stream,
            &self.nodes.stream,
            &self.tellers.stream,
        ];
        try_join_all(streams.map(look_at)).await.map(drop)
    }
}

async fn look_at(stream: &Stream) -> Result<(), StoreError> {
    let known = stream.cached_info();
    let name = &known.config.name;
    let info = stream.get_info().await;
    let info = info.map_err(|error| failed(&format!("stream {name}"), &error))?;
    if info.created != known.created {
        // Another node has made it again, empty; what is known of the old one is of no use.
        return Err(vanished());
    }
    if info.cluster.is_some_and(|servers| servers.leader.is_none()) {
        return Err(StoreError::unavailable(format!(
            "no server leads stream {name}"
        )));
    }
    Ok(())
}

/// The error of everything that is asked of a store whose streams have vanished.
pub(super) fn vanished() -> StoreError {
    StoreError::Unavailable {
        trouble: Trouble::Vanished,
        detail: "a stream has vanished from the servers".to_owned(),
    }
}
