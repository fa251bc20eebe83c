//! Routes to start from: along taut strings round the threats, over the ground, long enough to climb, and along a route
//! that is already known.

mod climbs;
mod contours;
mod count;
mod exposed;
mod few;
mod flanks;
mod heap;
mod height;
mod known;
mod levels;
mod net;
mod over;
mod roadmap;
mod rounded;
mod spare;
mod surplus;
mod tangents;
mod thin;
mod trails;
mod ways;
mod wider;
mod worth;

pub(super) use count::with_waypoints;
pub(super) use heap::spread;
pub(super) use height::steepest;
pub(super) use roadmap::is_vast;

use super::polish::{Polish, Steps};
use super::price::price;
use super::{Stop, same, why_stop};
use crate::cost::Model;
use crate::geometry::{LEVEL, Point3, Vector2};
use crate::optimizer::Fitness;
use crate::scenario::{Seeding, WarmStart};
use crate::seeding::{Obstacles, Outline, TautString, steep_ground, taut_strings_until};
use crate::threat::Threat;
use height::{is_steep, lifted, winding};
use net::Found;

/// Strings taken from each scene of obstacles.
const STRINGS: usize = 5;

/// The same where mountains are obstacles too: there a net of places also finds ways through them.
const STRINGS_ROUND_MOUNTAINS: usize = 2;

/// Routes to start from at most.
const STARTS: usize = 16;

/// Free waypoints of a coarse route, unless its bends need more.
const COARSE: usize = 4;

/// Over hills, where every leg must also follow the ground.
const COARSE_OVER_HILLS: usize = 7;

/// Maximum number of free waypoints of a coarse route, unless no route with so few is good enough.
const MOST_COARSE: usize = 20;

/// Routes taken from the net of places.
const OVERLAND: usize = 8;

/// Routes taken from each of the nets for long detours.
const FAR_ABOUT: usize = 16;

/// A start more expensive than the best refined one by this share is not worth refining. Corners drawn round a string
/// may reach into the next soft zone.
const HOPELESS: f64 = 0.12;

/// The same over hills, where starts already follow the ground.
const HOPELESS_OVER_HILLS: f64 = 0.08;

/// The same where soft zones are expensive or many, so that a small shift changes more of the cost.
const HOPELESS_IN_ZONES: f64 = 0.3;

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
    /// Routes priced on the way.
    pub(super) evaluations: u64,
}

/// Where the search of `model` starts; `None` for the algorithm alone.
pub(super) fn routes(model: &Model, stop: &dyn Stop) -> Option<Starts> {
    let settings = &model.scenario.planner;
    let is_over = || why_stop(model.scenario, stop).is_some();
    let known = match &settings.warm_start {
        Some(WarmStart::Waypoints(points)) => Some(known::route(model, points)),
        Some(WarmStart::Plan(_)) | None => None,
    };
    let warm = known.is_some();
    let (mut legs_priced, mut evaluations) = (0, 0);
    let mut shapes: Vec<Vec<Point3>> = known.into_iter().collect();
    let (mut low, mut rough) = (false, false);
    let mut hopeless = if model.scenario.terrain.is_flat() {
        HOPELESS
    } else {
        HOPELESS_OVER_HILLS
    };
    if settings.seeding == Seeding::Tangent {
        shapes.extend(along_strings(model, &is_over));
        // A caller who supplies a route has dealt with the hills already.
        if !warm {
            let (found, is_rough) = over_ground(model, &shapes, &is_over);
            rough = is_rough;
            if rough {
                hopeless = HOPELESS_IN_ZONES;
            }
            let climbs = climbs::routes(model, &is_over);
            legs_priced = found.legs_priced + climbs.legs_priced;
            shapes.extend(found.routes);
            if !climbs.routes.is_empty() {
                shapes.extend(climbs.routes);
                evaluations += shapes.len() as u64;
                (shapes, low) = worth::promising(model, shapes);
            }
            let (round, routes_priced) = round_mountains(model, &shapes, &is_over);
            legs_priced += round.legs_priced;
            evaluations += routes_priced;
            shapes.extend(round.routes);
        }
    }
    if shapes.is_empty() {
        return None;
    }
    // A known route keeps its bends; a string needs only as many waypoints as it has bends.
    let coarse = if warm || low {
        settings.waypoints
    } else {
        bends(model, &shapes, hopeless).min(settings.waypoints)
    };
    let mut starts = Starts {
        routes: Vec::new(),
        beyond: Vec::new(),
        evaluations: evaluations + legs_priced / (coarse as u64 + 1),
    };
    let mut priced: Vec<(Fitness, Vec<Point3>)> = Vec::new();
    let is_vast = roadmap::is_vast(model.scenario);
    for shape in shapes {
        // The first will do where looking at another takes time that is not there.
        if is_vast && !priced.is_empty() && is_over() {
            break;
        }
        let route = with_waypoints(model, shape, coarse);
        if !priced
            .iter()
            .any(|(_, other)| same(model.scenario, &route, other))
        {
            starts.evaluations += 1;
            priced.push((price(model, &route), route));
        }
    }
    // The known route goes first, so that others are refined only where they are already cheaper.
    let others = usize::from(warm);
    priced[others..].sort_by(|one, other| one.0.rank(&other.0));
    if settings.polish {
        let hopeless = if warm { 0.0 } else { hopeless };
        refine(model, &mut priced, hopeless, stop, &mut starts.evaluations);
        if rough && !model.scenario.terrain.is_flat() {
            let (beyond, evaluations) = wider::routes(model, &priced, stop);
            starts.beyond = beyond;
            starts.evaluations += evaluations;
        }
    }
    priced.truncate(STARTS);
    starts.routes = priced.into_iter().map(|(_, route)| route).collect();
    Some(starts)
}

/// Pull the routes that may still win roughly into place, and drop those that end up where another one is. One that
/// breaks limits will not be cheaper once it keeps them.
fn refine(
    model: &Model,
    priced: &mut Vec<(Fitness, Vec<Point3>)>,
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
    let mut refined: Vec<(Fitness, Vec<Point3>)> = Vec::new();
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

/// Greatest number of bends of the routes that may still win, which are less than `hopeless` more expensive than the
/// best; limited to [`MOST_COARSE`], but not below the bends of the route with the fewest.
fn bends(model: &Model, shapes: &[Vec<Point3>], hopeless: f64) -> usize {
    let priced: Vec<(Fitness, usize)> = shapes
        .iter()
        .map(|route| (price(model, route), route.len() - 2))
        .collect();
    let best = priced
        .iter()
        .map(|(fitness, _)| *fitness)
        .min_by(Fitness::rank)
        .unwrap_or(Fitness::WORST);
    let least = if model.scenario.terrain.is_flat() {
        COARSE
    } else {
        COARSE_OVER_HILLS
    };
    let may_win = priced.iter().filter(|(fitness, _)| {
        fitness.violation <= best.violation && fitness.cost <= best.cost * (1.0 + hopeless)
    });
    let bends = may_win.map(|(_, bends)| *bends);
    let fewest = bends.clone().min().unwrap_or(0);
    bends.fold(least, usize::max).min(fewest.max(MOST_COARSE))
}

/// Routes with as few waypoints as each needs, along the taut strings of several scenes: round the
/// soft zones, round the threats alone, over those that can be overflown, round steep ground.
fn along_strings(model: &Model, is_over: &dyn Fn() -> bool) -> Vec<Vec<Point3>> {
    let scenario = model.scenario;
    let everything = |_: usize, _: &Threat| true;
    let in_the_way = |_: usize, threat: &Threat| !over::passable(scenario, threat);
    let mut shapes = Vec::new();
    let mut follow = |obstacles: &Obstacles, count: usize| {
        for string in taut_strings_until(obstacles, count, is_over).strings {
            shapes.push(along(model, &string));
        }
    };
    follow(&Obstacles::soft(scenario, everything), STRINGS);
    follow(&Obstacles::hard(scenario, everything), STRINGS);
    if scenario
        .threats
        .iter()
        .any(|threat| over::passable(scenario, threat))
    {
        follow(&Obstacles::soft(scenario, in_the_way), STRINGS);
        follow(&Obstacles::hard(scenario, in_the_way), STRINGS);
    }
    if !scenario.terrain.is_flat() {
        let steep = steep_ground(scenario);
        if !steep.is_empty() {
            let outlines = scenario.threats.iter().map(Outline::soft).chain(steep);
            let ends = [scenario.start.xy(), scenario.target.xy()];
            let obstacles = Obstacles::new(outlines.map(Some), ends, Some(scenario.area));
            follow(&obstacles, STRINGS_ROUND_MOUNTAINS);
        }
    }
    // Straight ahead, for when crossing soft zones is worth it.
    shapes.push(vec![scenario.start, scenario.target]);
    shapes
}

/// Routes over the ground: through a fine net only where the coarse one has none that can be flown as it is, as long
/// detours where the best so far pays much for soft zones, and along the ways between threats where these are many or
/// near to each other; and whether there are such zones or ways. Once `is_over`, what has been found so far.
fn over_ground(
    model: &Model,
    strings: &[Vec<Point3>],
    is_over: &dyn Fn() -> bool,
) -> (Found, bool) {
    let strings: Vec<Priced> = priced(model, strings).collect();
    let cheapest = strings.iter().copied().min_by(by_rank);
    let dearest = cheapest.map_or(f64::INFINITY, |(fitness, _)| fitness.cost);
    let (mut found, few) = roadmap::routes(model, OVERLAND, dearest, is_over);
    let near = best_of(model, priced(model, &found.routes));
    let others = [best_of(model, strings), best_of(model, priced(model, &few))];
    let known = others.into_iter().chain([near]).flatten().min_by(by_rank);
    let sought = ways::sought(model, known.map(|(fitness, _)| fitness.cost), is_over);
    let ways = sought
        .filter(|_| !is_over())
        .map(|sought| ways::routes(model, sought, is_over));
    let ways = ways.unwrap_or_default();
    let between = best_of(model, priced(model, &ways.routes));
    let best = known.into_iter().chain(between).min_by(by_rank);
    let detour = best.and_then(|(_, route)| exposed::detour(model, route));
    let is_open = near.or(between).is_some();
    found.add(ways);
    if !is_open || detour.is_some() {
        let count = if detour.is_some() {
            FAR_ABOUT
        } else {
            OVERLAND
        };
        found.add(trails::routes(model, detour, count, is_over));
    }
    found.routes.extend(few);
    let rounded = |route: &Vec<Point3>| rounded::rounded(model.scenario, route);
    let turned: Vec<_> = found.routes.iter().filter_map(rounded).collect();
    found.routes.extend(turned);
    (found, detour.is_some() || sought.is_some())
}

/// Routes that wind round mountains, and how many whole routes were priced: along flanks where one end is too far above
/// the other, or where none of the `known` routes over hills can be flown; along contours where that finds none either.
fn round_mountains(
    model: &Model,
    known: &[Vec<Point3>],
    is_over: &dyn Fn() -> bool,
) -> (Found, u64) {
    let mut found = Found::default();
    if model.scenario.terrain.is_flat() {
        return (found, 0);
    }
    let can_any_be_flown = |routes| flown(model, priced(model, routes)).next().is_some();
    let is_known = can_any_be_flown(known);
    if is_known && !is_steep(model.scenario) {
        return (found, 0);
    }
    let mut routes_priced = known.len();
    found.add(flanks::routes(model, OVERLAND, is_over));
    if !is_known {
        routes_priced += found.routes.len();
        if !can_any_be_flown(&found.routes) {
            found.add(contours::routes(model, is_over));
        }
    }
    (found, routes_priced as u64)
}

/// A route and its price.
type Priced<'r> = (Fitness, &'r [Point3]);

fn by_rank(one: &Priced, other: &Priced) -> std::cmp::Ordering {
    one.0.rank(&other.0)
}

fn priced<'r>(model: &Model, routes: &'r [Vec<Point3>]) -> impl Iterator<Item = Priced<'r>> {
    let priced = |route: &'r Vec<Point3>| (price(model, route), route.as_slice());
    routes.iter().map(priced)
}

/// The best of those `priced` that can be flown as it is.
fn best_of<'r>(model: &Model, priced: impl IntoIterator<Item = Priced<'r>>) -> Option<Priced<'r>> {
    flown(model, priced).min_by(by_rank)
}

/// Those of the `priced` that can be flown as they are.
fn flown<'r>(
    model: &Model,
    priced: impl IntoIterator<Item = Priced<'r>>,
) -> impl Iterator<Item = Priced<'r>> {
    let most = model.scenario.planner.waypoints + 2;
    priced
        .into_iter()
        .filter(move |(fitness, route)| fitness.is_feasible() && route.len() <= most)
}

/// The route along `string`, in the middle of the band where it can be reached.
fn along(model: &Model, string: &TautString) -> Vec<Point3> {
    let scenario = model.scenario;
    let corners = tangents::corners(scenario, string, scenario.planner.waypoints.min(COARSE));
    let mut route = vec![scenario.start];
    route.extend(corners.iter().map(|&corner| lifted(scenario, corner, 0.5)));
    route.push(scenario.target);
    over::lift(model, &mut route);
    route
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
