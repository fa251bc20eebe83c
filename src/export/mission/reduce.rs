//! A path as few straight legs: no sample of it farther from them than a tolerance, and no leg that
//! breaks what the path keeps.
//!
//! The corners are samples of the path, or lie beside one on the outside of its bend, where a leg
//! past a threat has room. Of all chains of legs over a thinned choice of corners the one with the
//! fewest is taken. Where none holds, the path itself is the answer.

use crate::cost::{Model, turns};
use crate::geometry::{Point3, Rect};
use crate::planner;
use crate::scenario::{Quadrature, Scenario};

/// Share of the tolerance by which corners on the path are chosen, and by which others lie beside it.
const THINNING: f64 = 0.125;
const OFFSET: f64 = 0.95;

/// A corner is given up after so many corners in a row that no leg from it reaches.
const HOPELESS: usize = 16;

/// What is kept while reducing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Metres from the path, in space.
    pub(super) tolerance_m: f64,
    /// Legs follow the ground: heights above it, too, keep within the tolerance between corners.
    pub(super) follows_ground: bool,
}

/// A place where a leg may end.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Corner {
    /// Of the sample on or beside which it lies.
    index: usize,
    point: Point3,
    /// Height above ground, metres; 0 where nobody asks.
    agl: f64,
}

/// The fewest corners that stand for `path`, its ends among them.
///
/// `path` must keep the constraints of `scenario` that a path is held to; the legs do, too.
pub(super) fn reduce(scenario: &Scenario, path: &[Point3], shape: Shape) -> Vec<Point3> {
    let near = Scenario {
        threats: Vec::new(),
        ..scenario.clone()
    };
    let near = Scenario {
        threats: within_reach(scenario, path, 2.0 * shape.tolerance_m),
        ..near
    };
    let reduction = Reduction {
        model: Model::new(&near),
        shape,
        samples: corners_of(&near, path, shape),
    };
    let reduced = reduction
        .fewest(&reduction.choice())
        .filter(|corners| keeps(&Model::new(scenario), corners));
    reduced.unwrap_or_else(|| path.to_vec())
}

/// Whether `route` keeps what a path is held to.
pub(super) fn keeps(model: &Model, route: &[Point3]) -> bool {
    let mut kept = true;
    model.assess(route, Quadrature::Integral, model.tolerance, |breach| {
        kept &= !planner::binds_paths(&breach);
    });
    kept
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
    let meets = |extent: &Rect| boxes.iter().any(|run| overlap(run, extent));
    let threats = scenario.threats.iter();
    threats
        .filter(|threat| meets(&threat.extent()))
        .cloned()
        .collect()
}

fn overlap(one: &Rect, other: &Rect) -> bool {
    one.min.x <= other.max.x
        && other.min.x <= one.max.x
        && one.min.y <= other.max.y
        && other.min.y <= one.max.y
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
        point.z - scenario.terrain.elevation(point.xy())
    } else {
        0.0
    }
}

struct Reduction<'s> {
    model: Model<'s>,
    shape: Shape,
    /// Every one of the path.
    samples: Vec<Corner>,
}

/// A leg of the graph, with what it takes to fly it last.
#[derive(Debug, Clone, Copy)]
struct Leg {
    to: usize,
    /// Legs up to its end, itself among them, and the misses of all, for choosing among equals.
    legs: usize,
    misses: f64,
    /// The leg before, as corner and position among that corner's legs.
    before: Option<(usize, usize)>,
}

impl Reduction<'_> {
    /// The corners to choose from, in the order of the path.
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

    /// Some of the samples, any two in a row a leg that holds to a share of the tolerance.
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
            // The next sample is always reached: that is a leg of the path itself.
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

    /// The corner on the outside of the bend at `corner`; none on a straight.
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

    /// The chain of fewest legs over `choice`, its first and last corner the ends.
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

    /// The leg between two corners, after the best leg to the first from which it can be turned into.
    fn leg(&self, choice: &[Corner], arriving: &[Vec<Leg>], from: usize, to: usize) -> Option<Leg> {
        let (a, b) = (&choice[from], &choice[to]);
        let miss = self.miss(a, b, self.shape.tolerance_m)?;
        let before = if from == 0 {
            None
        } else {
            let turnable = |leg: &&(usize, &Leg)| {
                let start = leg.1.before.map_or(0, |(corner, _)| corner);
                self.turns_into(choice[start].point, a.point, b.point)
            };
            let legs = arriving[from].iter().enumerate();
            let best = legs
                .collect::<Vec<_>>()
                .iter()
                .filter(turnable)
                .min_by(|one, other| better(one.1, other.1))
                .copied();
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

    /// Whether the leg by itself keeps what a path is held to.
    fn is_free(&self, from: &Corner, to: &Corner) -> bool {
        keeps(&self.model, &[from.point, to.point])
    }

    /// How far the samples between two corners are from the leg at most; `None` when that is more
    /// than `tolerance`.
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

/// From a point to a leg, metres.
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
mod tests {
    use super::*;
    use crate::export::tests::accepted;
    use crate::geometry::Point2;
    use crate::geometry::bspline::BSpline;
    use crate::threat::{Cylinder, Threat};
    use proptest::prelude::*;
    use serde_json::json;

    /// Open ground under 500 m of room, no limit that matters.
    fn open(max_turn_deg: f64) -> Scenario {
        accepted(&json!({
            "start": {"x": 0, "y": 0, "z": 100},
            "target": {"x": 1000, "y": 0, "z": 100},
            "area": {"min": {"x": -500, "y": -800}, "max": {"x": 1500, "y": 800}},
            "terrain": {"kind": "peaks", "base": 0, "peaks":
                [{"center": {"x": 500, "y": 0}, "height": 60, "spread": {"x": 150, "y": 300}}]},
            "altitude": {"min": 10, "max": 500},
            "vehicle": {"max_turn_deg": max_turn_deg, "max_climb_deg": 60, "min_leg": 1},
        }))
    }

    /// A smoothed path over `steps` of 100 m east, and discs that touch it at some of its samples.
    fn hugging(
        steps: &[(f64, f64)],
        touched: &[(usize, bool, f64)],
    ) -> Option<(Scenario, Vec<Point3>)> {
        let mut scenario = open(90.0);
        let free = steps
            .iter()
            .zip(1_i32..)
            .map(|(&(north, up), step)| Point3::new(100.0 * f64::from(step), north, 150.0 + up));
        let ends = (scenario.start, scenario.target);
        let route = std::iter::once(ends.0).chain(free).chain([ends.1]);
        let path = smoothed(route.collect());
        if !keeps(&Model::new(&scenario), &path) {
            return None;
        }
        for &(sample, left, radius) in touched {
            let index = 1 + sample % (path.len() - 2);
            let along = (path[index + 1] - path[index - 1]).xy().normalize();
            let aside =
                nalgebra::Vector2::new(-along.y, along.x) * if left { radius } else { -radius };
            let disc = Threat {
                name: None,
                shape: crate::threat::Shape::Cylinder(Cylinder {
                    center: Point2::from(path[index].xy() + aside),
                    radius,
                    influence: radius,
                }),
                base: None,
                top: None,
            };
            scenario.threats.push(disc);
            if !keeps(&Model::new(&scenario), &path) {
                scenario.threats.pop();
            }
        }
        Some((scenario, path))
    }

    /// Samples of a B-spline, no matter what it cuts.
    fn smoothed(corners: Vec<Point3>) -> Vec<Point3> {
        let spline = BSpline::clamped_uniform(corners, 3);
        let mut samples = vec![spline.control_points[0]];
        for (piece, from, to) in spline.spans() {
            let step = |step: i32| from + (to - from) * f64::from(step) / 24.0;
            samples.extend((1..=24).map(|count| spline.at(piece, step(count))));
        }
        samples
    }

    fn farthest(path: &[Point3], corners: &[Point3]) -> f64 {
        let miss = |&point: &Point3| {
            let legs = corners
                .windows(2)
                .map(|ends| distance(point, (ends[0], ends[1])));
            legs.fold(f64::INFINITY, f64::min)
        };
        path.iter().map(miss).fold(0.0, f64::max)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn the_legs_keep_what_the_path_keeps(
            steps in prop::collection::vec((-60.0..60.0, -20.0..20.0), 9),
            touched in prop::collection::vec((any::<usize>(), any::<bool>(), 5.0..80.0), 0..6),
            tolerance_m in prop_oneof![Just(0.05), Just(1.0), Just(8.0)],
            follows_ground: bool,
        ) {
            if let Some((scenario, path)) = hugging(&steps, &touched) {
                let shape = Shape { tolerance_m, follows_ground };
                let corners = reduce(&scenario, &path, shape);
                prop_assert!(farthest(&path, &corners) <= tolerance_m);
                prop_assert!(keeps(&Model::new(&scenario), &corners));
                prop_assert_eq!(corners[0], path[0]);
                prop_assert_eq!(corners[corners.len() - 1], path[path.len() - 1]);
                prop_assert!(corners.len() <= path.len());
                if follows_ground {
                    let flat = |points: &[Point3]| -> Vec<Point3> {
                        points.iter().map(|point| {
                            let z = point.z - scenario.terrain.elevation(point.xy());
                            Point3::new(point.x, point.y, z)
                        }).collect()
                    };
                    prop_assert!(farthest(&flat(&path), &flat(&corners)) <= tolerance_m);
                }
            }
        }

        /// Of all chains over the samples of a short path, tried one by one, none has fewer legs by
        /// more than one; off the samples there may be shorter ones still.
        #[test]
        fn the_legs_are_few(offsets in prop::collection::vec(-3.0..3.0_f64, 9)) {
            let scenario = open(90.0);
            let path: Vec<Point3> = std::iter::once(0.0)
                .chain(offsets)
                .chain([0.0])
                .zip(0_i32..)
                .map(|(north, step)| Point3::new(100.0 * f64::from(step), north, 150.0))
                .collect();
            let shape = Shape { tolerance_m: 1.0, follows_ground: false };
            let found = reduce(&scenario, &path, shape).len();
            let best = (0..1_u32 << (path.len() - 2))
                .filter_map(|chosen| {
                    let kept = |index: usize| {
                        index == 0 || index == path.len() - 1 || chosen >> (index - 1) & 1 == 1
                    };
                    let corners: Vec<usize> = (0..path.len()).filter(|&index| kept(index)).collect();
                    let holds = corners.windows(2).all(|ends| {
                        let leg = (path[ends[0]], path[ends[1]]);
                        path[ends[0]..=ends[1]].iter().all(|&point| distance(point, leg) <= 1.0)
                    });
                    holds.then_some(corners.len())
                })
                .min()
                .expect("the path itself holds");
            prop_assert!(found <= best + 1, "{found} corners where {best} do");
        }
    }

    /// Round a disc at its very edge, legs between samples would all cut it: beside it they do not.
    #[test]
    fn an_arc_along_a_threat_takes_few_legs() {
        let mut scenario = open(90.0);
        scenario.terrain = crate::terrain::Terrain::Flat(crate::terrain::Flat { elevation: 0.0 });
        let center = Point2::new(500.0, 0.0);
        scenario.threats.push(Threat {
            name: None,
            shape: crate::threat::Shape::Cylinder(Cylinder {
                center,
                radius: 199.9,
                influence: 199.9,
            }),
            base: None,
            top: None,
        });
        let path: Vec<Point3> = (0..=180)
            .map(|step| {
                let (sin, cos) =
                    libm::sincos(std::f64::consts::PI * (1.0 - f64::from(step) / 180.0));
                Point3::new(500.0 + 200.0 * cos, 200.0 * sin, 150.0)
            })
            .collect();
        assert!(keeps(&Model::new(&scenario), &path));
        let shape = Shape {
            tolerance_m: 1.0,
            follows_ground: false,
        };
        let corners = reduce(&scenario, &path, shape);
        // Tangents of 199.9 m between corners at 200.95 m are 41 m long, of an arc of 628 m; samples are
        // 3.5 m apart.
        assert!((16..=23).contains(&corners.len()), "{}", corners.len());
    }

    /// A bend that legs of the tolerance would make in one corner is made in as many as the vehicle
    /// can turn.
    #[test]
    fn no_corner_is_sharper_than_the_vehicle_can_turn() {
        let bend = |step: i32| {
            let (sin, cos) = libm::sincos(f64::from(step).to_radians());
            Point3::new(300.0 + 2.0 * sin, 2.0 - 2.0 * cos, 150.0)
        };
        let straight = |step: i32| Point3::new(10.0 * f64::from(step), 0.0, 150.0);
        let back = |step: i32| Point3::new(300.0 - 10.0 * f64::from(step), 4.0, 150.0);
        let path: Vec<Point3> = (0..30)
            .map(straight)
            .chain((0..=18).map(|step| bend(10 * step)))
            .chain((1..30).map(back))
            .collect();
        let scenario = open(60.0);
        let shape = Shape {
            tolerance_m: 1.5,
            follows_ground: false,
        };
        let corners = reduce(&scenario, &path, shape);
        let sharpest = turns(&corners)
            .map(f64::abs)
            .fold(0.0, f64::max)
            .to_degrees();
        assert!(sharpest <= 60.0 + 1e-6, "{sharpest}");
        assert!(corners.len() <= 8, "{}", corners.len());
    }
}
