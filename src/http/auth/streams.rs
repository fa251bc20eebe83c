//! Limits on open event streams: one permit each, held for as long as the stream lives.

use std::collections::HashMap;
use std::sync::Arc;

use parking_lot::Mutex;

use crate::job::Owner;

/// Counts of open streams.
#[derive(Debug)]
pub(super) struct Streams {
    most: usize,
    most_per_owner: usize,
    open: Mutex<Open>,
}

#[derive(Debug, Default)]
struct Open {
    all: usize,
    by_owner: HashMap<Owner, usize>,
}

/// Which limit was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::http) struct TooMany {
    /// Its name in `GET /limits`.
    pub(in crate::http) limit: &'static str,
    /// Maximum number of streams.
    pub(in crate::http) most: usize,
}

/// Permission to hold a stream open, until it is dropped.
#[derive(Debug)]
pub(in crate::http) struct Permit {
    streams: Arc<Streams>,
    owner: Option<Owner>,
}

impl Streams {
    pub(super) fn new(most: usize, most_per_owner: usize) -> Arc<Self> {
        Arc::new(Self {
            most,
            most_per_owner,
            open: Mutex::default(),
        })
    }

    /// Permission for one more stream. Callers without a name are limited by `most` alone.
    pub(super) fn open(self: &Arc<Self>, owner: Option<Owner>) -> Result<Permit, TooMany> {
        let mut open = self.open.lock();
        let too_many = |limit, most| Err(TooMany { limit, most });
        if open.all >= self.most {
            return too_many("streams", self.most);
        }
        if let Some(owner) = &owner {
            let own = open.by_owner.entry(owner.clone()).or_default();
            if *own >= self.most_per_owner {
                return too_many("streams_per_key", self.most_per_owner);
            }
            *own += 1;
        }
        open.all += 1;
        drop(open);
        let streams = self.clone();
        Ok(Permit { streams, owner })
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let mut open = self.streams.open.lock();
        open.all -= 1;
        let Some(owner) = &self.owner else {
            return;
        };
        if let Some(own) = open.by_owner.get_mut(owner) {
            *own -= 1;
            if *own == 0 {
                open.by_owner.remove(owner);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permit_counts_until_it_is_dropped() {
        let streams = Streams::new(3, 2);
        let open = |owner: &str| streams.open(Some(owner.to_owned()));
        let too_many = |limit, most| TooMany { limit, most };
        let first = open("a").expect("room");
        let _second = open("a").expect("room");
        assert_eq!(open("a").expect_err("full"), too_many("streams_per_key", 2));
        let other = streams.open(None).expect("room");
        assert_eq!(open("b").expect_err("full"), too_many("streams", 3));
        drop(first);
        let _again = open("a").expect("room again");
        drop(other);
        let _third = open("b").expect("room again");
        assert_eq!(streams.open.lock().by_owner.len(), 2);
    }
}
