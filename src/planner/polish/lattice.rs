//! All waypoints at once, each to one of a few places near it: dynamic programming over the legs.

use crate::cost::{Model, Tolerance};
use crate::geometry::{LEVEL, Point2, Point3, wrap_angle};
use crate::optimizer::Fitness;

/// A waypoint's choices: shares of the step along the course, across it, and up.
const PATTERN: [[f64; 3]; 9] = [
    [0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [0.7, 0.7, 0.0],
    [-0.7, 0.7, 0.0],
];
const CHOICES: usize = PATTERN.len();

/// Prices legs and joins them.
pub(super) struct Lattice<'m, 's> {
    model: &'m Model<'s>,
    tolerance: Tolerance,
    steepest: f64,
    cos_turn: f64,
    max_turn: f64,
    pub(super) legs_priced: u64,
}

#[derive(Clone, Copy)]
struct Leg {
    price: Fitness,
    direction: Option<(f64, f64)>,
}

#[derive(Clone, Copy)]
struct Reached {
    price: Fitness,
    from: u8,
}

const NOWHERE: Reached = Reached {
    price: Fitness::WORST,
    from: 0,
};

fn plus(a: Fitness, b: Fitness) -> Fitness {
    Fitness {
        violation: a.violation + b.violation,
        cost: a.cost + b.cost,
    }
}

impl<'m, 's> Lattice<'m, 's> {
    pub(super) fn new(model: &'m Model<'s>) -> Self {
        let vehicle = &model.scenario.vehicle;
        Self {
            model,
            tolerance: model.tolerance.scaled(0.5),
            steepest: libm::tan(vehicle.max_climb_deg.to_radians()),
            cos_turn: libm::cos(vehicle.max_turn_deg.to_radians()),
            max_turn: vehicle.max_turn_deg,
            legs_priced: 0,
        }
    }

    /// Move the waypoints of `route` to the best combination of places one `step` away; whether
    /// any moved. `price` is that of the route by its legs, before and after.
    pub(super) fn sweep(
        &mut self,
        route: &mut [Point3],
        steps: &[f64],
        kind: usize,
    ) -> Option<Fitness> {
        let last = route.len() - 1;
        let mut choices: Vec<[Point3; CHOICES]> = Vec::with_capacity(route.len());
        for idx in 0..=last {
            choices.push(if idx == 0 || idx == last {
                [route[idx]; CHOICES]
            } else {
                self.choices(route, idx, steps[idx], kind)
            });
        }
        let count = |idx: usize| if idx == 0 || idx == last { 1 } else { CHOICES };
        let mut legs = vec![
            [Leg {
                price: Fitness::WORST,
                direction: None
            }; CHOICES * CHOICES];
            last
        ];
        for leg_idx in 0..last {
            for a in 0..count(leg_idx) {
                for b in 0..count(leg_idx + 1) {
                    let (from, to) = (choices[leg_idx][a], choices[leg_idx + 1][b]);
                    legs[leg_idx][a * CHOICES + b] = self.leg(from, to, leg_idx + 1 < last);
                }
            }
        }
        let mut reached = vec![[NOWHERE; CHOICES * CHOICES]; last];
        for b in 0..count(1) {
            reached[0][b] = Reached {
                price: legs[0][b].price,
                from: 0,
            };
        }
        for leg_idx in 1..last {
            for b in 0..count(leg_idx) {
                for c in 0..count(leg_idx + 1) {
                    let next = legs[leg_idx][b * CHOICES + c];
                    let mut best = NOWHERE;
                    for a in 0..count(leg_idx - 1) {
                        let before = reached[leg_idx - 1][a * CHOICES + b].price;
                        if !before.beats(&best.price) {
                            continue;
                        }
                        let turn =
                            self.turn(legs[leg_idx - 1][a * CHOICES + b].direction, next.direction);
                        let price = Fitness {
                            violation: before.violation + turn,
                            cost: before.cost,
                        };
                        if price.beats(&best.price) {
                            best = Reached {
                                price,
                                from: a as u8,
                            };
                        }
                    }
                    best.price = plus(best.price, next.price);
                    reached[leg_idx][b * CHOICES + c] = best;
                }
            }
        }
        // Back from the target along the best.
        let mut b = 0;
        for candidate in 1..count(last - 1) {
            if reached[last - 1][candidate * CHOICES]
                .price
                .beats(&reached[last - 1][b * CHOICES].price)
            {
                b = candidate;
            }
        }
        let price = reached[last - 1][b * CHOICES].price;
        let (mut b, mut c) = (b, 0);
        let mut moved = false;
        for leg_idx in (0..last).rev() {
            // Leg leg_idx runs from choice b of waypoint leg_idx to choice c of the next.
            route[leg_idx] = choices[leg_idx][b];
            moved |= b != 0;
            let a = reached[leg_idx][b * CHOICES + c].from as usize;
            (b, c) = (a, b);
        }
        moved.then_some(price)
    }

    fn choices(&self, route: &[Point3], idx: usize, step: f64, kind: usize) -> [Point3; CHOICES] {
        let scenario = self.model.scenario;
        let (before, here, after) = (route[idx - 1], route[idx], route[idx + 1]);
        let way = match kind % 3 {
            0 => after.xy() - before.xy(),
            1 => here.xy() - before.xy(),
            _ => after.xy() - here.xy(),
        };
        let length = way.norm();
        let along = if length < LEVEL {
            nalgebra::Vector2::new(1.0, 0.0)
        } else {
            way / length
        };
        let across = nalgebra::Vector2::new(-along.y, along.x);
        let band = scenario.altitude;
        let middle = 0.5 * (band.min + band.max);
        let ground = scenario.terrain.elevation(here.xy());
        let height = here.z - ground;
        let mut pattern = PATTERN;
        if kind % 2 == 1 {
            pattern[7][1] = -0.7;
            pattern[8][1] = -0.7;
        }
        pattern.map(|[a, c, u]| {
            let at = here.xy() + along * (a * step) + across * (c * step);
            let at = Point2::new(
                at.x.clamp(scenario.area.min.x, scenario.area.max.x),
                at.y.clamp(scenario.area.min.y, scenario.area.max.y),
            );
            let mut h = height + u * step;
            if u != 0.0 && (height - middle) * (h - middle) < 0.0 {
                h = middle;
            }
            let mut z = h.clamp(band.min, band.max) + scenario.terrain.elevation(at);
            if a == 0.0 && c == 0.0 && u == 0.0 {
                return here;
            }
            for end in [scenario.start, scenario.target] {
                let reach = (at - end.xy()).norm() * self.steepest * (1.0 - 1e-9);
                z = z.clamp(end.z - reach, end.z + reach);
            }
            Point3::new(at.x, at.y, z)
        })
    }

    fn leg(&mut self, a: Point3, b: Point3, to_waypoint: bool) -> Leg {
        self.legs_priced += 1;
        let quadrature = self.model.scenario.planner.quadrature;
        let (mut violation, mut cost) = self.model.leg(a, b, quadrature, self.tolerance);
        if to_waypoint {
            let own = self.model.waypoint(b, self.tolerance);
            violation += own.0;
            cost += own.1;
        }
        let way = b.xy() - a.xy();
        let length = way.norm();
        let direction = (length >= LEVEL).then(|| (way.x / length, way.y / length));
        Leg {
            price: Fitness { violation, cost },
            direction,
        }
    }

    fn turn(&self, before: Option<(f64, f64)>, after: Option<(f64, f64)>) -> f64 {
        let (Some(u), Some(v)) = (before, after) else {
            return 0.0;
        };
        let dot = u.0 * v.0 + u.1 * v.1;
        if dot > self.cos_turn + 1e-9 {
            return 0.0;
        }
        let turn = wrap_angle(libm::atan2(u.0 * v.1 - u.1 * v.0, dot))
            .abs()
            .to_degrees();
        let amount = turn - self.max_turn;
        if amount > self.tolerance.angle_deg {
            amount
        } else {
            0.0
        }
    }
}
