//! Long work, away from the threads that answer requests.

use std::num::NonZero;
use std::sync::LazyLock;
use std::thread::available_parallelism;

use tokio::sync::Semaphore;

use super::problem::Problem;

/// One place per core: more would only compete for time and memory.
static PLACES: LazyLock<Semaphore> =
    LazyLock::new(|| Semaphore::new(available_parallelism().map_or(1, NonZero::get)));

/// Do `work` on a thread of its own; a panic there is passed on here. Its log lines keep the request's id.
pub(super) async fn run<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Problem> {
    let span = tracing::Span::current();
    let place = PLACES.acquire().await.expect("it is never closed");
    let work = move || {
        // Work continues when its caller has hung up, and keeps its place until it is done.
        let _place = place;
        span.in_scope(work)
    };
    let done = tokio::task::spawn_blocking(work).await;
    done.or_else(|broken| match broken.try_into_panic() {
        Ok(panic) => std::panic::resume_unwind(panic),
        Err(_) => Err(Problem::Draining { retry_after_s: 1 }),
    })
}
