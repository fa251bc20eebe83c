//! Processor time, which a busy machine distorts less than wall-clock time.

use rustix::time::{ClockId, clock_gettime};

/// Seconds of processor time since it was started, of all threads of this process.
pub(super) struct Stopwatch {
    begun: f64,
}

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self { begun: now_s() }
    }

    pub(super) fn seconds(&self) -> f64 {
        now_s() - self.begun
    }
}

fn now_s() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_time_increases_with_work_and_stays_within_all_cores() {
        let (watch, wall) = (Stopwatch::start(), std::time::Instant::now());
        let mut before = 0.0;
        while before < 2e-3 {
            let now = watch.seconds();
            assert!(now >= before);
            before = now;
        }
        // Other tests run in this process too, on at most this many cores.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        assert!(before <= (wall.elapsed().as_secs_f64() + 1e-3) * cores as f64);
    }
}
