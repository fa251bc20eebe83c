//! Kinds of first and last legs: the least cost of a route that has one.

use nalgebra::Vector2;

use super::super::departure::{Departure, Place};
use super::super::prices::Prices;
use super::super::string::{narrowed, scene, shortest};
use super::super::wall::Wall;
use super::ramp::Ramp;
use super::slopes::Slopes;
use super::threats::Climb;
use crate::geometry::Point2;

/// No string is computed for sectors wider than this share of the way.
const COARSEST: f64 = 0.04;

/// Initial number of sectors.
const SECTORS: u32 = 8;

/// First legs of routes, or, seen backwards, last ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    /// The middle of their headings, and half of their range, radians.
    pub(super) heading: f64,
    pub(super) half: f64,
    /// Lengths seen from above, metres; the second may be infinite.
    pub(super) lengths: [f64; 2],
    /// No route with such a leg costs less than this seen from above.
    pub(super) cost: f64,
    /// Least extra cost of the leg.
    pub(super) steepness: f64,
    /// The least cost of the shortest of them seen from above, less the fuel from their ends to that of the one in the
    /// middle.
    pub(super) leg: f64,
    /// Possible gain from dividing the headings.
    pub(super) turned: f64,
    /// Whether a string may show that the cost is higher.
    pub(super) is_rough: bool,
    /// Least cost of the soft zones along the shortest of them.
    pub(super) exposed: f64,
    /// Their slopes; `None` for all.
    pub(super) slopes: Option<Slopes>,
    /// Possible gain from dividing the slopes.
    pub(super) sloped: f64,
}

impl Kind {
    /// All legs, for routes that cost `least` or more.
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
            slopes: None,
            sloped: 0.0,
        };
        (0..SECTORS).map(sector).collect()
    }

    fn climb(&self) -> Climb {
        self.slopes.map_or(Climb::Any, Climb::As)
    }
}

/// Where a route begins, or, seen backwards, ends.
pub(super) struct End<'a> {
    /// 0 for the start, 1 for the target.
    pub(super) which: usize,
    pub(super) from: Point2,
    pub(super) to: Point2,
    /// Metres between it and the middle of the band.
    pub(super) height: f64,
    /// Whether it lies below that.
    pub(super) is_below: bool,
    /// Cost of a metre between the waypoint and the middle of the band, on this side of it and beyond it; 0 where
    /// nothing is known of that.
    pub(super) weight: f64,
    pub(super) beyond: f64,
    /// Greatest climb per metre seen from above, metres.
    pub(super) steepest: f64,
    /// Set where it lies outside the band.
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
    /// `kind`, with the least cost of its legs at the price of the straight line from there.
    pub(super) fn priced(&self, kind: Kind) -> Kind {
        let [length, longest] = kind.lengths;
        if length <= 0.0 {
            let steepness = self.steepness([0.0, longest], 0.0, kind.slopes);
            return Kind { steepness, ..kind };
        }
        let (at, spread) = self.reached(&kind);
        if self.is_blocked(at, spread, kind.climb()) {
            return Kind {
                cost: f64::INFINITY,
                ..kind
            };
        }
        let fuel = self.prices.fuel;
        let [exposed, middle] = self.exposed(at, kind.half, kind.climb());
        let leg = fuel * (length - spread) + exposed + self.later(length);
        Kind {
            cost: kind.cost.max(leg + fuel * (self.to - at).norm()),
            steepness: self.steepness(kind.lengths, exposed, kind.slopes),
            leg,
            turned: 2.0 * fuel * spread + (middle - exposed),
            is_rough: spread <= COARSEST * (self.to - self.from).norm(),
            exposed,
            sloped: self.sloped(&kind, (at, spread), exposed),
            ..kind
        }
    }

    /// `kind`, with the least cost of its legs beyond the `rise` of a potential on the way to any place within a given
    /// distance of another, before they enter the zone round the other end.
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
                steepness: self.before_other_zone(kind.lengths, 0.0, kind.slopes),
                ..kind
            };
        }
        let (at, spread) = self.reached(&kind);
        let highest = rise(at, spread).filter(|_| !self.is_blocked(at, spread, kind.climb()));
        let Some(highest) = highest else {
            return Kind {
                cost: f64::INFINITY,
                ..kind
            };
        };
        let fuel = self.prices.fuel;
        let [exposed, middle] = self.exposed(at, kind.half, kind.climb());
        Kind {
            cost: kind
                .cost
                .max(fuel * length + exposed + self.later(length) - highest),
            steepness: self.before_other_zone(kind.lengths, exposed, kind.slopes),
            // The potential is at least about as steep as the fuel price.
            turned: fuel * spread + (middle - exposed),
            exposed,
            sloped: self.sloped(&kind, (at, spread), exposed),
            ..kind
        }
    }

    /// `kind`, with the price of the string from there, and the ways examined; a string proven to cost `enough` is not
    /// computed to the end.
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

    /// Where the shortest leg in the middle of `kind` ends, and the greatest distance of others from it, point by
    /// point.
    fn reached(&self, kind: &Kind) -> (Point2, f64) {
        let length = kind.lengths[0];
        let way = Vector2::new(libm::cos(kind.heading), libm::sin(kind.heading)) * length;
        (self.from + way, length * kind.half)
    }

    /// Possible gain from dividing the slopes of legs of `kind` that are `exposed`: the greatest cost of passable
    /// threats.
    fn sloped(&self, kind: &Kind, (at, spread): (Point2, f64), exposed: f64) -> f64 {
        if kind.slopes.is_some() || self.radii.iter().all(Option::is_some) {
            return 0.0;
        }
        if self.is_blocked(at, spread, Climb::Along) {
            return f64::INFINITY;
        }
        self.exposed(at, kind.half, Climb::Along)[0] - exposed
    }

    /// A lower bound for routes from within `spread` of `at` to the other end, except for the fuel of `spread`, or
    /// `enough` of it, and the ways examined.
    fn rest(&self, at: Point2, spread: f64, enough: f64) -> (f64, usize) {
        // The way may use the middle of the sector for free.
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
    use super::super::super::widening;
    use super::*;
    use crate::seeding::arc::point_segment;

    /// The start, 100 m below the middle of the band, at a cost of 1 per metre off it, with climbs of up to 45
    /// degrees.
    pub(in super::super) fn end<'a>(
        prices: &'a Prices,
        walls: &'a [Wall],
        radii: &'a [Option<f64>],
    ) -> End<'a> {
        End {
            which: 0,
            from: prices.ends[0].xy(),
            to: prices.ends[1].xy(),
            height: 100.0,
            is_below: true,
            weight: 1.0,
            beyond: 1.0,
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

    /// From (200, 100), 100 m below the middle of the band, at 0.5 per metre flown and 1 per metre off the middle.
    pub(in super::super) fn check(examine: impl Fn(&End)) {
        let scenario = scenario(
            r#""threats": [{"kind": "cylinder", "center": {"x": 400, "y": 160}, "radius": 50, "influence": 80}]"#,
        );
        let prices = Prices::of(&scenario);
        let walls = widening::walls(&scenario, &prices);
        let radii: Vec<_> = walls.iter().map(|wall| Some(wall.wide)).collect();
        examine(&end(&prices, &walls, &radii));
    }

    /// However often kinds are divided, every leg belongs to one, and none is priced above its actual cost.
    #[test]
    fn every_leg_belongs_to_a_kind_that_costs_no_more() {
        check(|end| {
            let mut kinds = Kind::all(0.0);
            for round in 0..200 {
                let kind = kinds.swap_remove(round * 7 % kinds.len());
                let parts = end.parts(&kind).into_iter().map(|part| end.priced(part));
                kinds.extend(parts.map(|part| end.pulled(part, f64::INFINITY).0));
            }
            let mut free = 0;
            for idx in 0..400 {
                let share = f64::from(idx) / 400.0;
                let (heading, length) = (
                    share * std::f64::consts::TAU,
                    1000.0 * (share * 37.0).fract(),
                );
                let way = Vector2::new(libm::cos(heading), libm::sin(heading));
                let at = end.from + way * length;
                // Only fuel is paid where the leg avoids the soft zone and the way on from it is clear.
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
                if is_free {
                    assert!(own.all(|kind| kind.cost <= least + 1e-6));
                    free += 1;
                }
            }
            assert!(free > 100, "only {free} legs avoid the soft zone");
        });
    }

    /// Among threats that can be flown over or under, some at the height of the start: no leg that stays out of
    /// cores costs less than stated, however it climbs.
    #[test]
    fn no_leg_past_passable_threats_costs_less_than_its_kind() {
        let discs = [
            (260.0, 100.0, 30.0, 100.0, [f64::NEG_INFINITY, 60.0]),
            (170.0, 210.0, 50.0, 90.0, [30.0, f64::INFINITY]),
            (120.0, 60.0, 20.0, 110.0, [-20.0, 12.0]),
            (300.0, 220.0, 25.0, 70.0, [20.0, 70.0]),
        ];
        let limit = |name: &str, limit: f64| {
            if limit.is_finite() {
                format!(r#", "{name}": {limit}"#)
            } else {
                String::new()
            }
        };
        let threats = discs.map(|(x, y, radius, influence, [base, top])| {
            let limits = limit("base", base) + &limit("top", top);
            format!(
                r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {influence}{limits}}}"#
            )
        });
        let scenario = scenario(&format!(r#""threats": [{}]"#, threats.join(", ")));
        let prices = Prices::of(&scenario);
        let walls = widening::walls(&scenario, &prices);
        let end = end(&prices, &walls, &[None; 4]);
        let mut kinds = Kind::all(0.0);
        for round in 0..600 {
            let kind = kinds.swap_remove(round * 7 % kinds.len());
            let parts = end.parts(&kind).into_iter();
            kinds.extend(parts.map(|part| end.beyond(part, &|_, _| Some(0.0))));
        }
        let (mut told, mut blocked) = (0, 0);
        for idx in 0..2000 {
            let share = f64::from(idx) / 2000.0;
            let (heading, slope) = (
                share * std::f64::consts::TAU,
                2.0 * (share * 613.0).fract() - 1.0,
            );
            let length = 300.0 * (share * 37.0).fract();
            let way = Vector2::new(libm::cos(heading), libm::sin(heading));
            let (mut depths, mut enters) = (0.0, false);
            for part in 0..800 {
                let flown = length * (f64::from(part) + 0.5) / 800.0;
                let at = end.from + way * flown;
                for (x, y, radius, influence, [base, top]) in discs {
                    if base <= slope * flown && slope * flown < top {
                        let away = (at - Point2::new(x, y)).norm();
                        enters |= away < radius;
                        depths += (influence - away).max(0.0) * length / 800.0;
                    }
                }
            }
            let slant = (1.0 + slope * slope).sqrt();
            let flown = (prices.fuel * length + prices.exposure * depths) * slant;
            let cost = flown + (100.0 - slope * length).abs() + end.later(length);
            let of = |kind: &&Kind| {
                let off = crate::geometry::wrap_angle(heading - kind.heading).abs();
                off <= kind.half + 1e-9
                    && (kind.lengths[0]..=kind.lengths[1]).contains(&length)
                    && kind.slopes.is_none_or(|slopes| slopes.hold(slope))
            };
            let mut own = kinds.iter().filter(of).peekable();
            assert!(own.peek().is_some());
            for kind in own {
                blocked += i32::from(kind.cost.is_infinite());
                told += i32::from(kind.slopes.is_some());
                let least = kind.cost + kind.steepness;
                assert!(enters || least <= cost + 0.05, "{least} {cost}");
            }
        }
        assert!(told > 1000 && blocked > 100, "{told} {blocked}");
    }
}
