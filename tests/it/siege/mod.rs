//! Attempts to break the service: kills, races, cut and stalled readers, slow and lying callers, masses.
//!
//! `NOCTULE_SIEGE=full` runs each at the size of docs/RELIABILITY.md, otherwise at one that fits CI.

mod answers;
mod bodies;
mod connections;
mod hostile;
mod kill;
mod masses;
mod queue;
mod races;
mod still;
mod streams;

/// Reproducible pseudo-random numbers: `SplitMix64`.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number from 0 to `n` - 1.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        usize::try_from(self.next() % n as u64).expect("less than n")
    }
}
