//! Kinds of first and last legs: what a route costs at least that has such a one.

use nalgebra::Vector2;

use super::super::departure::{Departure, Place, leaving};
use super::super::prices::Prices;
use super::super::string::{narrowed, scene, shortest};
use super::super::wall::Wall;
use super::exposure;
use super::ramp::Ramp;
use crate::geometry::{Point2, ring};
use crate::seeding::arc::point_segment;
use crate::seeding::outline::OutlineShape;

/// No string is pulled for sectors that are wider than this share of the way.
const COARSEST: f64 = 0.04;

/// Sectors to begin with.
const SECTORS: u32 = 8;

/// First legs of routes, or, seen backwards, last ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    /// The middle of their headings, and the half of their range, radians.
    heading: f64,
    half: f64,
    /// Lengths seen from above, metres; the second may be infinite.
    pub(super) lengths: [f64; 2],
    /// No route with such a leg costs less seen from above.
    pub(super) cost: f64,
    /// What the leg costs at least on top.
    pub(super) steepness: f64,
    /// What the shortest of them cost at least seen from above, less the fuel from their ends to that of the one in the
    /// middle.
    leg: f64,
    /// What may be gained by cutting the headings.
    turned: f64,
    /// Whether a string may tell that the cost is higher.
    pub(super) is_rough: bool,
    /// What the soft zones along the shortest of them cost at least.
    exposed: f64,
}

impl Kind {
    /// All legs, of routes that cost `least` or more.
    pub(super) fn all(least: f64) -> Vec<Self> {
        let half = std::f64::consts::PI / f64::from(SECTORS);
        let sector = |sector| Self {
            heading: 2.0 * half * f64::from(sector),
            half,
            lengths: [0.0, f64::INFINITY],
            cost: least,
            steepness: 0.0,
            leg: 0.0,
            turned: 0.0,
            is_rough: false,
            exposed: 0.0,
        };
        (0..SECTORS).map(sector).collect()
    }
}

/// Where a route begins, or, seen backwards, ends.
pub(super) struct End<'a> {
    /// 0 of the start, 1 of the target.
    pub(super) which: usize,
    pub(super) from: Point2,
    pub(super) to: Point2,
    /// Metres between it and the middle of the band.
    pub(super) height: f64,
    /// Of a metre between the waypoint and the middle of the band.
    pub(super) weight: f64,
    /// Metres of climb in a metre seen from above, at most.
    pub(super) steepest: f64,
    /// Where it lies outside the band.
    pub(super) ramp: Option<Ramp>,
    /// Metres from it to the zone round the other end.
    pub(super) apart: f64,
    pub(super) prices: &'a Prices,
    pub(super) walls: &'a [Wall],
    pub(super) radii: &'a [Option<f64>],
    pub(super) slack: f64,
    pub(super) stop: &'a dyn Fn() -> bool,
}

impl End<'_> {
    /// What may be gained by looking at `kind` more closely.
    pub(super) fn gain(&self, kind: &Kind) -> f64 {
        if kind.is_rough {
            f64::INFINITY
        } else {
            kind.turned.max(self.longer(kind))
        }
    }

    /// What may be gained by cutting the lengths of `kind`.
    fn longer(&self, kind: &Kind) -> f64 {
        // What is flown in the zone round the other end is not told apart.
        if kind.lengths[0] >= self.apart {
            return 0.0;
        }
        self.steepness([kind.lengths[0]; 2], kind.exposed) - kind.steepness
    }

    /// `kind` in two parts, not yet priced.
    pub(super) fn parts(&self, kind: &Kind) -> [Kind; 2] {
        if kind.turned >= self.longer(kind) {
            let half = 0.5 * kind.half;
            let part = |side: f64| Kind {
                heading: kind.heading + side * half,
                half,
                ..*kind
            };
            return [part(-1.0), part(1.0)];
        }
        let [shortest, longest] = kind.lengths;
        let between = self.between(kind).clamp(shortest, longest);
        [[shortest, between], [between, longest]].map(|lengths| Kind { lengths, ..*kind })
    }

    /// The length at which those of `kind` are cut.
    fn between(&self, kind: &Kind) -> f64 {
        let [shortest, longest] = kind.lengths;
        if let Some(ramp) = self.ramp {
            let bends = [ramp.reach, ramp.run(self.height)];
            let mut within = bends
                .into_iter()
                .filter(|at| shortest < *at && *at < longest);
            if let Some(bend) = within.next() {
                return bend;
            }
            if shortest >= ramp.reach {
                return 0.5 * (shortest + longest);
            }
        }
        let steepest = self.gently(shortest, kind.exposed);
        self.length_of(0.5 * (steepest + kind.steepness), kind.exposed)
    }

    /// `kind`, with what its legs cost at least at the price of the straight line from there.
    pub(super) fn priced(&self, kind: Kind) -> Kind {
        let [length, longest] = kind.lengths;
        if length <= 0.0 {
            let steepness = self.gently(longest, 0.0);
            return Kind { steepness, ..kind };
        }
        let (at, spread) = self.reached(&kind);
        if self.is_blocked(at, spread) {
            return Kind {
                cost: f64::INFINITY,
                ..kind
            };
        }
        let fuel = self.prices.fuel;
        let [exposed, middle] = self.exposed(at, kind.half);
        let leg = fuel * (length - spread) + exposed + self.later(length);
        Kind {
            cost: kind.cost.max(leg + fuel * (self.to - at).norm()),
            steepness: self.steepness(kind.lengths, exposed),
            leg,
            turned: 2.0 * fuel * spread + (middle - exposed),
            is_rough: spread <= COARSEST * (self.to - self.from).norm(),
            exposed,
            ..kind
        }
    }

    /// `kind`, with what its legs cost at least beyond the `rise` of a potential on the way to any place within so many
    /// metres of another, before they come to the zone round the other end.
    pub(super) fn beyond(&self, kind: Kind, rise: &dyn Fn(Point2, f64) -> Option<f64>) -> Kind {
        let [shortest, longest] = kind.lengths;
        let kind = Kind {
            lengths: [shortest.min(self.apart), longest],
            ..kind
        };
        let length = kind.lengths[0];
        if length <= 0.0 {
            return Kind {
                cost: self.later(length),
                steepness: self.before_other_zone(kind.lengths, 0.0),
                ..kind
            };
        }
        let (at, spread) = self.reached(&kind);
        let highest = rise(at, spread).filter(|_| !self.is_blocked(at, spread));
        let Some(highest) = highest else {
            return Kind {
                cost: f64::INFINITY,
                ..kind
            };
        };
        let fuel = self.prices.fuel;
        let [exposed, middle] = self.exposed(at, kind.half);
        Kind {
            cost: kind
                .cost
                .max(fuel * length + exposed + self.later(length) - highest),
            steepness: self.before_other_zone(kind.lengths, exposed),
            // The potential is at least as steep as fuel is dear, about.
            turned: fuel * spread + (middle - exposed),
            exposed,
            ..kind
        }
    }

    /// `kind`, with the price of the string from there, and the ways looked at; one that is proven to be `enough` is not
    /// pulled to its end.
    pub(super) fn pulled(&self, kind: Kind, enough: f64) -> (Kind, usize) {
        let (at, spread) = self.reached(&kind);
        let (rest, ways) = self.rest(at, spread, enough - kind.steepness - kind.leg);
        let kind = Kind {
            cost: kind.cost.max(kind.leg + rest),
            is_rough: false,
            ..kind
        };
        (kind, ways)
    }

    /// Where the shortest leg in the middle of `kind` ends, and how far others are from it at most, point by point.
    fn reached(&self, kind: &Kind) -> (Point2, f64) {
        let length = kind.lengths[0];
        let way = Vector2::new(libm::cos(kind.heading), libm::sin(kind.heading)) * length;
        (self.from + way, length * kind.half)
    }

    /// The walls that count, each with the metres from here on for which it does.
    fn counting(&self) -> impl Iterator<Item = (&Wall, f64)> {
        let both = self.walls.iter().zip(self.radii);
        let counts = both.map(|(wall, radius)| {
            let stay = radius.map_or(wall.stays[self.which], |_| f64::INFINITY);
            (wall, stay)
        });
        counts.filter(|(_, stay)| *stay > 0.0)
    }

    /// How far a leg to `at` leads in so many metres.
    fn at_most(&self, at: Point2, metres: f64) -> Point2 {
        let way = at - self.from;
        let length = way.norm();
        if metres < length {
            self.from + way * (metres / length)
        } else {
            at
        }
    }

    /// What is paid at least, after a leg of `length`, in the zones of walls that cannot be passed yet.
    fn later(&self, length: f64) -> f64 {
        let passable = self.counting().filter(|(_, stay)| stay.is_finite());
        let exposed = passable.map(|(wall, stay)| {
            let first = |metres| leaving(wall, (self.from, 0.0), metres);
            first(stay) - first(stay.min(length))
        });
        self.prices.exposure * exposed.sum::<f64>()
    }

    /// Whether every leg to within `spread` of `at` enters a core.
    pub(super) fn is_blocked(&self, at: Point2, spread: f64) -> bool {
        self.counting().any(|(wall, stay)| {
            let at = self.at_most(at, stay);
            match &wall.shape {
                OutlineShape::Disc(center) => {
                    wall.core > spread && point_segment(*center, self.from, at) < wall.core - spread
                }
                OutlineShape::Ring(ring) => (1..=16).rev().any(|i| {
                    let point = self.from + (at - self.from) * (f64::from(i) / 16.0);
                    ring::contains(ring, point)
                        && ring::distance(ring, point) > spread + 2.0 * self.prices.tolerance
                }),
            }
        })
    }

    /// What the soft zones cost of all legs to as far as `at` and within `half` radians of it: no less than the first, and
    /// of the one to `at` about the second.
    pub(super) fn exposed(&self, at: Point2, half: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (wall, stay) in self.counting() {
            let at = self.at_most(at, stay);
            for (sum, half) in sums.iter_mut().zip([half, 0.0]) {
                *sum += self.prices.exposure * exposure::least(wall, (self.from, at), half);
            }
        }
        sums
    }

    /// What no route from within `spread` of `at` to the other end undercuts, but for the fuel of `spread`, or `enough` of
    /// it, and the ways looked at.
    fn rest(&self, at: Point2, spread: f64, enough: f64) -> (f64, usize) {
        // Free to move to the middle of the sector first.
        let radii = narrowed((self.walls, self.radii), at, spread);
        let field = (self.walls, &radii[..]);
        let here = Place {
            at,
            spread,
            end: None,
        };
        let there = Place {
            at: self.to,
            spread: 0.0,
            end: Some(1 - self.which),
        };
        let first = Departure::of(field, self.prices, [here, there], &[]);
        let last = Departure::of(field, self.prices, [there, here], &[]);
        let tolls = first.toll + last.toll;
        let scene = scene(field, [at, last.at]);
        let enough = (enough - tolls).max(0.0) / self.prices.fuel + self.slack;
        let (string, ways) = shortest(&scene, (enough, self.stop));
        (self.prices.fuel * (string - self.slack) + tolls, ways)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::super::super::tests::scenario;
    use super::super::super::around;
    use super::*;

    /// The start, 100 m below the middle of the band, at 1 a metre off it, for climbs of 45 degrees.
    fn end<'a>(prices: &'a Prices, walls: &'a [Wall], radii: &'a [Option<f64>]) -> End<'a> {
        End {
            which: 0,
            from: prices.ends[0].xy(),
            to: prices.ends[1].xy(),
            height: 100.0,
            weight: 1.0,
            steepest: 1.0,
            ramp: None,
            apart: f64::INFINITY,
            prices,
            walls,
            radii,
            slack: 0.0,
            stop: &|| false,
        }
    }

    /// From (200, 100), 100 m below the middle of the band, at 0.5 a metre and 1 a metre off the middle.
    pub(in super::super) fn check(examine: impl Fn(&End)) {
        let scenario = scenario(
            r#""threats": [{"kind": "cylinder", "center": {"x": 400, "y": 160}, "radius": 50, "influence": 80}]"#,
        );
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let radii: Vec<_> = walls.iter().map(|wall| Some(wall.wide)).collect();
        examine(&end(&prices, &walls, &radii));
    }

    /// Beneath the top for 60 m, a leg is as exposed, and as blocked, as one so long; a shorter one leaves something to
    /// those after it.
    #[test]
    fn a_leg_is_under_a_top_for_as_long_as_it_climbs() {
        let scenario = scenario(
            r#""threats": [{"kind": "cylinder", "center": {"x": 260, "y": 100}, "radius": 30, "influence": 100, "top": 60}]"#,
        );
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let end = end(&prices, &walls, &[None]);
        let to = |length: f64| end.from - Vector2::new(0.0, length);
        let exposed = |length: f64| end.exposed(to(length), 0.0)[0];
        assert!(exposed(30.0) < exposed(60.0) && exposed(60.0) > 0.0);
        assert!((exposed(90.0) - exposed(60.0)).abs() < 1e-3);
        assert!(end.later(0.0) > end.later(30.0) && end.later(30.0) > 0.0);
        assert!(end.later(60.0) < 1e-4 * end.later(0.0));
        let over = end.from + Vector2::new(90.0, 0.0);
        assert!(end.is_blocked(over, 0.0) && !end.is_blocked(to(90.0), 0.0));
    }

    /// However often kinds are cut: all legs are of one, and none is told to cost more than it does.
    #[test]
    fn every_leg_is_of_a_kind_that_costs_no_more() {
        check(|end| {
            let mut kinds = Kind::all(0.0);
            for round in 0..200 {
                let kind = kinds.swap_remove(round * 7 % kinds.len());
                let parts = end.parts(&kind).map(|part| end.priced(part));
                kinds.extend(parts.map(|part| end.pulled(part, f64::INFINITY).0));
            }
            for idx in 0..400 {
                let share = f64::from(idx) / 400.0;
                let (heading, length) = (
                    share * std::f64::consts::TAU,
                    1000.0 * (share * 37.0).fract(),
                );
                let way = Vector2::new(libm::cos(heading), libm::sin(heading));
                let at = end.from + way * length;
                // Nothing is paid but fuel where a leg keeps away from the soft zone, and nothing is in the way from there.
                let least = end.prices.fuel * (length + (end.to - at).norm());
                let is_free = [(end.from, at), (at, end.to)]
                    .iter()
                    .all(|(a, b)| point_segment(Point2::new(400.0, 160.0), *a, *b) > 80.0);
                let of = |kind: &&Kind| {
                    let off = crate::geometry::wrap_angle(heading - kind.heading).abs();
                    off <= kind.half + 1e-9 && (kind.lengths[0]..=kind.lengths[1]).contains(&length)
                };
                let mut own = kinds.iter().filter(of).peekable();
                assert!(own.peek().is_some());
                assert!(!is_free || own.all(|kind| kind.cost <= least + 1e-6));
            }
        });
    }
}
