//! The cost, on top of a string, of leaving the zones round ends outside the band, however that is flown. The argument
//! is section 7 of docs/BOUND.md.

use super::super::prices::Prices;
use super::super::string::{between, departures, narrowed};
use super::super::wall::Wall;
use super::ends;
use crate::scenario::Scenario;

/// A lower bound for routes round `walls` widened to `radii`, from the climb out of the zones round ends below the
/// band, or the descent from above it; 0 where there are no such zones.
pub(in super::super) fn rising(
    scenario: &Scenario,
    prices: &Prices,
    (walls, radii): (&[Wall], &[Option<f64>]),
    stop: &dyn Fn() -> bool,
) -> f64 {
    let Some(ends) = ends(scenario, prices, (walls, radii), stop) else {
        return 0.0;
    };
    if ends.iter().all(|end| end.ramp.is_none()) {
        return 0.0;
    }
    // Where no wall is in a zone, a string has no way through it that is longer than straight ahead.
    let zones = ends.iter().filter_map(|end| Some((end.from, end.ramp?)));
    let radii = zones.fold(radii.to_vec(), |radii, (at, ramp)| {
        narrowed((walls, &radii), at, ramp.reach)
    });
    let field = (walls, &radii[..]);
    let departures = departures(field, prices, &[]);
    let tolls = departures[0].toll + departures[1].toll;
    let (across, _) = between(departures, field, prices, (f64::INFINITY, stop));
    let on_top = ends.map(|end| end.leaving(tolls));
    across + on_top[0] + on_top[1]
}
