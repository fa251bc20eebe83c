//! A mesh with the greatest allowed rise of its triangles, and potentials over it.

use super::lead::Leads;
use super::levels::Levels;
use super::marching::Seed;
use super::mesh::{Mesh, PARTS};
use super::slopes::steepness;
use super::spacing::Spacing;
use super::zones::Zones;
use super::{easing, marching};
use crate::geometry::Point2;

/// A triangle this many times as steep as its limits is subdivided.
const TOO_STEEP: f64 = 1.005;

/// A mesh with the greatest allowed rise of its triangles.
pub(super) struct Priced {
    pub(super) mesh: Mesh,
    /// In the nodes of each triangle, per metre.
    pub(super) limits: Vec<[f64; 6]>,
    /// The same, per metre: the part that is used.
    prices: Vec<[f64; 6]>,
    /// Where routes may be after first legs, and before last ones; empty where these cost nothing beyond their way.
    led: [Vec<Seed>; 2],
}

impl Priced {
    pub(super) fn over(
        vertices: &[Point2],
        zones: &Zones,
        spacing: &Spacing,
        leads: &Leads,
    ) -> Option<Self> {
        let mesh = Mesh::new(vertices, |corners| zones.leave_out(corners))?;
        let triangles = mesh.triangles.iter();
        let limits: Vec<[f64; 6]> = triangles
            .map(|triangle| zones.limits(&mesh.places(triangle)))
            .collect();
        let shares: Vec<f64> = mesh.nodes.iter().map(|at| spacing.share(*at)).collect();
        let triangles = mesh.triangles.iter().zip(&limits);
        let prices: Vec<[f64; 6]> = triangles
            .map(|(triangle, limits)| {
                let shares = triangle.of(&shares);
                std::array::from_fn(|node| limits[node] * shares[node])
            })
            .collect();
        let led = [0, 1].map(|end| {
            let over = (&mesh, vertices.len());
            let lead = leads[end].as_ref();
            lead.map_or_else(Vec::new, |lead| lead.seeds(end, over, &prices, spacing))
        });
        Some(Self {
            mesh,
            limits,
            prices,
            led,
        })
    }

    /// The approximate cost of the cheapest ways to each node from either end, and how much first and last legs add to
    /// a way to the other end. Ways begin with such legs, or as if they had paid what these add.
    pub(super) fn costs(&self) -> ([Vec<f64>; 2], [f64; 2]) {
        let free = self.march(&[0, 1].map(|end| self.about(end, 0.0)));
        if self.led.iter().all(Vec::is_empty) {
            return (free, [0.0; 2]);
        }
        let led = self.march(&self.led);
        let extras = [0, 1].map(|end| {
            let extra = led[end][1 - end] - free[end][1 - end];
            if extra.is_finite() {
                extra.max(0.0)
            } else {
                0.0
            }
        });
        let costs = [0, 1].map(|end| {
            let both = free[end].iter().zip(&led[end]);
            both.map(|(free, led)| led.min(free + extras[end]))
                .collect()
        });
        (costs, extras)
    }

    fn march(&self, seeds: &[Vec<Seed>; 2]) -> [Vec<f64>; 2] {
        marching::march(&self.mesh, &self.prices, seeds)
    }

    /// The approximate cost of the straight way from one node of a triangle to another.
    pub(super) fn straight(&self, triangle: usize, [one, other]: [usize; 2]) -> f64 {
        let (nodes, limits) = (&self.mesh.triangles[triangle].nodes, &self.limits[triangle]);
        let [from, to] = [one, other].map(|node| self.mesh.nodes[nodes[node]]);
        0.5 * (limits[one] + limits[other]) * (to - from).norm()
    }

    /// The nodes at both ends of each side of the parts of triangles, and the approximate cost of the way between them.
    pub(super) fn sides(&self) -> impl Iterator<Item = ([usize; 2], f64)> {
        let sides = PARTS
            .iter()
            .flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        let triangles = self.mesh.triangles.iter().enumerate();
        triangles.flat_map(move |(idx, triangle)| {
            let side = move |side: [usize; 2]| {
                (
                    side.map(|node| triangle.nodes[node]),
                    self.straight(idx, side),
                )
            };
            sides.clone().map(side)
        })
    }

    fn about(&self, end: usize, cost: f64) -> Vec<Seed> {
        Seed::about(&self.mesh, &self.prices, end, cost)
    }

    /// A potential that exceeds the limits in few places only, for the `extras` of first and last legs.
    pub(super) fn potential(&self, extras: [f64; 2]) -> Vec<f64> {
        let [from, to] = self.march(&[0, 1].map(|end| {
            let mut seeds = self.led[end].clone();
            seeds.extend(self.about(end, extras[end]));
            seeds
        }));
        // Away from the cheapest way the two do not rise in the same direction, so their mean is less steep there.
        let mean = |(from, to): (&f64, &f64)| 0.5 * (from - to);
        let mut potential: Vec<f64> = from.iter().zip(&to).map(mean).collect();
        self.ease(&mut potential, easing::FEW);
        potential
    }

    /// Makes a potential less steep where it is too steep.
    pub(super) fn ease(&self, potential: &mut [f64], sweeps: usize) {
        easing::ease(&self.mesh, &self.limits, potential, (2, sweeps));
    }

    /// What a potential over it proves.
    pub(super) fn levels(&self, potential: &[f64]) -> Levels {
        Levels::new(&self.mesh, &self.limits, potential)
    }

    /// The middles of the sides of all triangles that are nevertheless too steep.
    pub(super) fn between(&self, potential: &[f64]) -> Vec<Point2> {
        let triangles = self.mesh.triangles.iter().zip(&self.limits);
        let steep = triangles.filter(|(triangle, limits)| {
            let values = triangle.of(potential);
            steepness(triangle, limits, &values) > TOO_STEEP
                && values.iter().any(|value| *value > potential[0])
                && values.iter().any(|value| *value < potential[1])
        });
        let mut nodes: Vec<usize> = steep
            .flat_map(|(triangle, _)| triangle.nodes[3..].to_vec())
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
            .into_iter()
            .map(|node| self.mesh.nodes[node])
            .collect()
    }
}
