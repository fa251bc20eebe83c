//! What a potential proves: of all routes, and of those that pass some place.

use super::cells::Cells;
use super::levels::Levels;
use super::mesh::{Mesh, SIDES, Triangle};
use super::slopes::{gradients, range};
use crate::geometry::{Point2, Rect, Vector2};

/// Cells in which triangles are looked up.
const CELLS: usize = 2000;

/// Share of its terms by which a sum may be off, and more.
const ROUNDING: f64 = 1e-9;

/// A potential that is nowhere steeper than what a metre costs.
pub(in super::super) struct Proof {
    mesh: Mesh,
    potential: Vec<f64>,
    levels: Levels,
    /// What a route costs at least that leaves the mesh.
    cap: f64,
    /// Where the mesh has its origin.
    origin: Vector2,
    cells: Cells,
    /// Of each cell, the triangles that come into it.
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

    /// What no route undercuts seen from above.
    pub(in super::super) fn total(&self) -> f64 {
        self.levels.total().min(self.cap)
    }

    /// What no route undercuts seen from above that costs so much more than the potential rises by.
    pub(in super::super) fn with(&self, excess: f64) -> f64 {
        (self.levels.total() + excess).min(self.cap)
    }

    /// Make it known where triangles are.
    pub(in super::super) fn look_up(&mut self) {
        self.near = vec![Vec::new(); self.cells.count()];
        for (idx, triangle) in self.mesh.triangles.iter().enumerate() {
            let [a, b, c, ..] = self.mesh.places(triangle);
            for cell in self.cells.round([a, b, c]) {
                self.near[cell].push(idx);
            }
        }
    }

    /// By how much the potential rises at most on the way from the start to any place within `spread` of `at` where a
    /// route can be, or, for the other `end`, from there to the target; `None` where there is no such place.
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

    /// The least and the most that the potential takes in those parts of `triangle` that are within `spread` of `at`, or
    /// beyond; `None` where it has none, or nothing leads to it.
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
        // Taylor's series about `at`, which ends with the second derivatives.
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
