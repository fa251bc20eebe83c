//! Common parts of ways over the ground: a net of spots, and the cheapest chains through it.

use crate::cost::Model;
use crate::cost::batch::{LANES, PointRow, Price};
use crate::geometry::{Point2, Point3, Vector2};
use crate::optimizer::Fitness;
use crate::scenario::Scenario;

/// Chains that are nowhere farther apart than this share of the direct way count as one.
pub(super) const NEAR: f64 = 2.0 * super::super::SAME;

/// Chains that take a different way are somewhere this far apart, as a share of the direct way.
const APART: f64 = 0.12;

/// The result of a search for ways.
#[derive(Default)]
pub(super) struct Found {
    /// Routes that differ; those of a net have the cheapest first.
    pub(super) routes: Vec<Vec<Point3>>,
    /// Legs priced for them.
    pub(super) legs_priced: u64,
}

impl Found {
    /// With what another search found.
    pub(super) fn add(&mut self, other: Self) {
        self.routes.extend(other.routes);
        self.legs_priced += other.legs_priced;
    }
}

/// A hexagonal net.
pub(super) struct Spots {
    pub(super) points: Vec<Point2>,
    /// Distance from each to the next, metres.
    pub(super) step: f64,
}

/// About `count` spots within the area over all points through which the way from start to target is at most `detour`
/// times the direct one.
pub(super) fn spots(scenario: &Scenario, count: usize, detour: f64) -> Spots {
    let (start, target) = (scenario.start.xy(), scenario.target.xy());
    let way = target - start;
    let direct = way.norm();
    let along = way / direct;
    let across = Vector2::new(-along.y, along.x);
    // An ellipse with both ends as its foci.
    let (long, wide) = (
        0.5 * detour * direct,
        0.5 * direct * (detour * detour - 1.0).sqrt(),
    );
    let step = (std::f64::consts::PI * long * wide / (0.866 * count as f64)).sqrt();
    let middle = nalgebra::center(&start, &target);
    let mut points = Vec::new();
    let (rows, columns) = ((wide / (0.866 * step)).floor(), (long / step).ceil());
    let mut row = -rows;
    while row <= rows {
        let shift = if row.rem_euclid(2.0) < 0.5 { 0.0 } else { 0.5 };
        let mut column = -columns;
        while column <= columns {
            let (x, y) = ((column + shift) * step, row * 0.866 * step);
            let at: Point2 = middle + along * x + across * y;
            let inside = (x / long) * (x / long) + (y / wide) * (y / wide) <= 1.0;
            if inside && scenario.area.contains(at) {
                points.push(at);
            }
            column += 1.0;
        }
        row += 1.0;
    }
    Spots { points, step }
}

/// What `pricing`, given the rows of both ends, finds of the legs between `places`, by the numbers of their `ends`.
pub(super) fn priced(
    places: &[Point3],
    ends: &[(usize, usize)],
    pricing: impl FnOnce(&[PointRow], &[PointRow], &mut [Price]),
) -> Vec<Fitness> {
    let side =
        |end: fn(&(usize, usize)) -> usize| PointRow::of(ends.iter().map(|ends| places[end(ends)]));
    let [from, to] = [side(|ends| ends.0), side(|ends| ends.1)];
    let mut prices = vec![Price::ZERO; from.len()];
    pricing(&from, &to, &mut prices);
    let of = |idx: usize| Fitness {
        violation: prices[idx / LANES].violation[idx % LANES],
        cost: prices[idx / LANES].cost[idx % LANES],
    };
    (0..ends.len()).map(of).collect()
}

/// The cheapest chains from one place to all others.
pub(super) struct Tree {
    /// Cost for each place.
    pub(super) costs: Vec<f64>,
    /// The place before it; where there is none, itself.
    pub(super) before: Vec<usize>,
}

impl Tree {
    /// Chains of no leg, from `source` to one of `count` places.
    pub(super) fn from(source: usize, count: usize) -> Self {
        let mut costs = vec![f64::INFINITY; count];
        costs[source] = 0.0;
        Self {
            costs,
            before: (0..count).collect(),
        }
    }

    /// From `place` back to where all chains begin.
    pub(super) fn trace(&self, mut place: usize) -> Vec<usize> {
        let mut chain = vec![place];
        while self.before[place] != place {
            place = self.before[place];
            chain.push(place);
        }
        chain
    }
}

/// Up to `count` chains that differ, the cheapest first, out of the trees from start and target.
pub(super) fn chains(
    model: &Model,
    places: &[Point3],
    [from_start, from_target]: &[Tree; 2],
    count: usize,
) -> Vec<Vec<Point3>> {
    // The cheapest chain over each place; neighbouring places of a chain give it again.
    let over: Vec<(f64, usize)> = (0..places.len())
        .map(|place| (from_start.costs[place] + from_target.costs[place], place))
        .filter(|(cost, _)| cost.is_finite())
        .collect();
    let through = |place: usize| -> Vec<usize> {
        let mut chain = from_start.trace(place);
        chain.reverse();
        chain.extend(from_target.trace(place).into_iter().skip(1));
        chain
    };
    different(model, places, over, through, count)
}

/// Up to `count` chains that differ, the cheapest first, out of those `through` certain points, given with their costs.
pub(super) fn different<P: Copy + Ord>(
    model: &Model,
    places: &[Point3],
    mut over: Vec<(f64, P)>,
    through: impl Fn(P) -> Vec<usize>,
    count: usize,
) -> Vec<Vec<Point3>> {
    over.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let mut chains: Vec<Vec<Point3>> = Vec::new();
    // First those that take an entirely different way.
    for (count, reach) in [(count / 2, APART), (count, NEAR)] {
        let reach = reach * model.scenario.direct();
        // Most chains lead over places that others lead over.
        let mut is_near: Vec<Vec<Option<bool>>> = vec![vec![None; places.len()]; chains.len()];
        for &(_, point) in &over {
            if chains.len() >= count {
                break;
            }
            let chain = through(point);
            let is_known = chains.iter().zip(&mut is_near).any(|(other, is_near)| {
                let mut all = chain.iter();
                all.all(|&at| {
                    *is_near[at].get_or_insert_with(|| is_point_near(places[at], other, reach))
                })
            });
            if !is_known {
                chains.push(chain.into_iter().map(|idx| places[idx]).collect());
                is_near.push(vec![None; places.len()]);
            }
        }
    }
    chains
}

/// Whether every waypoint of `chain` lies within `reach`, a share of the direct way, of a leg of `other`.
pub(super) fn is_near(model: &Model, chain: &[Point3], other: &[Point3], reach: f64) -> bool {
    let reach = reach * model.scenario.direct();
    let mut points = chain.iter();
    points.all(|point| is_point_near(*point, other, reach))
}

/// Whether a point lies within `reach` metres of a leg of `chain`.
fn is_point_near(point: Point3, chain: &[Point3], reach: f64) -> bool {
    chain.windows(2).any(|ends| {
        let way = ends[1] - ends[0];
        let share = ((point - ends[0]).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        (ends[0] + way * share - point).norm() <= reach
    })
}
