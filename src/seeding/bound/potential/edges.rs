//! The edges of soft zones, of cores and of the area, where the price of a metre jumps or begins to change.

use std::f64::consts::TAU;

use super::super::wall::Wall;
use super::zones::Zones;
use crate::geometry::{Point2, Rect, Vector2, ring};
use crate::seeding::outline::OutlineShape;

/// Maximum number of corners of a ring whose edges are listed.
const MOST_CORNERS: usize = 100;

/// An edge.
pub(super) struct Edge<'a> {
    line: Line,
    /// A rectangle round it.
    pub(super) extent: Rect,
    /// The wall that it belongs to and its least distance from the wall's shape; `None` for an edge of the area.
    of: Option<(&'a Wall, f64)>,
}

/// All edges that overlap the rectangle of `zones`.
pub(super) fn all<'a>(zones: &Zones<'a>) -> Vec<Edge<'a>> {
    let (rect, tolerance) = (zones.rect(), zones.tolerance());
    let mut edges: Vec<Edge> = ring::edges(&rect.corners())
        .map(|(a, b)| Edge::new(Line::Straight(a, b), None))
        .collect();
    for wall in zones
        .counted()
        .filter(|wall| wall.corners() <= MOST_CORNERS)
    {
        round(wall, tolerance, &mut |line, away| {
            let edge = Edge::new(line, Some((wall, away - tolerance)));
            if edge.extent.meets(&rect) {
                edges.push(edge);
            }
        });
    }
    edges
}

impl<'a> Edge<'a> {
    fn new(line: Line, of: Option<(&'a Wall, f64)>) -> Self {
        Self {
            extent: line.extent(),
            line,
            of,
        }
    }

    /// Length, metres.
    pub(super) fn length(&self) -> f64 {
        match &self.line {
            Line::Straight(a, b) => (b - a).norm(),
            Line::Circle(_, radius) => TAU * radius,
        }
    }

    /// Radius of its circle; infinite if it is straight.
    pub(super) fn radius(&self) -> f64 {
        match &self.line {
            Line::Straight(..) => f64::INFINITY,
            Line::Circle(_, radius) => *radius,
        }
    }

    /// The place this many metres after its beginning.
    pub(super) fn at(&self, along: f64) -> Point2 {
        match &self.line {
            Line::Straight(a, b) => a + (b - a) * (along / (b - a).norm()),
            Line::Circle(center, radius) => {
                let (sin, cos) = libm::sincos(along / radius);
                center + Vector2::new(cos, sin) * *radius
            }
        }
    }

    /// Whether it is an edge at that place: an edge of a soft zone within another part of the same zone does not count.
    pub(super) fn is_there(&self, place: Point2) -> bool {
        self.of
            .is_none_or(|(wall, away)| wall.distance(place) >= away)
    }

    /// Where it crosses another.
    pub(super) fn crossings(&self, other: &Self) -> impl Iterator<Item = Point2> {
        let places = crossings(&self.line, &other.line).into_iter().flatten();
        places.filter(|place| self.is_there(*place) && other.is_there(*place))
    }
}

#[derive(Debug, Clone, Copy)]
enum Line {
    Straight(Point2, Point2),
    Circle(Point2, f64),
}

impl Line {
    fn extent(&self) -> Rect {
        match self {
            Self::Straight(a, b) => Rect::around([*a, *b]).expect("two points"),
            Self::Circle(center, radius) => Rect {
                min: *center,
                max: *center,
            }
            .grown(*radius),
        }
    }
}

/// Report the lines round a wall's core and soft zone, with their distance from its shape: inside them by the
/// tolerance, so that what is linear between places on them lies within.
fn round(wall: &Wall, tolerance: f64, tell: &mut dyn FnMut(Line, f64)) {
    let zone = wall.influence - 2.0 * tolerance;
    match &wall.shape {
        OutlineShape::Disc(center) => {
            let core = wall.core - 0.5 * tolerance;
            for radius in [core, zone] {
                if radius >= core && radius > tolerance {
                    tell(Line::Circle(*center, radius), radius);
                }
            }
        }
        OutlineShape::Ring(ring) => {
            // Inside the ring by more than a route may enter it.
            for (a, b) in ring::edges(&inset(ring, 3.0 * tolerance)) {
                tell(Line::Straight(a, b), 0.0);
            }
            if zone > tolerance {
                for (a, b) in ring::edges(ring) {
                    tell(Line::Circle(a, zone), zone);
                    let along = b - a;
                    let out = Vector2::new(-along.y, along.x).normalize() * zone;
                    for out in [out, -out] {
                        tell(Line::Straight(a + out, b + out), zone);
                    }
                }
            }
        }
    }
}

/// The ring with its corners moved inwards so that its edges are `by` metres inside the given ones.
fn inset(ring: &[Point2], by: f64) -> Vec<Point2> {
    let turning = ring::twice_area(ring).signum();
    let count = ring.len();
    (0..count)
        .map(|i| {
            let [before, at, after] = [
                ring[(i + count - 1) % count],
                ring[i],
                ring[(i + 1) % count],
            ];
            let left = |way: Vector2| Vector2::new(-way.y, way.x) * turning;
            let [one, other] = [at - before, after - at].map(|way| left(way.normalize()));
            let sum = one + other;
            // A spike has practically no inside.
            at + sum * (2.0 * by / sum.norm_squared().max(1e-4))
        })
        .collect()
}

/// Where two lines cross.
fn crossings(one: &Line, other: &Line) -> [Option<Point2>; 2] {
    match (one, other) {
        (Line::Circle(a, p), Line::Circle(b, q)) => {
            let between = b - a;
            let apart = between.norm();
            let along = (apart * apart + p * p - q * q) / (2.0 * apart);
            let squared = p * p - along * along;
            if squared.is_nan() || squared < 0.0 {
                return [None; 2];
            }
            let unit = between / apart;
            let aside = Vector2::new(-unit.y, unit.x) * squared.sqrt();
            [
                Some(a + unit * along + aside),
                Some(a + unit * along - aside),
            ]
        }
        (Line::Circle(center, radius), Line::Straight(a, b))
        | (Line::Straight(a, b), Line::Circle(center, radius)) => {
            let way = b - a;
            let length = way.norm();
            let unit = way / length;
            let along = (center - a).dot(&unit);
            let squared = radius * radius - (a + unit * along - center).norm_squared();
            if squared.is_nan() || squared < 0.0 {
                return [None; 2];
            }
            [squared.sqrt(), -squared.sqrt()].map(|half| {
                let place = along + half;
                (0.0..=length).contains(&place).then(|| a + unit * place)
            })
        }
        (Line::Straight(a, b), Line::Straight(c, d)) => {
            let share = ring::crossing((*a, *b), (*c, *d));
            [share.map(|share| a + (b - a) * share), None]
        }
    }
}
