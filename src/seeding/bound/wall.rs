//! Threats as a bound sees them: how far each may be widened for free, and which may be passed by
//! flying over or under them.

use super::super::arc::nearest_points;
use super::super::outline::{Outline, OutlineShape};
use super::prices::Prices;
use crate::geometry::Point2;
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
    scenario.threats.iter().filter_map(wall).collect()
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
        let mut wall = Self {
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
        let outline = wall.outline(0.0);
        let nearest = [scenario.start, scenario.target]
            .map(|end| outline.distance(end.xy()))
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        // (w + s (I - r)) r is concave in r, so that its ends decide whether it is w R or more all
        // the way from the core to R.
        let (w, s) = (prices.fuel, prices.exposure);
        let reach = influence.min(nearest).max(core);
        let at_core = (w + s * (influence - core).max(0.0)) * core / w;
        wall.safe = at_core.clamp(core, reach);
        wall.wide = wall.safe;
        wall.dip = core;
        if wall.safe < reach {
            // The smaller root of (w + s (I - r)) r = w R.
            let b = w + s * influence;
            let root = b * b - 4.0 * s * w * reach;
            if s > 0.0 && root > 0.0 {
                let dip = 2.0 * w * reach / (b + root.sqrt());
                let dip = dip * (1.0 + 1e-9);
                // The greater root must not lie below R either.
                if dip < reach && b + root.sqrt() >= 2.0 * s * reach * (1.0 - 1e-12) {
                    wall.wide = reach;
                    wall.dip = dip.max(core);
                }
            }
        }
        Some(wall)
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
