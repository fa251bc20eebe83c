//! Whether the store takes writes, asked once for all who want to know at the same time: to ask is a write that waits for
//! the disk or for other machines, and anybody may.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::Mutex;
use tokio::time::Instant;

use crate::store::StoreError;

/// For so long an answer is told to whoever comes.
const GOOD_FOR: Duration = Duration::from_millis(500);

/// What the store said of itself last.
#[derive(Debug, Clone, Default)]
pub struct Readiness(Arc<Mutex<Option<Answer>>>);

#[derive(Debug)]
struct Answer {
    came: Instant,
    said: Result<(), StoreError>,
}

impl Readiness {
    /// What `ask` answers, or what it has just answered to somebody else.
    pub(super) async fn told(
        &self,
        ask: impl Future<Output = Result<(), StoreError>>,
    ) -> Result<(), StoreError> {
        // Who comes meanwhile waits here and finds the answer; who asks and goes away leaves it to the next.
        let mut last = self.0.lock().await;
        if let Some(answer) = &*last
            && answer.came.elapsed() < GOOD_FOR
        {
            return answer.said.clone();
        }
        let said = ask.await;
        *last = Some(Answer {
            came: Instant::now(),
            said: said.clone(),
        });
        said
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use futures_util::FutureExt as _;
    use futures_util::future::{join, join_all, pending};
    use tokio::sync::oneshot;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn all_who_come_at_a_time_are_told_the_same() {
        let (readiness, asked) = (Readiness::default(), AtomicUsize::new(0));
        let ask = |answer: Result<(), StoreError>| {
            readiness.told(async {
                asked.fetch_add(1, Ordering::Relaxed);
                answer
            })
        };
        let full = || Err(StoreError::unavailable("full"));
        let (answer, answered) = oneshot::channel();
        let first = readiness.told(async { answered.await.expect("an answer") });
        let others = join_all((0..100).map(|_| ask(Ok(()))));
        let mut all = Box::pin(join(first, others));
        assert!(all.as_mut().now_or_never().is_none(), "they wait for it");
        answer.send(full()).expect("somebody waits");
        let (first, others) = all.await;
        assert!(first.is_err() && others.iter().all(Result::is_err));
        assert!(ask(Ok(())).await.is_err());
        assert_eq!(asked.load(Ordering::Relaxed), 0);

        tokio::time::advance(GOOD_FOR).await;
        assert!(ask(Ok(())).await.is_ok());
        assert!(ask(full()).await.is_ok());
        tokio::time::advance(GOOD_FOR).await;
        assert!(ask(full()).await.is_err());
        assert_eq!(asked.load(Ordering::Relaxed), 2);
    }

    #[tokio::test]
    async fn who_goes_away_while_it_is_asked_holds_up_nobody() {
        let readiness = Readiness::default();
        assert!(readiness.told(pending()).now_or_never().is_none());
        assert!(readiness.told(async { Ok(()) }).await.is_ok());
    }
}
