//! The cheapest way over the grid: by A*, over the ranges of heights at which its cells can be reached.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::ground::{Ground, Range, cells, common, holds, is_empty, wider};
use super::tolls::Tolls;
use crate::geometry::{Point2, Point3};

/// Ranges of heights kept for one cell.
const RANGES: usize = 4;

/// The ends are joined to the cells within this many steps of the grid.
const REACH: f64 = 3.0;

/// Cells looked at between two checks whether to stop.
const UNWATCHED: usize = 1_000;

/// Steps to the cells around: to neighbours, and a knight's move away. The first half lead to cells of higher numbers, the
/// others back.
const STEPS: [[isize; 2]; 2 * ONWARD] = [
    [1, 0],
    [0, 1],
    [1, 1],
    [-1, 1],
    [2, 1],
    [1, 2],
    [-1, 2],
    [-2, 1],
    [-1, 0],
    [0, -1],
    [-1, -1],
    [1, -1],
    [-2, -1],
    [-1, -2],
    [1, -2],
    [2, -1],
];

/// How many of the steps lead to cells of higher numbers.
pub(super) const ONWARD: usize = 8;

/// A step from one cell to the next.
pub(super) struct Step {
    /// The cell that it leads to.
    pub(super) to: [usize; 2],
    /// In half steps of the grid.
    halfway: [usize; 2],
    /// Metres.
    away: f64,
}

/// The heights at which a way from the start can be over a cell.
#[derive(Clone, Copy)]
struct Reached {
    cell: [usize; 2],
    heights: Range,
    cost: f64,
    before: Option<usize>,
}

/// What is still to be looked at, by the least cost of a way over it and its number among all that was reached.
/// Costs are never negative, so their bits sort like them.
type Open = BinaryHeap<Reverse<(u64, usize)>>;

/// A grid between two ends.
pub(super) struct Grid<'g> {
    pub(super) ground: &'g Ground,
    pub(super) tolls: &'g Tolls,
    pub(super) ends: [Point3; 2],
    /// Metres climbed per metre at most.
    pub(super) climb: f64,
    /// Metres of the band kept free below and above.
    pub(super) margin: f64,
}

impl Grid<'_> {
    /// The cheapest way, if there is one that costs no more than `most`.
    pub(super) fn cheapest(&self, most: f64, is_over: &dyn Fn() -> bool) -> Option<Vec<Point3>> {
        let mut search = Search::from_start(self);
        let mut looked_at = 0;
        while let Some(own) = search.next(most) {
            looked_at += 1;
            if looked_at % UNWATCHED == 0 && is_over() {
                return None;
            }
            if search.arrives(own) {
                return Some(self.way(&search.all, own));
            }
            search.go_on(own);
        }
        None
    }

    /// The way that ends with number `last` of `all`: at each place as near to the middle of the band as may be.
    fn way(&self, all: &[Reached], last: usize) -> Vec<Point3> {
        let [start, target] = self.ends;
        let mut way = vec![target];
        let (mut from, mut halfway) = (last, None);
        loop {
            let reached = &all[from];
            let at = self.place(reached.cell);
            let after = way[way.len() - 1];
            let climb = (after.xy() - at).norm() * self.climb;
            let onward = match halfway {
                None => wider([after.z; 2], climb),
                Some(halfway) => {
                    let middle = common(wider([after.z; 2], 0.5 * climb), self.within(halfway));
                    wider(middle, 0.5 * climb)
                }
            };
            let [low, high] = common(reached.heights, onward);
            let [floor, ceiling] = self.allowed(reached.cell);
            let z = (0.5 * (floor + ceiling)).max(low).min(high);
            way.push(Point3::new(at.x, at.y, z));
            let Some(before) = reached.before else {
                break;
            };
            let [one, other] = [all[before].cell, reached.cell];
            halfway = Some([one[0] + other[0], one[1] + other[1]]);
            from = before;
        }
        way.push(start);
        way.reverse();
        way
    }

    fn place(&self, cell: [usize; 2]) -> Point2 {
        self.ground.at(2 * cell[0], 2 * cell[1])
    }

    fn allowed(&self, cell: [usize; 2]) -> Range {
        self.within([2 * cell[0], 2 * cell[1]])
    }

    fn within(&self, [column, row]: [usize; 2]) -> Range {
        wider(self.ground.allowed(column, row), -self.margin)
    }

    /// The cells near to an end.
    fn around(&self, at: Point2) -> Vec<[usize; 2]> {
        let reach = REACH * self.ground.step;
        let offset = at - self.ground.corner;
        let about = |metres: f64, count: usize| {
            let from = cells((metres - reach) / self.ground.step);
            from..(cells((metres + reach) / self.ground.step) + 1).min(count)
        };
        let [columns, rows] = self.ground.size;
        let mut near = Vec::new();
        for row in about(offset.y, rows) {
            for column in about(offset.x, columns) {
                if (self.place([column, row]) - at).norm() <= reach {
                    near.push([column, row]);
                }
            }
        }
        near
    }
}

/// The step number `direction` from `cell`, where it does not lead off the `ground`.
pub(super) fn step(ground: &Ground, cell: [usize; 2], direction: usize) -> Option<Step> {
    let step = STEPS[direction];
    let next = |axis: usize| {
        let next = cell[axis].checked_add_signed(step[axis]);
        next.filter(|&next| next < ground.size[axis])
    };
    let to = [next(0)?, next(1)?];
    Some(Step {
        to,
        halfway: [cell[0] + to[0], cell[1] + to[1]],
        away: ground.step * ((step[0] * step[0] + step[1] * step[1]) as f64).sqrt(),
    })
}

/// What has been reached so far.
struct Search<'g> {
    grid: &'g Grid<'g>,
    /// The cells from which the target may be reached.
    near_target: Vec<[usize; 2]>,
    all: Vec<Reached>,
    open: Open,
    /// For each cell, the ranges that were looked at.
    known: Vec<Vec<Range>>,
}

impl<'g> Search<'g> {
    fn from_start(grid: &'g Grid) -> Self {
        let [start, target] = grid.ends;
        let [columns, rows] = grid.ground.size;
        let mut search = Self {
            grid,
            near_target: grid.around(target.xy()),
            all: Vec::new(),
            open: Open::new(),
            known: vec![Vec::new(); columns * rows],
        };
        for cell in grid.around(start.xy()) {
            let length = (grid.place(cell) - start.xy()).norm();
            let from_start = wider([start.z; 2], length * grid.climb);
            search.reach(Reached {
                cell,
                heights: common(from_start, grid.allowed(cell)),
                cost: length * grid.tolls.metre,
                before: None,
            });
        }
        search
    }

    /// To be looked at in its turn, if it is news.
    fn reach(&mut self, reached: Reached) {
        let Reached { cell, heights, .. } = reached;
        if is_empty(heights) || is_known(&self.known[self.number(cell)], heights) {
            return;
        }
        let away = (self.grid.ends[1].xy() - self.grid.place(cell)).norm();
        let least = reached.cost + away * self.grid.tolls.metre;
        self.open.push(Reverse((least.to_bits(), self.all.len())));
        self.all.push(reached);
    }

    /// The number of what is to be looked at now, which is known from then on; nothing if ways over it cost more than
    /// `most`.
    fn next(&mut self, most: f64) -> Option<usize> {
        while let Some(Reverse((least, own))) = self.open.pop() {
            if f64::from_bits(least) > most {
                return None;
            }
            let Reached { cell, heights, .. } = self.all[own];
            let number = self.number(cell);
            let known = &mut self.known[number];
            if known.len() < RANGES && !is_known(known, heights) {
                known.push(heights);
                return Some(own);
            }
        }
        None
    }

    /// Whether a way to number `own` can go straight on to the target.
    fn arrives(&self, own: usize) -> bool {
        let Reached { cell, heights, .. } = self.all[own];
        let target = self.grid.ends[1];
        if !self.near_target.contains(&cell) {
            return false;
        }
        let away = (target.xy() - self.grid.place(cell)).norm();
        let to_target = wider([target.z; 2], away * self.grid.climb);
        !is_empty(common(heights, to_target))
    }

    /// Reach the cells around that of number `own`.
    fn go_on(&mut self, own: usize) {
        let grid = self.grid;
        let from = self.all[own];
        for direction in 0..STEPS.len() {
            let Some(step) = step(grid.ground, from.cell, direction) else {
                continue;
            };
            let climb = 0.5 * step.away * grid.climb;
            let middle = common(wider(from.heights, climb), grid.within(step.halfway));
            if is_empty(middle) {
                continue;
            }
            let heights = common(wider(middle, climb), grid.allowed(step.to));
            let cells = [from.cell, step.to].map(|cell| self.number(cell));
            let cost = step.away * grid.tolls.per_metre(heights, grid.allowed(step.to))
                + grid.tolls.exposure(cells, direction);
            self.reach(Reached {
                cell: step.to,
                heights,
                cost: from.cost + cost,
                before: Some(own),
            });
        }
    }

    fn number(&self, cell: [usize; 2]) -> usize {
        cell[1] * self.grid.ground.size[0] + cell[0]
    }
}

fn is_known(known: &[Range], heights: Range) -> bool {
    known.iter().any(|&other| holds(other, heights))
}
