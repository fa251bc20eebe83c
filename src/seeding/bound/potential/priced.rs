//! A mesh with what its triangles may rise by, and potentials over it.

use super::mesh::{Mesh, PARTS};
use super::slopes::steepness;
use super::spacing::Spacing;
use super::zones::Zones;
use super::{easing, marching};
use crate::geometry::Point2;

/// How many times as steep as its limits a triangle is that is cut up.
const TOO_STEEP: f64 = 1.01;

/// A mesh with what its triangles may rise by.
pub(super) struct Priced {
    pub(super) mesh: Mesh,
    /// In the nodes of each triangle, a metre.
    pub(super) limits: Vec<[f64; 6]>,
    /// In the parts of each triangle, a metre: what is made use of.
    prices: Vec<[f64; 4]>,
}

impl Priced {
    pub(super) fn over(vertices: &[Point2], zones: &Zones, spacing: &Spacing) -> Option<Self> {
        let mesh = Mesh::new(vertices, |corners| zones.leave_out(corners))?;
        let triangles = mesh.triangles.iter();
        let limits: Vec<[f64; 6]> = triangles
            .map(|triangle| zones.limits(&mesh.places(triangle)))
            .collect();
        let shares: Vec<f64> = mesh.nodes.iter().map(|at| spacing.share(*at)).collect();
        let of_part = |nodes: &[usize; 6], limits: &[f64; 6], part: [usize; 3]| {
            let prices = part.map(|node| limits[node] * shares[nodes[node]]);
            prices.iter().sum::<f64>() / 3.0
        };
        let triangles = mesh.triangles.iter().zip(&limits);
        let prices = triangles
            .map(|(triangle, limits)| PARTS.map(|part| of_part(&triangle.nodes, limits, part)))
            .collect();
        Some(Self {
            mesh,
            limits,
            prices,
        })
    }

    /// What the cheapest ways to each node cost from either end, about.
    pub(super) fn costs(&self) -> [Vec<f64>; 2] {
        marching::march(&self.mesh, &self.prices)
    }

    /// A potential that is hardly anywhere steeper than the limits.
    pub(super) fn potential(&self) -> Vec<f64> {
        let [from, to] = self.costs();
        // Away from the cheapest way the two do not rise in the same direction: their mean is less steep there.
        let mean = |(from, to): (&f64, &f64)| 0.5 * (from - to);
        let mut potential: Vec<f64> = from.iter().zip(&to).map(mean).collect();
        easing::ease(&self.mesh, &self.limits, &mut potential, 2);
        potential
    }

    /// The middles of the sides of all triangles that are too steep nevertheless.
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
