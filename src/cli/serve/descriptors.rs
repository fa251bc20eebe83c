//! File descriptors: as many as the system allows the process, and no more connections than that.
//!
//! A service that runs out of them can accept nobody, not even to say whether it is ready; one that stops accepting
//! before that leaves callers in the listener's backlog until others go.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// For everything except connections: the store, datasets being read or uploaded, webhooks, the log. Most of it is for
/// threads that read files, of which tokio starts up to 512.
const RESERVE: u64 = 512;

/// Raise the limit of this process as far as possible, and return how many connections fit below it, at most `wished`.
pub(super) fn connections(wished: usize) -> usize {
    let Some(limit) = raise() else {
        return wished;
    };
    let fitting = fitting(wished, limit);
    if fitting < wished {
        tracing::warn!(
            file_descriptors = limit,
            connections = fitting,
            "fewer connections than http.max_connections, {wished}, for the limit of open files is {limit}"
        );
    }
    fitting
}

/// The limit now in force; `None` when there is none.
fn raise() -> Option<u64> {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit {
        current: limit.maximum,
        ..limit
    };
    match setrlimit(Resource::Nofile, raised) {
        Ok(()) => limit.maximum,
        Err(error) => {
            tracing::warn!(%error, "the limit of open files could not be raised");
            limit.current
        }
    }
}

/// Where the limit is low, the reserve is a quarter of it.
fn fitting(wished: usize, limit: u64) -> usize {
    let left = limit - RESERVE.min(limit / 4);
    wished
        .min(usize::try_from(left).unwrap_or(usize::MAX))
        .max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_connection_limit_leaves_descriptors_for_everything_else() {
        for (wished, limit, expected) in [
            (20_000, 1_048_576, 20_000),
            (20_000, 20_512, 20_000),
            (20_000, 20_000, 19_488),
            (20_000, 1_024, 768),
            (100, 1_024, 100),
            (20_000, 64, 48),
            (1, 0, 1),
        ] {
            assert_eq!(fitting(wished, limit), expected, "{wished} of {limit}");
        }
    }
}
