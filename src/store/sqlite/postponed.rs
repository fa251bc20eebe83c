//! Plans that could not be run when it was their turn: the others go before them, and then they do, each in its turn.
//!
//! Else a few plans whose ground is out of reach would keep all others from being run. They are forgotten with the
//! process: after a restart each is tried once in its old place.

use std::collections::HashMap;

use rusqlite::Connection;

/// The queued plans that go after the others.
#[derive(Debug, Default)]
pub(super) struct Postponed {
    /// By their `seq`, when each was postponed, counted.
    turns: HashMap<i64, u64>,
    next: u64,
}

impl Postponed {
    pub(super) fn add(&mut self, seq: i64) {
        self.turns.insert(seq, self.next);
        self.next += 1;
    }

    /// The plan is being run.
    pub(super) fn remove(&mut self, seq: i64) {
        self.turns.remove(&seq);
    }

    /// The `seq` of the plan that goes first, or one below.
    pub(super) fn first(&mut self, connection: &Connection) -> rusqlite::Result<i64> {
        if self.turns.is_empty() {
            return Ok(i64::MIN);
        }
        let mut queue = connection.prepare_cached(
            "SELECT seq FROM plans INDEXED BY plans_queue WHERE status = 'queued' ORDER BY seq",
        )?;
        let mut waiting = HashMap::new();
        for seq in queue.query_map([], |row| row.get::<_, i64>(0))? {
            let seq = seq?;
            let Some(turn) = self.turns.get(&seq) else {
                return Ok(seq);
            };
            waiting.insert(seq, *turn);
        }
        // All are postponed, but for those that have left the queue since.
        self.turns = waiting;
        let first = self.turns.iter().min_by_key(|(_, turn)| **turn);
        Ok(first.map_or(i64::MIN, |(seq, _)| *seq))
    }
}
