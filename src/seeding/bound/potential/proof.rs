//! What a potential proves: about all routes, and about those that pass some place.

use super::cells::Cells;
use super::levels::Levels;
use super::mesh::{Mesh, SIDES, Triangle};
use super::slopes::{gradients, range};
use crate::geometry::{Point2, Rect, Vector2};

/// Number of cells in which triangles are looked up.
const CELLS: usize = 2000;

/// Upper bound of the rounding error of a sum, as a share of its terms.
const ROUNDING: f64 = 1e-9;

/// A potential that is nowhere steeper than the cost of a metre.
pub(in super::super) struct Proof {
    mesh: Mesh,
    potential: Vec<f64>,
    levels: Levels,
    /// Lower bound of the cost of a route that leaves the mesh.
    cap: f64,
    /// Origin of the mesh.
    origin: Vector2,
    cells: Cells,
    /// For each cell, the triangles that overlap it.
    near: Vec<Vec<usize>>,
}

impl Proof {
    pub(super) fn new(
        (mesh, potential, levels): (Mesh, Vec<f64>, Levels),
        cap: f64,
        (origin, rect): (Vector2, Rect),
    ) -> Self {
        Self {
            mesh,
            potential,
            levels,
            cap,
            origin,
            cells: Cells::about(rect, CELLS),
            near: Vec::new(),
        }
    }

    /// A lower bound for all routes, seen from above.
    pub(in super::super) fn total(&self) -> f64 {
        self.levels.total().min(self.cap)
    }

    /// A lower bound, seen from above, for routes that cost `excess` more than the rise of the potential.
    pub(in super::super) fn with(&self, excess: f64) -> f64 {
        (self.levels.total() + excess).min(self.cap)
    }

    /// Build the index of triangles by place.
    pub(in super::super) fn look_up(&mut self) {
        self.near = vec![Vec::new(); self.cells.count()];
        for (idx, triangle) in self.mesh.triangles.iter().enumerate() {
            let [a, b, c, ..] = self.mesh.places(triangle);
            for cell in self.cells.round([a, b, c]) {
                self.near[cell].push(idx);
            }
        }
    }

    /// The greatest rise of the potential on the way from the start to any place within `spread` of `at` where a route
    /// can be, or, for the other `end`, from there to the target; `None` where there is no such place.
    pub(in super::super) fn rise(&self, end: usize, at: Point2, spread: f64) -> Option<f64> {
        let at = at - self.origin;
        let cells = self.cells.within(at, spread);
        let ranges = cells
            .flat_map(|cell| &self.near[cell])
            .filter_map(|triangle| self.around(&self.mesh.triangles[*triangle], at, spread));
        if end == 0 {
            let highest = ranges.map(|[_, highest]| highest).reduce(f64::max);
            highest.map(|highest| self.levels.at(highest))
        } else {
            let lowest = ranges.map(|[lowest, _]| lowest).reduce(f64::min);
            lowest.map(|lowest| self.levels.total() - self.levels.at(lowest))
        }
    }

    /// Bounds of the least and the greatest value of the potential in the parts of `triangle` within `spread` of `at`;
    /// `None` where there are no such parts, or nothing leads there.
    fn around(&self, triangle: &Triangle, at: Point2, spread: f64) -> Option<[f64; 2]> {
        let values = triangle.of(&self.potential);
        let corners = self.mesh.places(triangle);
        let mut shares = [0.0; 3];
        for (corner, share) in shares.iter_mut().enumerate() {
            let (rate, way) = (&triangle.rates[corner], at - corners[corner]);
            *share = 1.0 + rate.dot(&way);
            let rounding = ROUNDING * (1.0 + rate.norm() * way.norm());
            if *share < -spread * rate.norm() - rounding {
                return None;
            }
        }
        let [least, most] = range(&values);
        if !least.is_finite() {
            return None;
        }
        // Taylor series about `at`, which ends with the second derivatives.
        let mut terms = [0.0; 6];
        for corner in 0..3 {
            terms[corner] = values[corner] * shares[corner] * (2.0 * shares[corner] - 1.0);
        }
        for (middle, [one, other]) in (3..).zip(SIDES) {
            terms[middle] = 4.0 * values[middle] * shares[one] * shares[other];
        }
        let value: f64 = terms.iter().sum();
        let size: f64 = terms.iter().map(|term| term.abs()).sum();
        let gradients = gradients(triangle, &values);
        let corners = || gradients.iter().zip(&triangle.rates).zip(shares);
        let slope: Vector2 = corners()
            .map(|((gradient, _), share)| gradient * share)
            .sum();
        let bend: nalgebra::Matrix2<f64> = corners()
            .map(|((gradient, rate), _)| gradient * rate.transpose())
            .sum();
        let change = spread * (slope.norm() + 0.5 * spread * bend.norm());
        let change = change + ROUNDING * (size + change);
        if change.is_nan() {
            return Some([least, most]);
        }
        Some([least.max(value - change), most.min(value + change)])
    }
}
