//! At which heights a place is worth being flown over: in the middle of the band, and where a threat can be passed
//! above or below, just clear of it.

use super::{lifted, steepest};
use crate::geometry::{Point2, Point3, Vector2};
use crate::scenario::Scenario;

/// A leg at the height of a base touches it; metres below, it does not.
const TOUCH: f64 = 1e-3;

/// By which tops and bases are kept clear of besides, as a share of the band: so much may a leg slope over a threat.
const CLEAR: f64 = 0.02;

/// Ways on which a climb can begin.
const DIRECTIONS: usize = 24;

/// Of the threats about a place, the heights of so many at most.
const MOST: usize = 4;

/// Heights nearer to each other than this share of the band are one.
const ALIKE: f64 = 0.01;

/// `spot` in the middle of the band, then at the heights that clear threats within `reach` of it, those nearest to the
/// middle first.
pub(super) fn over(scenario: &Scenario, spot: Point2, reach: f64) -> Vec<Point3> {
    let middle = lifted(scenario, spot, 0.5);
    let band = scenario.altitude;
    let ground = scenario.terrain.elevation(middle.xy());
    let (lowest, highest) = (ground + band.min, ground + band.max);
    let clear = CLEAR * (band.max - band.min);
    let mut places: Vec<Point3> = scenario
        .threats
        .iter()
        .filter(|threat| threat.extent().grown(reach).contains(middle.xy()))
        .flat_map(|threat| {
            let above = threat.top.filter(|top| (middle.z..=highest).contains(top));
            let below = threat.base.filter(|base| (lowest..middle.z).contains(base));
            [
                above,
                above.map(|top| (top + clear).min(highest)),
                below.map(|base| base - TOUCH),
                below.map(|base| (base - clear).max(lowest)),
            ]
        })
        .flatten()
        .map(|z| Point3::new(middle.x, middle.y, z))
        .filter(|&point| can_be_reached(scenario, point))
        .collect();
    let away = |point: &Point3| (point.z - middle.z).abs();
    places.sort_by(|one, other| away(one).total_cmp(&away(other)));
    let alike = ALIKE * (band.max - band.min);
    places.dedup_by(|next, before| (next.z - before.z).abs() <= alike);
    if places.len() > MOST {
        places.drain(MOST - 1..places.len() - 1);
    }
    places.insert(0, middle);
    places
}

/// Places round start and target from which on, or up to which, the way is in the middle of the band: those that one leg
/// reaches as steeply as the vehicle can climb, if that is farther than `least`.
pub(super) fn about_ends(scenario: &Scenario, least: f64) -> Vec<Point3> {
    let middle = 0.5 * (scenario.altitude.min + scenario.altitude.max);
    let mut places = Vec::new();
    for end in [scenario.start, scenario.target] {
        let ground = scenario.terrain.elevation(end.xy());
        let reach = (ground + middle - end.z).abs() / steepest(scenario) * (1.0 + 1e-9);
        if !scenario.terrain.is_flat() || reach < least {
            continue;
        }
        places.extend(
            (0..DIRECTIONS)
                .map(|direction| {
                    let heading = std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64;
                    let way = Vector2::new(libm::cos(heading), libm::sin(heading)) * reach;
                    end.xy() + way
                })
                .filter(|spot| scenario.area.contains(*spot))
                .map(|spot| lifted(scenario, spot, 0.5)),
        );
    }
    places
}

/// Whether the vehicle can climb to `point` from the start, and from it to the target.
fn can_be_reached(scenario: &Scenario, point: Point3) -> bool {
    [scenario.start, scenario.target].iter().all(|end| {
        let way = (point.xy() - end.xy()).norm();
        (point.z - end.z).abs() <= way * steepest(scenario)
    })
}
