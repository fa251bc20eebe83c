//! The places of a net over flanks, and the legs between them, each priced on first use.

use std::ops::Range;

use crate::cost::Model;
use crate::cost::batch::Pricer;
use crate::geometry::{LEVEL, Point2, Point3, Vector2};
use crate::planner::price::{pricer, search_tolerance};
use crate::planner::starts::net::{self, Spots};
use crate::planner::starts::{steepest, winding};
use crate::scenario::Scenario;

/// Heights of each spot, as shares of the band.
const HEIGHTS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// The net covers all points over which the way is at most this many times as long as the direct one, or as a climb
/// from the height of one end to that of the other.
const DETOUR: f64 = 1.5;

/// Legs are at most this many steps of the net long, seen from above.
const REACH: f64 = 3.7;

/// At each place the cheapest chain is kept for each of these ranges of headings in which it may arrive.
pub(super) const HEADINGS: usize = 24;

/// The legs between places that break no limit.
pub(super) struct Legs<'s> {
    /// Start, the spots at their heights, target.
    pub(super) places: Vec<Point3>,
    /// For each spot, the numbers of those to which legs lead; start and target are the first and the last spot.
    near: Vec<Vec<usize>>,
    /// From each place, once they have been priced.
    known: Vec<Option<Vec<Leg>>>,
    /// How many were priced.
    pub(super) count: u64,
    pub(super) pricer: Pricer<'s>,
    /// Half the cost of each place as a waypoint, for each metre of a leg that begins or ends there.
    own: Vec<f64>,
    /// Metres climbed per metre seen from above, at most.
    pub(super) steepest: f64,
}

/// A leg to a place.
#[derive(Clone, Copy)]
pub(super) struct Leg {
    pub(super) to: usize,
    pub(super) heading: Vector2,
    /// The number of the range of its heading.
    pub(super) range: usize,
    pub(super) cost: f64,
}

impl<'s> Legs<'s> {
    /// None priced yet, between the places of a net of about so many `spots`.
    pub(super) fn new(model: &Model<'s>, spots: usize) -> Self {
        let scenario = model.scenario;
        let tolerance = search_tolerance(model);
        let steepest = steepest(scenario);
        let way = scenario.target - scenario.start;
        let direct = way.xy().norm().max(LEVEL);
        let length = direct.max(way.z.abs() / steepest);
        let Spots { points, step } = net::spots(scenario, spots, DETOUR * length / direct);
        let over = |&spot| HEIGHTS.map(|share| winding(scenario, spot, share));
        let places: Vec<Point3> = std::iter::once(scenario.start)
            .chain(points.iter().flat_map(over))
            .chain([scenario.target])
            .collect();
        // A route has one waypoint per certain distance, not one at every place.
        let waypoints_per_m = (scenario.planner.waypoints + 1) as f64 / length;
        let own = |&place| 0.5 * model.waypoint(place, tolerance).1 * waypoints_per_m;
        Self {
            near: near(scenario, &points, REACH * step),
            known: vec![None; places.len()],
            count: 0,
            pricer: pricer(model).verdicts(),
            own: places.iter().map(own).collect(),
            steepest: steepest * (1.0 + 1e-9),
            places,
        }
    }

    /// The legs from `place`.
    pub(super) fn from(&mut self, place: usize) -> &[Leg] {
        if self.known[place].is_none() {
            self.known[place] = Some(self.priced(place));
        }
        self.known[place].as_deref().unwrap_or_default()
    }

    fn priced(&mut self, from: usize) -> Vec<Leg> {
        let may_climb = |to: usize| {
            let leg = self.places[to] - self.places[from];
            let level = leg.xy().norm();
            level > LEVEL && leg.z.abs() <= self.steepest * level
        };
        let spots = &self.near[spot_of(from)];
        let ends: Vec<(usize, usize)> = spots
            .iter()
            .flat_map(|&spot| self.places_over(spot))
            .filter(|&to| may_climb(to))
            .map(|to| (from, to))
            .collect();
        let legs = net::priced(&self.places, &ends, |from, to, prices| {
            self.pricer.first_legs(from, to, ends.len(), prices);
        });
        self.count += ends.len() as u64;
        let legs = ends.iter().zip(&legs).filter_map(|(&(from, to), leg)| {
            let way = self.places[to] - self.places[from];
            let heading = way.xy().normalize();
            leg.is_feasible().then(|| Leg {
                to,
                heading,
                range: range(heading),
                cost: leg.cost + (self.own[from] + self.own[to]) * way.norm(),
            })
        });
        legs.collect()
    }

    /// The places over a spot.
    fn places_over(&self, spot: usize) -> Range<usize> {
        let from = (spot * HEIGHTS.len() + 1).saturating_sub(HEIGHTS.len());
        let last = self.places.len();
        if spot == 0 {
            0..1
        } else {
            from..(from + HEIGHTS.len()).min(last)
        }
    }
}

/// The number of the spot of a place.
fn spot_of(place: usize) -> usize {
    place.div_ceil(HEIGHTS.len())
}

/// For each of start, `spots` and target, those others that are at most `reach` metres away.
fn near(scenario: &Scenario, spots: &[Point2], reach: f64) -> Vec<Vec<usize>> {
    let spots: Vec<Point2> = std::iter::once(scenario.start.xy())
        .chain(spots.iter().copied())
        .chain([scenario.target.xy()])
        .collect();
    let is_near = |one: Point2, other: Point2| (one - other).norm_squared() <= reach * reach;
    let others = |(idx, &spot): (usize, &Point2)| {
        let near = (0..spots.len()).filter(|&other| other != idx && is_near(spot, spots[other]));
        near.collect()
    };
    spots.iter().enumerate().map(others).collect()
}

/// The number of the range of a heading.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "from 0 to the number of ranges"
)]
fn range(heading: Vector2) -> usize {
    let turns = libm::atan2(heading.y, heading.x) / std::f64::consts::TAU;
    let nearest = (turns * HEADINGS as f64).round();
    nearest.rem_euclid(HEADINGS as f64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::mountain;

    #[test]
    fn places_of_a_spot_belong_to_it() {
        let scenario = mountain(250.0, true);
        let legs = Legs::new(&Model::new(&scenario), 100);
        let spots = legs.near.len();
        let all: Vec<usize> = (0..spots).flat_map(|spot| legs.places_over(spot)).collect();
        assert_eq!(all, (0..legs.places.len()).collect::<Vec<_>>());
        for spot in 0..spots {
            assert!(legs.places_over(spot).all(|place| spot_of(place) == spot));
        }
    }
}
