//! The range of every number in a document; the operator's upper limits are in
//! [`Limits`](crate::scenario::limits::Limits).

use std::fmt::{self, Display};

/// An interval of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    pub(super) min: f64,
    pub(super) max: f64,
    /// Whether `min` itself is allowed.
    closed_min: bool,
    /// Whether `max` itself is allowed.
    closed_max: bool,
}

impl Range {
    /// `min <= value <= max`.
    pub(super) const fn closed(min: f64, max: f64) -> Self {
        Self {
            min,
            max,
            closed_min: true,
            closed_max: true,
        }
    }

    /// `0 < value <= max`.
    const fn positive(max: f64) -> Self {
        Self {
            min: 0.0,
            max,
            closed_min: false,
            closed_max: true,
        }
    }

    pub(super) fn contains(&self, value: f64) -> bool {
        let above = if self.closed_min {
            value >= self.min
        } else {
            value > self.min
        };
        let below = if self.closed_max {
            value <= self.max
        } else {
            value < self.max
        };
        above && below
    }

    /// The allowed range, for a message about `value`. An upper end of 1e6 or more is only a sanity limit, so it is
    /// left out for a value that is too small.
    pub(super) fn advice(&self, value: f64) -> String {
        let sane_max = self.max >= 1e6;
        if sane_max && self.min >= 0.0 && value <= self.min {
            self.lower()
        } else {
            self.to_string()
        }
    }

    fn lower(&self) -> String {
        format!("{} {}", if self.closed_min { ">=" } else { ">" }, self.min)
    }
}

impl Display for Range {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "{} and {} {}",
            self.lower(),
            if self.closed_max { "<=" } else { "<" },
            self.max
        )
    }
}

/// Greatest coordinate or height in either direction, metres.
pub const MOST_M: f64 = 1e7;

/// Coordinates and heights, metres.
pub(super) const COORDINATE: Range = Range::closed(-MOST_M, MOST_M);
/// Degrees.
pub(super) const LATITUDE: Range = Range::closed(-90.0, 90.0);
/// Degrees.
pub(super) const LONGITUDE: Range = Range::closed(-180.0, 180.0);
/// Corners of the area, metres; wider, so that the default area around the largest threat fits.
pub(super) const AREA: Range = Range::closed(-1e8, 1e8);
/// `radius` and `influence`, metres.
pub(super) const RADIUS: Range = Range::positive(1e7);
/// `margin`, metres.
pub(super) const MARGIN: Range = Range::closed(0.0, 1e7);
/// `spread` of a peak, metres; a narrower peak would need too fine steps to check a leg.
pub(super) const SPREAD: Range = Range::closed(1.0, 1e7);
/// `cell`, metres between nodes.
pub(super) const CELL: Range = Range::closed(0.01, 1e6);
/// `altitude.min` and `altitude.max`, metres above ground.
pub(super) const ALTITUDE: Range = Range::closed(0.0, 1e6);
/// `max_turn_deg`, degrees; 180 allows any turn.
pub(super) const TURN: Range = Range::positive(180.0);
/// `max_climb_deg`, degrees; below 90, where the tangent is infinite.
pub(super) const CLIMB: Range = Range {
    min: 0.0,
    max: 90.0,
    closed_min: false,
    closed_max: false,
};
/// `min_leg`, metres; 0 means no minimum.
pub(super) const MIN_LEG: Range = Range::closed(0.0, 1e7);
/// `cruise_speed`, metres per second.
pub(super) const SPEED: Range = Range::closed(0.01, 1e4);
/// `fuel_per_km`.
pub(super) const FUEL: Range = Range::closed(0.0, 1e6);
/// Each weight of Eq. 1.
pub(super) const WEIGHT: Range = Range::closed(0.0, 1e6);
/// `smoothing.spacing`, metres between delivered samples.
pub(super) const SPACING: Range = Range::closed(0.01, 1e6);
/// `smoothing.degree`, a whole number.
pub(super) const DEGREE: Range = Range::closed(1.0, 5.0);
/// `time_limit_ms`, a whole number, up to an hour.
pub(super) const TIME_LIMIT_MS: Range = Range::closed(1.0, 3_600_000.0);
/// `seed`, a whole number below 2^53, which every JSON parser represents exactly.
pub(super) const SEED: Range = Range::closed(0.0, 9_007_199_254_740_991.0);
/// `parameters.gap`, a fraction of the proven bound; 0 never ends the search.
pub(super) const GAP: Range = Range::closed(0.0, 10.0);
/// `parameters.threads`, a whole number.
pub(super) const THREADS: Range = Range::closed(1.0, 256.0);

/// Fewest nodes of a grid in either direction.
pub(super) const MIN_NODES: usize = 2;
/// Smallest population: one bat to move and one to learn from.
pub(super) const MIN_POPULATION: usize = 2;
/// Longest name, characters.
pub(super) const MAX_NAME_CHARS: usize = 200;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_ranges_are_those_that_are_checked() {
        let page = include_str!("../../../docs/PROBLEMS.md");
        for (field, range) in [
            (
                "`x`, `y`, `z`, `alt`, `base`, `top`, `elevation`, `height`, each of `elevations`",
                COORDINATE,
            ),
            ("`lat`", LATITUDE),
            ("`lon`", LONGITUDE),
            ("`area`'s corners", AREA),
            ("`radius`, `influence`", RADIUS),
            ("`margin`", MARGIN),
            ("`spread`'s `x` and `y`", SPREAD),
            ("`cell`", CELL),
            ("`altitude.min`, `altitude.max`", ALTITUDE),
            ("`max_turn_deg`", TURN),
            ("`max_climb_deg`", CLIMB),
            ("`min_leg`", MIN_LEG),
            ("`cruise_speed`", SPEED),
            ("`fuel_per_km`", FUEL),
            ("each weight", WEIGHT),
            ("`smoothing.spacing`", SPACING),
            ("`smoothing.degree`", DEGREE),
            ("`time_limit_ms`", TIME_LIMIT_MS),
            ("`seed`", SEED),
            ("`parameters.gap`", GAP),
            ("`parameters.threads`", THREADS),
        ] {
            let row = format!("| {field} | {range} |");
            assert!(page.contains(&row), "docs/PROBLEMS.md has no row {row}");
        }
    }

    #[test]
    fn advice_names_the_side_that_was_missed() {
        assert_eq!(RADIUS.advice(-3.0), "> 0");
        assert_eq!(RADIUS.advice(1e9), "> 0 and <= 10000000");
        assert_eq!(TURN.advice(-3.0), "> 0 and <= 180");
        assert_eq!(CLIMB.to_string(), "> 0 and < 90");
    }
}
