//! Retries of requests that the servers did not answer: while they elect a leader, they drop requests.

use std::time::Duration;

use tokio::time::{Instant, sleep};

/// An election takes a few seconds.
const PATIENCE: Duration = Duration::from_secs(10);

/// Pause before the first retry; doubled each time.
const SHORTEST: Duration = Duration::from_millis(20);

/// Longest pause between retries.
const LONGEST: Duration = Duration::from_secs(1);

/// An election that may be under way, timed from the first sign of it.
pub(super) struct Election {
    until: Option<Instant>,
    pause: Duration,
}

impl Election {
    /// No sign of an election yet.
    pub(super) fn perhaps() -> Self {
        Self {
            until: None,
            pause: SHORTEST,
        }
    }

    /// Wait before the next retry; false when it has lasted too long to be an election.
    pub(super) async fn goes_on(&mut self) -> bool {
        let now = Instant::now();
        if now > *self.until.get_or_insert(now + PATIENCE) {
            return false;
        }
        sleep(self.pause).await;
        self.pause = LONGEST.min(self.pause * 2);
        true
    }
}

/// Retry `work` until it succeeds or fails with an error that does not pass with an election.
///
/// # Errors
/// The last error of `work`.
pub(super) async fn outlast<T, E>(
    passes: impl Fn(&E) -> bool,
    mut work: impl AsyncFnMut() -> Result<T, E>,
) -> Result<T, E> {
    let mut election = Election::perhaps();
    loop {
        let done = work().await;
        let passes = matches!(&done, Err(error) if passes(error));
        if !passes || !election.goes_on().await {
            return done;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_passing_error_is_retried_for_a_few_seconds() {
        let mut asked = 0;
        let answer = outlast(
            |&passes: &bool| passes,
            async || {
                asked += 1;
                if asked < 9 { Err(true) } else { Ok(asked) }
            },
        );
        assert_eq!(answer.await, Ok(9));
        let begun = Instant::now();
        let answer = outlast(|&passes: &bool| passes, async || Err::<(), _>(true));
        assert_eq!(answer.await, Err(true));
        let waited = begun.elapsed();
        assert!(
            waited > PATIENCE && waited < PATIENCE + 2 * LONGEST,
            "{waited:?}"
        );
    }

    #[tokio::test(start_paused = true)]
    async fn a_lasting_error_is_returned_at_once() {
        let mut asked = 0;
        let answer = outlast(
            |&passes: &bool| passes,
            async || {
                asked += 1;
                Err::<(), _>(false)
            },
        );
        assert_eq!(answer.await, Err(false));
        assert_eq!(asked, 1);
    }
}
