//! Routes before they have all their waypoints: a known one, and those along strings, over the ground and round
//! mountains.

use super::height::{is_steep, lifted};
use super::net::Found;
use super::{
    climbs, contours, exposed, flanks, known, over, roadmap, rounded, tangents, trails, ways, worth,
};
use crate::cost::Model;
use crate::geometry::{Point2, Point3};
use crate::optimizer::Fitness;
use crate::planner::price::price;
use crate::scenario::Seeding;
use crate::seeding::{Obstacles, Outline, TautString, steep_ground, taut_strings_until};
use crate::threat::Threat;

/// Strings taken from each scene of obstacles.
const STRINGS: usize = 5;

/// The same where mountains are obstacles too: there a net of places also finds ways through them.
const STRINGS_ROUND_MOUNTAINS: usize = 2;

/// Routes taken from the net of places.
pub(super) const OVERLAND: usize = 8;

/// Routes taken from each of the nets for long detours.
const FAR_ABOUT: usize = 16;

/// A start more expensive than the best refined one by this share is not worth refining. Corners drawn round a string
/// may reach into the next soft zone.
const HOPELESS: f64 = 0.12;

/// The same over hills, where starts already follow the ground.
pub(super) const HOPELESS_OVER_HILLS: f64 = 0.08;

/// The same where soft zones are expensive or many, so that a small shift changes more of the cost.
const HOPELESS_IN_ZONES: f64 = 0.3;

/// Free waypoints of a coarse route, unless its bends need more.
const COARSE: usize = 4;

/// Over hills, where every leg must also follow the ground.
const COARSE_OVER_HILLS: usize = 7;

/// Maximum number of free waypoints of a coarse route, unless no route with so few is good enough.
pub(super) const MOST_COARSE: usize = 20;

/// Where no shape keeps all limits, as where the ends are outside the band, one that breaks them by up to this many times
/// as much as the best may win as well.
const ALIKE: f64 = 1.5;

/// Shapes of routes, and what finding them has told about the ground.
#[derive(Default)]
pub(super) struct Shapes {
    /// A known route first.
    pub(super) routes: Vec<Vec<Point3>>,
    /// The shortest one round all threats over level ground, however dear their soft zones make it.
    pub(super) shortest: Option<Vec<Point3>>,
    /// Round taut strings, as corners seen from above: as many as the route may have waypoints, and shorten it.
    pub(super) round: Vec<Vec<Point2>>,
    /// Whether one was known.
    pub(super) is_known: bool,
    /// Whether soft zones are expensive, or threats many or near to each other.
    pub(super) is_rough: bool,
    /// Whether spare waypoints are too expensive to be left out in a coarse search.
    is_low: bool,
    pub(super) legs_priced: u64,
    pub(super) routes_priced: u64,
}

impl Shapes {
    /// All shapes that a search of `model` may start from; once `is_over`, those found so far.
    pub(super) fn find(model: &Model, is_over: &dyn Fn() -> bool) -> Self {
        let settings = &model.scenario.planner;
        let known = known::given(model);
        let mut shapes = Self {
            is_known: known.is_some(),
            routes: known.into_iter().collect(),
            ..Self::default()
        };
        if settings.seeding == Seeding::Tangent {
            let along = along_strings(model, is_over);
            shapes.routes.extend(along.routes);
            shapes.shortest = along.shortest;
            shapes.round = along.round;
            // A caller who supplies a route has dealt with the hills already.
            if !shapes.is_known {
                shapes.look_over_ground(model, is_over);
            }
        }
        shapes
    }

    fn look_over_ground(&mut self, model: &Model, is_over: &dyn Fn() -> bool) {
        let (found, is_rough) = over_ground(model, &self.routes, is_over);
        self.is_rough = is_rough;
        self.add(found);
        let climbs = climbs::routes(model, is_over);
        let must_climb = !climbs.routes.is_empty();
        self.add(climbs);
        if must_climb {
            self.routes_priced += self.routes.len() as u64;
            (self.routes, self.is_low) = worth::promising(model, std::mem::take(&mut self.routes));
        }
        let (round, routes_priced) = round_mountains(model, &self.routes, is_over);
        self.routes_priced += routes_priced;
        self.add(round);
    }

    fn add(&mut self, found: Found) {
        self.legs_priced += found.legs_priced;
        self.routes.extend(found.routes);
    }

    /// The share by which a start may be more expensive than the best refined one and still be worth refining.
    pub(super) fn hopeless(&self, model: &Model) -> f64 {
        if self.is_rough {
            HOPELESS_IN_ZONES
        } else if model.scenario.terrain.is_flat() {
            HOPELESS
        } else {
            HOPELESS_OVER_HILLS
        }
    }

    /// How many waypoints a coarse route needs: a known route keeps its bends, a string needs only as many as it has.
    pub(super) fn waypoints(&self, model: &Model) -> usize {
        let all = model.scenario.planner.waypoints;
        if self.is_known || self.is_low {
            all
        } else {
            bends(model, &self.routes, self.hopeless(model)).min(all)
        }
    }
}

/// Greatest number of bends of the routes that may still win, which are less than `hopeless` more expensive than the
/// best; limited to [`MOST_COARSE`], but not below the bends of the route with the fewest.
pub(super) fn bends(model: &Model, shapes: &[Vec<Point3>], hopeless: f64) -> usize {
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
        fitness.violation <= ALIKE * best.violation && fitness.cost <= best.cost * (1.0 + hopeless)
    });
    let bends = may_win.map(|(_, bends)| *bends);
    let fewest = bends.clone().min().unwrap_or(0);
    bends.fold(least, usize::max).min(fewest.max(MOST_COARSE))
}

/// What follows taut strings.
#[derive(Default)]
pub(super) struct Along {
    /// Routes with as few waypoints as each needs.
    pub(super) routes: Vec<Vec<Point3>>,
    /// As in [`Shapes`].
    shortest: Option<Vec<Point3>>,
    /// As in [`Shapes`].
    round: Vec<Vec<Point2>>,
}

/// Routes along the taut strings of several scenes: round the soft zones, round the threats alone, over those that can be
/// overflown, round steep ground.
pub(super) fn along_strings(model: &Model, is_over: &dyn Fn() -> bool) -> Along {
    let scenario = model.scenario;
    let everything = |_: usize, _: &Threat| true;
    let in_the_way = |_: usize, threat: &Threat| !over::passable(scenario, threat);
    let mut along = Along::default();
    let waypoints = scenario.planner.waypoints;
    let is_level = scenario.terrain.is_flat();
    let mut follow = |obstacles: &Obstacles, count: usize| {
        let strings = taut_strings_until(obstacles, count, is_over).strings;
        for string in &strings {
            along.routes.push(along_string(model, string, is_over));
            if is_level {
                let corners = tangents::corners(scenario, string, waypoints);
                along.round.push(corners);
            }
        }
        strings.len()
    };
    let softly = follow(&Obstacles::soft(scenario, everything), STRINGS);
    let closely = follow(&Obstacles::hard(scenario, everything), STRINGS);
    if scenario
        .threats
        .iter()
        .any(|threat| over::passable(scenario, threat))
    {
        follow(&Obstacles::soft(scenario, in_the_way), STRINGS);
        follow(&Obstacles::hard(scenario, in_the_way), STRINGS);
    }
    let steep = steep_ground(scenario);
    if !steep.is_empty() {
        let outlines = scenario.threats.iter().map(Outline::soft).chain(steep);
        let ends = [scenario.start.xy(), scenario.target.xy()];
        let obstacles = Obstacles::new(outlines.map(Some), ends, Some(scenario.area));
        follow(&obstacles, STRINGS_ROUND_MOUNTAINS);
    }
    // Straight ahead, for when crossing soft zones is worth it.
    along.routes.push(vec![scenario.start, scenario.target]);
    along.shortest = (is_level && closely > 0).then(|| along.routes[softly].clone());
    along
}

/// Routes over the ground: through a fine net only where the coarse one has none that can be flown as it is, as long
/// detours where the best so far pays much for soft zones, and along the ways between threats where these are many or
/// near to each other; and whether there are such zones or ways. Once `is_over`, what has been found so far.
fn over_ground(
    model: &Model,
    strings: &[Vec<Point3>],
    is_over: &dyn Fn() -> bool,
) -> (Found, bool) {
    let strings: Vec<PricedShape> = priced(model, strings).collect();
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

/// A shape and its price.
type PricedShape<'r> = (Fitness, &'r [Point3]);

fn by_rank(one: &PricedShape, other: &PricedShape) -> std::cmp::Ordering {
    one.0.rank(&other.0)
}

pub(super) fn priced<'r>(
    model: &Model,
    routes: &'r [Vec<Point3>],
) -> impl Iterator<Item = PricedShape<'r>> {
    let priced = |route: &'r Vec<Point3>| (price(model, route), route.as_slice());
    routes.iter().map(priced)
}

/// The best of those `priced` that can be flown as it is.
fn best_of<'r>(
    model: &Model,
    priced: impl IntoIterator<Item = PricedShape<'r>>,
) -> Option<PricedShape<'r>> {
    flown(model, priced).min_by(by_rank)
}

/// Those of the `priced` that can be flown as they are.
fn flown<'r>(
    model: &Model,
    priced: impl IntoIterator<Item = PricedShape<'r>>,
) -> impl Iterator<Item = PricedShape<'r>> {
    let most = model.scenario.planner.waypoints + 2;
    priced
        .into_iter()
        .filter(move |(fitness, route)| fitness.is_feasible() && route.len() <= most)
}

/// The route along `string`, in the middle of the band where it can be reached.
fn along_string(model: &Model, string: &TautString, is_over: &dyn Fn() -> bool) -> Vec<Point3> {
    let scenario = model.scenario;
    let corners = tangents::corners(scenario, string, scenario.planner.waypoints.min(COARSE));
    let mut route = vec![scenario.start];
    route.extend(corners.iter().map(|&corner| lifted(scenario, corner, 0.5)));
    route.push(scenario.target);
    over::lifted_over(model, route, is_over)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::{disc, scenario};

    #[test]
    fn shapes_that_break_limits_about_as_much_as_the_best_keep_their_bends() {
        let mut scenario = scenario();
        scenario.threats = vec![disc([500.0, 500.0, 50.0, 50.0])];
        let model = Model::new(&scenario);
        // Straight through the disc, so many metres deep.
        let through = |depth: f64, bends: u32| -> Vec<Point3> {
            let legs = f64::from(bends + 1);
            let at = |idx| Point3::new(100.0 + 800.0 * f64::from(idx) / legs, 450.0 + depth, 100.0);
            (0..=bends + 1).map(at).collect()
        };
        for (depth, expected) in [(12.0, 12), (20.0, 6)] {
            let shapes = [through(10.0, 6), through(depth, 12)];
            assert_eq!(bends(&model, &shapes, HOPELESS), expected, "{depth}");
        }
        let round = through(-10.0, 6);
        assert_eq!(bends(&model, &[round, through(1.0, 12)], HOPELESS), 6);
    }
}
