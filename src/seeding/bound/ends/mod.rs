//! The extra cost, on top of the string, of a start and target at another height than the middle of the band: a first
//! leg is straight, so that where the way bends soon, it is short and steep. The argument is section 7 of
//! docs/BOUND.md.

mod climb;
mod dividing;
mod excess;
mod exposure;
mod kind;
mod lead;
mod ramp;
mod rising;
mod slopes;
mod threats;

pub(super) use excess::over;
pub(super) use lead::leads;
pub(super) use rising::rising;

use super::prices::Prices;
use super::string::{cores, slack};
use super::toll::steepest;
use super::wall::Wall;
use crate::geometry::Point2;
use crate::scenario::Scenario;
use kind::{End, Kind};
use ramp::Ramp;

/// With more corners than this, only the difference in height of the ends is used.
const MOST_CORNERS: usize = 80;

/// Possible gain from dividing a kind of leg, as a share of a route's cost, below which it is not divided.
const LEAST: f64 = 1e-3;

/// A kind of leg proven to cost this multiple of the bound so far is not examined further for now.
const AHEAD: f64 = 1.03;

/// Effort of a string, in addition to the ways examined for it and the corners of rings.
const STRING: usize = 20;

/// This many corners of rings take as much effort as a kind of leg.
const CORNERS: usize = 3;

/// Whether there are too many corners to examine legs, with so many of each wall.
pub(super) fn are_too_many(corners: impl Iterator<Item = usize>) -> bool {
    corners.sum::<usize>() > MOST_CORNERS
}

/// The first and the last legs of routes round widened walls.
pub(super) struct Legs<'a> {
    prices: &'a Prices,
    /// `None` where legs cost nothing extra.
    told_apart: Option<([End<'a>; 2], [Vec<Kind>; 2])>,
    /// Number of corners of the rings.
    corners: usize,
    /// Remaining effort: one unit for a kind of leg, more for a string. Without any, nothing more is proven.
    pub(super) effort: usize,
}

impl<'a> Legs<'a> {
    /// For routes that go round `walls` widened to radii, and cost `least` or more seen from above.
    pub(super) fn new(
        scenario: &Scenario,
        prices: &'a Prices,
        (walls, radii): (&'a [Wall], &'a [Option<f64>]),
        least: f64,
        (effort, stop): (usize, &'a dyn Fn() -> bool),
    ) -> Self {
        let matter = least.is_finite() && !are_too_many(walls.iter().map(Wall::bends));
        let ends = matter
            .then(|| ends(scenario, prices, (walls, radii), stop))
            .flatten();
        Self {
            prices,
            told_apart: ends.map(|ends| (ends, [0, 1].map(|_| Kind::all(least)))),
            corners: walls.iter().map(Wall::corners).sum(),
            effort,
        }
    }

    /// A lower bound for routes that cost `least` or more seen from above, from what is known of legs.
    pub(super) fn known(&self, least: f64) -> f64 {
        let level = self.prices.climbing_at(least);
        let told_apart = self.told_apart.as_ref();
        told_apart.map_or(level, |(_, kinds)| cheapest(kinds, least).0.max(level))
    }

    /// A lower bound for routes that cost `least` or more seen from above: the cheapest combination of all kinds of
    /// first and last legs. These are divided further until it does not matter, until all combinations cost `enough`,
    /// or until the effort is spent.
    pub(super) fn bound(&mut self, least: f64, enough: f64) -> f64 {
        let level = self.prices.climbing_at(least);
        let Some((ends, kinds)) = &mut self.told_apart else {
            return level;
        };
        loop {
            let (cost, worst) = cheapest(kinds, least);
            let gain = |end: usize| ends[end].gain(&kinds[end][worst[end]]);
            let end = usize::from(gain(1) > gain(0));
            let is_fine = gain(end) < LEAST * cost || cost >= enough || level >= enough;
            if is_fine || self.effort == 0 || (ends[end].stop)() {
                return cost.max(level);
            }
            let kind = kinds[end].remove(worst[end]);
            let mut keep = |kind: Kind| {
                let at = kinds[end].partition_point(|other| other.cost <= kind.cost);
                kinds[end].insert(at, kind);
            };
            if kind.is_rough {
                let (kind, ways) = ends[end].pulled(kind, AHEAD * cost);
                self.effort = self.effort.saturating_sub(STRING + self.corners + ways);
                keep(kind);
            } else {
                self.effort = self.effort.saturating_sub(1 + self.corners / CORNERS);
                for part in ends[end].parts(&kind) {
                    keep(ends[end].priced(part));
                }
            }
        }
    }
}

/// Both ends, where waypoints off the middle of the band cost something or ends lie outside it; `None` elsewhere.
fn ends<'a>(
    scenario: &Scenario,
    prices: &'a Prices,
    (walls, radii): (&'a [Wall], &'a [Option<f64>]),
    stop: &'a dyn Fn() -> bool,
) -> Option<[End<'a>; 2]> {
    let middle = &prices.middle;
    // A single waypoint ends both legs.
    let share = if scenario.planner.waypoints > 1 {
        1.0
    } else {
        0.5
    };
    let steepest = steepest(scenario);
    let ramps = Ramp::round(scenario, middle);
    let between = prices.direct();
    let weights = [0, 1].map(|end| {
        if middle.is_known(end) {
            share * scenario.weights.altitude
        } else {
            0.0
        }
    });
    let off_middle = middle.off();
    let matter = weights.iter().any(|weight| *weight > 0.0) || ramps.iter().any(Option::is_some);
    matter.then(|| {
        [0, 1].map(|end| End {
            which: end,
            from: prices.ends[end].xy(),
            to: prices.ends[1 - end].xy(),
            height: off_middle[end],
            is_below: middle.below[end] > 0.0 || !middle.is_level,
            weight: weights[end],
            beyond: if middle.is_level { weights[end] } else { 0.0 },
            steepest,
            ramp: ramps[end],
            apart: ramps[1 - end].map_or(f64::INFINITY, |other| between - other.reach),
            prices,
            walls,
            radii,
            slack: slack(walls, radii, prices),
            stop,
        })
    })
}

/// The approximate extra cost of a string, given by places and the cost up to each, because its ends are off the middle
/// of the band.
pub(super) fn climbing(
    scenario: &Scenario,
    prices: &Prices,
    walls: &[Wall],
    string: &[(Point2, f64)],
    stop: &dyn Fn() -> bool,
) -> f64 {
    let radii = cores(walls);
    let ends = ends(scenario, prices, (walls, &radii), stop);
    let Some((ends, (_, whole))) = ends.zip(string.last()) else {
        return 0.0;
    };
    let more = |end: &End| {
        let beginning = string.iter().map(|(at, paid)| {
            let paid = if end.which == 0 { *paid } else { whole - paid };
            (*at, paid)
        });
        end.climbing_along(beginning)
    };
    ends.iter().map(more).sum()
}

/// The least cost of a route whose first leg is one of the first `kinds` and whose last leg is one of the others, and
/// which legs these are. Both are sorted by cost, cheapest first.
fn cheapest(kinds: &[Vec<Kind>; 2], least: f64) -> (f64, [usize; 2]) {
    let cost = |end: usize, idx: usize| kinds[end].get(idx).map_or(f64::INFINITY, |kind| kind.cost);
    let steepness = |end: usize, idx: usize| kinds[end][idx].steepness;
    let (mut found, mut worst) = (f64::INFINITY, [0; 2]);
    // Of the kinds up to a rising cost, those with the least extra cost.
    let mut flattest: [Option<usize>; 2] = [None; 2];
    let mut next = [0; 2];
    while next[0] < kinds[0].len() || next[1] < kinds[1].len() {
        let end = usize::from(cost(1, next[1]) < cost(0, next[0]) || next[0] == kinds[0].len());
        let idx = next[end];
        next[end] += 1;
        if flattest[end].is_none_or(|other| steepness(end, idx) < steepness(end, other)) {
            flattest[end] = Some(idx);
            if let [Some(first), Some(last)] = flattest {
                let total = cost(end, idx).max(least) + steepness(0, first) + steepness(1, last);
                if total < found {
                    (found, worst) = (total, [first, last]);
                }
            }
        }
    }
    (found, worst)
}
