//! What of a ring's soft zone belongs to each of its edges and corners.
//!
//! A point outside the ring is as far from it as from the nearest edge or corner. Those to which the same one is nearest
//! are its cell, which lies beside the edge, or before the corner between the normals of both of its edges. Few other
//! features reach into a cell, and above some height one of them is nearer everywhere; both are found once for each
//! ring.

use std::sync::OnceLock;

use nalgebra::Vector2;

use super::Polygon;
use super::nearest::Edge;
use super::zones::HAIR;
use crate::geometry::{Point2, ring};

/// The cells of a ring, each found when it is first asked for.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    /// 1 where the ring runs anticlockwise, else -1.
    turning: f64,
    beside_edges: Vec<OnceLock<Cell>>,
    /// Of the vertex at the beginning of each edge.
    before_corners: Vec<OnceLock<Cell>>,
}

#[derive(Debug, Clone)]
pub(super) struct Cell {
    /// Nothing farther from the feature than this has it for its nearest, metres.
    pub(super) top: f64,
    /// What may be nearer in it; `None` if that is too much.
    pub(super) rivals: Option<Box<[Rival]>>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Rival {
    /// No nearer than the feature up to this distance from the latter, metres.
    pub(super) from: f64,
    pub(super) feature: Feature,
}

/// The vertex at the beginning of an edge, or the edge; where two are equally near, the lesser owns the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Feature {
    Vertex(usize),
    Edge(usize),
}

/// Cells are derived from the ring, which is compared itself: any two are equal.
impl PartialEq for Cells {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Limits are widened by this share of them, since rounding must hide no rival.
const SLACK: f64 = 1e-9;

/// Vertices and edges on either side of a feature that are looked at first: they leave a low cell, into which fewer
/// others reach.
const BESIDE: usize = 4;

/// More edges than this near a cell are not looked at, and more rivals are not kept: cutting legs where the nearest
/// feature changes is no slower then.
const MOST_EDGES: usize = 256;
const MOST_RIVALS: usize = 64;

/// A cell is found in so many strips, or sectors, at most: fewer rivals reach into all of it than into one of them.
const MOST_STRIPS: usize = 8;

/// A strip or sector of a cell: between these ends of it on the edge, or these directions from the corner.
struct Strip {
    ends: [Point2; 2],
    outward: [Vector2<f64>; 2],
    turning: f64,
    /// Nothing higher than this is nearest to the feature.
    top: f64,
}

/// From which distance on something is nearer than the feature somewhere, and everywhere in a strip.
type Reach = [f64; 2];

const NOWHERE: Reach = [f64::INFINITY; 2];

/// Squared metres below which points are the same.
const SAME: f64 = 1e-18;

impl Strip {
    /// How far `point` lies from the feature in the directions of the strip: the least and the greatest.
    fn lean(&self, point: Point2) -> [f64; 2] {
        let away = point - self.ends[0];
        let [one, other] = self.outward.map(|outward| outward.dot(&away));
        let [one_side, other_side] = [
            self.outward[0].perp(&away) * self.turning,
            away.perp(&self.outward[1]) * self.turning,
        ];
        let most = if one_side > 0.0 && other_side > 0.0 {
            away.norm()
        } else {
            one.max(other)
        };
        [one.min(other), most]
    }

    /// At distance `h` from its foot, a point is nearer to `p` where `h` times twice the lean of `p` exceeds the squared
    /// distance from the foot to `p`.
    fn reach(&self, point: Point2) -> Reach {
        let [a, b] = self.ends;
        let [least, most] = self.lean(point);
        let farthest = (point - a).norm_squared().max((point - b).norm_squared());
        [
            height(ring::squared_distance((a, b), point), most),
            surely(farthest, least),
        ]
    }

    fn reach_of_edge(&self, rival: &Edge) -> Reach {
        let (ends, others) = (self.ends, [rival.a, end(rival)]);
        let leans = others.map(|end| self.lean(end));
        let most = leans[0][1].max(leans[1][1]);
        if most <= 0.0 {
            return NOWHERE;
        }
        let [own, other] = [(ends[0], ends[1]), (others[0], others[1])];
        // Edges of a simple ring do not cross, so the nearest point is at an end of one of them.
        let nearest = others
            .iter()
            .map(|end| ring::squared_distance(own, *end))
            .chain(ends.iter().map(|end| ring::squared_distance(other, *end)))
            .fold(f64::INFINITY, f64::min);
        // From either end of the rival to the other as from one end of the strip to the other: the height in question
        // is a convex quadratic over a linear function, which is greatest at an end, and nothing at one that they share.
        let everywhere = [[0, 1], [1, 0]].map(|order: [usize; 2]| {
            let at = [0, 1].map(|end| (others[order[end]] - ends[end]).norm_squared());
            let heights = [0, 1].map(|end| {
                if at[end] <= SAME && at[1 - end] > SAME {
                    0.0
                } else {
                    surely(at[end], leans[order[end]][0])
                }
            });
            heights[0].max(heights[1])
        });
        [height(nearest, most), everywhere[0].min(everywhere[1])]
    }
}

/// The distance from a foot at which a point with this `lean`, and so far away from the foot, is as near.
fn height(squared: f64, lean: f64) -> f64 {
    if squared <= SAME {
        0.0
    } else if lean > 0.0 {
        squared / (2.0 * lean)
    } else {
        f64::INFINITY
    }
}

/// As `height`, above rounding: infinite where the lean may be none.
fn surely(squared: f64, lean: f64) -> f64 {
    if lean > 1e-12 * squared.sqrt() {
        squared / (2.0 * lean)
    } else {
        f64::INFINITY
    }
}

fn end(edge: &Edge) -> Point2 {
    edge.a + edge.along * edge.length
}

impl Cells {
    pub(super) fn of(vertices: &[Point2]) -> Self {
        Self {
            turning: ring::twice_area(vertices).signum(),
            beside_edges: vec![OnceLock::new(); vertices.len()],
            before_corners: vec![OnceLock::new(); vertices.len()],
        }
    }

    /// Unit vector out of the ring, at right angles to an edge.
    pub(super) fn outward(&self, edge: &Edge) -> Vector2<f64> {
        Vector2::new(edge.along.y, -edge.along.x) * self.turning
    }
}

/// A height that surely is no less.
fn above(height: f64) -> f64 {
    height * (1.0 + SLACK) + HAIR
}

/// Whether `other` is the feature itself, or one that is as far only on the border of its cell.
fn touches(feature: Feature, other: Feature, count: usize) -> bool {
    match (feature, other) {
        (Feature::Edge(edge), Feature::Vertex(vertex))
        | (Feature::Vertex(vertex), Feature::Edge(edge)) => {
            vertex == edge || vertex == (edge + 1) % count
        }
        (feature, other) => feature == other,
    }
}

/// Finding the cells of a ring.
impl Polygon {
    /// The cell beside edge `idx`.
    pub(super) fn beside(&self, idx: usize) -> &Cell {
        self.cells.beside_edges[idx].get_or_init(|| {
            let edge = &self.edges[idx];
            let outward = self.cells.outward(edge);
            let is_short = |count: &usize| edge.length <= 0.25 * self.margin * *count as f64;
            let count = (1..MOST_STRIPS).find(is_short).unwrap_or(MOST_STRIPS);
            let at =
                |strip: usize| edge.a + edge.along * (edge.length * strip as f64 / count as f64);
            let strips =
                (0..count).map(|strip| self.strip([at(strip), at(strip + 1)], [outward; 2]));
            self.find(Feature::Edge(idx), idx, strips.collect())
        })
    }

    /// The cell before the corner at the beginning of edge `idx`; `None` where the ring points inwards.
    pub(super) fn before(&self, idx: usize) -> Option<&Cell> {
        let (before, edge) = (self.edge_before(idx), &self.edges[idx]);
        let [from, to] = [before, edge].map(|edge| self.cells.outward(edge));
        if !self.is_convex && from.dot(&edge.along) > 0.0 {
            return None;
        }
        Some(self.cells.before_corners[idx].get_or_init(|| {
            let turn = libm::atan2(from.perp(&to), from.dot(&to));
            let is_narrow = |count: &usize| turn.abs() <= 0.2 * *count as f64;
            let count = (1..MOST_STRIPS).find(is_narrow).unwrap_or(MOST_STRIPS);
            let at = |strip: usize| {
                let (sin, cos) = libm::sincos(turn * strip as f64 / count as f64);
                Vector2::new(from.x * cos - from.y * sin, from.x * sin + from.y * cos)
            };
            let strips =
                (0..count).map(|strip| self.strip([edge.a; 2], [at(strip), at(strip + 1)]));
            self.find(Feature::Vertex(idx), idx, strips.collect())
        }))
    }

    pub(super) fn edge_after(&self, idx: usize) -> &Edge {
        &self.edges[(idx + 1) % self.edges.len()]
    }

    pub(super) fn edge_before(&self, idx: usize) -> &Edge {
        &self.edges[(idx + self.edges.len() - 1) % self.edges.len()]
    }

    fn strip(&self, ends: [Point2; 2], outward: [Vector2<f64>; 2]) -> Strip {
        Strip {
            ends,
            outward,
            turning: self.cells.turning,
            top: self.margin,
        }
    }

    /// How far the vertex at the beginning of edge `idx`, and that edge, reach into the cell of `feature`.
    fn reaches(
        &self,
        idx: usize,
        feature: Feature,
        strip: &Strip,
    ) -> impl Iterator<Item = (Feature, Reach)> + use<> {
        let vertex = (Feature::Vertex(idx), strip.reach(self.vertices[idx]));
        let edge = (Feature::Edge(idx), strip.reach_of_edge(&self.edges[idx]));
        let count = self.edges.len();
        [vertex, edge]
            .into_iter()
            .filter(move |(other, _)| !touches(feature, *other, count))
    }

    /// What may be nearer than `feature` in a strip of its cell, among `edges` and their first vertices.
    fn rivals(&self, feature: Feature, strip: &mut Strip, edges: &[usize]) -> Vec<Rival> {
        let mut rivals = Vec::new();
        for near in edges {
            for (feature, [from, everywhere]) in self.reaches(*near, feature, strip) {
                strip.top = strip.top.min(everywhere);
                let from = from * (1.0 - SLACK) - HAIR;
                rivals.push(Rival { from, feature });
            }
        }
        rivals.retain(|rival| rival.from <= above(strip.top));
        rivals
    }

    /// The cell of `feature`, which begins at vertex `idx`, from its strips.
    fn find(&self, feature: Feature, idx: usize, mut strips: Vec<Strip>) -> Cell {
        if self.is_convex {
            return Cell {
                top: self.margin,
                rivals: Some(Box::default()),
            };
        }
        let count = self.edges.len();
        let beside = (0..=2 * BESIDE).map(|step| (idx + count * BESIDE + step - BESIDE) % count);
        for strip in &mut strips {
            for near in beside.clone() {
                for (_, [_, everywhere]) in self.reaches(near, feature, strip) {
                    strip.top = strip.top.min(everywhere);
                }
            }
        }
        let top = |strips: &[Strip]| strips.iter().map(|strip| strip.top).fold(0.0, f64::max);
        let reach = 2.0 * above(top(&strips));
        let [from, to] = [strips[0].ends[0], strips[strips.len() - 1].ends[1]];
        let edges = self.edges_beside(from, to, reach);
        let mut rivals = None;
        if edges.len() <= MOST_EDGES {
            let met = strips
                .iter_mut()
                .map(|strip| self.rivals(feature, strip, &edges));
            let mut met: Vec<Rival> = met.flatten().collect();
            met.sort_by(|one, other| {
                let order = one.feature.cmp(&other.feature);
                order.then(one.from.total_cmp(&other.from))
            });
            met.dedup_by_key(|rival| rival.feature);
            rivals = (met.len() <= MOST_RIVALS).then(|| met.into_boxed_slice());
        }
        Cell {
            top: above(top(&strips)),
            rivals,
        }
    }
}
