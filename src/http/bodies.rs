//! How much memory the bodies of all requests take, from their first bytes until they have been read.
//!
//! A caller needs one connection to begin hundreds of bodies and to end none. A body takes its share as it comes, so
//! what is merely announced costs nothing; whoever would need more than is left is refused at once, since waiting
//! would keep what has come. The first bytes of each body have room of their own, for the sake of short ones.

use std::sync::Arc;

use bytes::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::problem::{Busy, Problem};

/// Bytes of each body that come out of the room for beginnings. Most bodies have no more.
const BEGINNING: usize = 64 * 1024;

/// Bytes of a block that has room for what comes next, at most.
const BLOCK: usize = 256 * 1024;

/// The room for beginnings is this part of the whole.
const FOR_BEGINNINGS: usize = 4;

/// The room for the bodies of all requests.
#[derive(Debug, Clone)]
pub struct Bodies {
    beginnings: Arc<Semaphore>,
    rest: Arc<Semaphore>,
    bytes: usize,
}

impl Bodies {
    /// Room for `bytes`, or more if one body of `longest` bytes needs more, packed and unpacked.
    #[must_use]
    pub fn new(bytes: usize, longest: usize) -> Self {
        let beginnings = (bytes / FOR_BEGINNINGS).clamp(2 * BEGINNING, Semaphore::MAX_PERMITS);
        let rest = bytes.saturating_sub(beginnings);
        let rest = rest
            .max(longest.saturating_mul(2))
            .min(Semaphore::MAX_PERMITS);
        Self {
            beginnings: Arc::new(Semaphore::new(beginnings)),
            rest: Arc::new(Semaphore::new(rest)),
            bytes: beginnings.saturating_add(rest),
        }
    }

    /// For a body of at most `longest` bytes, of which nothing has come.
    pub(super) fn begin(&self, longest: usize) -> Growing {
        let share = Share {
            bodies: self.clone(),
            beginning: None,
            rest: None,
        };
        Growing {
            blocks: Vec::new(),
            length: 0,
            longest,
            share,
        }
    }
}

/// A body, as far as it has come: in blocks, since one that grew as a whole would be there twice each time it is moved.
pub(super) struct Growing {
    blocks: Vec<Vec<u8>>,
    length: usize,
    longest: usize,
    share: Share,
}

impl Growing {
    /// The next bytes of it, which must not make it longer than announced.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<(), Problem> {
        let spare = |block: &Vec<u8>| block.capacity() - block.len();
        let spare = self.blocks.last().map_or(0, spare);
        let (fits, rest) = piece.split_at(spare.min(piece.len()));
        if let Some(block) = self.blocks.last_mut() {
            block.extend_from_slice(fits);
            self.length += fits.len();
        }
        if !rest.is_empty() {
            let mut block = self.block(rest.len())?;
            block.extend_from_slice(rest);
            self.blocks.push(block);
            self.length += rest.len();
        }
        Ok(())
    }

    /// An empty block with room for `least` bytes; for more, the more has come.
    fn block(&mut self, least: usize) -> Result<Vec<u8>, Problem> {
        let ample = (self.length / 2).min(BLOCK);
        let size = ample.min(self.longest - self.length).max(least);
        self.share.grow(size)?;
        Ok(Vec::with_capacity(size))
    }

    /// How much has come.
    pub(super) fn len(&self) -> usize {
        self.length
    }

    /// All of it; it has its share until nobody needs it.
    pub(super) fn whole(mut self) -> Bytes {
        if self.blocks.len() > 1 {
            let mut whole = Vec::with_capacity(self.length);
            // Each block is given back before the next one is copied.
            for block in self.blocks.drain(..) {
                whole.extend_from_slice(&block);
            }
            self.blocks.push(whole);
        }
        Bytes::from_owner(self)
    }
}

/// A whole body has one block, or none.
impl AsRef<[u8]> for Growing {
    fn as_ref(&self) -> &[u8] {
        self.blocks.first().map_or(&[], Vec::as_slice)
    }
}

/// What one body takes; given back when dropped.
struct Share {
    bodies: Bodies,
    beginning: Option<OwnedSemaphorePermit>,
    rest: Option<OwnedSemaphorePermit>,
}

impl Share {
    /// Take `bytes` more.
    fn grow(&mut self, bytes: usize) -> Result<(), Problem> {
        let begun = held(self.beginning.as_ref());
        let beginning = bytes.min(BEGINNING - begun);
        let grown = take(&self.bodies.beginnings, beginning, &mut self.beginning)
            && take(&self.bodies.rest, bytes - beginning, &mut self.rest);
        if grown {
            Ok(())
        } else {
            Err(Problem::Busy(Busy::Bodies(self.bodies.bytes)))
        }
    }
}

fn held(permit: Option<&OwnedSemaphorePermit>) -> usize {
    permit.map_or(0, OwnedSemaphorePermit::num_permits)
}

/// Take `bytes` of this room, if it has them, beside those that are held already.
fn take(room: &Arc<Semaphore>, bytes: usize, held: &mut Option<OwnedSemaphorePermit>) -> bool {
    if bytes == 0 {
        return true;
    }
    let Ok(bytes) = u32::try_from(bytes) else {
        return false;
    };
    let Ok(more) = room.clone().try_acquire_many_owned(bytes) else {
        return false;
    };
    match held {
        Some(held) => held.merge(more),
        None => *held = Some(more),
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: usize = 1 << 20;

    #[test]
    fn bodies_are_refused_what_is_not_left_and_give_back_what_they_had() {
        let bodies = Bodies::new(8 * MIB, MIB);
        let begin = || bodies.begin(8 * MIB);
        let mut first = begin();
        first.add(&vec![7; BEGINNING / 2]).expect("room");
        first.add(&vec![7; 6 * MIB + BEGINNING / 2]).expect("room");
        let mut second = begin();
        let refused = second
            .add(&vec![7; BEGINNING + 1])
            .expect_err("nothing is left");
        assert!(matches!(refused, Problem::Busy(Busy::Bodies(bytes)) if bytes == 8 * MIB));
        let short = begin().add(&vec![7; BEGINNING]);
        short.expect("short bodies have their own room");

        let whole = first.whole();
        assert_eq!(whole.len(), 6 * MIB + BEGINNING);
        let part = whole.slice(2..);
        drop(whole);
        assert!(second.add(&[7]).is_err(), "it has taken its beginning");
        drop((part, second));
        assert_eq!(bodies.beginnings.available_permits(), 2 * MIB);
        assert_eq!(bodies.rest.available_permits(), 6 * MIB);
    }

    #[test]
    fn a_body_takes_what_it_occupies_however_small_its_pieces() {
        let bodies = Bodies::new(8 * MIB, MIB);
        let mut body = bodies.begin(MIB);
        for piece in vec![7; MIB].chunks(1000) {
            body.add(piece).expect("room");
            let left = bodies.beginnings.available_permits() + bodies.rest.available_permits();
            assert_eq!(left, 8 * MIB - occupied(&body));
        }
        assert_eq!((body.len(), occupied(&body)), (MIB, MIB));
    }

    fn occupied(body: &Growing) -> usize {
        body.blocks.iter().map(Vec::capacity).sum()
    }

    #[test]
    fn a_whole_body_is_its_pieces_in_their_order() {
        let bytes: Vec<u8> = (0..=250).cycle().take(MIB).collect();
        for longest in [0, 1, 1000, BEGINNING, MIB] {
            for piece in [1, 999, BEGINNING] {
                let mut body = Bodies::new(8 * MIB, MIB).begin(longest);
                for piece in bytes[..longest].chunks(piece) {
                    body.add(piece).expect("room");
                }
                assert!(body.blocks.len() < 40, "{}", body.blocks.len());
                assert_eq!(body.len(), longest);
                assert!(body.whole() == bytes[..longest]);
            }
        }
    }

    #[test]
    fn there_is_room_for_many_beginnings_and_not_for_any_number() {
        let bodies = Bodies::new(MIB, 0);
        let mut begun: Vec<_> = (0..5).map(|_| bodies.begin(MIB)).collect();
        let added = begun.iter_mut().map(|body| body.add(&vec![7; BEGINNING]));
        let added: Vec<_> = added.map(|added| added.is_ok()).collect();
        assert_eq!(added, [true, true, true, true, false]);
    }

    #[test]
    fn one_body_always_fits_packed_and_unpacked() {
        for (bytes, longest) in [(0, MIB), (MIB, 8 * MIB), (8 * MIB, 8 * MIB)] {
            let bodies = Bodies::new(bytes, longest);
            let [mut packed, mut plain] = [(); 2].map(|()| bodies.begin(longest));
            packed.add(&vec![7; longest]).expect("room");
            plain.add(&vec![7; longest]).expect("room");
        }
        let _ = Bodies::new(usize::MAX, usize::MAX);
    }
}
