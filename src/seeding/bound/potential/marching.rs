//! A potential on the vertices of a mesh that is about as steep as its triangles allow, marched from
//! one end, and flattened where it is steeper.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::mesh::{HEIGHT, Mesh, REACH};

/// Within so many sides of its end, squared, a potential is set and not marched.
const SET: i32 = 4;

/// Within so many sides, squared, it is not above what is proven of the way out.
const CAPPED: i32 = 17;

/// Sides from an end beyond which a potential counts: what is set, and as far as a cell reaches.
pub(super) const EXEMPT: f64 = 2.0 + REACH;

/// Levels that a potential is flattened by.
const LEVELS: usize = 1024;

/// What is left of a limit at least where a march had come out too steep.
const LEAST: f64 = 0.1;

/// Weights of a vertex and of each of the six round it in the mean over the vertex's cell.
const MEAN: [f64; 2] = [11.0 / 18.0, 7.0 / 108.0];

/// A function on the vertices, linear in between.
#[derive(Debug, Clone)]
pub(super) struct Potential {
    /// Infinite where no triangle leads.
    pub(super) values: Vec<f64>,
}

impl Potential {
    /// Marched from the vertex `end`, out of which to a distance of so many metres costs `out` at
    /// least: it is not above that within `CAPPED`. Beyond `EXEMPT`, its mean over cells is nowhere steeper
    /// than the mean of the limits.
    ///
    /// A march keeps to the limits where it passes, which makes curved fronts too steep beside: it is repeated
    /// with lower limits there, and flattened where that is not enough.
    pub(super) fn march(mesh: &Mesh, end: usize, out: impl Fn(f64) -> f64) -> Self {
        let (mut potential, order) = Self::first(mesh, end, &out);
        let mut limits = mesh.limits.clone();
        let round = potential.round(mesh, &potential.slopes(mesh, end));
        for triangle in mesh.triangles() {
            if let Some(steep) = Round::of(&round, mesh.corners(triangle)).too_steep() {
                let limit = &mut limits[triangle];
                *limit = (*limit - steep).max(LEAST * mesh.limits[triangle]);
            }
        }
        potential.repeat(mesh, &limits, &order, end, &out);
        potential.flatten(mesh, end);
        potential
    }

    /// Marched over all vertices, and the order in which they were reached; it proves nothing.
    pub(super) fn first(mesh: &Mesh, end: usize, out: &dyn Fn(f64) -> f64) -> (Self, Vec<u32>) {
        let count = mesh.columns * mesh.rows;
        let mut march = March {
            mesh,
            values: vec![f64::INFINITY; count],
            known: vec![false; count],
            heap: BinaryHeap::new(),
        };
        for (vertex, squared) in disc(mesh, end) {
            let cap = out(mesh.side * f64::from(squared).sqrt());
            if squared <= SET {
                march.values[vertex] = cap;
                march.known[vertex] = true;
            } else if !mesh.is_edge(vertex) {
                march.suggest(vertex, cap);
            }
        }
        for (vertex, squared) in disc(mesh, end) {
            if squared <= SET && !mesh.is_edge(vertex) {
                march.suggest_round(vertex);
            }
        }
        let mut order = Vec::new();
        while let Some(Reverse((key, reached))) = march.heap.pop() {
            let vertex = reached as usize;
            if !march.known[vertex] && key == march.values[vertex].to_bits() {
                march.known[vertex] = true;
                march.suggest_round(vertex);
                order.push(reached);
            }
        }
        let values = march.values;
        (Self { values }, order)
    }

    /// Marched again with other limits, in the same order.
    fn repeat(
        &mut self,
        mesh: &Mesh,
        limits: &[f64],
        order: &[u32],
        end: usize,
        out: &dyn Fn(f64) -> f64,
    ) {
        for vertex in order {
            self.values[*vertex as usize] = f64::INFINITY;
        }
        let capped: HashMap<usize, f64> = disc(mesh, end)
            .map(|(vertex, squared)| (vertex, out(mesh.side * f64::from(squared).sqrt())))
            .collect();
        for vertex in order {
            let vertex = *vertex as usize;
            let mut least = capped.get(&vertex).copied().unwrap_or(f64::INFINITY);
            for (triangle, [one, other]) in mesh.round(vertex) {
                let limit = limits[triangle];
                if limit > 0.0 {
                    least = least.min(next(self.values[one], self.values[other], limit));
                }
            }
            self.values[vertex] = least;
        }
    }

    /// Rise over a side in each triangle that is to keep its limit: less than nothing in those that are
    /// set, and where nothing leads. Where one corner cannot be reached, none can.
    fn slopes(&self, mesh: &Mesh, end: usize) -> Vec<f64> {
        let slope_of = |triangle: usize| {
            if mesh.limits[triangle] <= 0.0 {
                return f64::NEG_INFINITY;
            }
            let slope = slope(mesh.corners(triangle).map(|corner| self.values[corner]));
            if slope.is_finite() {
                slope
            } else {
                f64::NEG_INFINITY
            }
        };
        let mut slopes: Vec<f64> = (0..mesh.limits.len()).map(slope_of).collect();
        let set: Vec<usize> = disc(mesh, end)
            .filter(|(_, squared)| *squared <= SET)
            .map(|(vertex, _)| vertex)
            .collect();
        for vertex in set.iter().filter(|vertex| !mesh.is_edge(**vertex)) {
            for (triangle, others) in mesh.round(*vertex) {
                if others.iter().all(|other| set.contains(other)) {
                    slopes[triangle] = f64::NEG_INFINITY;
                }
            }
        }
        slopes
    }

    /// What lies round each vertex.
    fn round(&self, mesh: &Mesh, slopes: &[f64]) -> Vec<Round> {
        let mut round = vec![Round::default(); self.values.len()];
        for (triangle, slope) in slopes.iter().enumerate() {
            if *slope >= 0.0 {
                let corners = mesh.corners(triangle);
                let values = corners.map(|corner| self.values[corner]);
                let limit = mesh.limits[triangle];
                let mut over = [f64::NEG_INFINITY; 2];
                over[triangle % 2] = slope - limit;
                let here = Round {
                    over,
                    limit,
                    low: lesser(lesser(values[0], values[1]), values[2]),
                    high: greater(greater(values[0], values[1]), values[2]),
                };
                for corner in corners {
                    round[corner] = round[corner].and(&here);
                }
            }
        }
        round
    }

    /// Divide what it rises by at each level by as much as it is too steep anywhere there.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of the levels, and never negative"
    )]
    fn flatten(&mut self, mesh: &Mesh, end: usize) {
        let finite = self.values.iter().filter(|value| value.is_finite());
        let highest = finite.fold(0.0, |highest: f64, value| highest.max(*value));
        let height = highest / (LEVELS - 1) as f64;
        let level = |value: f64| ((value / height) as usize).min(LEVELS - 1);
        let mut steepness = [1.0_f64; LEVELS];
        let slopes = self.slopes(mesh, end);
        let round = self.round(mesh, &slopes);
        for triangle in mesh.triangles() {
            let near = Round::of(&round, mesh.corners(triangle));
            if let Some(steep) = near.too_steep() {
                let most = 1.0 + steep / near.limit;
                let levels = &mut steepness[level(near.low)..=level(near.high)];
                if levels.iter().any(|level| *level < most) {
                    let steep = steepest(mesh, triangle, &slopes);
                    for level in levels {
                        *level = level.max(steep);
                    }
                }
            }
        }
        let mut below = [0.0; LEVELS];
        for level in 1..LEVELS {
            below[level] = below[level - 1] + height / steepness[level - 1];
        }
        for value in self.values.iter_mut().filter(|value| value.is_finite()) {
            let level = level(*value);
            *value = below[level] + (*value - level as f64 * height) / steepness[level];
        }
    }

    /// Its mean over the cell of a vertex all of whose triangles are of the mesh.
    pub(super) fn mean(&self, mesh: &Mesh, vertex: usize) -> f64 {
        let round = mesh.round(vertex);
        let sum: f64 = round.iter().map(|(_, [next, _])| self.values[*next]).sum();
        MEAN[0] * self.values[vertex] + MEAN[1] * sum
    }
}

/// Of some triangles.
#[derive(Debug, Clone, Copy)]
struct Round {
    /// The most that a triangle which points up, and one which points down, rises by over a side
    /// beyond its limit.
    over: [f64; 2],
    /// The least of their limits.
    limit: f64,
    /// Values between which all of them lie.
    low: f64,
    high: f64,
}

impl Default for Round {
    fn default() -> Self {
        Self {
            over: [f64::NEG_INFINITY; 2],
            limit: f64::INFINITY,
            low: f64::INFINITY,
            high: 0.0,
        }
    }
}

impl Round {
    /// Of all triangles that the cells of points in one with those `corners` meet.
    fn of(round: &[Self], corners: [usize; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| &round[corner]);
        a.and(b).and(c)
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            over: [0, 1].map(|way| greater(self.over[way], other.over[way])),
            limit: lesser(self.limit, other.limit),
            low: lesser(self.low, other.low),
            high: greater(self.high, other.high),
        }
    }

    /// The most that a mean over cells, of which half points up, rises by over a side beyond the mean
    /// of the limits, if it does.
    fn too_steep(&self) -> Option<f64> {
        let steep = 0.5 * (self.over[0] + self.over[1]);
        (steep > 0.0).then_some(steep)
    }
}

/// How many times steeper than its limits a mean over cells of points in `triangle` is, at most.
fn steepest(mesh: &Mesh, triangle: usize, slopes: &[f64]) -> f64 {
    let mut steepest = 1.0;
    loop {
        let mut worst = [(f64::NEG_INFINITY, 0.0, 1.0); 2];
        for corner in mesh.corners(triangle) {
            for (near, _) in mesh.round(corner) {
                let (slope, limit) = (slopes[near], mesh.limits[near]);
                let over = slope - steepest * limit;
                if over > worst[near % 2].0 {
                    worst[near % 2] = (over, slope, limit);
                }
            }
        }
        let [one, other] = worst;
        let steep = (one.1 + other.1) / (one.2 + other.2);
        if steep <= steepest * (1.0 + 1e-12) {
            return steepest * (1.0 + 1e-12);
        }
        steepest = steep;
    }
}

/// Of two numbers, neither of which is not one.
fn lesser(one: f64, other: f64) -> f64 {
    if other < one { other } else { one }
}

fn greater(one: f64, other: f64) -> f64 {
    if other > one { other } else { one }
}

/// Distances in sides of the vertices that are capped.
pub(super) fn capped() -> impl Iterator<Item = f64> {
    // All i^2 + i j + j^2 are among these.
    (0..=CAPPED).map(|squared| f64::from(squared).sqrt())
}

/// The vertices about `end` where a march begins, and their distances from it in sides, squared.
fn disc(mesh: &Mesh, end: usize) -> impl Iterator<Item = (usize, i32)> + '_ {
    let [column, row] = mesh.place(end);
    let (first, last) = (mesh.place(0), mesh.place(mesh.columns * mesh.rows - 1));
    (-5..=5).flat_map(move |j: i32| {
        (-5..=5).filter_map(move |i: i32| {
            let place = [column + i, row + j];
            let is_there = (0..2).all(|axis| (first[axis]..=last[axis]).contains(&place[axis]));
            let squared = i * i + i * j + j * j;
            (is_there && squared <= CAPPED).then(|| (mesh.vertex(place), squared))
        })
    })
}

struct March<'a> {
    mesh: &'a Mesh,
    values: Vec<f64>,
    known: Vec<bool>,
    /// The bits of values, which are never negative, and vertices; outdated ones too.
    heap: BinaryHeap<Reverse<(u64, u32)>>,
}

impl March<'_> {
    /// Tell the unknown vertices round `vertex` that it is known now.
    fn suggest_round(&mut self, vertex: usize) {
        let value = self.values[vertex];
        let round = self.mesh.round(vertex);
        for (at, (triangle, [other, left])) in round.into_iter().enumerate() {
            if self.known[other] {
                continue;
            }
            // Its triangles are this one and the one before.
            let (before, [right, _]) = round[(at + 5) % 6];
            let mut least = f64::INFINITY;
            for (triangle, third) in [(triangle, left), (before, right)] {
                let limit = self.mesh.limits[triangle];
                if limit > 0.0 {
                    let third = if self.known[third] {
                        self.values[third]
                    } else {
                        f64::INFINITY
                    };
                    least = least.min(next(value, third, limit));
                }
            }
            self.suggest(other, least);
        }
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "there are far fewer than 2^32 vertices"
    )]
    fn suggest(&mut self, vertex: usize, value: f64) {
        if value < self.values[vertex] {
            self.values[vertex] = value;
            self.heap.push(Reverse((value.to_bits(), vertex as u32)));
        }
    }
}

/// What a front reaches the third corner of a triangle at that reaches the others at `a` and `b`.
fn next(a: f64, b: f64, limit: f64) -> f64 {
    let across = (b - a).abs();
    // The steepest way down must lead into the triangle.
    if across <= 0.5 * limit {
        0.5 * (a + b) + HEIGHT * (limit * limit - across * across).sqrt()
    } else {
        a.min(b) + limit
    }
}

/// Rise over a side in a triangle with those corners, along its steepest way.
pub(super) fn slope([a, b, c]: [f64; 3]) -> f64 {
    let squared = (b - a) * (b - a) + (c - b) * (c - b) + (a - c) * (a - c);
    (squared * 2.0 / 3.0).sqrt()
}
