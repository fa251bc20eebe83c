//! All waypoints at once, each to one of a few places near it: dynamic programming over the legs.
//!
//! Every waypoint has [`CHOICES`] places, its own among them. Legs between places of neighbours are
//! priced alone; turns join two legs. The best combination of all places is found exactly, so that
//! waypoints that only gain together, such as those of one bend, move together.

use super::super::price::{pricer, search_tolerance};
use super::clear::ClearWays;
use super::turns::Turns;
use super::ways::{CHOICES, Leg, Waypoint, Ways, count};
use crate::cost::batch::{LANES, PointRow, Price, Pricer, Row};
use crate::cost::{Model, Tolerance};
use crate::geometry::{LEVEL, Point2, Point3, Vector2};
use crate::optimizer::Fitness;

/// Joining the legs again costs more than measuring a few that may be needed next.
const AT_ONCE: usize = 3 * LANES;

/// The new places, as shares of the step along the route, across it, and up.
const PATTERNS: [[[f64; 3]; LANES]; 2] = [pattern(0.7), pattern(-0.7)];

const fn pattern(diagonal: f64) -> [[f64; 3]; LANES] {
    [
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.7, diagonal, 0.0],
        [-0.7, diagonal, 0.0],
    ]
}

/// Prices legs and joins them.
pub(super) struct Lattice<'m, 's> {
    model: &'m Model<'s>,
    pricer: Pricer<'s>,
    /// For searches in which a leg that breaks a limit is worth nothing.
    verdicts: Pricer<'s>,
    tolerance: Tolerance,
    /// Tangent of the steepest climb.
    steepest: f64,
    /// Whether heights take long to measure.
    hilly: bool,
    pub(super) legs_priced: u64,
    waypoints: Vec<Waypoint>,
    /// Where the new places of each free waypoint lie, and the elevation of the ground there.
    around: Vec<PointRow>,
    ground: Vec<Row>,
    /// Between the places of neighbours, in order.
    legs: Vec<Leg>,
    ways: Ways,
    clear: ClearWays,
    /// Place of each waypoint on the best way.
    chosen: Vec<usize>,
    /// For each leg, by the places of its ends: whether its heights are in its price.
    measured: Vec<[[bool; CHOICES]; CHOICES]>,
    from: Vec<PointRow>,
    to: Vec<PointRow>,
    prices: Vec<Price>,
}

impl<'m, 's> Lattice<'m, 's> {
    pub(super) fn new(model: &'m Model<'s>) -> Self {
        let tolerance = search_tolerance(model);
        let pricer = pricer(model);
        Self {
            model,
            verdicts: pricer.clone().verdicts(),
            hilly: pricer.is_hilly(),
            pricer,
            tolerance,
            steepest: model.scenario.vehicle.steepest(),
            legs_priced: 0,
            waypoints: Vec::new(),
            around: Vec::new(),
            ground: Vec::new(),
            legs: Vec::new(),
            ways: Ways::new(model, tolerance),
            clear: ClearWays::new(Turns::new(model, tolerance)),
            chosen: Vec::new(),
            measured: Vec::new(),
            from: Vec::new(),
            to: Vec::new(),
            prices: Vec::new(),
        }
    }

    /// The fitness of `route`, within rounding.
    pub(super) fn price(&mut self, route: &[Point3]) -> Fitness {
        self.from.clear();
        self.from
            .extend(route.iter().map(|&point| PointRow::splat(point)));
        let price = self.pricer.first_routes(&self.from, 1);
        Fitness {
            violation: price.violation[0],
            cost: price.cost[0],
        }
    }

    /// Move the waypoints of `route` to the best combination of places one `step` away; `turn` distinguishes sweeps. If
    /// the route is not `feasible`, a unit of violation costs `rate`. Returns whether any waypoint moved.
    pub(super) fn sweep(
        &mut self,
        route: &mut [Point3],
        feasible: bool,
        rate: f64,
        step: f64,
        turn: usize,
    ) -> bool {
        let last = route.len() - 1;
        self.look_around(route, step, turn);
        if !(feasible && self.find_clear(last)) {
            self.price_legs(last, false);
            self.ways.reach(&mut self.legs, rate);
            self.ways.trace_back(&mut self.chosen);
        }
        let mut moved = false;
        for (idx, &place) in self.chosen.iter().enumerate() {
            route[idx] = self.waypoints[idx].place(place);
            moved |= place != 0;
        }
        moved
    }

    /// Choose the best way where the route keeps every limit; the best way then keeps them too. Above hills legs are
    /// priced as if they kept their heights, and measured until all those of the best way are proven to.
    fn find_clear(&mut self, last: usize) -> bool {
        self.price_legs(last, true);
        self.clear.set(&self.legs);
        self.measured.clear();
        let mut measured = [[false; CHOICES]; CHOICES];
        // The route itself keeps its heights.
        measured[0][0] = true;
        self.measured.resize(last, measured);
        while self.clear.find(&self.legs, &mut self.chosen) {
            if !(self.hilly && self.measure()) {
                return true;
            }
        }
        false
    }

    /// Find the places of every waypoint of `route`.
    fn look_around(&mut self, route: &[Point3], step: f64, turn: usize) {
        self.waypoints.clear();
        self.waypoints.extend(route.iter().map(|&own| Waypoint {
            own,
            new: PointRow::splat(own),
            violation: [0.0; CHOICES],
            cost: [0.0; CHOICES],
        }));
        let last = route.len() - 1;
        self.around.clear();
        for idx in 1..last {
            let places = self.places(route, idx, step, turn);
            self.around.push(places);
        }
        self.pricer.ground(&self.around, &mut self.ground);
        for (free, &own) in route[1..last].iter().enumerate() {
            self.waypoints[free + 1] = self.waypoint(own, free, step, turn);
        }
    }

    /// At `own`, with the places of free waypoint number `free` raised to their heights.
    fn waypoint(&self, own: Point3, free: usize, step: f64, turn: usize) -> Waypoint {
        let scenario = self.model.scenario;
        let band = scenario.altitude;
        let middle = band.middle();
        let below = scenario.terrain.elevation(own.xy());
        let height = own.z - below;
        let mut waypoint = Waypoint {
            own,
            new: self.around[free],
            violation: [0.0; CHOICES],
            cost: [0.0; CHOICES],
        };
        let price =
            |point: Point3, ground: f64| self.model.waypoint_above(point, ground, self.tolerance);
        (waypoint.violation[0], waypoint.cost[0]) = price(own, below);
        for (lane, [.., rise]) in PATTERNS[turn % 2].into_iter().enumerate() {
            let mut raised = height + rise * step;
            // F3 has its kink at the middle of the band: no step may skip it.
            if (height - middle) * (raised - middle) < 0.0 {
                raised = middle;
            }
            let ground = self.ground[free][lane];
            let at = waypoint.new.get(lane).xy();
            let point = self.reachable(at, ground + raised.clamp(band.min, band.max));
            waypoint.new.set(lane, point);
            (waypoint.violation[lane + 1], waypoint.cost[lane + 1]) = price(point, ground);
        }
        waypoint
    }

    /// Price every leg between places of neighbours: those of the route itself last, the others in
    /// rows that lead to the eight new places of one waypoint, or come from them. For a `clear` way, legs that break a
    /// limit are worth nothing, and above hills all are priced as if they kept their heights.
    fn price_legs(&mut self, last: usize, clear: bool) {
        self.from.clear();
        self.to.clear();
        for leg_idx in 0..last {
            let (a, b) = (&self.waypoints[leg_idx], &self.waypoints[leg_idx + 1]);
            if leg_idx + 1 < last {
                for place in 0..count(leg_idx, last) {
                    self.from.push(PointRow::splat(a.place(place)));
                    self.to.push(b.new);
                }
            }
            if leg_idx > 0 {
                self.from.push(a.new);
                self.to.push(PointRow::splat(b.own));
            }
        }
        self.legs_priced += (self.from.len() * LANES + last) as u64;
        let own = self.from.len();
        for leg_idx in 0..last {
            let (a, b) = (self.waypoints[leg_idx].own, self.waypoints[leg_idx + 1].own);
            self.push_leg(leg_idx, a, b);
        }
        self.prices.clear();
        self.prices.resize(self.from.len(), Price::ZERO);
        let (from, to) = (&self.from, &self.to);
        match (clear, self.hilly) {
            (false, _) => self.pricer.legs(from, to, &mut self.prices),
            (true, false) => self.verdicts.legs(from, to, &mut self.prices),
            (true, true) => self.verdicts.legs_at_best(from, to, &mut self.prices),
        }
        // Those of the sweep before are written over: nobody reads what they keep of it.
        self.legs.resize_with(last, || Leg::EMPTY);
        let mut rows = self.prices.iter();
        let mut next = || rows.next().expect("as many rows as were priced");
        for (leg_idx, leg) in self.legs.iter_mut().enumerate() {
            if leg_idx + 1 < last {
                for place in 0..count(leg_idx, last) {
                    let price = next();
                    leg.violation[place][1..].copy_from_slice(&price.violation);
                    leg.cost[place][1..].copy_from_slice(&price.cost);
                }
            }
            if leg_idx > 0 {
                let price = next();
                for lane in 0..LANES {
                    leg.violation[lane + 1][0] = price.violation[lane];
                    leg.cost[lane + 1][0] = price.cost[lane];
                }
            }
            let (row, lane) = (own + leg_idx / LANES, leg_idx % LANES);
            leg.violation[0][0] = self.prices[row].violation[lane];
            leg.cost[0][0] = self.prices[row].cost[lane];
            let (a, b) = (&self.waypoints[leg_idx], &self.waypoints[leg_idx + 1]);
            leg.finish(a, b, count(leg_idx, last));
        }
    }

    /// Measure the heights of the legs of the best way, and of a few others beside those;
    /// whether any breaks a limit.
    fn measure(&mut self) -> bool {
        self.from.clear();
        self.to.clear();
        let mut legs = Vec::new();
        for leg_idx in 0..self.measured.len() {
            self.choose(leg_idx, self.chosen[leg_idx + 1], &mut legs);
        }
        for idx in 0..legs.len() {
            let (leg_idx, ..) = legs[idx];
            for b in 0..count(leg_idx + 1, self.measured.len()) {
                if legs.len() < AT_ONCE {
                    self.choose(leg_idx, b, &mut legs);
                }
            }
        }
        self.prices.clear();
        self.prices.resize(self.from.len(), Price::ZERO);
        self.verdicts
            .heights_of_legs(&self.from, &self.to, legs.len(), &mut self.prices);
        let mut worse = false;
        for (idx, (leg_idx, a, b)) in legs.into_iter().enumerate() {
            if self.prices[idx / LANES].violation[idx % LANES] > 0.0 {
                self.clear.break_off(leg_idx, a, b);
                worse = true;
            }
        }
        worse
    }

    /// Add leg number `leg_idx` from the best way's place to `b` to the `legs` to be measured, once.
    fn choose(&mut self, leg_idx: usize, b: usize, legs: &mut Vec<(usize, usize, usize)>) {
        let a = self.chosen[leg_idx];
        if !std::mem::replace(&mut self.measured[leg_idx][a][b], true) {
            let (from, to) = (&self.waypoints[leg_idx], &self.waypoints[leg_idx + 1]);
            self.push_leg(legs.len(), from.place(a), to.place(b));
            legs.push((leg_idx, a, b));
        }
    }

    /// Add a leg as number `idx` of those priced lane by lane.
    fn push_leg(&mut self, idx: usize, a: Point3, b: Point3) {
        if idx.is_multiple_of(LANES) {
            // Unused lanes repeat a leg.
            self.from.push(PointRow::splat(a));
            self.to.push(PointRow::splat(b));
        } else {
            let row = self.from.len() - 1;
            self.from[row].set(idx % LANES, a);
            self.to[row].set(idx % LANES, b);
        }
    }

    /// Where the new places of waypoint `idx` lie. Frames follow the legs before, after and between by turns.
    fn places(&self, route: &[Point3], idx: usize, step: f64, turn: usize) -> PointRow {
        let here = route[idx];
        let (before, after) = (route[idx - 1].xy(), route[idx + 1].xy());
        let way = match turn % 3 {
            0 => after - before,
            1 => here.xy() - before,
            _ => after - here.xy(),
        };
        let length = way.norm();
        let along = if length < LEVEL {
            Vector2::x()
        } else {
            way / length
        };
        let across = Vector2::new(-along.y, along.x);
        let mut places = PointRow::splat(here);
        for (lane, [a, c, _]) in PATTERNS[turn % 2].into_iter().enumerate() {
            let at = here.xy() + along * (a * step) + across * (c * step);
            let at = self.model.scenario.area.nearest(at);
            (places.x[lane], places.y[lane]) = (at.x, at.y);
        }
        places
    }

    /// `z`, or the height nearest to it that can be climbed to from the start and from the target.
    fn reachable(&self, at: Point2, mut z: f64) -> Point3 {
        for end in [self.model.scenario.start, self.model.scenario.target] {
            let reach = (at - end.xy()).norm() * self.steepest * (1.0 - 1e-9);
            z = z.clamp(end.z - reach, end.z + reach);
        }
        Point3::new(at.x, at.y, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::price::price;
    use crate::planner::starts;
    use crate::planner::tests::hilly_scenario;
    use crate::planner::{Nobody, plan};

    /// From a feasible route the quick sweep and the thorough one choose the same places.
    #[test]
    fn the_quick_sweep_agrees_with_the_thorough_one() {
        let mut scenario = hilly_scenario();
        scenario.planner.iterations = 3;
        for seed in 0..4 {
            scenario.planner.seed = seed;
            let model = Model::new(&scenario);
            let mut route = plan(&scenario, &mut Nobody, &Nobody).waypoints;
            route = starts::with_waypoints(&model, route, 7);
            let (mut quick, mut thorough) = (Lattice::new(&model), Lattice::new(&model));
            let mut moves = 0;
            for turn in 0..12 {
                let step = 60.0 / (1.0 + turn as f64);
                let mut other = route.clone();
                let feasible = price(&model, &route).is_feasible();
                let moved = quick.sweep(&mut route, feasible, f64::INFINITY, step, turn);
                assert_eq!(
                    moved,
                    thorough.sweep(&mut other, false, f64::INFINITY, step, turn)
                );
                assert_eq!(route, other, "seed {seed}, turn {turn}");
                moves += usize::from(feasible && moved);
            }
            assert!(moves > 2, "{moves}");
        }
    }
}
