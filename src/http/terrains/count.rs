//! How many datasets there are, for those who do not want to wait for it.

use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::Semaphore;
use tokio::time::timeout;

use crate::catalogue::Tally;

/// Nobody waits longer than this for a count.
const PATIENCE: Duration = Duration::from_millis(500);

/// What the datasets came to when they were last counted.
#[derive(Debug, Clone)]
pub(super) struct Count {
    last: Arc<Mutex<Tally>>,
    turn: Arc<Semaphore>,
}

impl Count {
    /// Nothing counted yet.
    pub(super) fn new() -> Self {
        Self {
            last: Arc::default(),
            turn: Arc::new(Semaphore::new(1)),
        }
    }

    /// What `count` returns; what the last one did while another counts, or where it takes long. A directory that does not
    /// answer thus holds one thread and nobody who asks.
    pub(super) async fn ask(&self, count: impl FnOnce() -> Tally + Send + 'static) -> Tally {
        if let Ok(turn) = self.turn.clone().try_acquire_owned() {
            let last = self.last.clone();
            let counting = tokio::task::spawn_blocking(move || {
                let tally = count();
                *last.lock() = tally;
                drop(turn);
            });
            // What takes longer is there for those who ask next.
            _ = timeout(PATIENCE, counting).await;
        }
        *self.last.lock()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    fn of(datasets: u64) -> Tally {
        Tally {
            datasets,
            ..Tally::default()
        }
    }

    #[tokio::test]
    async fn who_asks_while_a_count_hangs_is_told_the_last_one() {
        let count = Count::new();
        assert_eq!(count.ask(|| of(1)).await, of(1));
        let (answer, waits) = channel();
        let hangs = move || waits.recv().expect("an answer");
        assert_eq!(count.ask(hangs).await, of(1));
        assert_eq!(count.ask(|| unreachable!("another counts")).await, of(1));
        answer.send(of(2)).expect("it waits");
        let ended = count.turn.acquire().await.expect("it ends");
        assert_eq!(*count.last.lock(), of(2));
        drop(ended);
        assert_eq!(count.ask(|| of(3)).await, of(3));
    }
}
