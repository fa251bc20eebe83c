//! Which threats a leg may meet, among many.

use crate::geometry::{Point2, Rect, Segment};

/// Cells over the threats, each with the threats whose boxes it touches.
#[derive(Debug)]
pub(super) struct Index {
    extent: Rect,
    /// Cells per metre, east and north.
    per_metre: Point2,
    columns: usize,
    rows: usize,
    /// Where the threats of each cell begin in `threats`; one entry more than cells.
    starts: Vec<u32>,
    threats: Vec<u32>,
    boxes: Vec<Rect>,
}

/// From the cell of one corner to that of the other, both included.
struct Cells {
    columns: std::ops::RangeInclusive<usize>,
    rows: std::ops::RangeInclusive<usize>,
}

impl Index {
    /// For the boxes round threats and their soft zones, at least one.
    pub(super) fn of(boxes: impl Iterator<Item = Rect>) -> Self {
        // Rounding errs on the side of including a threat.
        let boxes: Vec<Rect> = boxes
            .map(|extent| extent.grown(1e-6 * (1.0 + extent.diagonal())))
            .collect();
        let corners = boxes.iter().flat_map(|extent| [extent.min, extent.max]);
        let extent = Rect::around(corners).expect("there are threats");
        let side = side(boxes.len());
        let size = extent.max - extent.min;
        let mut index = Self {
            extent,
            per_metre: Point2::new(side as f64 / size.x, side as f64 / size.y),
            columns: side,
            rows: side,
            starts: vec![0; side * side + 1],
            threats: Vec::new(),
            boxes,
        };
        // Count, then fill.
        for extent in &index.boxes {
            for cell in index.cells(extent).iter(side) {
                index.starts[cell + 1] += 1;
            }
        }
        for cell in 0..side * side {
            index.starts[cell + 1] += index.starts[cell];
        }
        let mut next = index.starts.clone();
        index.threats = vec![0; next[side * side] as usize];
        for (threat_idx, extent) in (0_u32..).zip(&index.boxes) {
            for cell in index.cells(extent).iter(side) {
                index.threats[next[cell] as usize] = threat_idx;
                next[cell] += 1;
            }
        }
        index
    }

    /// The threats whose boxes meet those of `legs`, in order, and maybe some more.
    pub(super) fn find(&self, legs: impl Iterator<Item = Segment> + Clone, found: &mut Vec<u32>) {
        found.clear();
        let ends = legs.clone().flat_map(|leg| [leg.a.xy(), leg.b.xy()]);
        let Some(around) = Rect::around(ends) else {
            return;
        };
        let together = self.cells(&around).count();
        let cells_of = |leg: Segment| self.cells(&box_of(&leg)).count();
        // Each leg has at least one cell.
        if together <= 2 * legs.clone().count()
            || together <= 2 * legs.clone().map(cells_of).sum::<usize>()
        {
            self.find_in(&around, found);
            if together == 1 {
                // In order, and each only once.
                return;
            }
        } else {
            legs.for_each(|leg| self.find_in(&box_of(&leg), found));
        }
        if found.len() >= self.boxes.len() {
            // So many duplicates that examining all threats is faster than sorting.
            found.clear();
            found.extend((0_u32..).take(self.boxes.len()));
            return;
        }
        found.sort_unstable();
        found.dedup();
    }

    fn find_in(&self, own: &Rect, found: &mut Vec<u32>) {
        if !own.meets(&self.extent) {
            return;
        }
        for cell in self.cells(own).iter(self.columns) {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            let near = self.threats[range].iter();
            found.extend(near.filter(|threat| own.meets(&self.boxes[**threat as usize])));
        }
    }

    fn cells(&self, of: &Rect) -> Cells {
        let column = |x: f64| onto((x - self.extent.min.x) * self.per_metre.x, self.columns);
        let row = |y: f64| onto((y - self.extent.min.y) * self.per_metre.y, self.rows);
        Cells {
            columns: column(of.min.x)..=column(of.max.x),
            rows: row(of.min.y)..=row(of.max.y),
        }
    }
}

impl Cells {
    fn count(&self) -> usize {
        let side = |range: &std::ops::RangeInclusive<usize>| range.end() - range.start() + 1;
        side(&self.columns) * side(&self.rows)
    }

    fn iter(self, width: usize) -> impl Iterator<Item = usize> {
        let Self { columns, rows } = self;
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }
}

fn box_of(leg: &Segment) -> Rect {
    Rect {
        min: Point2::new(leg.a.x.min(leg.b.x), leg.a.y.min(leg.b.y)),
        max: Point2::new(leg.a.x.max(leg.b.x), leg.a.y.max(leg.b.y)),
    }
}

/// Cells in either direction for `count` threats: four threats to a cell, about as wide as a leg
/// where threats are many, and not too many cells.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the root of a count is positive and small"
)]
fn side(count: usize) -> usize {
    ((0.5 * (count as f64).sqrt()) as usize).clamp(1, 64)
}

/// The cell of a coordinate in cells; beyond an edge, that of the edge.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the cells first; what is not a number becomes 0"
)]
pub(super) fn onto(cells: f64, count: usize) -> usize {
    cells.clamp(0.0, (count - 1) as f64) as usize
}
