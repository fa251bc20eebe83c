//! Plans that could not be run when it was their turn: for a while the others go before them.
//!
//! Else a few plans whose ground is out of reach would keep all others from being run. They are forgotten with the
//! process: after a restart each is tried once in its old place.

use std::collections::HashMap;

use rusqlite::Connection;
use tokio::time::Instant;

use crate::store::pause_after;

/// The queued plans that go after the others.
#[derive(Debug, Default)]
pub(super) struct Postponed {
    /// By their `seq`.
    waits: HashMap<i64, Wait>,
    next: u64,
}

#[derive(Debug, Clone, Copy)]
struct Wait {
    until: Instant,
    /// Of those that wait, the one with the least goes first.
    turn: u64,
}

impl Postponed {
    /// Others go before this plan, of which this was the `attempt`-th run.
    pub(super) fn add(&mut self, seq: i64, attempt: u64) {
        let until = Instant::now() + pause_after(attempt);
        let turn = self.next;
        self.waits.insert(seq, Wait { until, turn });
        self.next += 1;
    }

    /// The plan is being run.
    pub(super) fn remove(&mut self, seq: i64) {
        self.waits.remove(&seq);
    }

    /// The `seq` of the plan that goes first, or one below.
    pub(super) fn first(&mut self, connection: &Connection) -> rusqlite::Result<i64> {
        if self.waits.is_empty() {
            return Ok(i64::MIN);
        }
        let now = Instant::now();
        let mut queue = connection.prepare_cached(
            "SELECT seq FROM plans INDEXED BY plans_queue WHERE status = 'queued' ORDER BY seq",
        )?;
        let mut waiting = HashMap::new();
        for seq in queue.query_map([], |row| row.get::<_, i64>(0))? {
            let seq = seq?;
            match self.waits.get(&seq) {
                Some(wait) if wait.until > now => waiting.insert(seq, *wait),
                _ => return Ok(seq),
            };
        }
        // All are postponed, but for those that have left the queue since.
        self.waits = waiting;
        let first = self.waits.iter().min_by_key(|(_, wait)| wait.turn);
        Ok(first.map_or(i64::MIN, |(seq, _)| *seq))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn others_go_first_for_a_while_only() -> rusqlite::Result<()> {
        let connection = Connection::open_in_memory()?;
        connection.execute_batch(
            "CREATE TABLE plans (seq INTEGER PRIMARY KEY, status TEXT);
             CREATE INDEX plans_queue ON plans (seq) WHERE status = 'queued';
             INSERT INTO plans VALUES (1, 'queued'), (2, 'queued'), (3, 'queued');",
        )?;
        let mut postponed = Postponed::default();
        postponed.add(1, 1);
        postponed.add(2, 2);
        assert_eq!(postponed.first(&connection)?, 3);
        tokio::time::sleep(Duration::from_secs(11)).await;
        assert_eq!(postponed.first(&connection)?, 1);
        postponed.add(1, 2);
        tokio::time::sleep(Duration::from_secs(10)).await;
        assert_eq!(
            postponed.first(&connection)?,
            2,
            "it has waited twice as long"
        );

        // Where there is nothing else, whoever has waited longest goes first.
        connection.execute_batch("UPDATE plans SET status = 'running' WHERE seq = 3")?;
        postponed.add(2, 3);
        assert_eq!(postponed.first(&connection)?, 1);
        postponed.remove(1);
        connection.execute_batch("UPDATE plans SET status = 'running'")?;
        assert!(postponed.first(&connection)? <= 1 && postponed.waits.is_empty());
        Ok(())
    }
}
