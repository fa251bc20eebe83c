//! Where routes can lead that cost less than some price, by two potentials that are marched towards each other.

use super::super::prices::Prices;
use super::Marched;
use super::marching::EXEMPT;
use super::mesh::Mesh;

/// The cost below which there are `count` triangles.
pub(super) fn within(sums: &[f64], count: usize) -> f64 {
    let mut sums: Vec<f64> = sums.iter().copied().filter(|sum| sum.is_finite()).collect();
    if sums.len() <= count {
        return f64::INFINITY;
    }
    *sums.select_nth_unstable_by(count, f64::total_cmp).1
}

/// What a route costs at least that comes into each triangle, infinite outside the mesh.
pub(super) fn sums(mesh: &Mesh, one: &Marched, other: &Marched, prices: &Prices) -> Vec<f64> {
    let ends = prices.ends.map(|end| end.xy());
    let near = (EXEMPT + 1.0) * mesh.side;
    let mut sums = vec![f64::INFINITY; mesh.limits.len()];
    for triangle in mesh.triangles() {
        let middle = mesh.middle(triangle);
        sums[triangle] = if ends.iter().any(|end| (middle - end).norm() < near) {
            0.0
        } else {
            let lowest = lowest_sum(
                mesh,
                triangle,
                &one.potential.values,
                &other.potential.values,
            );
            lowest - one.lost - other.lost
        };
    }
    sums
}

/// The least in `triangle` of the means over cells of two potentials.
fn lowest_sum(mesh: &Mesh, triangle: usize, one: &[f64], other: &[f64]) -> f64 {
    let corners = mesh.corners(triangle);
    let sum = corners
        .iter()
        .map(|corner| one[*corner] + other[*corner])
        .fold(f64::INFINITY, f64::min);
    sum + dip(mesh, corners, one) + dip(mesh, corners, other)
}

/// How far the vertices round a triangle lie below the plane through its corners, at most: a mean
/// over a cell weighs the values round it so that a plane gives itself.
fn dip(mesh: &Mesh, [at, one, other]: [usize; 3], values: &[f64]) -> f64 {
    const ROUND: [[i32; 2]; 9] = [
        [-1, 0],
        [-1, 1],
        [0, -1],
        [1, -1],
        [2, -1],
        [2, 0],
        [1, 1],
        [0, 2],
        [-1, 2],
    ];
    let (start, along, across) = (
        values[at],
        values[one] - values[at],
        values[other] - values[at],
    );
    if !start.is_finite() {
        return 0.0;
    }
    let turned = if one > at { 1 } else { -1 };
    let [column, row] = mesh.place(at);
    ROUND
        .iter()
        .map(|[i, j]| {
            let value = values[mesh.vertex([column + turned * i, row + turned * j])];
            value - (start + f64::from(*i) * along + f64::from(*j) * across)
        })
        .fold(0.0, f64::min)
}

/// The triangles that a route cheaper than `cap` can come into, and those that touch them; and what
/// a route costs at least that comes into another one.
pub(super) fn widened(mesh: &Mesh, sums: &[f64], cap: f64) -> (Vec<bool>, f64) {
    let mut is_near = vec![false; mesh.columns * mesh.rows];
    let mut beyond = f64::INFINITY;
    for triangle in mesh.triangles() {
        if sums[triangle] < cap {
            for corner in mesh.corners(triangle) {
                is_near[corner] = true;
            }
        } else {
            beyond = beyond.min(sums[triangle]);
        }
    }
    let mut kept = vec![false; mesh.limits.len()];
    for vertex in (0..is_near.len()).filter(|vertex| is_near[*vertex]) {
        for (triangle, _) in mesh.round(vertex) {
            kept[triangle] = true;
        }
    }
    (kept, beyond)
}
