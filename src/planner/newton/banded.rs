//! Systems of equations whose unknowns are coupled to near ones only.

/// Coupled unknowns are at most this far apart: three waypoints of three coordinates each.
const REACH: usize = 8;

/// A symmetric matrix, its lower half: of each row the entries up to the diagonal, which is the last.
#[derive(Clone)]
pub(super) struct Banded {
    rows: Vec<[f64; REACH + 1]>,
}

impl Banded {
    pub(super) fn zero(size: usize) -> Self {
        Self {
            rows: vec![[0.0; REACH + 1]; size],
        }
    }

    /// Add `value` at row `i` and column `j`; above the diagonal nothing is kept.
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        if j <= i {
            self.rows[i][REACH + j - i] += value;
        }
    }

    /// The product with a vector of unknowns.
    #[cfg(test)]
    pub(super) fn times(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; vector.len()];
        for i in 0..vector.len() {
            for j in i.saturating_sub(REACH)..=i {
                let value = self.rows[i][REACH + j - i];
                product[i] += value * vector[j];
                if j < i {
                    product[j] += value * vector[i];
                }
            }
        }
        product
    }

    /// The solution for `right` when `shifts` are added to the diagonal; `None` unless the matrix is then positive
    /// definite.
    pub(super) fn solve(
        &self,
        shifts: impl Iterator<Item = f64>,
        right: &[f64],
    ) -> Option<Vec<f64>> {
        let factor = self.factor(shifts)?;
        let mut solution = right.to_vec();
        for i in 0..solution.len() {
            for j in i.saturating_sub(REACH)..i {
                solution[i] -= factor[i][REACH + j - i] * solution[j];
            }
            solution[i] /= factor[i][REACH];
        }
        for i in (0..solution.len()).rev() {
            solution[i] /= factor[i][REACH];
            for j in i.saturating_sub(REACH)..i {
                solution[j] -= factor[i][REACH + j - i] * solution[i];
            }
        }
        Some(solution)
    }

    /// Cholesky's factor.
    fn factor(&self, shifts: impl Iterator<Item = f64>) -> Option<Vec<[f64; REACH + 1]>> {
        let mut factor = self.rows.clone();
        for (i, shift) in (0..factor.len()).zip(shifts) {
            factor[i][REACH] += shift;
            let first = i.saturating_sub(REACH);
            for j in first..=i {
                let known = (first.max(j.saturating_sub(REACH))..j)
                    .map(|k| factor[i][REACH + k - i] * factor[j][REACH + k - j])
                    .sum::<f64>();
                let left = factor[i][REACH + j - i] - known;
                factor[i][REACH + j - i] = if j < i {
                    left / factor[j][REACH]
                } else if left > 0.0 {
                    left.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimizer::Random;
    use std::iter::repeat;

    #[test]
    fn the_solution_satisfies_the_shifted_system() {
        let mut random = Random::new(3);
        for size in [1, 2, 8, 9, 10, 40] {
            let mut matrix = Banded::zero(size);
            for i in 0..size {
                for j in i.saturating_sub(REACH)..=i {
                    let value = if i == j {
                        12.0
                    } else {
                        random.between(-1.0, 1.0)
                    };
                    matrix.add(i, j, value);
                }
            }
            let right: Vec<f64> = (0..size).map(|_| random.between(-5.0, 5.0)).collect();
            let solution = matrix.solve(repeat(0.5), &right).expect("positive");
            let product = matrix.times(&solution);
            for ((own, product), right) in solution.iter().zip(product).zip(&right) {
                assert!((product + 0.5 * own - right).abs() < 1e-12, "{size}");
            }
            assert!(matrix.solve(repeat(-40.0), &right).is_none());
        }
    }
}
