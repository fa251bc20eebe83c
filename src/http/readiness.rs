//! Whether the store accepts writes, asked once for all who want to know at the same time: asking is a write that waits
//! for the disk or for other machines, and anybody may ask.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::Mutex;
use tokio::time::Instant;

use crate::store::StoreError;

/// How long an answer is reused.
const GOOD_FOR: Duration = Duration::from_millis(500);

/// The store's last answer.
#[derive(Debug, Clone, Default)]
pub struct Readiness(Arc<Mutex<Option<Answer>>>);

#[derive(Debug)]
struct Answer {
    came: Instant,
    said: Result<(), StoreError>,
}

impl Readiness {
    /// The answer of `ask`, or the one it has just given to somebody else.
    pub(super) async fn shared(
        &self,
        ask: impl Future<Output = Result<(), StoreError>>,
    ) -> Result<(), StoreError> {
        // Later callers wait here and find the answer; if the one asking goes away, the next one asks.
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
    async fn concurrent_callers_share_one_answer() {
        let (readiness, asked) = (Readiness::default(), AtomicUsize::new(0));
        let ask = |answer: Result<(), StoreError>| {
            readiness.shared(async {
                asked.fetch_add(1, Ordering::Relaxed);
                answer
            })
        };
        let full = || Err(StoreError::unavailable("full"));
        let (answer, answered) = oneshot::channel();
        let first = readiness.shared(async { answered.await.expect("an answer") });
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
    async fn a_caller_that_disconnects_blocks_nobody() {
        let readiness = Readiness::default();
        assert!(readiness.shared(pending()).now_or_never().is_none());
        assert!(readiness.shared(async { Ok(()) }).await.is_ok());
    }
}
