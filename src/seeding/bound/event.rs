//! What a route would have to do to beat the string round the widened walls, and the least cost of doing so: slip
//! between two walls, cut a corner, fly over or under.

use super::departure::early;
use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::{Point2, ring};
use crate::seeding::arc::{nearest_points, point_segment};
use crate::seeding::outline::OutlineShape;

/// Pairs of cores looked at before the search for gaps gives up.
const MOST_PAIRS: usize = 300_000;

/// Number of pairs examined between two checks whether to stop: in a ring of thousands of corners, each takes a while.
const PAIRS_UNWATCHED: usize = 64;

/// A way to beat the string.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Event {
    pub(super) kind: Kind,
    /// No route does it for less than this.
    pub(super) cost: f64,
    /// Its cost beyond the string round walls that are not widened.
    pub(super) extra: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Pass between two walls where their shapes are nearest to each other; the same wall twice where a ring nearly
    /// closes.
    Slip {
        walls: [usize; 2],
        between: [Point2; 2],
    },
    /// Come nearer to a wall than its `dip`.
    Dip { wall: usize },
    /// Fly over or under a wall.
    Pass { wall: usize },
}

impl Event {
    /// The walls involved, sometimes the same one twice.
    pub(super) fn walls(&self) -> impl Iterator<Item = usize> + use<> {
        let walls = match self.kind {
            Kind::Slip { walls, .. } => walls,
            Kind::Dip { wall } | Kind::Pass { wall } => [wall, wall],
        };
        walls.into_iter()
    }
}

/// Where edges of two rings cross, each this many times the tolerance beyond the other at both of its ends, nothing
/// passes between the rings.
const CROSSED: f64 = 4.0;

/// A convex core: a disc's centre, or an edge of a ring.
#[derive(Debug, Clone, Copy)]
struct Core {
    a: Point2,
    b: Point2,
    wall: usize,
    edge: usize,
}

impl Core {
    /// Whether it is the edge of a ring.
    fn is_edge(&self) -> bool {
        self.a != self.b
    }
}

/// All events, cheapest first; `None` when there are too many to examine, or once `stop` asks for it.
pub(super) fn events(
    walls: &[Wall],
    prices: &Prices,
    stop: &dyn Fn() -> bool,
) -> Option<Vec<Event>> {
    let mut events = gaps(walls, prices, stop)?;
    let early = early(walls, prices);
    for (idx, wall) in walls.iter().enumerate() {
        if let Some(toll) = wall.toll {
            let vertical = toll.vertical.max(prices.rise());
            events.push(Event {
                kind: Kind::Pass { wall: idx },
                cost: prices.climbing(prices.direct(), vertical) + toll.altitude + early,
                extra: toll.altitude,
            });
        }
        if wall.dip > wall.core && wall.wide > wall.safe {
            events.push(dip(idx, wall, prices));
        }
    }
    events.sort_by(|one, other| one.cost.total_cmp(&other.cost));
    Some(events)
}

/// Coming as near to a wall as `dip`, and away again: on either side the soft zone is crossed at least as fast as the
/// distance to the corner grows.
fn dip(idx: usize, wall: &Wall, prices: &Prices) -> Event {
    let (mut cost, mut extra) = (f64::INFINITY, f64::INFINITY);
    for center in wall.centers() {
        let ways = prices
            .ends
            .map(|end| ((end.xy() - center).norm() - wall.dip).max(0.0));
        let depth = (wall.influence - wall.dip).max(0.0);
        let more = prices.exposure * (ramp(depth, 1.0, ways[0]) + ramp(depth, 1.0, ways[1]));
        let length = (ways[0] + ways[1]).max(prices.direct());
        cost = cost.min(prices.reaching(length, more));
        extra = extra.min(more);
    }
    Event {
        kind: Kind::Dip { wall: idx },
        cost,
        extra,
    }
}

/// Integral of `(depth - slope u)_+` for u from 0 to `way`.
pub(super) fn ramp(depth: f64, slope: f64, way: f64) -> f64 {
    if depth <= 0.0 {
        return 0.0;
    }
    let way = way.min(depth / slope);
    way * (depth - 0.5 * slope * way)
}

/// The gaps between walls that overlap when widened.
pub(super) fn gaps(walls: &[Wall], prices: &Prices, stop: &dyn Fn() -> bool) -> Option<Vec<Event>> {
    let mut cores = cores(walls);
    let low = |core: &Core| core.a.x.min(core.b.x) - walls[core.wall].wide;
    let high = |core: &Core| core.a.x.max(core.b.x) + walls[core.wall].wide;
    cores.sort_by(|one, other| low(one).total_cmp(&low(other)));
    let (mut events, mut pairs) = (Vec::new(), 0);
    for (at, one) in cores.iter().enumerate() {
        let near = cores[at + 1..]
            .iter()
            .take_while(|other| low(other) <= high(one));
        for other in near {
            pairs += 1;
            if pairs > MOST_PAIRS || (pairs % PAIRS_UNWATCHED == 0 && stop()) {
                return None;
            }
            events.extend(gap(one, other, walls, prices));
        }
    }
    Some(events)
}

fn cores(walls: &[Wall]) -> Vec<Core> {
    let mut cores = Vec::new();
    for (wall_idx, wall) in walls.iter().enumerate() {
        match &wall.shape {
            OutlineShape::Disc(center) => cores.push(Core {
                a: *center,
                b: *center,
                wall: wall_idx,
                edge: 0,
            }),
            OutlineShape::Ring(ring) => {
                cores.extend((0..ring.len()).map(|edge| Core {
                    a: ring[edge],
                    b: ring[(edge + 1) % ring.len()],
                    wall: wall_idx,
                    edge,
                }));
            }
        }
    }
    cores
}

/// The gap between two cores, if their widened walls overlap and something can pass there.
fn gap(one: &Core, other: &Core, walls: &[Wall], prices: &Prices) -> Option<Event> {
    let (wall, next) = (&walls[one.wall], &walls[other.wall]);
    let (p, q) = nearest_points((one.a, one.b), (other.a, other.b));
    let apart = (q - p).norm();
    if apart >= wall.wide + next.wide {
        return None;
    }
    let same = one.wall == other.wall;
    let closed = if same {
        is_closed(wall, one, other, p, q)
    } else {
        is_shut([one, other], [wall, next], apart, prices.tolerance)
    };
    if closed {
        return None;
    }
    let ways = prices.ends.map(|end| point_segment(end.xy(), p, q));
    let exposure: f64 = ways
        .iter()
        .map(|way| {
            if same {
                ramp(wall.influence - 0.5 * apart, 1.0, *way)
            } else {
                let depth = wall.influence + next.influence - apart;
                let discs = one.a == one.b && other.a == other.b;
                if discs {
                    between_discs(wall, next, apart, *way)
                } else {
                    // The border has no zone that could be left.
                    let zones = if wall.is_border || next.is_border {
                        1.0
                    } else {
                        2.0
                    };
                    ramp(depth, zones, *way)
                }
            }
        })
        .sum();
    let length = (ways[0] + ways[1]).max(prices.direct());
    let extra = prices.exposure * exposure;
    Some(Event {
        kind: Kind::Slip {
            walls: [one.wall, other.wall],
            between: [p, q],
        },
        cost: prices.reaching(length, extra),
        extra,
    })
}

/// Whether nothing passes between the hard parts of two walls where they are `apart`. To touch is not to enter, and a
/// ring may be entered by the tolerance, which the core of a disc is smaller by already.
fn is_shut([one, other]: [&Core; 2], walls: [&Wall; 2], apart: f64, tolerance: f64) -> bool {
    let hard = walls[0].core + walls[1].core;
    match (one.is_edge(), other.is_edge()) {
        (false, false) => apart <= hard,
        (true, true) => {
            let beyond = |end, of: &Core| point_segment(end, of.a, of.b) > CROSSED * tolerance;
            let is_beyond = |edge: &Core, of: &Core| beyond(edge.a, of) && beyond(edge.b, of);
            apart <= 0.0 && is_beyond(one, other) && is_beyond(other, one)
        }
        _ => apart <= hard - tolerance,
    }
}

/// Least exposure to two discs on a way that begins between their centres and goes `way` metres or
/// further from there: the integral of `(I + I' - D sqrt(1 + u^2 / q))_+`.
fn between_discs(one: &Wall, other: &Wall, apart: f64, way: f64) -> f64 {
    let depth = one.influence + other.influence;
    let least = (one.core * (apart - one.core)).min(other.core * (apart - other.core));
    if depth <= apart || least <= 0.0 {
        return ramp(depth - apart, 2.0, way);
    }
    let ratio = depth / apart;
    let way = way.min((least * (ratio * ratio - 1.0)).sqrt());
    // With k = sqrt(q): integral of sqrt(1 + u^2 / k^2) = (u sqrt(1 + u^2/k^2) + k asinh(u / k)) / 2.
    let k = least.sqrt();
    let root = (1.0 + way * way / least).sqrt();
    let integral = 0.5 * (way * root + k * libm::asinh(way / k));
    let lower = (depth * way - apart * integral) - 1e-12 * depth * way;
    lower.max(ramp(depth - apart, 2.0, way))
}

/// Whether nothing passes between two edges of one ring: they meet, a third edge joins them where
/// they are nearest, or the inside lies between.
fn is_closed(wall: &Wall, one: &Core, other: &Core, p: Point2, q: Point2) -> bool {
    let OutlineShape::Ring(ring) = &wall.shape else {
        return true;
    };
    let count = ring.len();
    if (one.edge + 1) % count == other.edge || (other.edge + 1) % count == one.edge {
        return true;
    }
    let edges = || ring::edges(ring);
    if edges().any(|(a, b)| (a == p && b == q) || (a == q && b == p)) {
        return true;
    }
    let middle = p + (q - p) * 0.5;
    edges().all(|edge| ring::crossing(edge, (p, q)).is_none()) && ring::contains(ring, middle)
}
