//! Access to contents: putting them on the shelf, finding them there, and fetching them to this node.

use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use super::Shared;
use super::headers::Headers;
use super::view::{Shelved, View, content_key};
use crate::catalogue::records::{Content, Name};
use crate::catalogue::{CatalogueError, Checked, Room, Staged};
use crate::terrain::DatasetError;

/// Most attempts to fetch a file: one put a moment ago may not have reached every server.
const TRIES: u32 = 4;

/// The pause after the first attempt; it doubles with each further one.
const PAUSE: Duration = Duration::from_millis(100);

impl Shared {
    /// Remove the mark from a needed content; `false` if it was removed or changed meanwhile.
    pub(super) fn need(&self, view: &View, sha256: &str) -> Result<bool, CatalogueError> {
        let Some(content) = view.contents.get(sha256) else {
            return Ok(false);
        };
        if !content.unneeded {
            return Ok(true);
        }
        let needed = Shelved {
            unneeded: false,
            ..content.clone()
        };
        let key = content_key(sha256);
        let written = self.write(&key, &needed, view.written(&key))?;
        Ok(written.is_some())
    }

    /// Make sure that a content is on the shelf and not about to be removed.
    pub(super) fn shelve(&self, file: &Checked, room: Room) -> Result<(), CatalogueError> {
        let sha256 = &file.sha256;
        loop {
            let view = self.view()?;
            if self.need(&view, sha256)? {
                return Ok(());
            }
            if view.contents.contains_key(sha256) {
                continue;
            }
            let content = Content::of(file);
            let contents = view.contents.values().map(|shelved| &shelved.content);
            room.admit(contents, content.bytes)?;
            let mut bytes = file
                .staged
                .reader()
                .map_err(|error| CatalogueError::unavailable("read", file.staged.path(), error))?;
            let put = self.shelf.put(&mut bytes).map_err(CatalogueError::shelf)?;
            let content = Shelved {
                content,
                headers: Headers::of(&file.metadata),
                file: put.clone(),
                unneeded: false,
            };
            // After an error it may still have been written, so the file stays until that is known.
            let key = content_key(sha256);
            let written = self.write(&key, &content, view.written(&key))?;
            if written.is_some() {
                return Ok(());
            }
            self.discard(&put);
        }
    }

    /// Remove a file, or leave it to a later sweep.
    pub(super) fn discard(&self, file: &str) {
        if let Err(error) = self.shelf.discard(file) {
            tracing::warn!(file, %error, "a file that nothing refers to is left for a later sweep");
        }
    }

    /// The requested content, with no mark on it.
    pub(super) fn meant(
        &self,
        name: &str,
        sha256: Option<&str>,
    ) -> Result<(String, Shelved), DatasetError> {
        loop {
            let view = match self.view() {
                Ok(view) => view,
                // Content with a given checksum never changes, so a copy is as good as the original.
                Err(away) => return self.copied(sha256).ok_or_else(|| away.into()),
            };
            let wanted = Name::wanted(&view.names, name, sha256)?;
            let Some(content) = view.contents.get(wanted) else {
                let may_be_unread = view.has_unread();
                return Err(Name::missing(&view.names, name, wanted, may_be_unread));
            };
            if self.need(&view, wanted)? {
                return Ok((wanted.to_owned(), content.clone()));
            }
        }
    }

    /// The last known record of a content whose bytes are on this node.
    fn copied(&self, sha256: Option<&str>) -> Option<(String, Shelved)> {
        let (sha256, view) = (sha256?, self.last_view());
        let content = view.contents.get(sha256)?;
        let path = self.cache.find(sha256, &content.content.declared);
        path.ok()??;
        Some((sha256.to_owned(), content.clone()))
    }

    /// Path of the content's bytes on this node.
    pub(super) fn fetched(
        &self,
        sha256: &str,
        content: &Shelved,
    ) -> Result<PathBuf, CatalogueError> {
        let Content {
            bytes, declared, ..
        } = &content.content;
        let mut tries = 0;
        loop {
            let path = self
                .cache
                .find_or_fetch(sha256, declared, *bytes, |staged| {
                    let fetched = self.fetch(&content.file, staged);
                    let metrics = &self.instruments.metrics;
                    metrics.terrain_fetched(fetched.is_ok(), staged.bytes());
                    fetched
                });
            tries += 1;
            match path {
                Err(error) if tries < TRIES => {
                    tracing::debug!(sha256, %error, "a dataset could not be fetched; trying again");
                    thread::sleep(PAUSE * (1 << (tries - 1)));
                }
                path => return path,
            }
        }
    }

    fn fetch(&self, file: &str, to: &mut Staged) -> Result<(), CatalogueError> {
        match self.shelf.fetch(file, to) {
            Ok(true) => Ok(()),
            Ok(false) => Err(CatalogueError::away(
                "the datasets that all nodes share cannot be reached",
                format!("the file {file} is not there"),
            )),
            Err(error) => Err(to.failure().unwrap_or_else(|| CatalogueError::shelf(error))),
        }
    }
}
