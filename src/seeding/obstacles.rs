//! What a string seen from above must go round: discs, and rings widened by a radius.
//!
//! A ring is one capsule for each edge. Its inside cannot be reached without crossing an edge, so
//! that only a ring that is not widened at all needs a look at its inside.

use nalgebra::Vector2;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::arc::{Arc, point_segment, segment_segment};
use super::outline::{Outline, OutlineShape};
use crate::geometry::{Point2, Rect, ring};
use crate::scenario::Scenario;
use crate::threat::Threat;

/// Up to this many bodies are searched one by one; beyond it a tree is built.
const FEW_BODIES: usize = 24;

/// Touching is not entering: bodies count as smaller by this share of the scene's extent.
const TOUCH: f64 = 1e-9;

/// A scene of obstacles between two ends.
#[derive(Debug, Clone)]
pub struct Obstacles {
    pub(super) ends: [Point2; 2],
    pub(super) bodies: Vec<Body>,
    pub(super) corners: Vec<Corner>,
    /// By index of the outline, the range of its corners; empty for outlines left out.
    pub(super) corners_of: Vec<std::ops::Range<usize>>,
    rings: Vec<Ring>,
    tree: Option<RTree<Entry>>,
    /// Metres of a straight way that are looked up in the tree at a time.
    stride: f64,
    /// No straight or round part of a string, plus what remains after it, is longer, metres.
    pub(super) longest_way: f64,
    pub(super) area: Option<Rect>,
    /// How deep a body may be touched, metres.
    pub(super) touch: f64,
}

type Entry = GeomWithData<Rectangle<[f64; 2]>, usize>;

/// A capsule: all points within `radius` of the segment from `a` to `b`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    pub(super) a: Point2,
    pub(super) b: Point2,
    pub(super) radius: f64,
    /// Index of the outline.
    pub(super) outline: usize,
}

/// A circle round which a string may bend.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) center: Point2,
    pub(super) radius: f64,
    /// The bodies that it belongs to; the same one twice for a disc.
    pub(super) bodies: [usize; 2],
    /// Unit vectors along the edges that meet at the corner of a ring.
    pub(super) edges: Option<[Vector2<f64>; 2]>,
    /// Index of the outline.
    pub(super) outline: usize,
}

/// A ring that is not widened, so that a string could slip in through a corner.
#[derive(Debug, Clone)]
struct Ring {
    vertices: Vec<Point2>,
    extent: Rect,
    outline: usize,
}

impl Obstacles {
    /// The hard parts of the threats of `scenario` that `counts` picks, by index, between its start
    /// and its target. A string may bend only inside the area.
    #[must_use]
    pub fn hard(scenario: &Scenario, counts: impl Fn(usize, &Threat) -> bool) -> Self {
        Self::of(scenario, counts, Outline::hard)
    }

    /// As [`Obstacles::hard`], with the threats widened by their soft zones, but not over an end of the way.
    #[must_use]
    pub fn soft(scenario: &Scenario, counts: impl Fn(usize, &Threat) -> bool) -> Self {
        Self::of(scenario, counts, Outline::soft)
    }

    /// As [`Obstacles::hard`], with each threat's outline made by the caller.
    #[must_use]
    pub fn of(
        scenario: &Scenario,
        counts: impl Fn(usize, &Threat) -> bool,
        outline: impl Fn(&Threat) -> Outline,
    ) -> Self {
        let outlines = scenario
            .threats
            .iter()
            .enumerate()
            .map(|(idx, threat)| counts(idx, threat).then(|| outline(threat)));
        Self::new(
            outlines,
            [scenario.start.xy(), scenario.target.xy()],
            Some(scenario.area),
        )
    }

    /// `outlines` (`None` leaves one out but keeps the numbers of the others) between two ends. An outline that reaches
    /// over an end is shrunk, down to its core. Strings bend only inside `area`, if there is one.
    #[must_use]
    pub fn new(
        outlines: impl IntoIterator<Item = Option<Outline>>,
        ends: [Point2; 2],
        area: Option<Rect>,
    ) -> Self {
        let outlines: Vec<Option<Outline>> = outlines.into_iter().collect();
        let count = outlines.len();
        let extent = outlines.iter().flatten().flat_map(|outline| {
            let points: &[Point2] = match &outline.shape {
                OutlineShape::Disc(center) => std::slice::from_ref(center),
                OutlineShape::Ring(ring) => ring,
            };
            points.iter().copied()
        });
        let extent = Rect::around(extent.chain(ends)).unwrap_or(Rect {
            min: ends[0],
            max: ends[0],
        });
        let mut scene = Self {
            ends,
            bodies: Vec::with_capacity(count),
            corners: Vec::with_capacity(count),
            corners_of: Vec::with_capacity(count),
            rings: Vec::new(),
            tree: None,
            stride: f64::INFINITY,
            longest_way: 2.0 * extent.diagonal(),
            area,
            touch: TOUCH * extent.diagonal().max(1.0),
        };
        for (idx, outline) in outlines.into_iter().enumerate() {
            let first = scene.corners.len();
            if let Some(outline) = outline {
                scene.add(idx, outline);
            }
            scene.corners_of.push(first..scene.corners.len());
        }
        let radii = scene.corners.iter().map(|corner| corner.radius);
        scene.longest_way += 20.0 * radii.fold(0.0, f64::max);
        if scene.bodies.len() > FEW_BODIES {
            let entries = scene.bodies.iter().enumerate().map(|(idx, body)| {
                let (low, high) = body.corners();
                GeomWithData::new(Rectangle::from_corners(low, high), idx)
            });
            scene.tree = Some(RTree::bulk_load(entries.collect()));
            // Roughly the visible distance among that many bodies.
            scene.stride = 2.0 * extent.diagonal() / (scene.bodies.len() as f64).sqrt();
        }
        scene
    }

    /// As it is, with bodies that may be touched `deep` metres deep at least.
    #[must_use]
    pub(super) fn forgiving(mut self, deep: f64) -> Self {
        self.touch = self.touch.max(deep);
        self
    }

    fn add(&mut self, idx: usize, outline: Outline) {
        let distances = self.ends.map(|end| outline.distance(end));
        let nearest = distances[0].min(distances[1]);
        if nearest < outline.core - self.touch {
            return;
        }
        if let OutlineShape::Ring(ring) = &outline.shape
            && self
                .ends
                .iter()
                .any(|end| ring::contains(ring, *end) && ring::distance(ring, *end) > self.touch)
        {
            return;
        }
        let radius = outline.radius.min(nearest);
        match outline.shape {
            OutlineShape::Disc(center) => self.add_disc(idx, center, radius),
            OutlineShape::Ring(ring) => self.add_ring(idx, ring, radius),
        }
    }

    fn add_disc(&mut self, outline: usize, center: Point2, radius: f64) {
        if radius <= self.touch {
            return;
        }
        let body = self.bodies.len();
        self.bodies.push(Body {
            a: center,
            b: center,
            radius,
            outline,
        });
        self.corners.push(Corner {
            center,
            radius,
            bodies: [body; 2],
            edges: None,
            outline,
        });
    }

    fn add_ring(&mut self, outline: usize, ring: Vec<Point2>, radius: f64) {
        let ring = ring::distinct(ring);
        let count = ring.len();
        let first_body = self.bodies.len();
        let twice_area = ring::twice_area(&ring);
        for i in 0..count {
            let (a, b) = (ring[i], ring[(i + 1) % count]);
            self.bodies.push(Body {
                a,
                b,
                radius,
                outline,
            });
            let before = ring[(i + count - 1) % count];
            let edges = [(before - a).normalize(), (b - a).normalize()];
            // A string never bends round a corner that points inwards.
            if count == 2 || edges[1].perp(&edges[0]) * twice_area > 0.0 {
                self.corners.push(Corner {
                    center: a,
                    radius,
                    bodies: [first_body + (i + count - 1) % count, first_body + i],
                    edges: Some(edges),
                    outline,
                });
            }
        }
        if radius <= self.touch {
            let extent = Rect::around(ring.iter().copied()).expect("a ring has vertices");
            self.rings.push(Ring {
                vertices: ring,
                extent,
                outline,
            });
        }
    }

    /// A body that the straight way from `a` to `b` enters, other than the bodies `own`; returns the index of its
    /// outline.
    pub(super) fn blocks_segment(&self, a: Point2, b: Point2, own: &[usize]) -> Option<usize> {
        let blocks = |body: &Body| {
            if body.radius > self.touch {
                let distance = if body.a == body.b {
                    point_segment(body.a, a, b)
                } else {
                    segment_segment((a, b), (body.a, body.b))
                };
                distance < body.radius - self.touch
            } else {
                self.crosses((a, b), (body.a, body.b))
            }
        };
        let way = b - a;
        let parts = (way.norm() / self.stride).ceil().max(1.0);
        let mut part = 0.0;
        while part < parts {
            let (from, to) = (a + way * (part / parts), a + way * ((part + 1.0) / parts));
            let low = [from.x.min(to.x), from.y.min(to.y)];
            let high = [from.x.max(to.x), from.y.max(to.y)];
            if let Some(outline) = self.first_of(low, high, own, blocks) {
                return Some(outline);
            }
            part += 1.0;
        }
        self.slips_into_ring(a, b)
    }

    /// A body that `arc` enters, other than its own bodies; returns the index of its outline.
    pub(super) fn blocks_arc(&self, arc: &Arc, own: &[usize]) -> Option<usize> {
        if arc.length() <= 0.0 {
            return None;
        }
        let (center, radius) = (arc.on.center, arc.on.radius);
        let low = [center.x - radius, center.y - radius];
        let high = [center.x + radius, center.y + radius];
        self.first_of(low, high, own, |body| {
            let distance = distance(arc, body);
            // An edge without width is not crossed either: the ring's inside is beyond it.
            distance < body.radius - self.touch
                || (body.radius <= self.touch && distance <= 0.0 && self.crosses_edge(arc, body))
        })
    }

    /// Whether `arc`, which meets the edge `body`, crosses it by more than a touch: not only with an end, and not only
    /// as far as it bulges.
    fn crosses_edge(&self, arc: &Arc, body: &Body) -> bool {
        let flatter = arc.narrowed(self.touch);
        distance(&flatter, body) <= 0.0 && !touches(arc, body, self.touch)
    }

    /// Whether `arc` leaves the area.
    pub(super) fn leaves_area(&self, arc: &Arc) -> bool {
        let Some(area) = self.area else {
            return false;
        };
        let outside = |point| area.excess(point) > self.touch;
        let bulges = [Vector2::x(), -Vector2::x(), Vector2::y(), -Vector2::y()];
        outside(arc.start())
            || outside(arc.end())
            || bulges.into_iter().any(|way| {
                outside(arc.on.center + way * arc.on.radius) && arc.turn > 0.0 && arc.passes(way)
            })
    }

    /// The outline of the first body near to the box that `blocks`.
    fn first_of(
        &self,
        low: [f64; 2],
        high: [f64; 2],
        own: &[usize],
        blocks: impl Fn(&Body) -> bool,
    ) -> Option<usize> {
        let body = |idx: usize| {
            let body = &self.bodies[idx];
            (!own.contains(&idx) && blocks(body)).then_some(body.outline)
        };
        match &self.tree {
            None => (0..self.bodies.len()).find_map(body),
            Some(tree) => tree
                .locate_in_envelope_intersecting(AABB::from_corners(low, high))
                .find_map(|entry| body(entry.data)),
        }
    }

    /// Whether two segments cross by more than a touch.
    fn crosses(&self, one: (Point2, Point2), other: (Point2, Point2)) -> bool {
        let off = |(a, b): (Point2, Point2), point: Point2| {
            let way = b - a;
            way.perp(&(point - a)).abs() / way.norm().max(f64::MIN_POSITIVE)
        };
        ring::crossing(one, other).is_some()
            && off(other, one.0) > self.touch
            && off(other, one.1) > self.touch
            && off(one, other.0) > self.touch
            && off(one, other.1) > self.touch
    }

    /// Whether the way from `a` to `b` touches corners of a ring without width and lies inside it
    /// between them.
    fn slips_into_ring(&self, a: Point2, b: Point2) -> Option<usize> {
        let way = b - a;
        let length = way.norm();
        if length <= 2.0 * self.touch {
            return None;
        }
        let near = Rect::around([a, b]).expect("two points").grown(self.touch);
        let slips = |ring: &&Ring| {
            if !ring.extent.meets(&near) {
                return false;
            }
            let along = way / length;
            let mut touches: Vec<f64> = ring
                .vertices
                .iter()
                .filter(|vertex| along.perp(&(*vertex - a)).abs() <= 2.0 * self.touch)
                .map(|vertex| along.dot(&(vertex - a)).clamp(0.0, length))
                .chain([0.0, length])
                .collect();
            touches.sort_by(f64::total_cmp);
            touches.windows(2).any(|pair| {
                let middle = a + along * (0.5 * (pair[0] + pair[1]));
                pair[1] - pair[0] > 4.0 * self.touch
                    && ring::contains(&ring.vertices, middle)
                    && ring::distance(&ring.vertices, middle) > 2.0 * self.touch
            })
        };
        self.rings.iter().find(slips).map(|ring| ring.outline)
    }
}

impl Body {
    fn corners(&self) -> ([f64; 2], [f64; 2]) {
        let radius = self.radius;
        (
            [
                self.a.x.min(self.b.x) - radius,
                self.a.y.min(self.b.y) - radius,
            ],
            [
                self.a.x.max(self.b.x) + radius,
                self.a.y.max(self.b.y) + radius,
            ],
        )
    }
}

/// Distance of `arc` from the middle of `body`.
fn distance(arc: &Arc, body: &Body) -> f64 {
    if body.a == body.b {
        arc.distance_to(body.a)
    } else {
        arc.distance_to_segment(body.a, body.b)
    }
}

/// Whether `arc` meets `body` only at one of the body's ends or of its own.
fn touches(arc: &Arc, body: &Body, touch: f64) -> bool {
    [body.a, body.b]
        .into_iter()
        .any(|end| arc.distance_to(end) <= touch)
        || [arc.start(), arc.end()]
            .into_iter()
            .any(|end| point_segment(end, body.a, body.b) <= touch)
}
