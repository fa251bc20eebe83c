//! A cost that no feasible route can undercut, with its proof in docs/BOUND.md.
//!
//! Seen from above, a soft zone costs so much that going through it is never cheaper than going round it: its threat
//! can be widened and counts as hard. The string round the widened threats, priced by its fuel, is then a lower bound
//! for all routes that pass none of the few places where that argument has a gap, and those places are priced one by
//! one; the way out of a soft zone that contains an end is added. Where soft zones must be crossed, a potential in the
//! field of all prices proves more; the better of both counts. Finally, a start or target at another height than the
//! middle of the band costs what its straight legs do.

mod border;
mod departure;
mod ends;
mod event;
mod field;
mod least_legs;
mod middle;
mod peak;
mod potential;
mod prices;
mod promise;
mod string;
mod toll;
mod wall;
mod widening;

use std::cell::Cell;

use super::simpler;
use crate::geometry::Side;
use crate::scenario::Scenario;
use crate::threat::Threat;
use event::Event;
use field::{Field, cost_of};
use least_legs::least_legs;
pub use potential::{WaysSought, cheap_ways};
use prices::Prices;
use promise::promise;
use wall::Wall;

/// Covers the rounding of the sums behind a bound, so that it holds in floating point too.
const ROUNDING: f64 = 1e-9;

/// Total number of ways examined before the bisection on the number of events ends.
const MOST_WAYS_IN_ALL: usize = 120_000;

/// Bisections on the number of events that a cheaper route may use.
const MOST_LEVELS: usize = 24;

/// If the string is not this many times as expensive as the known bound, a potential is not worth trying.
const WORTHWHILE: f64 = 1.02;

/// The same for the string with its climbs, of which a route that leaves the string pays less.
const WORTHWHILE_CLIMBING: f64 = 1.03;

/// If a potential proves this many times what strings do, the legs of strings prove nothing more.
const BEYOND_STRINGS: f64 = 1.04;

/// A proven lower bound on the total cost of any feasible route from start to target, Eq. 1; 0 where fuel costs
/// nothing. The argument is in docs/BOUND.md.
#[must_use]
pub fn lower_bound(scenario: &Scenario) -> f64 {
    lower_bound_until(scenario, &|| false)
}

/// As [`lower_bound`]; once `stop` asks for it, returns what was proven so far.
#[must_use]
pub fn lower_bound_until(scenario: &Scenario, stop: &dyn Fn() -> bool) -> f64 {
    let prices = Prices::of(scenario);
    if prices.fuel <= 0.0 {
        return 0.0;
    }
    // Smaller rings forbid and cost less.
    let simpler = simpler(scenario, Side::Within);
    let scenario = simpler.as_ref().unwrap_or(scenario);
    // The way may be too short to climb.
    let needed = prices.rise() / toll::steepest(scenario);
    let straight = prices
        .climbing_at(prices.fuel * prices.direct().max(needed))
        .max(least_legs(scenario, &prices));
    let bound = round_walls(scenario, &prices, stop).max(straight);
    let bound = if bound.is_finite() { bound } else { straight };
    bound * (1.0 - ROUNDING)
}

/// Whether threats, and the border of the area, leave no way at all from the start to the target, seen from above: no
/// route keeps every limit then. `false` where that is not known, as once `stop` asks for an end.
#[must_use]
pub fn is_closed(scenario: &Scenario, stop: &dyn Fn() -> bool) -> bool {
    let prices = Prices::of(scenario);
    if prices.fuel <= 0.0 {
        return false;
    }
    let simpler = simpler(scenario, Side::Within);
    let walls = widening::walls(simpler.as_ref().unwrap_or(scenario), &prices);
    let bare = string::cores(&walls);
    string::plain(&walls, &bare, &prices, stop).is_infinite()
}

/// A lower bound for routes that slip through a gap between threats that their soft zones would have them avoid;
/// infinite where there is no such gap, fuel costs nothing, or the threats have too many corners to examine quickly.
#[must_use]
pub fn cheapest_slip(scenario: &Scenario, stop: &dyn Fn() -> bool) -> f64 {
    let prices = Prices::of(scenario);
    if prices.fuel <= 0.0 {
        return f64::INFINITY;
    }
    // Walls of thousands of corners take a while themselves.
    if ends::are_too_many(scenario.threats.iter().map(Threat::bends)) {
        return f64::INFINITY;
    }
    let walls = widening::walls(scenario, &prices);
    let slips = event::gaps(&walls, &prices, stop).unwrap_or_default();
    let costs = slips.iter().map(|slip| slip.cost);
    costs.fold(f64::INFINITY, f64::min)
}

/// The largest cost that can be proven: by strings round walls, by a potential, and by the legs that leave the ends.
fn round_walls(scenario: &Scenario, prices: &Prices, stop: &dyn Fn() -> bool) -> f64 {
    let walls = widening::walls(scenario, prices);
    let Some(events) = event::events(&walls, prices, stop) else {
        let radii = string::cores(&walls);
        let proven = string::plain(&walls, &radii, prices, stop);
        let promised = || promise(&walls, &radii, prices, &scenario.area, stop);
        if !proven.is_finite() || !potential::applies(&walls, prices) {
            return proven;
        }
        let known = (proven, promised().cost);
        let proof = potential::prove(
            &walls,
            prices,
            &scenario.area,
            known,
            &potential::FREE,
            stop,
        );
        let early = departure::early(&walls, prices);
        let dense = proof.map_or(0.0, |proof| proof.total() + early);
        return proven.max(prices.climbing_at(dense));
    };
    let field = Field {
        scenario,
        prices,
        walls: &walls,
        ways: Cell::new(0),
        stop,
    };
    let (proven, used) = without_others(&field, &events);
    if stop() {
        proven
    } else {
        let crossing = crossing(&field, &events, &events[..used], proven);
        proven.max(crossing).max(field.rising(&events, used))
    }
}

/// The largest cost that strings prove: a route cheaper than it could use only the events that cost less, and without
/// the others no route is cheaper; and the number of these events.
fn without_others(field: &Field, events: &[Event]) -> (f64, usize) {
    // The first level at which the next event costs as much as can be proven without it; beyond that, less can be
    // proven.
    let (mut low, mut high) = (0, events.len());
    let (mut proven, mut level, mut best) = (0.0_f64, 0, 0);
    for _ in 0..MOST_LEVELS {
        let next = cost_of(events, level);
        // The string without any event is searched to the end: it shows which events matter at all.
        let enough = if level == 0 { f64::INFINITY } else { next };
        let bound = field.level(&events[..level], enough);
        if bound.min(next) > proven {
            (proven, best) = (bound.min(next), level);
        }
        if next >= bound {
            high = level;
            if low >= high {
                break;
            }
        } else {
            low = level + 1;
            if level == 0 {
                // Events more expensive than what was proven without them need not be examined.
                high = events.partition_point(|event| event.cost < bound).max(low);
            }
        }
        // The highest level comes next: there, what is proven is the bound itself.
        level = if level == 0 {
            high
        } else if field.ways.get() > MOST_WAYS_IN_ALL || (field.stop)() {
            break;
        } else {
            usize::midpoint(low, high)
        };
    }
    (proven, best)
}

/// What a potential proves beyond `known` where soft zones may have to be crossed, and what legs prove; `known` is what
/// strings prove that use some events at most.
fn crossing(field: &Field, events: &[Event], used: &[Event], known: f64) -> f64 {
    let Field {
        scenario,
        prices,
        walls,
        stop,
        ..
    } = *field;
    if !known.is_finite() || !potential::applies(walls, prices) {
        return legs(field, events, 0.0);
    }
    let promise = promise(walls, &field.radii(used), prices, &scenario.area, stop);
    let radii = string::cores(walls);
    let leads = ends::leads(scenario, prices, (walls, &radii), stop);
    let prove = |known: f64| {
        let known = (known, promise.cost);
        potential::prove(walls, prices, &scenario.area, known, &leads, stop)
    };
    let over = |proof| ends::over(proof, scenario, prices, walls, stop);
    if let Some(proof) = prove(known) {
        let dense = proof.total() + departure::early(walls, prices);
        let level = prices.climbing_at(dense).max(over(proof));
        // Legs of strings that are far too cheap prove nothing.
        if dense > BEYOND_STRINGS * known {
            return level;
        }
        return level.max(legs(field, events, dense));
    }
    let known = known.max(legs(field, events, 0.0));
    // Over hills it has proven nothing more, and takes longer than the search.
    if !prices.middle.is_level {
        return known;
    }
    // Not for its own sake, but for the cost of the legs at the ends beyond it.
    let climbing = ends::climbing(scenario, prices, walls, &promise.places, stop);
    if climbing <= 0.0 || promise.cost + climbing <= WORTHWHILE_CLIMBING * known {
        return known;
    }
    prove(0.0).map_or(known, |proof| known.max(over(proof)))
}

/// A lower bound from the events one by one and the legs of strings, where no route costs less than `dense` seen from
/// above; 0 where there are too many corners.
fn legs(field: &Field, events: &[Event], dense: f64) -> f64 {
    if ends::are_too_many(field.walls.iter().map(Wall::bends)) {
        0.0
    } else {
        field.one_by_one(events, dense)
    }
}

#[cfg(test)]
mod tests;
