//! What may be hoped for: the string's own price.

use super::departure::early;
use super::potential::whole;
use super::prices::Prices;
use super::string::{departures, pulled, scene};
use super::wall::Wall;
use crate::geometry::{Point2, Rect};
use crate::seeding::taut::Piece;

/// Share of the direct way by which a string may leave the area: a way within it is about as long.
const OUTSIDE: f64 = 0.01;

/// Points on a way at which soft zones are looked up.
const SAMPLES: u32 = 256;

/// What is hoped for: more than that cannot be proven.
pub(super) struct Promise {
    /// What the string costs with all its soft zones, about; infinite where it leaves the area.
    pub(super) cost: f64,
    /// Where it bends first after the start and last before the target.
    pub(super) bends: [Point2; 2],
}

/// What the string round `walls` widened to `radii` promises.
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
    let [start, target] = prices.ends.map(|end| end.xy());
    let mut promise = Promise {
        cost: f64::INFINITY,
        bends: [target, start],
    };
    if let Some(string) = found.strings.first() {
        let price = |length, at: &dyn Fn(f64) -> Point2| price(walls, prices, area, (length, at));
        // Straight out of the soft zone that an end lies in.
        let out = |end: usize| {
            let from = prices.ends[end].xy();
            let way = ends[end].at - from;
            price(way.norm(), &|share| from + way * share)
        };
        let across = price(string.length, &|share| string.at(share))
            + out(0)
            + out(1)
            + early(walls, prices);
        // Waypoints off the middle of the band are no reason to look farther.
        promise.cost = prices.climbing(across / prices.fuel, prices.rise());
        if let [Piece::Straight { to, .. }, .., Piece::Straight { from, .. }] = &string.pieces[..] {
            promise.bends = [*to, *from];
        }
    }
    promise
}

/// What a way costs seen from above, about, that is at places told by their shares of its length; infinite where it
/// leaves the area, of which strings know nothing.
fn price(
    walls: &[Wall],
    prices: &Prices,
    area: &Rect,
    (length, at): (f64, &dyn Fn(f64) -> Point2),
) -> f64 {
    let depth = |at: Point2| -> f64 {
        whole(walls)
            .map(|wall| (wall.influence - wall.distance(at)).max(0.0))
            .sum()
    };
    let middle = |part| at((f64::from(part) + 0.5) / f64::from(SAMPLES));
    let outside = OUTSIDE * prices.direct();
    if (0..SAMPLES).any(|part| area.excess(middle(part)) > outside) {
        return f64::INFINITY;
    }
    let depths: f64 = (0..SAMPLES).map(|part| depth(middle(part))).sum();
    length * (prices.fuel + prices.exposure * depths / f64::from(SAMPLES))
}
