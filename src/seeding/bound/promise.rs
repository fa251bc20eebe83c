//! An estimate of what can be proven: the string's own price.

use super::departure::early;
use super::potential::whole;
use super::prices::Prices;
use super::string::{departures, pulled, scene};
use super::wall::Wall;
use crate::geometry::{Point2, Rect};

/// Share of the direct way by which a string may leave the area: a way inside it is about as long.
const OUTSIDE: f64 = 0.01;

/// Number of pieces of a string at which soft zones are looked up.
const PIECES: u32 = 256;

/// Number of pieces of a way straight out of a soft zone.
const PIECES_OUT: u32 = 32;

/// The estimate: no more than this can be proven.
pub(super) struct Promise {
    /// Approximate cost of the string with all its soft zones; infinite where it leaves the area.
    pub(super) cost: f64,
    /// Places along it from the start to the target, and the cost up to each seen from above.
    pub(super) places: Vec<(Point2, f64)>,
}

/// The estimate for the string round `walls` widened to `radii`.
pub(super) fn promise(
    walls: &[Wall],
    radii: &[Option<f64>],
    prices: &Prices,
    area: &Rect,
    stop: &dyn Fn() -> bool,
) -> Promise {
    let ends = departures((walls, radii), prices, &[]);
    let found = pulled(
        &scene((walls, radii), ends.map(|end| end.at)),
        (f64::INFINITY, stop),
    );
    let mut promise = Promise {
        cost: f64::INFINITY,
        places: Vec::new(),
    };
    if let Some(string) = found.strings.first() {
        let share = |part: u32, pieces: u32| f64::from(part) / f64::from(pieces);
        // Straight out of the soft zone that an end lies in.
        let out = |end: usize, part: u32| {
            let from = prices.ends[end].xy();
            from + (ends[end].at - from) * share(part, PIECES_OUT)
        };
        let places = (0..=PIECES_OUT)
            .map(|part| out(0, part))
            .chain((1..PIECES).map(|part| string.at(share(part, PIECES))))
            .chain((0..=PIECES_OUT).rev().map(|part| out(1, part)));
        promise.places = paid(walls, prices, places);
        let outside = OUTSIDE * prices.direct();
        let leaves = |(at, _): &(Point2, f64)| area.excess(*at) > outside;
        if let (Some((_, across)), false) =
            (promise.places.last(), promise.places.iter().any(leaves))
        {
            // Waypoints off the middle of the band are no reason to search further.
            let length = (across + early(walls, prices)) / prices.fuel;
            promise.cost = prices.climbing(length, prices.rise());
        }
    }
    promise
}

/// The approximate cost of a way over `places` up to each of them, seen from above.
fn paid(
    walls: &[Wall],
    prices: &Prices,
    places: impl Iterator<Item = Point2>,
) -> Vec<(Point2, f64)> {
    let depth = |at: Point2| -> f64 {
        whole(walls)
            .map(|wall| (wall.influence - wall.distance(at)).max(0.0))
            .sum()
    };
    let mut paid: Vec<(Point2, f64)> = Vec::new();
    for place in places {
        let so_far = paid.last().map_or(0.0, |(before, so_far)| {
            let metre = prices.fuel + prices.exposure * depth(nalgebra::center(before, &place));
            so_far + metre * (place - before).norm()
        });
        paid.push((place, so_far));
    }
    paid
}
