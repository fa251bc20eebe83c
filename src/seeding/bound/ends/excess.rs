//! The cost of first and last legs beyond the rise of a potential along them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::super::potential::Proof;
use super::super::prices::Prices;
use super::super::string::cores;
use super::super::wall::Wall;
use super::kind::{End, Kind};
use super::ramp::Ramp;
use super::{MOST_CORNERS, ends};
use crate::geometry::{Point2, Vector2};
use crate::scenario::Scenario;

/// Possible gain from dividing a kind of leg, as a share of what is proven, below which it is not divided.
const LEAST: f64 = 3e-4;

/// Number of sectors into which the edge of a zone is divided.
const SECTORS: u32 = 64;

/// Number of kinds of legs examined for each end; fewer with more than `MOST_CORNERS` corners.
const EFFORT: usize = 1500;

/// A lower bound for all routes from `proof` and the legs at ends that are off the middle of the band: the potential
/// rises by no more than the cost of the way seen from above, and both legs are straight and climb; 0 where that costs
/// nothing.
pub(in super::super) fn over(
    mut proof: Proof,
    scenario: &Scenario,
    prices: &Prices,
    walls: &[Wall],
    stop: &dyn Fn() -> bool,
) -> f64 {
    let radii = cores(walls);
    let Some(ends) = ends(scenario, prices, (walls, &radii), stop) else {
        return 0.0;
    };
    proof.look_up();
    let fine = LEAST * proof.total();
    let corners: usize = walls.iter().map(Wall::bends).sum();
    let effort = EFFORT * MOST_CORNERS / corners.max(MOST_CORNERS);
    let excess = |end: usize| {
        let rise = |at, spread| proof.rise(end, at, spread);
        least(&ends[end], &rise, (fine, effort))
    };
    proof.with(excess(0) + excess(1))
}

/// The least cost of a leg beyond the `rise`, as accurate as requested unless that takes more effort.
fn least(
    end: &End,
    rise: &dyn Fn(Point2, f64) -> Option<f64>,
    (fine, effort): (f64, usize),
) -> f64 {
    let zone = zone(end, rise);
    let mut kinds = Vec::new();
    let mut cheapest = BinaryHeap::new();
    let keep = |kind: Kind, kinds: &mut Vec<Kind>, cheapest: &mut BinaryHeap<_>| {
        // Bits of numbers that are not negative are ordered as they are.
        let [shortest, longest] = kind.lengths;
        let leaving = zone
            .filter(|(ramp, _)| shortest < ramp.reach)
            .map_or(0.0, |(ramp, rise)| end.beginning(&ramp, longest, rise));
        let total = (kind.cost + kind.steepness).max(leaving).max(0.0);
        cheapest.push((Reverse(total.to_bits()), kinds.len()));
        kinds.push(kind);
    };
    for kind in Kind::all(0.0) {
        keep(end.beyond(kind, rise), &mut kinds, &mut cheapest);
    }
    while let Some((Reverse(total), idx)) = cheapest.pop() {
        let kind = kinds[idx];
        let is_fine = end.gain(&kind) < fine || kind.cost.is_infinite();
        if is_fine || kinds.len() > effort || (end.stop)() {
            return f64::from_bits(total);
        }
        for part in end.parts(&kind) {
            keep(end.beyond(part, rise), &mut kinds, &mut cheapest);
        }
    }
    0.0
}

/// The zone round an end outside the band, and the greatest rise of the potential on the way to its edge; `None` where
/// there is no zone.
fn zone(end: &End, rise: &dyn Fn(Point2, f64) -> Option<f64>) -> Option<(Ramp, f64)> {
    let ramp = end.ramp?;
    let half = std::f64::consts::PI / f64::from(SECTORS);
    let rises = (0..SECTORS).filter_map(|sector| {
        let (sin, cos) = libm::sincos(2.0 * half * f64::from(sector));
        let at = end.from + Vector2::new(cos, sin) * ramp.reach;
        rise(at, ramp.reach * half)
    });
    Some((ramp, rises.reduce(f64::max)?))
}
