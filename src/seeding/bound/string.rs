//! The taut string round walls that are widened, pulled for a bound.

use super::super::obstacles::Obstacles;
use super::super::taut::{Limits, TautString, TautStrings, taut_strings_within};
use super::potential;
use super::prices::Prices;
use super::wall::Wall;

/// Ways looked at for one string: beyond a few hundred walls, the search ends with what it has
/// proven so far.
const MOST_WAYS: usize = 60_000;

/// Without widening anything: where there are too many gaps to look at.
pub(super) fn plain(
    walls: &[Wall],
    radii: &[Option<f64>],
    prices: &Prices,
    stop: &dyn Fn() -> bool,
) -> f64 {
    let (length, _) = length(walls, radii, prices, (f64::INFINITY, stop));
    prices.climbing(length, prices.rise())
}

/// Radii of nothing but cores.
pub(super) fn cores(walls: &[Wall]) -> Vec<Option<f64>> {
    let radius = |wall: &Wall| wall.toll.is_none().then_some(wall.core);
    walls.iter().map(radius).collect()
}

/// What the string round `walls` widened to `radii` costs with all its soft zones, about: more than that
/// cannot be proven by prices.
pub(super) fn price(
    walls: &[Wall],
    radii: &[Option<f64>],
    prices: &Prices,
    stop: &dyn Fn() -> bool,
) -> f64 {
    let found = pulled(&scene(walls, radii, prices), (f64::INFINITY, stop));
    let price = |string: &TautString| prices.climbing_at(potential::price(walls, prices, string));
    found.strings.first().map_or(f64::INFINITY, price)
}

/// Length of the string round `walls` widened to `radii` (`None` leaves one out), metres, less what
/// routes may cut off corners, but not below 0; infinite where there is none. Once that is proven to be `enough`, or
/// `stop` asks for it, what is proven. With it, the ways looked at.
pub(super) fn length(
    walls: &[Wall],
    radii: &[Option<f64>],
    prices: &Prices,
    (enough, stop): (f64, &dyn Fn() -> bool),
) -> (f64, usize) {
    let slack = slack(walls, radii, prices);
    let (shortest, ways) = shortest(&scene(walls, radii, prices), (enough + slack, stop));
    // Where little is paid for fuel and much for soft zones, corners may be worth more than the way.
    ((shortest - slack).max(0.0), ways)
}

fn scene(walls: &[Wall], radii: &[Option<f64>], prices: &Prices) -> Obstacles {
    let outlines = walls.iter().zip(radii);
    Obstacles::new(
        outlines.map(|(wall, radius)| radius.map(|radius| wall.outline(radius))),
        prices.ends.map(|end| end.xy()),
        None,
    )
}

/// Metres by which the string may be shorter since routes may cut off corners, or pay for it.
pub(super) fn slack(walls: &[Wall], radii: &[Option<f64>], prices: &Prices) -> f64 {
    let kept = walls
        .iter()
        .zip(radii)
        .filter(|(_, radius)| radius.is_some());
    let length: f64 = kept.map(|(wall, _)| wall.slack(prices.tolerance)).sum();
    // A way round a corner instead of across it may lie in every soft zone.
    let dearest: f64 = walls.iter().map(|wall| wall.influence).sum();
    length * (1.0 + prices.exposure * dearest / prices.fuel)
}

/// Length that no string in `scene` undercuts, or `enough` of it, and the ways looked at.
pub(super) fn shortest(
    scene: &Obstacles,
    (enough, stop): (f64, &dyn Fn() -> bool),
) -> (f64, usize) {
    let found = pulled(scene, (enough, stop));
    let first = found.strings.first().map(|string| string.length);
    (first.unwrap_or(f64::INFINITY).min(found.beyond), found.ways)
}

fn pulled(scene: &Obstacles, (enough, stop): (f64, &dyn Fn() -> bool)) -> TautStrings {
    let limits = Limits {
        most_ways: MOST_WAYS,
        enough,
        stop,
    };
    taut_strings_within(scene, 1, limits)
}
