//! What the servers are asked about a plan, once for all who want to know it at the same time, and few plans at a time.
//! All answers come over the node's one connection, which the servers cut when too much waits on it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;
use tokio::sync::Semaphore;

use crate::job::PlanId;
use crate::store::StoreError;

/// One kind of question, with answers `T`.
pub(super) struct Together<T> {
    desks: Mutex<HashMap<PlanId, Visited<T>>>,
    permits: Semaphore,
}

/// A desk, and how many are at it.
struct Visited<T> {
    visitors: usize,
    desk: Arc<Desk<T>>,
}

/// Where those who ask about the same plan meet.
struct Desk<T> {
    /// How often it was asked for.
    asked: AtomicU64,
    /// What was answered last, and how often it had been asked for when that question was put.
    answered: tokio::sync::Mutex<Option<(u64, T)>>,
}

impl<T: Clone> Together<T> {
    /// Questions about at most `plans` plans are put at the same time.
    pub(super) fn new(plans: usize) -> Self {
        Self {
            desks: Mutex::default(),
            permits: Semaphore::new(plans),
        }
    }

    /// What `question` finds, or what was found by another that was put after this call; then `question` is not.
    pub(super) async fn ask(
        &self,
        id: PlanId,
        question: impl Future<Output = Result<T, StoreError>>,
    ) -> Result<T, StoreError> {
        let visit = Visit::to(self, id);
        let asked = visit.desk.asked.fetch_add(1, Ordering::Relaxed);
        let mut answered = visit.desk.answered.lock().await;
        if let Some((put, answer)) = &*answered
            && asked < *put
        {
            return Ok(answer.clone());
        }
        let _permit = self.permits.acquire().await;
        let put = visit.desk.asked.load(Ordering::Relaxed);
        let answer = question.await?;
        *answered = Some((put, answer.clone()));
        Ok(answer)
    }
}

/// Somebody at a desk; the last to leave takes it away.
struct Visit<'a, T> {
    together: &'a Together<T>,
    id: PlanId,
    desk: Arc<Desk<T>>,
}

impl<'a, T> Visit<'a, T> {
    fn to(together: &'a Together<T>, id: PlanId) -> Self {
        let fresh = || {
            let desk = Desk {
                asked: AtomicU64::default(),
                answered: tokio::sync::Mutex::default(),
            };
            Visited {
                visitors: 0,
                desk: Arc::new(desk),
            }
        };
        let mut desks = together.desks.lock();
        let visited = desks.entry(id).or_insert_with(fresh);
        visited.visitors += 1;
        let desk = Arc::clone(&visited.desk);
        Self { together, id, desk }
    }
}

impl<T> Drop for Visit<'_, T> {
    fn drop(&mut self) {
        let mut desks = self.together.desks.lock();
        if let Entry::Occupied(mut visited) = desks.entry(self.id) {
            visited.get_mut().visitors -= 1;
            if visited.get().visitors == 0 {
                visited.remove();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use futures_util::future::join_all;

    use super::*;

    /// The first question was put before the others came; one more answers all of them.
    #[tokio::test]
    async fn a_crowd_causes_two_questions_and_leaves_nothing() {
        let (together, id) = (Together::new(4), PlanId::now_v7());
        let put = AtomicUsize::new(0);
        let question = async || {
            let nth = put.fetch_add(1, Ordering::Relaxed);
            tokio::task::yield_now().await;
            Ok(nth)
        };
        let found = join_all((0..200).map(|_| together.ask(id, question()))).await;
        assert!(found.iter().all(Result::is_ok));
        assert_eq!(put.load(Ordering::Relaxed), 2);
        assert!(together.desks.lock().is_empty());
        let last = together.ask(id, question()).await.expect("an answer");
        assert_eq!(last, 2, "nothing old is passed on");
    }

    #[tokio::test]
    async fn who_leaves_or_fails_leaves_the_question_to_the_next() {
        let (together, id) = (Together::new(4), PlanId::now_v7());
        {
            let mut gone = Box::pin(together.ask(id, std::future::pending()));
            assert!(futures_util::poll!(&mut gone).is_pending());
        }
        let fails = async { Err(StoreError::unavailable("not now")) };
        assert!(together.ask(id, fails).await.is_err());
        let answer = async { Ok(()) };
        together.ask(id, answer).await.expect("an answer");
        assert!(together.desks.lock().is_empty());
    }

    #[tokio::test]
    async fn few_plans_are_asked_about_at_the_same_time() {
        let together = Together::new(4);
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let question = async || {
            most.fetch_max(now.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
            tokio::task::yield_now().await;
            now.fetch_sub(1, Ordering::Relaxed);
            Ok(())
        };
        join_all((0..50).map(|_| together.ask(PlanId::now_v7(), question()))).await;
        assert_eq!(most.load(Ordering::Relaxed), 4);
    }
}
