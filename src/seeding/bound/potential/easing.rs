//! Reduces slopes that are too steep: in the few places where the values left by a march are too steep for a quadratic,
//! the excess is shared with neighbouring places.

use super::mesh::Mesh;
use super::slopes::{gradients, response};

/// Maximum number of sweeps when checking whether a mesh is fine enough.
pub(super) const FEW: usize = 20;

/// Maximum number of sweeps for the final mesh.
pub(super) const MANY: usize = 40;

/// Multiple of the allowed steepness that is good enough.
const ENOUGH: f64 = 1.002;

/// Share of a Newton step that is taken, because the neighbouring nodes move too.
const TAKEN: f64 = 0.8;

/// How far beyond good enough a place that is too steep is eased, so that it need not be eased again.
const BEYOND: f64 = 0.999;

/// Change `values`, except those of the first `fixed` nodes, so that triangles are no steeper than their `limits`, as
/// far as possible in this many sweeps: by Newton's method for each node alone, on the squares of the excess.
pub(super) fn ease(
    mesh: &Mesh,
    limits: &[[f64; 6]],
    values: &mut [f64],
    (fixed, sweeps): (usize, usize),
) {
    // Squares of the allowed slopes.
    let squares: Vec<[f64; 6]> = limits
        .iter()
        .map(|limits| limits.map(|limit| limit * limit * (ENOUGH * ENOUGH)))
        .collect();
    let is_steep = |triangle: usize, values: &[f64]| {
        let of = &mesh.triangles[triangle];
        let gradients = gradients(of, &of.of(values));
        let mut each = gradients.iter().zip(&squares[triangle]);
        each.any(|(gradient, allowed)| gradient.norm_squared() > *allowed)
    };
    let mut asked: Vec<usize> = (0..mesh.triangles.len()).collect();
    // The sweep in which each was last visited.
    let mut met = (vec![0; values.len()], vec![0; mesh.triangles.len()]);
    for sweep in 1..=sweeps {
        asked.retain(|triangle| is_steep(*triangle, values));
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
            values[node] -= TAKEN * excess(mesh, &squares, values, node);
            for &(triangle, _) in mesh.round(node) {
                if std::mem::replace(&mut met.1[triangle], sweep) != sweep {
                    next.push(triangle);
                }
            }
        }
        asked = next;
    }
}

/// How much too high the value of `node` is for the slopes around it, according to one step of Newton's method.
fn excess(mesh: &Mesh, squares: &[[f64; 6]], values: &[f64], node: usize) -> f64 {
    let (mut slope, mut curvature) = (0.0, 0.0);
    for &(triangle, which) in mesh.round(node) {
        let of = &mesh.triangles[triangle];
        let gradients = gradients(of, &of.of(values));
        let allowed = squares[triangle].map(|square| square * BEYOND);
        let is_too_steep = |at: usize| gradients[at].norm_squared() > allowed[at];
        if !(0..6).any(is_too_steep) {
            continue;
        }
        let response = response(of, which);
        for at in (0..6).filter(|at| is_too_steep(*at)) {
            // Half the square of c, where c is how much the square of a slope exceeds the allowed one.
            let too_much = gradients[at].norm_squared() / allowed[at] - 1.0;
            let change = 2.0 * gradients[at].dot(&response[at]) / allowed[at];
            slope += too_much * change;
            curvature +=
                change * change + too_much * 2.0 * response[at].norm_squared() / allowed[at];
        }
    }
    // Neither can be determined for triangles that are too slim.
    let excess = slope / curvature;
    if excess.is_finite() { excess } else { 0.0 }
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
