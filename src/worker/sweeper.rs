//! Removes plans whose time has come, by a clock that is not believed when it jumps, and datasets that
//! nothing refers to any more.

use std::collections::BTreeSet;
use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::Instant;

use crate::catalogue::Catalogue;
use crate::store::{Clock, SWEEP, Store};

/// Between two sweeps.
const PERIOD: Duration = Duration::from_secs(5);

/// A clock that is ahead of the time that has passed, or behind it, by more than this has jumped.
const TOLERANCE_MS: i64 = 60_000;

/// A clock that has jumped is believed once it has gone on steadily for so long.
const PROBATION: Duration = Duration::from_secs(60 * 60);

/// Sweeps until it is dropped.
pub struct Sweeper {
    task: JoinHandle<()>,
    jump_ms: watch::Receiver<Option<i64>>,
}

impl Sweeper {
    /// Start to sweep.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    #[must_use]
    pub fn start(store: Arc<dyn Store>, catalogue: Arc<dyn Catalogue>, clock: Clock) -> Self {
        let (told, jump_ms) = watch::channel(None);
        Self {
            task: tokio::spawn(sweep(store, catalogue, clock, told)),
            jump_ms,
        }
    }

    /// By how much the clock has jumped, milliseconds, while it is not believed; nothing expires then.
    #[must_use]
    pub fn clock_jump_ms(&self) -> watch::Receiver<Option<i64>> {
        self.jump_ms.clone()
    }
}

impl Drop for Sweeper {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn sweep(
    store: Arc<dyn Store>,
    catalogue: Arc<dyn Catalogue>,
    clock: Clock,
    told: watch::Sender<Option<i64>>,
) {
    let began = Instant::now();
    let mut judge = Judge::new(clock());
    let mut sound = true;
    loop {
        tokio::time::sleep(PERIOD).await;
        let now_ms = clock();
        let jump_ms = judge.jump_ms(now_ms, began.elapsed());
        told.send_if_modified(|known| {
            let news = known.is_some() != jump_ms.is_some();
            *known = jump_ms;
            news
        });
        if jump_ms.is_some() {
            continue;
        }
        loop {
            match store.sweep(now_ms).await {
                Ok(SWEEP) => continue,
                Ok(_) => sound = true,
                Err(error) if sound => {
                    tracing::warn!(%error, "plans past their time could not be removed; trying again");
                    sound = false;
                }
                Err(_) => {}
            }
            break;
        }
        if let Err(error) = sweep_datasets(&*store, &catalogue).await {
            tracing::debug!(%error, "datasets were not swept; trying again");
        }
    }
}

/// Content that no name stands for goes with the last plan over it.
async fn sweep_datasets(
    store: &dyn Store,
    catalogue: &Arc<dyn Catalogue>,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    let asked = catalogue.clone();
    if !tokio::task::spawn_blocking(move || asked.has_unnamed()).await? {
        return Ok(());
    }
    let uses = store.datasets_in_use().await?;
    let used: BTreeSet<String> = uses.into_iter().map(|used| used.sha256).collect();
    let asked = catalogue.clone();
    tokio::task::spawn_blocking(move || asked.sweep(&used)).await??;
    Ok(())
}

/// Compares the wall clock with the time that has passed.
struct Judge {
    /// What the wall clock showed when no time had passed, as far as it is believed.
    origin_ms: i64,
    /// Another origin that the clock has kept to, and since when.
    doubtful: Option<(i64, Duration)>,
}

impl Judge {
    fn new(now_ms: i64) -> Self {
        Self {
            origin_ms: now_ms,
            doubtful: None,
        }
    }

    /// How far the clock is from where it should be when so much time has passed, while it is not
    /// believed.
    fn jump_ms(&mut self, now_ms: i64, passed: Duration) -> Option<i64> {
        let passed_ms = i64::try_from(passed.as_millis()).unwrap_or(i64::MAX);
        let origin_ms = now_ms.saturating_sub(passed_ms);
        let agrees = |other: i64| origin_ms.saturating_sub(other).saturating_abs() <= TOLERANCE_MS;
        if agrees(self.origin_ms) {
            // Clocks are slewed; small steps add up.
            self.origin_ms = origin_ms;
            if self.doubtful.take().is_some() {
                tracing::info!("the clock is where it was; plans expire again");
            }
            return None;
        }
        let jump_ms = origin_ms.saturating_sub(self.origin_ms);
        match self.doubtful {
            Some((kept_to, since)) if agrees(kept_to) => {
                if passed.saturating_sub(since) < PROBATION {
                    return Some(jump_ms);
                }
                tracing::info!(
                    jump_ms,
                    "the clock has been steady since it jumped; plans expire again"
                );
                self.origin_ms = origin_ms;
                self.doubtful = None;
                None
            }
            _ => {
                tracing::warn!(
                    jump_ms,
                    "the clock jumped; no plan expires until it has been steady for an hour"
                );
                self.doubtful = Some((origin_ms, passed));
                Some(jump_ms)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YEAR_MS: i64 = 365 * 24 * 60 * 60 * 1_000;

    /// What the judge says `minutes` after the start to a clock that is ahead.
    fn judged(judge: &mut Judge, minutes: u64, ahead_ms: i64) -> Option<i64> {
        let passed = Duration::from_secs(60 * minutes);
        judge.jump_ms(
            1_000_000 + 60_000 * minutes.cast_signed() + ahead_ms,
            passed,
        )
    }

    #[test]
    fn a_clock_that_jumps_is_believed_after_an_hour() {
        for jump_ms in [YEAR_MS, -YEAR_MS, 61_000] {
            let mut judge = Judge::new(1_000_000);
            assert_eq!(judged(&mut judge, 1, 59_000), None, "slewed");
            for minutes in 2..62 {
                let told = judged(&mut judge, minutes, 59_000 + jump_ms);
                assert_eq!(told, Some(jump_ms), "after {minutes} minutes");
            }
            assert_eq!(judged(&mut judge, 62, 59_000 + jump_ms), None);
        }
    }

    #[test]
    fn a_clock_that_comes_back_is_believed_at_once() {
        let mut judge = Judge::new(1_000_000);
        assert_eq!(judged(&mut judge, 1, YEAR_MS), Some(YEAR_MS));
        assert_eq!(judged(&mut judge, 2, 2 * YEAR_MS), Some(2 * YEAR_MS));
        assert_eq!(judged(&mut judge, 3, 0), None);
    }
}
