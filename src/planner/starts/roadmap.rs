//! Ways over the ground: the cheapest routes through a net of places in the middle of the band, and just above or
//! below threats that can be passed so.
//!
//! Taut strings take account of threats, but neither of mountains nor of the cost of crossing a soft zone. Here every
//! leg between two of some hundred places is priced as it is, those that break a limit left out, and the cheapest
//! chains from start to target are found; turns, and the allowed number of legs, are considered only where the cheapest
//! of all cannot be flown as it is (`few`).

use super::legs::{DETOUR, Legs};
use super::net::{self, Found, Spots};
use super::thin_band::is_thin_band;
use super::vast::is_vast;
use super::{levels, may_turn_along};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::scenario::Scenario;

/// Places of the net, apart from both ends, on level ground.
const PLACES: usize = 160;

/// The same over hills, where passes are narrow.
const PLACES_OVER_HILLS: usize = 320;

/// The same where the band is thin for the ground below it.
const PLACES_IN_A_THIN_BAND: usize = 640;

/// There, so many times as many routes are taken: more of them turn out to be the best once they are in place.
const MORE_IN_A_THIN_BAND: usize = 2;

/// Within this many steps of the net from a threat, a place also has the height that clears it.
const NEAR: f64 = 1.5;

/// Chains of more legs than this are as good as those of any number.
const MOST_LEGS: usize = 12;

/// Up to `count` routes that differ, given that one costing about `known` is available without them; and where not even
/// the first of them can be flown as it is, some with few enough legs and gentle enough turns. None where it takes
/// long, once `is_over`.
pub(super) fn routes(
    model: &Model,
    count: usize,
    known: f64,
    is_over: &dyn Fn() -> bool,
) -> (Found, Vec<Vec<Point3>>) {
    let (spots, count) = spots(model.scenario, count);
    let places = places(model.scenario, &spots);
    let mut legs = Legs::new(model, &places, known, is_over);
    let trees = [0, places.len() - 1].map(|end| legs.cheapest(end));
    if legs.watch.is_broken_off {
        let found = Found {
            routes: Vec::new(),
            legs_priced: legs.priced,
        };
        return (found, Vec::new());
    }
    let routes = net::chains(model, &places, &trees, count);
    let most = model.scenario.planner.waypoints + 1;
    let can_be_flown =
        |chain: &Vec<Point3>| chain.len() <= most + 1 && may_turn_along(chain, legs.sharpest);
    let few = if routes.first().is_none_or(can_be_flown) {
        Vec::new()
    } else {
        legs.few(model, most.min(MOST_LEGS))
    };
    let legs_priced = legs.priced;
    let found = Found {
        routes,
        legs_priced,
    };
    (found, few)
}

/// The spots of the net, and the number of routes taken from it where `count` are wanted.
fn spots(scenario: &Scenario, count: usize) -> (Spots, usize) {
    let spots = |count| net::spots(scenario, count, DETOUR);
    if scenario.terrain.is_flat() {
        return (spots(PLACES), count);
    }
    let over_hills = spots(PLACES_OVER_HILLS);
    if !is_vast(scenario) && is_thin_band(scenario, &over_hills) {
        let fine = spots(PLACES_IN_A_THIN_BAND);
        (fine, MORE_IN_A_THIN_BAND * count)
    } else {
        (over_hills, count)
    }
}

/// Start, the `spots` in the middle of the band, target.
fn places(scenario: &Scenario, spots: &Spots) -> Vec<Point3> {
    let near = NEAR * spots.step;
    let over = |&spot| levels::over(scenario, spot, near);
    std::iter::once(scenario.start)
        .chain(spots.points.iter().flat_map(over))
        .chain(levels::about_ends(scenario, 0.5 * spots.step))
        .chain([scenario.target])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::vast::legs_unwatched;
    use super::*;
    use crate::cost::batch::LANES;
    use crate::geometry::Point2;
    use crate::planner::tests::{outlined, scenario};

    /// Around a coast of thousands of corners legs take long to price, so a stop is checked after few of them.
    #[test]
    fn a_stop_is_noticed_while_legs_take_long_to_price() {
        let mut scenario = scenario();
        assert!(!is_vast(&scenario));
        let priced = |scenario: &Scenario, looks: u32| {
            let looked = std::cell::Cell::new(0);
            let is_over = || {
                looked.set(looked.get() + 1);
                looked.get() > looks
            };
            let found = routes(&Model::new(scenario), 8, f64::INFINITY, &is_over).0;
            (found.legs_priced, found.routes.is_empty())
        };
        let (all, is_empty) = priced(&scenario, 0);
        assert!(!is_empty);
        let coast = (0..8_000).map(|corner| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU / 8e3 * f64::from(corner));
            Point2::new(850.0 + 50.0 * cos, 150.0 + 50.0 * sin)
        });
        scenario.threats.push(outlined(coast.collect(), 0.0));
        assert!(is_vast(&scenario));
        let most = legs_unwatched(&scenario) as u64;
        let (few, is_empty) = priced(&scenario, 2);
        assert!(is_empty);
        assert!(0 < few && few <= 3 * most && 3 * most < all, "{few} {all}");
        // However much there is, some legs are priced before the next check.
        let coast = scenario.threats.pop().expect("pushed");
        scenario.threats = vec![coast; 51];
        assert_eq!(legs_unwatched(&scenario), LANES);
    }
}
