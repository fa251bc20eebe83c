//! Long work away from the threads that answer.

use super::problem::Problem;

/// Do `work` on a thread of its own; a panic there is one here. Its log lines keep the request's id.
pub(super) async fn run<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Problem> {
    let span = tracing::Span::current();
    let done = tokio::task::spawn_blocking(move || span.in_scope(work)).await;
    done.or_else(|broken| match broken.try_into_panic() {
        Ok(panic) => std::panic::resume_unwind(panic),
        Err(_) => Err(Problem::Draining { retry_after_s: 1 }),
    })
}
