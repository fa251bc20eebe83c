//! Routes to start from: along taut strings round the threats, over the ground, long enough to climb, and along a route
//! that is already known.

mod bow;
mod climbs;
mod contours;
mod count;
mod exposed;
mod few;
mod flanks;
mod grafts;
mod heap;
mod height;
mod known;
mod ledges;
mod legs;
mod levels;
mod net;
mod over;
mod roadmap;
mod round;
mod rounded;
mod shapes;
mod shortest;
mod sides;
mod spare;
mod surplus;
pub(super) mod tangents;
mod thin;
mod thin_band;
mod trails;
mod vast;
mod ways;
mod wider;
mod worth;

pub(super) use count::{with_waypoints, with_waypoints_until};
pub(super) use heap::spread;
pub(super) use height::steepest;
pub(super) use known::given;
pub(super) use ledges::{ledges, thinned_out};
pub(super) use round::at_heights_of;
pub(super) use sides::different_first;
pub(super) use vast::is_vast;

use super::polish::{Polish, Steps};
use super::price::{Priced, price};
use super::{Stop, same, why_stop};
use crate::cost::Model;
use crate::geometry::{LEVEL, Point2, Point3, Vector2};
use crate::optimizer::Fitness;
use crate::scenario::{Scenario, Seeding, WarmStart};
use height::{lifted, winding};
use shapes::Shapes;

/// Routes to start from at most.
const STARTS: usize = 16;

/// To leave the surplus of so many points out takes a while.
const LONG: usize = 64;

/// Steps by which a start is pulled into place.
const ROUGH_STEPS: Steps = Steps {
    from: 0.03,
    to: 0.005,
    gain: 5e-4,
    violation_m: 10.0,
};

/// A known route is in place except for what has changed; the polish at the end does the rest.
const GAIN_OF_KNOWN: f64 = 1e-4;

/// Where a search starts.
pub(super) struct Starts {
    /// Best first, all with the same number of waypoints.
    pub(super) routes: Vec<Vec<Point3>>,
    /// Routes with the requested number of waypoints that break limits, but may become better than all others.
    pub(super) beyond: Vec<Vec<Point3>>,
    /// Routes that lead elsewhere than the best one, with its ends.
    pub(super) grafts: Vec<Vec<Point3>>,
    /// Ways round the threats as seen from above, with as many corners as shorten them.
    pub(super) round: Vec<Vec<Point2>>,
    /// Routes priced on the way.
    pub(super) evaluations: u64,
}

/// Whether a search of `scenario` starts from routes; else the algorithm runs alone.
pub(super) fn are_wanted(scenario: &Scenario) -> bool {
    let settings = &scenario.planner;
    let is_known = matches!(settings.warm_start, Some(WarmStart::Waypoints(_)));
    is_known || settings.seeding == Seeding::Tangent
}

/// Where the search of `model` starts; `None` for the algorithm alone.
pub(super) fn routes(model: &Model, stop: &dyn Stop) -> Option<Starts> {
    are_wanted(model.scenario)
        .then(|| starts_from(model, stop))
        .flatten()
}

/// All shapes, brought to one number of waypoints, from the cheapest on; then refined, and seen in a wider band.
fn starts_from(model: &Model, stop: &dyn Stop) -> Option<Starts> {
    let settings = &model.scenario.planner;
    let is_over = || why_stop(model.scenario, stop).is_some();
    let shapes = Shapes::find(model, &is_over);
    if shapes.routes.is_empty() {
        return None;
    }
    let (is_known, is_rough, hopeless) = (shapes.is_known, shapes.is_rough, shapes.hopeless(model));
    let coarse = shapes.waypoints(model);
    let mut evaluations = shapes.routes_priced + shapes.legs_priced / (coarse as u64 + 1);
    let mut priced = with_as_many(model, shapes.routes, coarse, &is_over);
    evaluations += priced.len() as u64;
    // The known route goes first, so that others are refined only where they are already cheaper.
    priced[usize::from(is_known)..].sort_by(|one, other| one.0.rank(&other.0));
    let (mut beyond, mut grafts) = (Vec::new(), Vec::new());
    if settings.polish {
        let hopeless = if is_known { 0.0 } else { hopeless };
        if !is_known && grafts::are_wanted(model, is_rough) {
            let (grafted, effort) = grafts::grafted(model, &priced);
            evaluations += effort.routes + effort.legs / (coarse as u64 + 1);
            grafts = grafted;
        }
        if let Some(shape) = shapes.shortest.filter(|_| !is_known) {
            evaluations += shortest::pull_forward(model, shape, &mut priced, stop);
        }
        refine(model, &mut priced, hopeless, stop, &mut evaluations);
        let best = priced.first().map_or(Fitness::WORST, |(best, _)| *best);
        let dearest = best.cost * (1.0 + hopeless);
        grafts.retain(|(graft, _)| !best.is_feasible() || graft.cost <= dearest);
        refine(model, &mut grafts, hopeless, stop, &mut evaluations);
        if is_rough && !model.scenario.terrain.is_flat() {
            let (routes, routes_priced) = wider::routes(model, &priced, stop);
            beyond = routes;
            evaluations += routes_priced;
        }
    }
    priced.truncate(STARTS);
    let routes = |priced: Vec<Priced>| priced.into_iter().map(|(_, route)| route).collect();
    Some(Starts {
        routes: routes(priced),
        grafts: routes(grafts),
        beyond,
        round: shapes.round,
        evaluations,
    })
}

/// The different routes along `shapes` with this many `waypoints`, and their prices.
fn with_as_many(
    model: &Model,
    shapes: Vec<Vec<Point3>>,
    waypoints: usize,
    is_over: &dyn Fn() -> bool,
) -> Vec<Priced> {
    let mut priced: Vec<Priced> = Vec::new();
    let is_scene_vast = is_vast(model.scenario);
    let is_late = || is_scene_vast && is_over();
    for shape in shapes {
        // The first will do where looking at another takes time that is not there.
        let takes_long = is_scene_vast || shape.len() > LONG;
        if takes_long && !priced.is_empty() && is_over() {
            break;
        }
        let route = with_waypoints_until(model, shape, waypoints, &is_late);
        let is_same = |(_, other): &Priced| same(model.scenario, &route, other);
        if !priced.iter().any(is_same) {
            priced.push((price(model, &route), route));
        }
    }
    priced
}

/// Pull the routes that may still win roughly into place, and drop those that end up where another one is. One that
/// breaks limits will not be cheaper once it keeps them.
fn refine(
    model: &Model,
    priced: &mut Vec<Priced>,
    hopeless: f64,
    stop: &dyn Stop,
    evaluations: &mut u64,
) {
    let mut polish = Polish::new(model, stop);
    let is_known = hopeless <= 0.0;
    let steps = Steps {
        gain: if is_known {
            GAIN_OF_KNOWN
        } else {
            ROUGH_STEPS.gain
        },
        ..ROUGH_STEPS
    };
    let waypoints = priced.first().map_or(0, |(_, route)| route.len() - 2);
    let mut best = Fitness::WORST;
    let mut refined: Vec<Priced> = Vec::new();
    let mut dear = Vec::new();
    for (fitness, mut route) in priced.drain(..) {
        if best.is_feasible() && fitness.cost > best.cost * (1.0 + hopeless) {
            dear.push((fitness, route));
            continue;
        }
        if refined.len() == STARTS {
            break;
        }
        if let Some(fitness) = polish.descend_unless_known(&mut route, steps, &refined) {
            if fitness.beats(&best) {
                best = fitness;
            }
            refined.push((fitness, route));
        }
    }
    *evaluations += polish.evaluations(waypoints);
    refined.append(&mut dear);
    refined.sort_by(|one, other| one.0.rank(&other.0));
    *priced = refined;
}

/// Whether the turn at the middle of `corner` is no sharper than the one with cosine `sharpest`.
fn may_turn(corner: [Point3; 3], sharpest: f64) -> bool {
    let [before, at, after] = corner.map(|point| point.xy());
    let [one, other]: [Vector2; 2] = [at - before, after - at];
    let lengths = one.norm() * other.norm();
    lengths < LEVEL * LEVEL || one.dot(&other) >= sharpest * lengths
}

/// Whether that holds for all turns of `chain`.
fn may_turn_along(chain: &[Point3], sharpest: f64) -> bool {
    let mut corners = chain.windows(3);
    corners.all(|corner| may_turn([corner[0], corner[1], corner[2]], sharpest))
}

/// A vector of length 1.
fn direction(heading: f64) -> Vector2 {
    Vector2::new(libm::cos(heading), libm::sin(heading))
}
