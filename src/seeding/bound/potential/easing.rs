//! Reduces slopes that are too steep: in the few places where the values left by a march are too steep for a quadratic,
//! the excess is shared with neighbouring places.

use super::mesh::{Mesh, Triangle};
use super::slopes::{in_corners, response, with_middles};
use crate::geometry::Vector2;

/// Maximum number of sweeps when checking whether a mesh is fine enough.
pub(super) const FEW: usize = 20;

/// Maximum number of sweeps for the final mesh.
pub(super) const MANY: usize = 40;

/// Multiple of the allowed steepness that is good enough.
const ENOUGH: f64 = 1.002;

/// Share of a Newton step that is taken, because the neighbouring nodes move too.
const TAKEN: f64 = 0.8;

/// Square of the multiple that a place that is too steep is eased to: a little beyond good enough, so that it need not be
/// eased again.
const AIMED: f64 = 0.999 * ENOUGH * ENOUGH;

/// Change `values`, except those of the first `fixed` nodes, so that triangles are no steeper than their `limits`, as
/// far as possible in this many sweeps: by Newton's method for each node alone, on the squares of the excess.
pub(super) fn ease(
    mesh: &Mesh,
    limits: &[[f64; 6]],
    values: &mut [f64],
    (fixed, sweeps): (usize, usize),
) {
    let triangles = mesh.triangles.iter().zip(limits);
    let mut slopes: Vec<Slope> = triangles
        .map(|(triangle, limits)| Slope::of(triangle, limits, values))
        .collect();
    let mut asked: Vec<usize> = (0..mesh.triangles.len()).collect();
    // The sweep in which each was last visited.
    let mut met = (vec![0; values.len()], vec![0; mesh.triangles.len()]);
    for sweep in 1..=sweeps {
        asked.retain(|triangle| slopes[*triangle].is_steep());
        if asked.is_empty() {
            return;
        }
        let mut next = Vec::new();
        for node in asked
            .iter()
            .flat_map(|triangle| mesh.triangles[*triangle].nodes)
        {
            if node < fixed || std::mem::replace(&mut met.0[node], sweep) == sweep {
                continue;
            }
            let change = -TAKEN * excess(mesh, &slopes, node);
            if change == 0.0 {
                continue;
            }
            values[node] += change;
            for &(triangle, which) in mesh.round(node) {
                slopes[triangle].follow(which, change);
                if std::mem::replace(&mut met.1[triangle], sweep) != sweep {
                    next.push(triangle);
                }
            }
        }
        asked = next;
    }
}

/// How much too high the value of `node` is for the slopes around it, according to one step of Newton's method.
fn excess(mesh: &Mesh, slopes: &[Slope], node: usize) -> f64 {
    let (mut slope, mut curvature) = (0.0, 0.0);
    for &(triangle, which) in mesh.round(node) {
        let of = &slopes[triangle];
        let gradients = with_middles(of.corners);
        let shares = of.shares(&gradients);
        if !shares.iter().any(|share| *share > 1.0) {
            continue;
        }
        let response = with_middles(response(&of.rates, which));
        for at in (0..6).filter(|at| shares[*at] > 1.0) {
            // Half the square of c, where c is how much the square of a slope exceeds the allowed one.
            let too_much = shares[at] - 1.0;
            let change = 2.0 * gradients[at].dot(&response[at]) * of.inverses[at];
            slope += too_much * change;
            curvature +=
                change * change + too_much * 2.0 * response[at].norm_squared() * of.inverses[at];
        }
    }
    // Neither can be determined for triangles that are too slim.
    let excess = slope / curvature;
    if excess.is_finite() { excess } else { 0.0 }
}

/// The slopes of a triangle. They follow the values of its nodes, which takes less than to compute them anew for each of
/// the nodes around.
struct Slope {
    /// Gradients in the corners.
    corners: [Vector2; 3],
    rates: [Vector2; 3],
    /// For each node, one over the square of the slope that is aimed at.
    inverses: [f64; 6],
}

impl Slope {
    fn of(triangle: &Triangle, limits: &[f64; 6], values: &[f64]) -> Self {
        Self {
            corners: in_corners(triangle, &triangle.of(values)),
            rates: triangle.rates,
            inverses: limits.map(|limit| 1.0 / (limit * limit * AIMED)),
        }
    }

    /// The squares of its slopes, given its `gradients`, as multiples of what is aimed at.
    #[inline]
    fn shares(&self, gradients: &[Vector2; 6]) -> [f64; 6] {
        std::array::from_fn(|at| gradients[at].norm_squared() * self.inverses[at])
    }

    fn is_steep(&self) -> bool {
        let shares = self.shares(&with_middles(self.corners));
        shares.iter().any(|share| *share > ENOUGH * ENOUGH / AIMED)
    }

    /// The value of a node has changed by so much.
    #[inline]
    fn follow(&mut self, which: usize, change: f64) {
        let response = response(&self.rates, which);
        for (corner, response) in self.corners.iter_mut().zip(response) {
            *corner += response * change;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::slopes::steepness;
    use super::*;
    use crate::geometry::Point2;

    #[test]
    fn a_spike_is_spread_over_its_surroundings() {
        let at = |i: u32, j: u32| Point2::new(f64::from(i), f64::from(j));
        let vertices: Vec<Point2> = (0..=10)
            .flat_map(|j| (0..=10).map(move |i| at(i, j)))
            .collect();
        let mesh = Mesh::new(&vertices, |_| false).expect("they are apart");
        let limits = vec![[1.0; 6]; mesh.triangles.len()];
        let mut values: Vec<f64> = mesh.nodes.iter().map(|node| 0.9 * node.x).collect();
        let spike = 60;
        values[spike] += 0.5;
        let steepest = |values: &[f64]| {
            let each = mesh.triangles.iter().zip(&limits);
            each.map(|(triangle, limits)| steepness(triangle, limits, &triangle.of(values)))
                .fold(0.0, f64::max)
        };
        let (before, first) = (steepest(&values), values[0]);
        ease(&mesh, &limits, &mut values, (2, MANY));
        let after = steepest(&values);
        assert!(before > 1.5 && after < 1.01, "{before} {after}");
        assert!((values[0] - first).abs() < f64::EPSILON);
    }
}
