//! Search events as bytes: a third of the size of their JSON, and no number is converted to digits and back.
//!
//! Most of what the store writes is these events. All others stay text, as all were in earlier versions.

use serde::{Deserialize, Serialize};

use crate::export::document::{Convergence, Incumbent, Position};
use crate::job::Event;

/// A search event. New kinds go last: files identify the kind by its position in this list.
#[derive(Serialize, Deserialize)]
enum Packed {
    Convergence {
        iteration: u64,
        evaluations: u64,
        elapsed_ms: f64,
        best_cost: Option<f64>,
        best_violation: f64,
        mean_cost: f64,
        feasible_fraction: f64,
    },
    Incumbent {
        iteration: u64,
        elapsed_ms: f64,
        cost: f64,
        feasible: bool,
        waypoints: Waypoints,
    },
}

/// Positions in one of the two frames.
#[derive(Serialize, Deserialize)]
struct Waypoints {
    geodetic: bool,
    /// x, y, z, or latitude, longitude, altitude.
    points: Vec<[f64; 3]>,
}

/// The events as bytes; `None` when other kinds are among them.
pub(super) fn pack(events: &[Event]) -> Option<Vec<u8>> {
    let packed: Option<Vec<Packed>> = events.iter().map(Packed::of).collect();
    postcard::to_stdvec(&packed?).ok()
}

/// The events that were packed.
///
/// # Errors
/// When the bytes were not made by [`pack`].
pub(super) fn unpack(bytes: &[u8]) -> Result<Vec<Event>, postcard::Error> {
    let packed: Vec<Packed> = postcard::from_bytes(bytes)?;
    Ok(packed.into_iter().map(Into::into).collect())
}

impl Packed {
    fn of(event: &Event) -> Option<Self> {
        match event {
            Event::Convergence(point) => Some(Self::Convergence {
                iteration: point.iteration as u64,
                evaluations: point.evaluations,
                elapsed_ms: point.elapsed_ms,
                best_cost: point.best_cost,
                best_violation: point.best_violation,
                mean_cost: point.mean_cost,
                feasible_fraction: point.feasible_fraction,
            }),
            Event::Incumbent(incumbent) => Some(Self::Incumbent {
                iteration: incumbent.iteration as u64,
                elapsed_ms: incumbent.elapsed_ms,
                cost: incumbent.cost,
                feasible: incumbent.feasible,
                waypoints: Waypoints::of(&incumbent.waypoints)?,
            }),
            Event::Status(_) | Event::End(_) => None,
        }
    }
}

impl Waypoints {
    /// `None` when the positions are in both frames.
    fn of(positions: &[Position]) -> Option<Self> {
        let is_geodetic = |position: &Position| matches!(position, Position::Geodetic { .. });
        let geodetic = positions.first().is_some_and(is_geodetic);
        let point = |position: &Position| {
            (is_geodetic(position) == geodetic).then_some(match *position {
                Position::Local { x, y, z } => [x, y, z],
                Position::Geodetic { lat, lon, alt } => [lat, lon, alt],
            })
        };
        let points = positions.iter().map(point).collect::<Option<_>>()?;
        Some(Self { geodetic, points })
    }
}

impl From<Packed> for Event {
    fn from(packed: Packed) -> Self {
        match packed {
            Packed::Convergence {
                iteration,
                evaluations,
                elapsed_ms,
                best_cost,
                best_violation,
                mean_cost,
                feasible_fraction,
            } => Self::Convergence(Convergence {
                iteration: count(iteration),
                evaluations,
                elapsed_ms,
                best_cost,
                best_violation,
                mean_cost,
                feasible_fraction,
            }),
            Packed::Incumbent {
                iteration,
                elapsed_ms,
                cost,
                feasible,
                waypoints,
            } => Self::Incumbent(Incumbent {
                iteration: count(iteration),
                elapsed_ms,
                cost,
                feasible,
                waypoints: waypoints.into(),
            }),
        }
    }
}

impl From<Waypoints> for Vec<Position> {
    fn from(Waypoints { geodetic, points }: Waypoints) -> Self {
        let position = |[first, second, third]: [f64; 3]| {
            if geodetic {
                Position::Geodetic {
                    lat: first,
                    lon: second,
                    alt: third,
                }
            } else {
                Position::Local {
                    x: first,
                    y: second,
                    z: third,
                }
            }
        };
        points.into_iter().map(position).collect()
    }
}

/// The file may come from a machine with a larger `usize`.
fn count(iterations: u64) -> usize {
    usize::try_from(iterations).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Status;

    fn point(best_cost: Option<f64>) -> Event {
        Event::Convergence(Convergence {
            iteration: 101,
            evaluations: 41_188,
            elapsed_ms: 22.021_484,
            best_cost,
            best_violation: 0.1 + 0.2,
            mean_cost: f64::MAX,
            feasible_fraction: 1.0,
        })
    }

    fn route(waypoints: Vec<Position>) -> Event {
        Event::Incumbent(Incumbent {
            iteration: 143,
            elapsed_ms: 30.1,
            cost: 489.446_017_196_105_06,
            feasible: false,
            waypoints,
        })
    }

    #[test]
    fn packed_events_unpack_to_the_same_bits() {
        let (x, y, z) = (305.474_248_726_745_7, -0.0, f64::MIN_POSITIVE);
        let (lat, lon, alt) = (48.1, -11.5, 520.25);
        let events = [
            point(None),
            point(Some(1.0 / 3.0)),
            route(vec![]),
            route(vec![Position::Local { x, y, z }; 12]),
            route(vec![Position::Geodetic { lat, lon, alt }; 2]),
        ];
        let bytes = pack(&events).expect("they are all of a search");
        let text = serde_json::to_string(&events).expect("JSON");
        assert!(2 * bytes.len() < text.len(), "{}", bytes.len());
        assert_eq!(unpack(&bytes).expect("they were packed"), events);
        for cut in 0..bytes.len() {
            assert!(unpack(&bytes[..cut]).is_err(), "{cut} bytes");
        }
    }

    #[test]
    fn other_events_are_not_packed() {
        let (x, y, z) = (1.0, 2.0, 3.0);
        let (lat, lon, alt) = (1.0, 2.0, 3.0);
        let mixed = vec![
            Position::Local { x, y, z },
            Position::Geodetic { lat, lon, alt },
        ];
        for events in [
            vec![point(None), Event::End(Status::Failed)],
            vec![route(mixed)],
        ] {
            assert_eq!(pack(&events), None, "{events:?}");
        }
    }

    /// Later versions must be able to read existing files.
    #[test]
    fn the_packed_format_does_not_change() {
        let bytes = pack(&[point(None)]).expect("it is of a search");
        let mut expected = vec![1, 0, 101, 0xe4, 0xc1, 0x02];
        expected.extend(22.021_484_f64.to_le_bytes());
        expected.push(0);
        for figure in [0.1 + 0.2, f64::MAX, 1.0] {
            expected.extend(f64::to_le_bytes(figure));
        }
        assert_eq!(bytes, expected);
    }
}
