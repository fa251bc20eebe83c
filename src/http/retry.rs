//! When to ask again: `Retry-After`, computed from the queue.

use super::Capacity;
use crate::job::{Plan, Status};
use crate::store::Stats;

/// Longest value, seconds.
const MAX_S: f64 = 600.0;

/// Assumed duration of a run before the first has ended, milliseconds.
const UNKNOWN_RUN_MS: f64 = 1000.0;

/// Seconds after which a refused plan may find room: until a tenth of the waiting plans has been started,
///
/// `ceil((queued / 10 + 1) * mean_run_ms / workers / 1000)`, within 1 to 600.
///
/// A tenth rather than one place, so that not everyone refused returns for the same place.
pub(super) fn for_room(stats: &Stats, capacity: Capacity) -> u64 {
    let runs = stats.queued as f64 / 10.0 + 1.0;
    seconds(runs * mean_run_ms(stats) / capacity.all_workers(Some(stats)) as f64)
}

/// As [`for_room`], where the counts may be unknown: an answer that needs nothing else of the store is given although
/// the store fails.
pub(super) fn for_room_if_known<E>(stats: Result<Stats, E>, capacity: Capacity) -> u64 {
    stats.map_or(seconds(UNKNOWN_RUN_MS), |stats| for_room(&stats, capacity))
}

/// Seconds until an active plan is likely to end: those before it in the queue, and its own run.
pub(super) fn for_end(plan: &Plan, stats: &Stats, capacity: Capacity) -> u64 {
    let waiting =
        plan.queue_position.unwrap_or(0) as f64 / capacity.all_workers(Some(stats)) as f64;
    let running = match plan.status {
        Status::Running => 1.0 - plan.progress,
        _ => 1.0,
    };
    seconds((waiting + running) * mean_run_ms(stats))
}

fn mean_run_ms(stats: &Stats) -> f64 {
    stats.mean_run_ms.unwrap_or(UNKNOWN_RUN_MS)
}

fn seconds(ms: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "1 to 600"
    )]
    let whole = (ms / 1000.0).ceil().clamp(1.0, MAX_S) as u64;
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retry_after_grows_with_the_queue_and_shrinks_with_the_workers() {
        let room_of = |queued, mean_run_ms, workers, slots| {
            let stats = Stats {
                queued,
                oldest_queued_ms: None,
                running: 0,
                mean_run_ms,
                slots,
            };
            for_room(
                &stats,
                Capacity {
                    workers,
                    queue: 1000,
                },
            )
        };
        let room = |queued, mean_run_ms, workers| room_of(queued, mean_run_ms, workers, None);
        assert_eq!(
            room(1000, Some(2000.0), 4),
            51,
            "101 runs of 2 s on 4 workers"
        );
        assert_eq!(room(1000, Some(2000.0), 8), 26);
        assert_eq!(room(0, Some(10.0), 1), 1, "at least a second");
        assert_eq!(
            room(1000, None, 1),
            101,
            "a second a run while none is known"
        );
        assert_eq!(room(1_000_000, Some(1e6), 1), 600, "at most ten minutes");
        let shared = |workers, slots| room_of(1000, Some(2000.0), workers, slots);
        assert_eq!(shared(0, Some(8)), 26, "other nodes run plans");
        assert_eq!(shared(4, Some(8)), 26);
        assert_eq!(shared(0, Some(0)), 202, "as if somebody came");
    }
}
