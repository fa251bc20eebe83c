//! Linear equations for a step of all free waypoints at once.

use super::Place;
use super::banded::Banded;

/// Linear equations for a step of all free waypoints.
pub(super) struct Equations {
    free: usize,
    /// Second derivatives of the merit.
    pub(super) matrix: Banded,
    /// Negative first derivatives.
    pub(super) down: Vec<f64>,
    /// How strongly each coordinate's cost bends, with all bends counted as positive.
    stiffness: Vec<f64>,
}

impl Equations {
    pub(super) fn new(free: usize) -> Self {
        Self {
            free,
            matrix: Banded::zero(3 * free),
            down: vec![0.0; 3 * free],
            stiffness: vec![0.0; 3 * free],
        }
    }

    /// The index of the unknown for coordinate `idx` counted from waypoint `first` on; `None` for start and target.
    fn unknown(&self, first: usize, idx: usize) -> Option<usize> {
        let at = first + idx / 3;
        (at >= 1 && at <= self.free).then(|| 3 * (at - 1) + idx % 3)
    }

    /// Add a figure that depends on waypoints from `first` on, by its derivatives.
    pub(super) fn add<const SIZE: usize>(
        &mut self,
        first: usize,
        gradient: &[f64; SIZE],
        curvature: &[[f64; SIZE]; SIZE],
    ) {
        for i in 0..SIZE {
            let Some(row) = self.unknown(first, i) else {
                continue;
            };
            self.down[row] -= gradient[i];
            self.stiffness[row] += curvature[i][i].abs();
            for (j, value) in curvature[i].iter().enumerate() {
                if let Some(column) = self.unknown(first, j) {
                    self.matrix.add(row, column, *value);
                }
            }
        }
    }

    /// Add a penalty by the `gradient` of its quantity: a `force` that grows by `rate` a metre.
    pub(super) fn press<const SIZE: usize>(
        &mut self,
        first: usize,
        gradient: &[f64; SIZE],
        force: f64,
        rate: f64,
    ) {
        let push = gradient.map(|slope| force * slope);
        let stiff = gradient.map(|one| gradient.map(|other| rate * one * other));
        self.add(first, &push, &stiff);
    }

    /// The step that is damped in proportion to the stiffness of each unknown, `soft` more, and what is expected to be gained
    /// by it; `None` where that is not enough for the matrix to be positive.
    pub(super) fn damped(&self, damping: f64, soft: f64) -> Option<(Vec<f64>, f64)> {
        let shifts = || self.stiffness.iter().map(|stiff| damping * (stiff + soft));
        let step = self.matrix.solve(shifts(), &self.down)?;
        let parts = step.iter().zip(&self.down).zip(shifts());
        let expected = parts
            .map(|((step, down), shift)| 0.5 * step * (shift * step + down))
            .sum();
        Some((step, expected))
    }

    /// Ask for a quantity to decrease by this amount.
    pub(super) fn bring_back<const SIZE: usize>(
        &mut self,
        first: usize,
        gradient: &[f64; SIZE],
        by: f64,
    ) {
        self.press(first, gradient, by, 1.0);
    }
}

/// Move all free `places` by `step`.
pub(super) fn advance(places: &mut [Place], step: &[f64]) {
    let last = places.len() - 1;
    for (place, step) in places[1..last].iter_mut().zip(step.chunks(3)) {
        for (axis, step) in step.iter().enumerate() {
            place.at[axis] += step;
        }
    }
}
