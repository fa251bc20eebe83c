//! Places where strings bend, and hashing for tables of them.

use std::hash::Hasher;

/// A corner and the sense in which it is rounded, or an end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Place {
    Start,
    Corner(usize, bool),
    Target,
}

/// Mixes the few whole numbers that a [`Place`] consists of; nobody chooses them to collide.
#[derive(Default)]
pub(super) struct Mix(u64);

impl Mix {
    fn add(&mut self, value: u64) {
        // The fractional part of the golden ratio: its multiples spread evenly.
        self.0 = (self.0.rotate_left(23) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

impl Hasher for Mix {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.add(u64::from(*byte));
        }
    }

    fn write_u8(&mut self, value: u8) {
        self.add(u64::from(value));
    }

    fn write_usize(&mut self, value: usize) {
        self.add(value as u64);
    }

    fn finish(&self) -> u64 {
        // Tables look at the low bits first, which a product fills last.
        self.0 ^ (self.0 >> 32)
    }
}
