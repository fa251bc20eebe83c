//! Whether the best route found may be far from the best there is, as the proven bound tells.

use super::log::Log;
use super::{newton, starts};
use crate::cost::Model;
use crate::geometry::Rect;

/// The best route found is mostly the best there is if it costs no more than this share beyond what is proven. (Over hills
/// the bound hardly ever proves so much.)
const PROVEN: f64 = 0.05;

/// Whether the best route of `log` costs little more than `lower`, which none costs less than.
pub(super) fn is_proven(lower: f64, log: &Log) -> bool {
    log.best.cost <= lower * (1.0 + PROVEN)
}

/// Whether over hills the best route of `log` flies at the limits of the vehicle and may be far from the best there is, given
/// that none costs less than `lower`.
pub(super) fn is_hard_pressed(model: &Model, lower: f64, log: &Log) -> bool {
    !model.scenario.terrain.is_flat()
        && !is_proven(lower, log)
        && newton::is_felt(model, &log.route)
}

/// Whether over level ground the best route of `log` may be far from the best there is, given that none costs less than
/// `lower`. No way is missed where no threat is near the straight one, and where single routes take long to price, nobody
/// waits for other searches.
pub(super) fn is_doubtful(model: &Model, lower: f64, log: &Log) -> bool {
    let scenario = model.scenario;
    let ends = [scenario.start.xy(), scenario.target.xy()];
    let straight = Rect::around(ends).expect("two points");
    let mut threats = scenario.threats.iter();
    scenario.terrain.is_flat()
        && !is_proven(lower, log)
        && threats.any(|threat| threat.extent().meets(&straight))
        && !starts::is_vast(scenario)
}
