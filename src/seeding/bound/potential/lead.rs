//! First legs of routes, or, seen backwards, last ones, and their effect on the shape of a potential: it should rise
//! little where they are expensive, so that their cost beyond it counts.

use super::marching::Seed;
use super::mesh::Mesh;
use super::spacing::Spacing;
use crate::geometry::Point2;

/// The legs from one end. They are not part of any proof: their costs may be inaccurate.
pub(in super::super) struct Lead<'a> {
    /// How far from the end they are considered, metres seen from above.
    pub(in super::super) reach: f64,
    /// Cost of one to a place, waypoint included; infinite where none leads.
    pub(in super::super) cost: Box<dyn Fn(Point2) -> f64 + 'a>,
}

/// The legs from start and target; `None` where they cost nothing beyond their way.
pub(in super::super) type Leads<'a> = [Option<Lead<'a>>; 2];

/// Unrestricted legs.
pub(in super::super) const FREE: Leads<'static> = [None, None];

impl Lead<'_> {
    /// Where routes are after such legs from the node `end`: at any of the first `vertices` vertices of a `mesh` in
    /// whose triangles a metre costs `prices`, except those that only expensive routes reach.
    pub(super) fn seeds(
        &self,
        end: usize,
        (mesh, vertices): (&Mesh, usize),
        prices: &[[f64; 6]],
        spacing: &Spacing,
    ) -> Vec<Seed> {
        let from = mesh.nodes[end];
        let seed = |node: usize| {
            let (way, (triangle, which)) = (mesh.nodes[node] - from, *mesh.round(node).first()?);
            if way.norm() > self.reach || spacing.share(mesh.nodes[node]) < 1.0 {
                return None;
            }
            let cost = (self.cost)(mesh.nodes[node]);
            // Straight away from the end; what a steep leg saves by being longer is ignored.
            let slope = way.try_normalize(0.0).unwrap_or_default() * prices[triangle][which];
            cost.is_finite().then_some(Seed { node, cost, slope })
        };
        (0..vertices).filter_map(seed).collect()
    }
}
