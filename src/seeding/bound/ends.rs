//! The string, and what start and target at another height than the middle of the band cost on top:
//! a first leg is straight, so that where the way bends soon, it is short and steep.

use nalgebra::Vector2;

use super::super::arc::point_segment;
use super::super::obstacles::Obstacles;
use super::super::outline::OutlineShape;
use super::prices::Prices;
use super::string::{length, shortest, slack};
use super::wall::Wall;
use crate::geometry::{Point2, Segment, ring};
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::{Cylinder, Shape, Threat};

/// With more corners than this, only the difference in height of the ends is made use of.
const MOST_CORNERS: usize = 80;

/// What proving legs may take: one for each sector, more for each string.
const EFFORT: usize = 12_000;

/// Sectors are not cut finer than this share of the way.
const FINEST: f64 = 0.003;

/// Nor is a string pulled for sectors wider than this share of it.
const COARSEST: f64 = 0.04;

/// Cuts of the range of 2-D costs.
const CUTS: usize = 9;

/// Bisections of the length of a leg.
const BISECTIONS: usize = 6;

/// Whether there are so many corners that legs are not looked at.
pub(super) fn are_too_many(walls: &[Wall]) -> bool {
    walls.iter().map(|wall| wall.centers().len()).sum::<usize>() > MOST_CORNERS
}

/// What no route undercuts that goes round `walls` widened to radii, and costs `dense` or more seen
/// from above.
pub(super) fn bound(
    scenario: &Scenario,
    prices: &Prices,
    (walls, radii): (&[Wall], &[Option<f64>]),
    dense: f64,
    stop: &dyn Fn() -> bool,
) -> f64 {
    let (string, _) = length(walls, radii, prices, (f64::INFINITY, stop));
    let level = prices
        .climbing(string, prices.rise())
        .max(prices.climbing_at(dense));
    let Terrain::Flat(ground) = scenario.terrain else {
        return level;
    };
    if !string.is_finite() || scenario.weights.altitude <= 0.0 || are_too_many(walls) {
        return level;
    }
    let corners: usize = walls.iter().map(|wall| wall.centers().len()).sum();
    let middle = 0.5 * (scenario.altitude.min + scenario.altitude.max) + ground.elevation;
    // A single waypoint ends both legs.
    let share = if scenario.planner.waypoints > 1 {
        1.0
    } else {
        0.5
    };
    let legs = [0, 1].map(|end| Leg {
        from: prices.ends[end].xy(),
        to: prices.ends[1 - end].xy(),
        height: (prices.ends[end].z - middle).abs(),
        weight: share * scenario.weights.altitude,
        prices,
        walls,
        radii,
        slack: slack(walls, radii, prices),
        known: Vec::new(),
        failed: None,
        effort: EFFORT / 2,
        price: 4 + corners + corners * corners / 10,
        stop,
    });
    level.max(with_legs(legs, dense.max(prices.fuel * string)))
}

/// The least of `cost + steepness` over all 2-D costs of `least` or more: a route of a certain cost
/// has first and last legs of a certain length at most, and they are at least so steep.
fn with_legs(mut legs: [Leg<'_>; 2], least: f64) -> f64 {
    let most = least + legs[0].steepness(0.0) + legs[1].steepness(0.0);
    // Ranges of 2-D cost, each with what its routes cost at least.
    let mut total = |from: f64, to: f64| {
        let steepness: f64 = legs
            .iter_mut()
            .map(|leg| {
                let longest = leg.longest(to);
                leg.steepness(longest)
            })
            .sum();
        (from, to, from + steepness)
    };
    let mut ranges = vec![total(least, most)];
    for _ in 0..CUTS {
        let Some(worst) = (0..ranges.len()).min_by(|&i, &j| ranges[i].2.total_cmp(&ranges[j].2))
        else {
            break;
        };
        let (from, to, _) = ranges[worst];
        if to - from < 1e-3 * least {
            break;
        }
        let middle = 0.5 * (from + to);
        ranges[worst] = total(from, middle);
        ranges.push(total(middle, to));
    }
    // Routes of a 2-D cost beyond the last range cost that much anyway.
    ranges.iter().fold(most, |bound, range| bound.min(range.2))
}

/// The first leg of a route, or, seen backwards, its last.
struct Leg<'a> {
    from: Point2,
    to: Point2,
    /// Metres between its end and the middle of the band.
    height: f64,
    /// Of a metre between the waypoint and the middle of the band.
    weight: f64,
    prices: &'a Prices,
    walls: &'a [Wall],
    radii: &'a [Option<f64>],
    slack: f64,
    /// Lengths and costs, and whether every route with so long a leg costs so much.
    known: Vec<(f64, f64, bool)>,
    /// Heading and half width of the sector that was not dear enough last.
    failed: Option<(f64, f64)>,
    /// What is left of it; without any, nothing more is proven.
    effort: usize,
    /// What pulling one string takes of it.
    price: usize,
    stop: &'a dyn Fn() -> bool,
}

impl Leg<'_> {
    /// What a leg of `length` metres seen from above costs at least on top of its fuel seen from
    /// above, waypoint included: it climbs, or its waypoint is off the middle. Falls with `length`.
    fn steepness(&self, length: f64) -> f64 {
        let (w, weight) = (self.prices.fuel, self.weight);
        // Flown with the slope at which a metre of climb costs as much as one off the middle.
        let climbed = if weight < w {
            let share = weight / w;
            (length * share / (1.0 - share * share).sqrt()).min(self.height)
        } else {
            self.height
        };
        let slant = (length * length + climbed * climbed).sqrt();
        (w * (slant - length) + weight * (self.height - climbed)).max(0.0)
    }

    /// No route of a 2-D cost below `cost` has a longer leg, metres.
    fn longest(&mut self, cost: f64) -> f64 {
        let direct = (self.to - self.from).norm();
        let mut high = 0.5 * (cost / self.prices.fuel + direct);
        let mut low = 0.0;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.is_dear(middle, cost) {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }

    /// Whether every route with a leg of `length` or more is proven to cost `cost` or more.
    fn is_dear(&mut self, length: f64, cost: f64) -> bool {
        for &(known_length, known_cost, dear) in &self.known {
            if dear && known_length <= length && known_cost >= cost {
                return true;
            }
            if !dear && known_length >= length && known_cost <= cost {
                return false;
            }
        }
        let eighth = std::f64::consts::FRAC_PI_8;
        // What was too cheap before may be so again.
        let again = self.failed.is_some_and(|(heading, half)| {
            half * length <= 2.0 * FINEST * (self.to - self.from).norm()
                && !self.sector_is_dear(length, cost, heading, half)
        });
        let dear = !again
            && (0..8).all(|sector| {
                self.sector_is_dear(length, cost, 2.0 * eighth * f64::from(sector), eighth)
            });
        self.known.push((length, cost, dear));
        dear
    }

    /// As `is_dear`, of the legs whose heading is within `half` radians of `heading`.
    fn sector_is_dear(&mut self, length: f64, cost: f64, heading: f64, half: f64) -> bool {
        if self.effort < self.price || (self.stop)() {
            return false;
        }
        self.effort -= 1;
        let w = self.prices.fuel;
        let way = Vector2::new(libm::cos(heading), libm::sin(heading)) * length;
        let at = self.from + way;
        // No leg of the sector is further than this from the one in its middle, point by point.
        let spread = length * half;
        let rest = (self.to - at).norm();
        let needed = cost / w - length + spread;
        if rest >= needed || self.is_blocked(at, spread) {
            return true;
        }
        let needed = needed - self.prices.exposure * self.exposure(at, spread) / w;
        if rest >= needed {
            return true;
        }
        let direct = (self.to - self.from).norm();
        if spread <= COARSEST * direct {
            self.effort -= self.price.min(self.effort);
            if self.is_far(at, spread, needed) {
                return true;
            }
        }
        if spread <= FINEST * direct {
            self.failed = Some((heading, half));
            return false;
        }
        // The half that leads closer to the other end first: it decides more often.
        let mut sides = [-0.5, 0.5];
        if way.perp(&(self.to - self.from)) > 0.0 {
            sides.reverse();
        }
        sides
            .into_iter()
            .all(|side| self.sector_is_dear(length, cost, heading + side * half, 0.5 * half))
    }

    /// The walls that count, and by how much they are widened.
    fn hard(&self) -> impl Iterator<Item = (&Wall, f64)> {
        let both = self.walls.iter().zip(self.radii);
        both.filter_map(|(wall, radius)| Some((wall, (*radius)?)))
    }

    /// Whether every leg to within `spread` of `at` enters a core.
    fn is_blocked(&self, at: Point2, spread: f64) -> bool {
        self.hard().any(|(wall, _)| match &wall.shape {
            OutlineShape::Disc(center) => {
                wall.core > spread && point_segment(*center, self.from, at) < wall.core - spread
            }
            OutlineShape::Ring(ring) => (1..=16).any(|i| {
                let point = self.from + (at - self.from) * (f64::from(i) / 16.0);
                ring::contains(ring, point)
                    && ring::distance(ring, point) > spread + 2.0 * self.prices.tolerance
            }),
        })
    }

    /// Least exposure of a leg to within `spread` of `at`, to discs.
    fn exposure(&self, at: Point2, spread: f64) -> f64 {
        let leg = Segment {
            a: self.from.coords.push(0.0).into(),
            b: at.coords.push(0.0).into(),
        };
        let discs = self.hard().filter_map(|(wall, _)| match wall.shape {
            OutlineShape::Disc(center) if wall.influence > spread => {
                let disc = Threat {
                    name: None,
                    shape: Shape::Cylinder(Cylinder {
                        center,
                        radius: 0.0,
                        influence: wall.influence - spread,
                    }),
                    base: None,
                    top: None,
                };
                Some(disc.encounter(&leg).exposure)
            }
            _ => None,
        });
        discs.sum()
    }

    /// Whether no route from within `spread` of `at` to the other end is shorter than `needed` metres,
    /// `spread` and what its soft zones cost included.
    fn is_far(&self, at: Point2, spread: f64, needed: f64) -> bool {
        let outlines = self.walls.iter().zip(self.radii).map(|(wall, radius)| {
            let mut outline = wall.outline((*radius)?);
            outline.core = 0.0;
            // Free to move to the middle of the sector first.
            let distance = outline.distance(at) - spread;
            outline.radius = outline.radius.min(distance);
            (distance > 0.0).then_some(outline)
        });
        let scene = Obstacles::new(outlines, [at, self.to], None);
        let enough = needed + self.slack;
        shortest(&scene, (enough, self.stop)).0 >= enough
    }
}
