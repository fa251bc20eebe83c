//! First legs of routes, or, seen backwards, last ones, as they shape a potential: it is to rise by little where they are
//! dear, so that what they cost beyond it counts.

use super::marching::Seed;
use super::mesh::Mesh;
use super::spacing::Spacing;
use crate::geometry::Point2;

/// The legs from one end. They are no part of any proof: what they cost may be off.
pub(in super::super) struct Lead<'a> {
    /// How far from the end they are looked at, metres seen from above.
    pub(in super::super) reach: f64,
    /// What one to a place costs, waypoint included; infinite where none leads.
    pub(in super::super) cost: Box<dyn Fn(Point2) -> f64 + 'a>,
}

/// Those from start and target; `None` where they cost nothing beyond their way.
pub(in super::super) type Leads<'a> = [Option<Lead<'a>>; 2];

/// Legs that may be as they like.
pub(in super::super) const FREE: Leads<'static> = [None, None];

impl Lead<'_> {
    /// Where routes are after such legs from the node `end`: at any of the first so many `vertices` of a `mesh` in whose
    /// triangles a metre costs `prices`, but for those that only dear routes come to.
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
            // Straight away from the end; what a steep leg saves by being longer is left out.
            let slope = way.try_normalize(0.0).unwrap_or_default() * prices[triangle][which];
            cost.is_finite().then_some(Seed { node, cost, slope })
        };
        (0..vertices).filter_map(seed).collect()
    }
}
