//! Threats as a bound sees them: how far each may be widened for free, and which may be passed by
//! flying over or under them.

use super::super::arc::{nearest_points, point_segment, segment_segment};
use super::super::outline::{Outline, OutlineShape};
use super::prices::Prices;
use crate::geometry::{Point2, Vector2, ring};
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::{Shape, Threat};

/// A threat that reaches over all heights, or that costs a toll to pass above or below.
#[derive(Debug, Clone)]
pub(super) struct Wall {
    pub(super) shape: OutlineShape,
    /// Metres that no route comes nearer than; 0 of a ring.
    pub(super) core: f64,
    /// End of the soft zone, metres.
    pub(super) influence: f64,
    /// Widened by so much, it counts as hard for routes that do not dip below `dip` of it.
    pub(super) wide: f64,
    /// Below this distance to a disc's centre or a ring's corner the way round is so short that
    /// cutting the corner could pay; not above `core` where it never does.
    pub(super) dip: f64,
    /// Widened by so much, it counts as hard for every route.
    pub(super) safe: f64,
    /// Cost of a route that passes above or below, beyond fuel for the way seen from above; `None`
    /// when there is no room.
    pub(super) toll: Option<Toll>,
}

/// What it takes to pass a threat above or below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Toll {
    /// Part of F3 that a waypoint beyond the threat's height costs at least.
    pub(super) altitude: f64,
    /// Metres that are climbed and descended at least.
    pub(super) vertical: f64,
}

/// All walls of `scenario`.
pub(super) fn walls(scenario: &Scenario, prices: &Prices) -> Vec<Wall> {
    let heights = Heights::of(scenario);
    let wall = |threat: &Threat| Wall::new(threat, scenario, prices, &heights);
    let mut walls: Vec<Wall> = scenario.threats.iter().filter_map(wall).collect();
    let ends = prices.ends.map(|end| end.xy());
    let first = Around::of(&walls, ends, None, prices);
    let taken = first.as_ref().map(|first| first.wall);
    let around = [first, Around::of(&walls, [ends[1], ends[0]], taken, prices)];
    // Of each end, the way straight out of the wall around it.
    let out = [0, 1].map(|end| {
        let farthest = around[end].map(|around| walls[around.wall].out(ends[end], around.radius));
        (ends[end], farthest.unwrap_or(ends[end]))
    });
    for (idx, wall) in walls.iter_mut().enumerate() {
        let mut most = f64::INFINITY;
        for end in 0..2 {
            most = most.min(match around[end] {
                Some(around) if around.wall == idx => around.radius,
                _ => wall.distance_to_way(out[end]),
            });
        }
        wall.widen(prices, most);
    }
    for end in 0..2 {
        // What is too near to the other end's way out to be around this one.
        if let Some(around) = around[end]
            && !walls[around.wall].is_around(ends[end])
        {
            let nearest = walls[around.wall].distance(ends[end]);
            let wall = &mut walls[around.wall];
            let most = nearest.min(wall.wide);
            wall.widen(prices, most);
        }
    }
    walls
}

/// A wall that may be widened over an end.
#[derive(Debug, Clone, Copy)]
struct Around {
    wall: usize,
    /// By so much at most: straight out to there, no other wall is in the way.
    radius: f64,
}

impl Around {
    /// Of the walls that can be, the one in whose soft zone the first of `ends` is the deepest, but for the one that is
    /// `taken`.
    fn of(
        walls: &[Wall],
        ends: [Point2; 2],
        taken: Option<usize>,
        prices: &Prices,
    ) -> Option<Self> {
        let depth = |wall: usize| walls[wall].influence - walls[wall].distance(ends[0]);
        let can_be = |idx: &usize| {
            let wall = &walls[*idx];
            taken != Some(*idx) && wall.toll.is_none() && wall.is_convex() && depth(*idx) > 0.0
        };
        let mut candidates: Vec<usize> = (0..walls.len()).filter(can_be).collect();
        candidates.sort_by(|one, other| depth(*other).total_cmp(&depth(*one)));
        candidates.into_iter().find_map(|wall| {
            let within = walls[wall].distance(ends[0]);
            let mut widened = walls[wall].clone();
            let radii = [1.0, 0.75, 0.5, 0.25].map(|share| within + share * depth(wall));
            let is_possible = |radius: &f64| {
                let way = (ends[0], widened.out(ends[0], *radius));
                widened.widen(prices, radius.min(widened.distance(ends[1])));
                let mut others = walls.iter().enumerate().filter(|(other, _)| *other != wall);
                widened.is_around(ends[0])
                    && others.all(|(_, other)| other.distance_to_way(way) > other.core)
            };
            let radius = radii.into_iter().find(is_possible)?;
            Some(Self { wall, radius })
        })
    }
}

impl Wall {
    fn new(
        threat: &Threat,
        scenario: &Scenario,
        prices: &Prices,
        heights: &Heights,
    ) -> Option<Self> {
        let toll = heights.toll(threat, scenario);
        let slack = prices.tolerance;
        let (shape, core, influence) = match &threat.shape {
            Shape::Cylinder(cylinder) => (
                OutlineShape::Disc(cylinder.center),
                (cylinder.radius - slack).max(0.0),
                cylinder.influence,
            ),
            Shape::Polygon(polygon) => (
                OutlineShape::Ring(polygon.vertices().to_vec()),
                0.0,
                polygon.margin(),
            ),
        };
        let wall = Self {
            shape,
            core,
            influence,
            wide: 0.0,
            dip: 0.0,
            safe: 0.0,
            toll,
        };
        if let OutlineShape::Ring(ring) = &wall.shape
            && (wall.slack(slack) >= perimeter(ring) || is_thin(ring, 2.0 * slack))
        {
            // A route may cut through: no obstacle to speak of.
            return None;
        }
        Some(wall)
    }

    /// Widen it by `most` at most.
    fn widen(&mut self, prices: &Prices, most: f64) {
        // (w + s (I - r)) r is concave in r, so that its ends decide whether it is w R or more all
        // the way from the core to R.
        let (w, s, core, influence) = (prices.fuel, prices.exposure, self.core, self.influence);
        let reach = influence.min(most).max(core);
        let at_core = (w + s * (influence - core).max(0.0)) * core / w;
        self.safe = at_core.clamp(core, reach);
        self.wide = self.safe;
        self.dip = core;
        if self.safe < reach {
            // The smaller root of (w + s (I - r)) r = w R.
            let b = w + s * influence;
            let root = b * b - 4.0 * s * w * reach;
            if s > 0.0 && root > 0.0 {
                let dip = 2.0 * w * reach / (b + root.sqrt());
                let dip = dip * (1.0 + 1e-9);
                // The greater root must not lie below R either.
                if dip < reach && b + root.sqrt() >= 2.0 * s * reach * (1.0 - 1e-12) {
                    self.wide = reach;
                    self.dip = dip.max(core);
                }
            }
        }
    }

    /// Whether `point` lies in what is added to it by widening, where it is no dip.
    fn is_around(&self, point: Point2) -> bool {
        let away = self.distance(point);
        away > self.core && away >= self.dip && away < self.wide
    }

    /// Metres to its shape before it is widened, 0 within a ring: what its soft zone is measured by.
    pub(super) fn distance(&self, point: Point2) -> f64 {
        self.shape.distance(point)
    }

    /// Of a straight way to its shape.
    fn distance_to_way(&self, (a, b): (Point2, Point2)) -> f64 {
        match &self.shape {
            OutlineShape::Disc(center) => point_segment(*center, a, b),
            OutlineShape::Ring(ring) if ring::contains(ring, a) => 0.0,
            OutlineShape::Ring(ring) => ring::edges(ring)
                .map(|edge| segment_segment(edge, (a, b)))
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// The place as far from its shape as `radius`, straight out by `point`, which lies outside of the shape.
    pub(super) fn out(&self, point: Point2, radius: f64) -> Point2 {
        let nearest = match &self.shape {
            OutlineShape::Disc(center) => *center,
            OutlineShape::Ring(ring) => ring::edges(ring)
                .map(|edge| nearest_points(edge, (point, point)).0)
                .min_by(|one, other| (one - point).norm().total_cmp(&(other - point).norm()))
                .unwrap_or(point),
        };
        nearest + (point - nearest).normalize() * radius
    }

    /// How many a ring has.
    pub(super) fn corners(&self) -> usize {
        match &self.shape {
            OutlineShape::Disc(_) => 0,
            OutlineShape::Ring(ring) => ring.len(),
        }
    }

    /// A circle round its shape.
    pub(super) fn circle(&self) -> (Point2, f64) {
        let centers = self.centers();
        let sum: Vector2 = centers.iter().map(|center| center.coords).sum();
        let middle = Point2::from(sum / centers.len() as f64);
        let away = centers.iter().map(|center| (center - middle).norm());
        (middle, away.fold(0.0, f64::max))
    }

    /// Whether the distance to its shape is convex.
    pub(super) fn is_convex(&self) -> bool {
        match &self.shape {
            OutlineShape::Disc(_) => true,
            OutlineShape::Ring(ring) => ring::is_convex(ring),
        }
    }

    /// The wall widened by `radius`.
    pub(super) fn outline(&self, radius: f64) -> Outline {
        Outline {
            shape: self.shape.clone(),
            radius,
            core: self.core,
        }
    }

    /// Centres of the circles that bound the widened wall: of a disc its own, of a ring those of
    /// its corners.
    pub(super) fn centers(&self) -> &[Point2] {
        match &self.shape {
            OutlineShape::Disc(center) => std::slice::from_ref(center),
            OutlineShape::Ring(ring) => ring,
        }
    }

    /// Metres by which a string may be shorter since a route may enter by the tolerance: of a disc
    /// it is in the core already; of a ring, twice the way into each of its corners.
    pub(super) fn slack(&self, tolerance: f64) -> f64 {
        let OutlineShape::Ring(ring) = &self.shape else {
            return 0.0;
        };
        let count = ring.len();
        (0..count)
            .map(|i| {
                let (before, at, after) = (
                    ring[(i + count - 1) % count],
                    ring[i],
                    ring[(i + 1) % count],
                );
                let (one, other) = ((before - at).normalize(), (after - at).normalize());
                // sin of half the angle between the edges.
                let half = 0.5 * (one - other).norm();
                2.0 * tolerance / half
            })
            .sum()
    }
}

/// Whether two edges of `ring` that have no corner in common come within `least` metres of each other.
fn is_thin(ring: &[Point2], least: f64) -> bool {
    let count = ring.len();
    let low = |edge: &(usize, Point2, Point2)| edge.1.x.min(edge.2.x);
    let mut edges: Vec<_> = (0..count)
        .map(|i| (i, ring[i], ring[(i + 1) % count]))
        .collect();
    edges.sort_by(|one, other| low(one).total_cmp(&low(other)));
    edges.iter().enumerate().any(|(at, one)| {
        let (highest_x, y) = (one.1.x.max(one.2.x), [one.1.y, one.2.y]);
        let after = edges[at + 1..].iter();
        after
            .take_while(|other| low(other) <= highest_x + least)
            .filter(|other| {
                other.1.y.min(other.2.y) <= y[0].max(y[1]) + least
                    && other.1.y.max(other.2.y) >= y[0].min(y[1]) - least
            })
            .filter(|other| (one.0 + 1) % count != other.0 && (other.0 + 1) % count != one.0)
            .any(|other| {
                let (p, q) = nearest_points((one.1, one.2), (other.1, other.2));
                (q - p).norm() <= least
            })
    })
}

fn perimeter(ring: &[Point2]) -> f64 {
    let count = ring.len();
    (0..count)
        .map(|i| (ring[(i + 1) % count] - ring[i]).norm())
        .sum()
}

/// The heights in the frame that a route can reach.
struct Heights {
    floor: f64,
    ceiling: f64,
    /// Elevation of the ground where it is level.
    level: Option<f64>,
}

impl Heights {
    fn of(scenario: &Scenario) -> Self {
        let (low, high, level) = match &scenario.terrain {
            Terrain::Flat(flat) => (flat.elevation, flat.elevation, Some(flat.elevation)),
            Terrain::Peaks(peaks) => {
                let sum = |part: fn(f64) -> f64| -> f64 {
                    peaks.peaks.iter().map(|peak| part(peak.height)).sum()
                };
                (
                    peaks.base + sum(|height| height.min(0.0)),
                    peaks.base + sum(|height| height.max(0.0)),
                    None,
                )
            }
            Terrain::Grid(grid) => {
                let nodes = grid.elevations.iter().copied();
                (
                    nodes.clone().fold(f64::INFINITY, f64::min),
                    nodes.fold(f64::NEG_INFINITY, f64::max),
                    None,
                )
            }
            Terrain::Dem(dem) => {
                let [low, high] = dem.elevations();
                (low, high, None)
            }
        };
        let band = scenario.altitude;
        let ends = [scenario.start, scenario.target]
            .map(|end| end.z - scenario.terrain.elevation(end.xy()));
        // Outside the terminal zones, a route keeps to the band; there are none where both ends do.
        let within = ends.iter().all(|h| (band.min..=band.max).contains(h));
        let lowest = ends.iter().fold(band.min, |low, h| low.min(*h));
        let floor = if within { band.min } else { lowest.min(0.0) };
        let ceiling = ends.iter().fold(band.max, |high, h| high.max(*h));
        let hair = 1e-3 + 1e-9 * (high.abs() + low.abs() + ceiling.abs());
        Self {
            floor: low + floor - hair,
            ceiling: high + ceiling + hair,
            level,
        }
    }

    /// What it takes to pass `threat` above or below; `None` when there is no room.
    fn toll(&self, threat: &Threat, scenario: &Scenario) -> Option<Toll> {
        let (start, target) = (scenario.start.z, scenario.target.z);
        let weight = scenario.weights.altitude;
        let middle = 0.5 * (scenario.altitude.min + scenario.altitude.max);
        // Legs are straight: a route beyond a height has a waypoint beyond it.
        let toll = |beyond: f64, ends_beyond: bool, up: f64| {
            let nothing = Toll {
                altitude: 0.0,
                vertical: 0.0,
            };
            let Some(level) = self.level.filter(|_| !ends_beyond) else {
                return nothing;
            };
            Toll {
                altitude: weight * (up * (beyond - level - middle)).max(0.0),
                vertical: (beyond - start).abs() + (beyond - target).abs(),
            }
        };
        let over = threat.top.filter(|top| *top <= self.ceiling);
        let over = over.map(|top| toll(top, start >= top || target >= top, 1.0));
        let under = threat.base.filter(|base| *base > self.floor);
        let under = under.map(|base| toll(base, start < base || target < base, -1.0));
        match (over, under) {
            (Some(over), Some(under)) => Some(Toll {
                altitude: over.altitude.min(under.altitude),
                vertical: over.vertical.min(under.vertical),
            }),
            (over, under) => over.or(under),
        }
    }
}
