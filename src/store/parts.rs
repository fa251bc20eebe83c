//! Events stored together: few enough that whoever reads one of them reads not many bytes more.

use crate::job::Event;

/// Events in a part, at most.
const EVENTS: usize = 256;

/// About how many bytes of them, unless one alone takes more. The points of as many iterations fit, and messages to a
/// NATS server may have 1 MiB by default.
const BYTES: usize = 128 << 10;

/// The events in their order, in parts that are written and read as one.
pub(super) fn parts(events: &[Event]) -> Vec<&[Event]> {
    let mut parts = Vec::new();
    let mut rest = events;
    while !rest.is_empty() {
        let mut bytes = 0;
        let fits = |event: &&Event| {
            bytes += event.bytes();
            bytes <= BYTES
        };
        let count = rest.iter().take(EVENTS).take_while(fits).count().max(1);
        let (part, more) = rest.split_at(count);
        parts.push(part);
        rest = more;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::document::{Convergence, Incumbent, Position};

    fn incumbent(waypoints: usize) -> Event {
        let place = Position::Local {
            x: -1.234_567_890_123_456_7e-300,
            y: -1.234_567_890_123_456_7e-300,
            z: -1.234_567_890_123_456_7e-300,
        };
        Event::Incumbent(Incumbent {
            iteration: 1,
            elapsed_ms: 1.0,
            cost: 1.0,
            feasible: false,
            waypoints: vec![place; waypoints],
        })
    }

    fn point() -> Event {
        Event::Convergence(Convergence {
            iteration: 1,
            evaluations: 1,
            elapsed_ms: 1.0,
            best_cost: None,
            best_violation: 0.0,
            mean_cost: 1.0,
            feasible_fraction: 0.0,
        })
    }

    #[test]
    fn parts_are_complete_in_order_and_short() {
        for (events, waypoints) in [(0, 3), (1, 3), (600, 3), (40, 200), (3, 20_000)] {
            let all = vec![incumbent(waypoints); events];
            let parts = parts(&all);
            assert_eq!(parts.concat(), all);
            for part in parts {
                let bytes = serde_json::to_vec(part).expect("they can be written").len();
                assert!(bytes <= 2 * BYTES || part.len() == 1, "{bytes}");
                assert!(part.len() <= EVENTS);
            }
        }
    }

    #[test]
    fn a_part_has_as_many_points_as_may_be() {
        let all = vec![point(); 2 * EVENTS + 1];
        let lengths = parts(&all).into_iter().map(<[Event]>::len);
        assert_eq!(lengths.collect::<Vec<_>>(), [EVENTS, EVENTS, 1]);
    }
}
