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
        log_news(last.as_ref(), &said);
        *last = Some(Answer {
            came: Instant::now(),
            said: said.clone(),
        });
        said
    }
}

/// Whoever asks may do so every second, so only what is new is logged.
fn log_news(last: Option<&Answer>, now: &Result<(), StoreError>) {
    let last = last.map_or(&Ok(()), |answer| &answer.said);
    if !is_news(last, now) {
        return;
    }
    match now {
        Ok(()) => tracing::info!("the store is ready again"),
        Err(error) => tracing::error!(%error, "the store is not ready"),
    }
}

fn is_news(last: &Result<(), StoreError>, now: &Result<(), StoreError>) -> bool {
    match (last, now) {
        (Ok(()), Ok(())) => false,
        (Err(last), Err(now)) => last.to_string() != now.to_string(),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use futures_util::FutureExt as _;
    use futures_util::future::{join, join_all, pending};
    use tokio::sync::oneshot;

    use super::*;

    #[test]
    fn a_trouble_that_lasts_is_news_once() {
        let away = || Err(StoreError::unavailable("the disk is away"));
        let full = || Err(StoreError::unavailable("the disk is full"));
        for (last, now, expected) in [
            (Ok(()), Ok(()), false),
            (Ok(()), away(), true),
            (away(), away(), false),
            (away(), full(), true),
            (full(), Ok(()), true),
        ] {
            assert_eq!(is_news(&last, &now), expected, "{last:?} {now:?}");
        }
    }

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
