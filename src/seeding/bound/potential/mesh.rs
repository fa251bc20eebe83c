//! A mesh of equilateral triangles, with one vertex on the start and one on the target.

use super::{Point2, Vector2};
use crate::geometry::Rect;

/// Half the square root of 3: the height of a triangle whose sides are 1.
pub(super) const HEIGHT: f64 = 0.866_025_403_784_438_6;

/// From the middle of a triangle to its corners, in sides; also from a vertex to the corners of its
/// cell, the hexagon of all points that are nearer to it than to other vertices.
pub(super) const REACH: f64 = 0.577_350_269_189_625_8;

/// Vertices that there is room for in a mesh that is made finer, whether they are of it or not, about.
const MOST_ROOM: i64 = 1_500_000;

/// Some triangles of the lattice in which a step of `(1, 0)` leads a `side` towards the target, and one of `(0, 1)`
/// as far at 60 degrees to its left.
///
/// A vertex is the number of its place in a rectangle of columns and rows. Each is the corner of two
/// triangles, `2 vertex` that points up and `2 vertex + 1` that points down, on whose outlines lie
/// `(0, 0), (1, 0), (0, 1)` and `(1, 1), (0, 1), (1, 0)` from it.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    start: Point2,
    /// Towards the target, of length 1.
    along: Vector2,
    pub(super) side: f64,
    /// Sides from start to target.
    steps: i32,
    /// Place of vertex 0 in the lattice.
    first: [i32; 2],
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// What the potential may differ by over a side in each triangle; 0 where the triangle is none
    /// of the mesh.
    pub(super) limits: Vec<f64>,
}

impl Mesh {
    /// A mesh of `steps` sides from start to target, of the triangles between `low` and `high` (metres
    /// towards the target, and to its left) whose middle is one of those.
    pub(super) fn between(
        ends: [Point2; 2],
        steps: f64,
        low: [f64; 2],
        high: [f64; 2],
        is_one: impl Fn(Point2) -> bool,
    ) -> Self {
        let way = ends[1] - ends[0];
        let side = way.norm() / steps;
        let row = |y: f64| y / (side * HEIGHT);
        let column = |x: f64, y: f64| x / side - 0.5 * row(y);
        let first = [whole(column(low[0], high[1])) - 3, whole(row(low[1])) - 3];
        let last = [whole(column(high[0], low[1])) + 4, whole(row(high[1])) + 4];
        let mut mesh = Self {
            start: ends[0],
            along: way.normalize(),
            side,
            steps: whole(steps),
            first,
            columns: 0,
            rows: 0,
            limits: Vec::new(),
        }
        .with_room(first, last);
        for triangle in 0..mesh.limits.len() {
            let is_inner = mesh.corners_are_inner(triangle);
            if is_inner && is_one(mesh.middle(triangle)) {
                mesh.limits[triangle] = 1.0;
            }
        }
        mesh
    }

    /// Whether a place of a triangle has a triangle, and that has others on all sides.
    fn corners_are_inner(&self, triangle: usize) -> bool {
        let (column, row) = (triangle / 2 % self.columns, triangle / 2 / self.columns);
        column > 0 && row > 0 && column + 2 < self.columns && row + 2 < self.rows
    }

    /// The mesh of half the side that covers the triangles of this one that are to be `kept`, without those
    /// that `is_one` denies by their middle and side; `None` where that takes too much room.
    pub(super) fn finer(
        &self,
        kept: &[bool],
        is_one: impl Fn(Point2, f64) -> bool,
    ) -> Option<Self> {
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for (triangle, _) in kept.iter().enumerate().filter(|(_, kept)| **kept) {
            let at = self.place(triangle / 2);
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis] + 1);
            }
        }
        // Both ends are there, and what is set about them.
        for (end, steps) in [(0, 0), (0, self.steps)] {
            low = [low[0].min(steps - 3), low[1].min(end - 3)];
            high = [high[0].max(steps + 3), high[1].max(end + 3)];
        }
        let room = i64::from(high[0] - low[0]) * i64::from(high[1] - low[1]);
        if 4 * room > MOST_ROOM {
            return None;
        }
        let mut finer = Self {
            side: 0.5 * self.side,
            steps: 2 * self.steps,
            limits: Vec::new(),
            ..*self
        }
        .with_room(
            [2 * low[0] - 2, 2 * low[1] - 2],
            [2 * high[0] + 2, 2 * high[1] + 2],
        );
        for (triangle, _) in kept.iter().enumerate().filter(|(_, kept)| **kept) {
            let [i, j] = self.place(triangle / 2);
            let at = finer.vertex([2 * i, 2 * j]);
            let (right, up) = (at + 1, at + finer.columns);
            let parts = if triangle % 2 == 0 {
                [2 * at, 2 * right, 2 * up, 2 * at + 1]
            } else {
                [2 * up + 2, 2 * right + 1, 2 * up + 1, 2 * up + 3]
            };
            for part in parts {
                if is_one(finer.middle(part), finer.side) {
                    finer.limits[part] = 1.0;
                }
            }
        }
        Some(finer)
    }

    fn with_room(mut self, first: [i32; 2], last: [i32; 2]) -> Self {
        let span = |axis: usize| usize::try_from(last[axis] - first[axis] + 1).unwrap_or(1);
        self.first = first;
        (self.columns, self.rows) = (span(0), span(1));
        self.limits = vec![0.0; 2 * self.columns * self.rows];
        self
    }

    /// The vertex at a place in the lattice, which lies in the rectangle.
    pub(super) fn vertex(&self, place: [i32; 2]) -> usize {
        let [i, j] = [0, 1].map(|axis| (place[axis] - self.first[axis]).unsigned_abs() as usize);
        j * self.columns + i
    }

    /// Whether `vertex` lies at the very edge of the rectangle, where no triangle of the mesh is.
    pub(super) fn is_edge(&self, vertex: usize) -> bool {
        let (column, row) = (vertex % self.columns, vertex / self.columns);
        column == 0 || row == 0 || column + 1 == self.columns || row + 1 == self.rows
    }

    /// Start and target.
    pub(super) fn ends(&self) -> [usize; 2] {
        [self.vertex([0, 0]), self.vertex([self.steps, 0])]
    }

    /// Place in the lattice of a vertex.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "columns and rows are a few thousand at most"
    )]
    pub(super) fn place(&self, vertex: usize) -> [i32; 2] {
        [
            self.first[0] + (vertex % self.columns) as i32,
            self.first[1] + (vertex / self.columns) as i32,
        ]
    }

    /// The point at a place in the lattice, or between places.
    fn point(&self, [i, j]: [f64; 2]) -> Point2 {
        let left = Vector2::new(-self.along.y, self.along.x);
        self.start + self.along * (self.side * (i + 0.5 * j)) + left * (self.side * HEIGHT * j)
    }

    /// Where a vertex lies.
    pub(super) fn at(&self, vertex: usize) -> Point2 {
        self.point(self.place(vertex).map(f64::from))
    }

    /// The middle of a triangle.
    pub(super) fn middle(&self, triangle: usize) -> Point2 {
        let third = if triangle.is_multiple_of(2) { 1.0 } else { 2.0 } / 3.0;
        self.point(
            self.place(triangle / 2)
                .map(|place| f64::from(place) + third),
        )
    }

    /// The corners of a triangle: in a lattice turned round by half a circle if it points down, `(0, 0)`, `(1, 0)`
    /// and `(0, 1)`.
    pub(super) fn corners(&self, triangle: usize) -> [usize; 3] {
        let at = triangle / 2;
        if triangle.is_multiple_of(2) {
            [at, at + 1, at + self.columns]
        } else {
            [at + self.columns + 1, at + self.columns, at + 1]
        }
    }

    /// The triangles round a vertex that has some, and the other two corners of each.
    pub(super) fn round(&self, vertex: usize) -> [(usize, [usize; 2]); 6] {
        let (v, c) = (vertex, self.columns);
        [
            (2 * v, [v + 1, v + c]),
            (2 * (v - 1) + 1, [v + c, v + c - 1]),
            (2 * (v - 1), [v + c - 1, v - 1]),
            (2 * (v - c - 1) + 1, [v - 1, v - c]),
            (2 * (v - c), [v - c, v - c + 1]),
            (2 * (v - c) + 1, [v - c + 1, v + 1]),
        ]
    }

    /// The triangles of the mesh.
    pub(super) fn triangles(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.limits.len()).filter(|triangle| self.limits[*triangle] > 0.0)
    }

    /// The triangles, of the mesh or not, whose middle may lie in `rect`.
    pub(super) fn near(&self, center: Point2, radius: f64) -> impl Iterator<Item = usize> + '_ {
        let offset = center - self.start;
        let (x, y) = (
            offset.dot(&self.along) / self.side,
            self.along.perp(&offset) / (self.side * HEIGHT),
        );
        let radius = radius / self.side;
        let rows = self.clamped(1, y - radius / HEIGHT - 1.0, y + radius / HEIGHT);
        rows.flat_map(move |row| {
            let j = f64::from(self.first[1]) + row as f64;
            // The nearest that a middle in this row can be.
            let away = ((y - j - 1.0).max(j - y).max(0.0) * HEIGHT).min(radius);
            let half = (radius * radius - away * away).sqrt();
            let columns = self.clamped(0, x - half - 0.5 * j - 1.5, x + half - 0.5 * j);
            columns.flat_map(move |column| {
                let at = 2 * (row * self.columns + column);
                [at, at + 1]
            })
        })
    }

    /// Columns or rows from `low` to `high` of the lattice, as far as there are.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the number of columns or rows"
    )]
    fn clamped(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let count = [self.columns, self.rows][axis] as f64;
        let first = f64::from(self.first[axis]);
        let from = (low - first).floor().clamp(0.0, count) as usize;
        let to = (high - first + 1.0).ceil().clamp(0.0, count) as usize;
        from..to
    }

    /// Whether routes in `area` come as near to the triangle with that `middle` as a cell reaches.
    pub(super) fn is_within(area: &Rect, middle: Point2, side: f64) -> bool {
        area.excess(middle) <= 2.0 * REACH * side * (1.0 + 1e-9)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a few thousand at most")]
fn whole(value: f64) -> i32 {
    value.floor() as i32
}
