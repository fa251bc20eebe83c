//! Taut strings: the shortest ways between two points round obstacles, one for each way of passing
//! them.
//!
//! A string pulled tight runs straight between obstacles and along their boundary. In each homotopy
//! class (left of this, right of that) there is exactly one, so that the k shortest different
//! strings are the best of k different classes.

mod search;

use super::obstacles::Obstacles;
use crate::geometry::Point2;
use search::Search;

/// A string pulled tight from start to target.
#[derive(Debug, Clone, PartialEq)]
pub struct TautString {
    /// Length, metres.
    pub length: f64,
    /// In order, each beginning where the one before ends; straight ones first and last.
    pub pieces: Vec<Piece>,
}

/// A part of a [`TautString`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// Straight.
    Straight {
        /// Where it begins.
        from: Point2,
        /// Where it ends.
        to: Point2,
    },
    /// Along a circle, or, with radius 0, a bend at a point.
    Arc {
        /// Index of the outline that is rounded.
        outline: usize,
        /// Centre of the circle.
        center: Point2,
        /// Radius, metres.
        radius: f64,
        /// Where it begins.
        from: Point2,
        /// Where it ends.
        to: Point2,
        /// Turn in radians, positive counter-clockwise.
        turn: f64,
    },
}

/// What a search for taut strings found.
#[derive(Debug, Clone, PartialEq)]
pub struct TautStrings {
    /// Shortest first, of different homotopy classes.
    pub strings: Vec<TautString>,
    /// Every string that is not listed has at least this length, metres; infinite when there is none.
    pub beyond: f64,
    /// Effort of the search: ways examined.
    pub ways: usize,
}

/// Number of ways examined before a search gives up.
const MOST_WAYS: usize = 2_000_000;

/// Strings nearer to each other than this share of their length everywhere count as one.
const SAME: f64 = 1e-7;

/// The `k` shortest taut strings between the ends of `obstacles`.
#[must_use]
pub fn taut_strings(obstacles: &Obstacles, k: usize) -> TautStrings {
    taut_strings_within(obstacles, k, Limits::NONE)
}

/// As [`taut_strings`]; once `stop` asks for it, returns what was found so far.
pub fn taut_strings_until(obstacles: &Obstacles, k: usize, stop: &dyn Fn() -> bool) -> TautStrings {
    let limits = Limits {
        stop,
        ..Limits::NONE
    };
    taut_strings_within(obstacles, k, limits)
}

/// When a search for strings ends before it has found what it looks for. What it has proven about the strings not found
/// is still valid.
#[derive(Clone, Copy)]
pub(super) struct Limits<'s> {
    /// Maximum number of ways examined.
    pub(super) most_ways: usize,
    /// The search ends once no string shorter than this, metres, is left to find.
    pub(super) enough: f64,
    /// Checked occasionally.
    pub(super) stop: &'s dyn Fn() -> bool,
}

impl Limits<'_> {
    const NONE: Limits<'static> = Limits {
        most_ways: MOST_WAYS,
        enough: f64::INFINITY,
        stop: &|| false,
    };
}

/// As [`taut_strings`], within `limits`.
pub(super) fn taut_strings_within(obstacles: &Obstacles, k: usize, limits: Limits) -> TautStrings {
    Search::new(obstacles, k, limits).run()
}

impl TautString {
    /// The point `share` of the length along the string, 0 to 1.
    #[must_use]
    pub fn at(&self, share: f64) -> Point2 {
        let mut remaining = share * self.length;
        for piece in &self.pieces {
            let length = piece.length();
            if remaining <= length {
                return piece.at(remaining);
            }
            remaining -= length;
        }
        match self.pieces.last() {
            Some(Piece::Straight { to, .. } | Piece::Arc { to, .. }) => *to,
            None => Point2::origin(),
        }
    }
}

impl Piece {
    /// Length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        match self {
            Self::Straight { from, to } => (to - from).norm(),
            Self::Arc { radius, turn, .. } => radius * turn.abs(),
        }
    }

    /// The point `way` metres from its beginning.
    fn at(&self, way: f64) -> Point2 {
        match *self {
            Self::Straight { from, to } => {
                let length = (to - from).norm();
                from + (to - from) * if length > 0.0 { way / length } else { 0.0 }
            }
            Self::Arc {
                center,
                radius,
                from,
                turn,
                ..
            } => {
                let angle = if radius > 0.0 {
                    turn.signum() * way / radius
                } else {
                    0.0
                };
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                let out = from - center;
                center
                    + nalgebra::Vector2::new(out.x * cos - out.y * sin, out.x * sin + out.y * cos)
            }
        }
    }
}

/// Whether two strings are the same line, found twice round obstacles that touch or coincide.
fn same(one: &TautString, other: &TautString) -> bool {
    let near = SAME * one.length.max(1.0);
    (one.length - other.length).abs() <= near
        && (1..16).all(|i| {
            let share = f64::from(i) / 16.0;
            (one.at(share) - other.at(share)).norm() <= 10.0 * near
        })
}

#[cfg(test)]
mod tests;
