//! Reduces a path to few straight legs: no sample of the path is farther from them than a tolerance, and no leg
//! violates the path's constraints.
//!
//! The corners are samples of the path, or lie beside one on the outside of its bend, where a leg past a threat has
//! room. Among all chains of legs over a thinned selection of corners, the one with the fewest legs is taken. If
//! there is none, the result is the path itself.

use crate::cost::{Model, turns};
use crate::geometry::{Point3, Rect};
use crate::planner::keeps_limits;
use crate::scenario::Scenario;

/// Fractions of the tolerance: for thinning the samples, and for the offset of corners beside the path.
const THINNING: f64 = 0.125;
const OFFSET: f64 = 0.95;

/// Legs from a corner are no longer tried after this many unreachable corners in a row.
const HOPELESS: usize = 16;

/// What the reduction must keep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Greatest 3-D distance from the path, metres.
    pub(super) tolerance_m: f64,
    /// Legs follow the ground: between corners, heights above ground also stay within the tolerance.
    pub(super) follows_ground: bool,
}

/// A possible end of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Corner {
    /// Index of the sample on or beside which it lies.
    index: usize,
    point: Point3,
    /// Height above ground, metres; 0 unless legs follow the ground.
    agl: f64,
}

/// The fewest corners that represent `path`, including its ends.
///
/// `path` must satisfy the path constraints of `scenario`; the legs then do, too.
pub(super) fn reduce(scenario: &Scenario, path: &[Point3], shape: Shape) -> Vec<Point3> {
    let near = Scenario {
        threats: within_reach(scenario, path, 2.0 * shape.tolerance_m),
        ..scenario.clone()
    };
    let reduction = Reduction {
        model: Model::new(&near),
        shape,
        samples: corners_of(&near, path, shape),
    };
    let reduced = reduction
        .fewest(&reduction.choice())
        .filter(|corners| keeps_limits(&Model::new(scenario), corners));
    reduced.unwrap_or_else(|| path.to_vec())
}

/// The threats that a leg within `reach` metres of `path` may meet.
fn within_reach(scenario: &Scenario, path: &[Point3], reach: f64) -> Vec<crate::threat::Threat> {
    let boxes: Vec<Rect> = (0..path.len())
        .step_by(64)
        .filter_map(|first| {
            let run = &path[first..path.len().min(first + 65)];
            Some(Rect::around(run.iter().map(Point3::xy))?.grown(reach))
        })
        .collect();
    let meets = |extent: &Rect| boxes.iter().any(|run| run.meets(extent));
    let threats = scenario.threats.iter();
    threats
        .filter(|threat| meets(&threat.extent()))
        .cloned()
        .collect()
}

fn corners_of(scenario: &Scenario, path: &[Point3], shape: Shape) -> Vec<Corner> {
    path.iter()
        .enumerate()
        .map(|(index, &point)| Corner {
            index,
            point,
            agl: agl(scenario, point, shape),
        })
        .collect()
}

fn agl(scenario: &Scenario, point: Point3, shape: Shape) -> f64 {
    if shape.follows_ground {
        scenario.terrain.height_of(point)
    } else {
        0.0
    }
}

struct Reduction<'s> {
    model: Model<'s>,
    shape: Shape,
    /// All samples of the path.
    samples: Vec<Corner>,
}

/// A leg of the graph, with the best chain that ends in it.
#[derive(Debug, Clone, Copy)]
struct Leg {
    to: usize,
    /// Legs in the chain, including this one, and the sum of their misses, which breaks ties.
    legs: usize,
    misses: f64,
    /// The previous leg, as a corner and the position among that corner's legs.
    before: Option<(usize, usize)>,
}

impl Reduction<'_> {
    /// The candidate corners, in the order of the path.
    fn choice(&self) -> Vec<Corner> {
        let on_path = self.thinned();
        let mut choice = Vec::new();
        for (position, &corner) in on_path.iter().enumerate() {
            choice.push(corner);
            if let Some(neighbours) = position
                .checked_sub(1)
                .and_then(|before| Some((on_path[before], *on_path.get(position + 1)?)))
            {
                choice.extend(self.beside(neighbours, corner));
            }
        }
        choice
    }

    /// A selection of samples; each two in a row form a leg within a fraction of the tolerance.
    fn thinned(&self) -> Vec<Corner> {
        let last = self.samples.len() - 1;
        let tolerance = THINNING * self.shape.tolerance_m;
        let holds = |from: usize, to: usize| {
            let (from, to) = (&self.samples[from], &self.samples[to]);
            self.miss(from, to, tolerance).is_some() && self.is_free(from, to)
        };
        let mut kept = vec![self.samples[0]];
        let mut at = 0;
        while at < last {
            // The next sample is always reachable, by a leg of the path itself.
            let (mut reached, mut step) = (at + 1, 2);
            while at + step <= last && holds(at, at + step) {
                reached = at + step;
                step *= 2;
            }
            let mut beyond = (at + step).min(last + 1);
            while beyond - reached > 1 {
                let middle = reached.midpoint(beyond);
                if holds(at, middle) {
                    reached = middle;
                } else {
                    beyond = middle;
                }
            }
            kept.push(self.samples[reached]);
            at = reached;
        }
        kept
    }

    /// The corner on the outside of the bend at `corner`; `None` on a straight part.
    fn beside(&self, (before, after): (Corner, Corner), corner: Corner) -> Option<Corner> {
        let (arriving, leaving) = (
            (corner.point - before.point).xy(),
            (after.point - corner.point).xy(),
        );
        let inwards = leaving.try_normalize(1e-9)? - arriving.try_normalize(1e-9)?;
        let outwards = -inwards.try_normalize(1e-6)?;
        let aside = OFFSET * self.shape.tolerance_m * outwards;
        let point = corner.point + nalgebra::Vector3::new(aside.x, aside.y, 0.0);
        let scenario = self.model.scenario;
        (scenario.area.excess(point.xy()) <= 0.0).then(|| Corner {
            point,
            agl: agl(scenario, point, self.shape),
            ..corner
        })
    }

    /// The chain with the fewest legs over `choice`, from its first corner to its last.
    fn fewest(&self, choice: &[Corner]) -> Option<Vec<Point3>> {
        let goal = choice.len() - 1;
        // The legs that end at each corner.
        let mut arriving: Vec<Vec<Leg>> = vec![Vec::new(); choice.len()];
        for from in 0..goal {
            if from > 0 && arriving[from].is_empty() {
                continue;
            }
            let mut hopeless = 0;
            for to in from + 1..choice.len() {
                if choice[to].index == choice[from].index {
                    continue;
                }
                let leg = self.leg(choice, &arriving, from, to);
                if let Some(leg) = leg {
                    hopeless = 0;
                    arriving[to].push(leg);
                } else {
                    hopeless += 1;
                    if hopeless > HOPELESS {
                        break;
                    }
                }
            }
        }
        let least = |legs: &[Leg]| {
            let order = |one: &usize, other: &usize| better(&legs[*one], &legs[*other]);
            (0..legs.len()).min_by(order)
        };
        let mut route = vec![choice[goal].point];
        let mut next = least(&arriving[goal]).map(|position| (goal, position));
        next?;
        while let Some((corner, position)) = next {
            next = arriving[corner][position].before;
            let from = next.map_or(0, |(corner, _)| corner);
            route.push(choice[from].point);
        }
        route.reverse();
        Some(route)
    }

    /// The leg between two corners, after the best leg to the first one that allows the turn.
    fn leg(&self, choice: &[Corner], arriving: &[Vec<Leg>], from: usize, to: usize) -> Option<Leg> {
        let (a, b) = (&choice[from], &choice[to]);
        let miss = self.miss(a, b, self.shape.tolerance_m)?;
        let before = if from == 0 {
            None
        } else {
            let turnable = |leg: &(usize, &Leg)| {
                let start = leg.1.before.map_or(0, |(corner, _)| corner);
                self.turns_into(choice[start].point, a.point, b.point)
            };
            let legs = arriving[from].iter().enumerate();
            let best = legs
                .filter(turnable)
                .min_by(|one, other| better(one.1, other.1));
            Some(best?)
        };
        self.is_free(a, b).then(|| Leg {
            to,
            legs: 1 + before.map_or(0, |(_, leg)| leg.legs),
            misses: miss + before.map_or(0.0, |(_, leg)| leg.misses),
            before: before.map(|(position, leg)| (leg.to, position)),
        })
    }

    fn turns_into(&self, before: Point3, corner: Point3, after: Point3) -> bool {
        let turn = turns(&[before, corner, after]).nth(1).unwrap_or(0.0);
        let vehicle = &self.model.scenario.vehicle;
        turn.abs().to_degrees() <= vehicle.max_turn_deg + self.model.tolerance.angle_deg
    }

    /// Whether the leg on its own satisfies the path constraints.
    fn is_free(&self, from: &Corner, to: &Corner) -> bool {
        keeps_limits(&self.model, &[from.point, to.point])
    }

    /// Greatest distance of the samples between two corners from the leg; `None` if it exceeds `tolerance`.
    fn miss(&self, from: &Corner, to: &Corner, tolerance: f64) -> Option<f64> {
        let lifted = |corner: &Corner| Point3::new(corner.point.x, corner.point.y, corner.agl);
        let mut most: f64 = 0.0;
        let ends = (from.point, to.point);
        let above_ground = (lifted(from), lifted(to));
        for sample in &self.samples[from.index..=to.index] {
            let mut miss = distance(sample.point, ends);
            if self.shape.follows_ground {
                miss = miss.max(distance(lifted(sample), above_ground));
            }
            if miss > tolerance {
                return None;
            }
            most = most.max(miss);
        }
        Some(most)
    }
}

fn better(one: &Leg, other: &Leg) -> std::cmp::Ordering {
    let misses = one.misses.total_cmp(&other.misses);
    one.legs.cmp(&other.legs).then(misses)
}

/// Distance from a point to a leg, metres.
fn distance(point: Point3, (a, b): (Point3, Point3)) -> f64 {
    let (along, offset) = (b - a, point - a);
    let squared = along.norm_squared();
    let share = if squared > 0.0 {
        (offset.dot(&along) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (offset - along * share).norm()
}

#[cfg(test)]
mod tests;
