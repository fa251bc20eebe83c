//! The regions where a sampled field exceeds a level: closed rings by marching squares.

/// Samples of a field at the nodes of a square lattice, row-major, surrounded by one row without a value so that
/// every ring closes beyond the sampled part.
pub(super) struct Field {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
}

/// Marks a crossing of the level with a lattice edge that has no successor.
const NONE: usize = usize::MAX;

impl Field {
    /// Calls `at` for each of `columns` x `rows` nodes.
    pub(super) fn sample(columns: usize, rows: usize, at: impl Fn(usize, usize) -> f64) -> Self {
        let (outer_columns, outer_rows) = (columns + 2, rows + 2);
        let mut values = vec![f64::NEG_INFINITY; outer_columns * outer_rows];
        for row in 0..rows {
            for column in 0..columns {
                values[(row + 1) * outer_columns + column + 1] = at(column, row);
            }
        }
        Self {
            columns: outer_columns,
            rows: outer_rows,
            values,
        }
    }

    /// Nodes in each direction.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.columns - 2, self.rows - 2)
    }

    pub(super) fn at(&self, column: usize, row: usize) -> f64 {
        self.values[(row + 1) * self.columns + column + 1]
    }

    /// Least and greatest sample.
    pub(super) fn range(&self) -> (f64, f64) {
        let samples = self.values.iter().filter(|value| value.is_finite());
        samples.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), &value| {
            (min.min(value), max.max(value))
        })
    }

    /// The rings around everything at or above `level`, in nodes from the first one. Where a ring leaves the sampled
    /// part it runs half a node beyond it.
    pub(super) fn rings(&self, level: f64) -> Vec<Vec<(f64, f64)>> {
        let mut next = vec![NONE; 2 * self.columns * self.rows];
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                self.link(column, row, level, &mut next);
            }
        }
        let mut rings = Vec::new();
        for first in 0..next.len() {
            let mut ring = Vec::new();
            let mut edge = first;
            while next[edge] != NONE {
                ring.push(self.crossing(edge, level));
                edge = std::mem::replace(&mut next[edge], NONE);
            }
            if ring.len() > 2 {
                rings.push(ring);
            }
        }
        rings
    }

    /// Add the one or two pieces in one cell to `next`, with the high ground on their left.
    fn link(&self, column: usize, row: usize, level: f64, next: &mut [usize]) {
        let corner = row * self.columns + column;
        let [sw, se] = [self.values[corner], self.values[corner + 1]];
        let [nw, ne] = [
            self.values[corner + self.columns],
            self.values[corner + self.columns + 1],
        ];
        let high = |value: f64, bit: u8| if value >= level { bit } else { 0 };
        // Horizontal edges are numbered by their western node, vertical ones after them by their southern node.
        let vertical = self.columns * self.rows;
        let (s, n) = (corner, corner + self.columns);
        let (w, e) = (vertical + corner, vertical + corner + 1);
        let joined = (sw + se + ne + nw) / 4.0 >= level;
        let pieces: &[(usize, usize)] = match high(sw, 1) + high(se, 2) + high(ne, 4) + high(nw, 8)
        {
            1 => &[(s, w)],
            2 => &[(e, s)],
            3 => &[(e, w)],
            4 => &[(n, e)],
            5 if joined => &[(n, w), (s, e)],
            5 => &[(s, w), (n, e)],
            6 => &[(n, s)],
            7 => &[(n, w)],
            8 => &[(w, n)],
            9 => &[(s, n)],
            10 if joined => &[(w, s), (e, n)],
            10 => &[(e, s), (w, n)],
            11 => &[(e, n)],
            12 => &[(w, e)],
            13 => &[(s, e)],
            14 => &[(w, s)],
            _ => &[],
        };
        for &(from, to) in pieces {
            next[from] = to;
        }
    }

    fn crossing(&self, edge: usize, level: f64) -> (f64, f64) {
        let nodes = self.columns * self.rows;
        let (node, along) = if edge < nodes {
            (edge, (1.0, 0.0))
        } else {
            (edge - nodes, (0.0, 1.0))
        };
        let other = if edge < nodes {
            node + 1
        } else {
            node + self.columns
        };
        let (a, b) = (self.values[node], self.values[other]);
        let t = if a.is_finite() && b.is_finite() {
            (level - a) / (b - a)
        } else {
            0.5
        };
        let (column, row) = ((node % self.columns) as f64, (node / self.columns) as f64);
        (column - 1.0 + t * along.0, row - 1.0 + t * along.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the enclosed area, positive counter-clockwise.
    fn doubled_area(ring: &[(f64, f64)]) -> f64 {
        let next = ring.iter().cycle().skip(1);
        ring.iter()
            .zip(next)
            .map(|(a, b)| a.0 * b.1 - b.0 * a.1)
            .sum()
    }

    #[test]
    fn a_cone_has_round_rings() {
        let field = Field::sample(41, 41, |column, row| {
            let (x, y) = (column as f64 - 20.0, row as f64 - 20.0);
            20.0 - (x * x + y * y).sqrt()
        });
        let rings = field.rings(10.0);
        assert_eq!(rings.len(), 1);
        for point in &rings[0] {
            let (x, y) = (point.0 - 20.0, point.1 - 20.0);
            assert!(((x * x + y * y).sqrt() - 10.0).abs() < 0.1);
        }
        let area = doubled_area(&rings[0]) / 2.0;
        assert!((area - 314.0).abs() < 4.0, "{area}");
    }

    #[test]
    fn high_ground_at_the_edge_closes_beyond_it() {
        let field = Field::sample(3, 3, |_, _| 1.0);
        let rings = field.rings(0.5);
        assert_eq!(rings.len(), 1);
        let outside = |&(x, y): &(f64, f64)| !(0.0..=2.0).contains(&x) || !(0.0..=2.0).contains(&y);
        assert!(rings[0].iter().all(outside), "{:?}", rings[0]);
        assert!(field.rings(1.5).is_empty());
    }

    #[test]
    fn a_basin_is_a_hole() {
        let field = Field::sample(9, 9, |column, row| {
            if (3..=5).contains(&column) && (3..=5).contains(&row) {
                0.0
            } else {
                1.0
            }
        });
        let mut areas: Vec<f64> = field
            .rings(0.5)
            .iter()
            .map(|ring| doubled_area(ring))
            .collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas.len(), 2);
        assert!(areas[0] < 0.0 && areas[1] > 0.0, "{areas:?}");
    }

    #[test]
    fn saddles_leave_no_loose_ends() {
        let field = Field::sample(
            20,
            20,
            |column, row| {
                if (column + row) % 2 == 0 { 1.0 } else { 0.0 }
            },
        );
        for level in [0.2, 0.5, 0.8] {
            let points: usize = field.rings(level).iter().map(Vec::len).sum();
            // Every edge inside is crossed, and so are those that lead outwards from high nodes at the rim.
            assert_eq!(points, 2 * 20 * 19 + 40);
        }
    }
}
