//! Many routes priced at once, in lanes.
//!
//! [`Pricer`] computes for [`LANES`] routes side by side what [`Model::assess`] computes for one, with the same results
//! within rounding: what it cannot settle in lanes (a leg that breaks the band above a grid, that enters a polygon) it
//! leaves to the scalar code, lane by lane. A lane's bits depend on its own route alone, not on its neighbours nor on
//! the width of the processor.

#[cfg(test)]
mod equality;
mod heights;
mod index;
mod leg;
mod peaks;
mod pyramid;
mod rings;
mod route;
mod scene;
mod stretch;
mod suspects;
mod swing;
mod threats;

pub use crate::geometry::lane::{LANES, Row};

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::{Model, Tolerance};
use crate::geometry::Point3;
use crate::geometry::lane::parts;
use crate::scenario::Quadrature;
use heights::Heights;
use route::Limits;
pub(super) use scene::Scene;
use scene::Surface;
use suspects::Suspects;

/// [`LANES`] points side by side, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointRow {
    /// East.
    pub x: Row,
    /// North.
    pub y: Row,
    /// Up.
    pub z: Row,
}

impl PointRow {
    /// `points` in rows; unused lanes repeat the first of them.
    #[must_use]
    pub fn of(points: impl Iterator<Item = Point3>) -> Vec<Self> {
        let mut rows: Vec<Self> = Vec::new();
        for (idx, point) in points.enumerate() {
            if idx % LANES == 0 {
                rows.push(Self::splat(point));
            }
            rows[idx / LANES].set(idx % LANES, point);
        }
        rows
    }

    /// `point` in every lane.
    #[must_use]
    pub fn splat(point: Point3) -> Self {
        Self {
            x: [point.x; LANES],
            y: [point.y; LANES],
            z: [point.z; LANES],
        }
    }

    /// The point of lane `lane`.
    ///
    /// # Panics
    /// Where there is no such lane.
    #[must_use]
    pub fn get(&self, lane: usize) -> Point3 {
        Point3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Write `point` into lane `lane`.
    ///
    /// # Panics
    /// Where there is no such lane.
    pub fn set(&mut self, lane: usize, point: Point3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (point.x, point.y, point.z);
    }
}

/// What [`LANES`] routes or legs cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// Sum of all breaches beyond the tolerance, in metres and degrees.
    pub violation: Row,
    /// The weighted cost, Eq. 1.
    pub cost: Row,
}

impl Price {
    /// Zero in every lane.
    pub const ZERO: Self = Self {
        violation: [0.0; LANES],
        cost: [0.0; LANES],
    };
}

/// A model made ready for pricing many routes.
#[derive(Debug, Clone)]
pub struct Pricer<'s> {
    model: Model<'s>,
    tolerance: Tolerance,
    /// Whether it matters only that a leg leaves the band or enters a polygon, not by how much.
    verdict: bool,
    quadrature: Quadrature,
    limits: Limits,
    scene: Arc<Scene>,
    heights: Heights,
    arch: Arch,
}

impl<'s> Pricer<'s> {
    /// Prices routes as `model` does by `quadrature`, counting breaches beyond `tolerance`.
    #[must_use]
    pub fn new(model: &Model<'s>, quadrature: Quadrature, tolerance: Tolerance) -> Self {
        Self {
            limits: Limits::of(model.scenario),
            scene: model
                .scene
                .get_or_init(|| Arc::new(Scene::of(model.scenario)))
                .clone(),
            heights: Heights::of(model, tolerance),
            model: model.clone(),
            tolerance,
            verdict: false,
            quadrature,
            arch: Arch::new(),
        }
    }

    /// Skips measuring how far a leg leaves the band or enters a polygon once it is seen to do so: for a search that has
    /// no use for such a leg. Whether there is a violation stays the same, and so does what a leg costs that enters no
    /// polygon; for one that enters, exposure to that polygon may be missing.
    #[must_use]
    pub fn verdicts(mut self) -> Self {
        self.verdict = true;
        self
    }

    /// Price [`LANES`] routes with equally many points: start, free waypoints, target.
    ///
    /// # Panics
    /// With fewer than two points.
    #[must_use]
    pub fn routes(&self, points: &[PointRow]) -> Price {
        self.first_routes(points, LANES)
    }

    /// As [`Pricer::routes`], for the first `count` of them only; the others are unused.
    ///
    /// # Panics
    /// With fewer than two points, or a `count` above [`LANES`].
    #[must_use]
    pub fn first_routes(&self, points: &[PointRow], count: usize) -> Price {
        self.dispatch::<true>(points, &[], count, &mut [])
    }

    /// As [`Pricer::first_routes`], assuming that every leg keeps the required heights: above hills, where those take
    /// longest to measure, this shows for most routes that they are not good enough. No violation is more than that
    /// from `routes`, and the costs are the same bits. `ground` is the elevation below each free waypoint. `proven`, a
    /// row for each leg, is set to 1 where its heights above ground at both ends prove that a leg keeps them; elsewhere
    /// to 0.
    ///
    /// # Panics
    /// With fewer than two points, or where there is not as much ground.
    #[must_use]
    pub fn routes_at_best(
        &self,
        points: &[PointRow],
        ground: &[Row],
        count: usize,
        proven: &mut Vec<Row>,
    ) -> Price {
        assert!(
            ground.len() + 2 == points.len(),
            "every free waypoint is above ground"
        );
        proven.resize(ground.len() + 1, [0.0; LANES]);
        self.dispatch::<false>(points, ground, count, proven)
    }

    /// The cost of routes for their fuel and heights alone: no route costs less, to the bit. `ground` is the elevation
    /// below each free waypoint.
    ///
    /// # Panics
    /// With fewer than two points, or where `ground` has another number of rows.
    #[must_use]
    pub fn least_costs(&self, points: &[PointRow], ground: &[Row]) -> Row {
        assert!(
            points.len() >= 2 && ground.len() + 2 == points.len(),
            "every free waypoint is above ground"
        );
        let mut costs = [0.0; LANES];
        self.arch.dispatch(Least {
            pricer: self,
            points,
            ground,
            costs: &mut costs,
        });
        costs
    }

    /// Whether there are hills, above which heights take long to measure.
    #[must_use]
    pub fn is_hilly(&self) -> bool {
        !matches!(self.scene.surface, Surface::Flat(_))
    }

    fn dispatch<const HEIGHTS: bool>(
        &self,
        points: &[PointRow],
        ground: &[Row],
        count: usize,
        proven: &mut [Row],
    ) -> Price {
        assert!(points.len() >= 2, "a route has a start and a target");
        let mut price = Price::ZERO;
        self.arch.dispatch(Routes::<HEIGHTS> {
            pricer: self,
            points,
            ground,
            count,
            proven,
            price: &mut price,
        });
        price
    }

    /// Price `prices.len()` rows of single legs, from `a` to `b`: fuel and exposure, and the
    /// breaches of threats, band, ground, climb and shortness. Turns, the area and F3 belong to
    /// routes and waypoints, and are left out.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn legs(&self, a: &[PointRow], b: &[PointRow], prices: &mut [Price]) {
        self.dispatch_legs::<true, true>(a, b, usize::MAX, prices);
    }

    /// As [`Pricer::legs`], for the first `count` of them only; the others are unused.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn first_legs(&self, a: &[PointRow], b: &[PointRow], count: usize, prices: &mut [Price]) {
        self.dispatch_legs::<true, true>(a, b, count, prices);
    }

    /// As [`Pricer::legs`], assuming that every leg keeps the required heights, see [`Pricer::routes_at_best`].
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn legs_at_best(&self, a: &[PointRow], b: &[PointRow], prices: &mut [Price]) {
        self.dispatch_legs::<true, false>(a, b, usize::MAX, prices);
    }

    /// As [`Pricer::first_legs`], for the required heights of a leg only: the part that [`Pricer::legs_at_best`] leaves
    /// out.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn heights_of_legs(
        &self,
        a: &[PointRow],
        b: &[PointRow],
        count: usize,
        prices: &mut [Price],
    ) {
        self.dispatch_legs::<false, true>(a, b, count, prices);
    }

    fn dispatch_legs<const FLIGHT: bool, const HEIGHTS: bool>(
        &self,
        a: &[PointRow],
        b: &[PointRow],
        count: usize,
        prices: &mut [Price],
    ) {
        assert!(a.len() == prices.len() && b.len() == prices.len());
        self.arch.dispatch(Legs::<FLIGHT, HEIGHTS> {
            pricer: self,
            a,
            b,
            count,
            prices,
        });
    }

    /// Raise points whose heights are above ground by the ground's elevation, which is written to `ground`, a
    /// row for each.
    pub fn raise(&self, points: &mut [PointRow], ground: &mut Vec<Row>) {
        self.ground(points, ground);
        for (point, ground) in points.iter_mut().zip(ground) {
            for (z, ground) in point.z.iter_mut().zip(ground) {
                *z += *ground;
            }
        }
    }

    /// Write the elevation of the ground below `points` to `ground`, a row for each.
    pub fn ground(&self, points: &[PointRow], ground: &mut Vec<Row>) {
        ground.clear();
        ground.resize(points.len(), [0.0; LANES]);
        self.arch.dispatch(Ground {
            pricer: self,
            points,
            elevations: ground,
        });
    }
}

struct Least<'a, 's> {
    pricer: &'a Pricer<'s>,
    points: &'a [PointRow],
    ground: &'a [Row],
    costs: &'a mut Row,
}

impl WithSimd for Least<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for part in 0..parts::<S>() {
            let cost = self.pricer.least_cost(simd, part, self.points, self.ground);
            cost.store(self.costs, part);
        }
    }
}

struct Ground<'a, 's> {
    pricer: &'a Pricer<'s>,
    points: &'a [PointRow],
    elevations: &'a mut [Row],
}

impl WithSimd for Ground<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (point, row) in self.points.iter().zip(self.elevations) {
            for part in 0..parts::<S>() {
                let elevation = self.pricer.elevation(simd, part, point);
                elevation.store(row, part);
            }
        }
    }
}

struct Routes<'a, 's, const HEIGHTS: bool> {
    pricer: &'a Pricer<'s>,
    points: &'a [PointRow],
    /// Ground below the free waypoints; known where heights are left out.
    ground: &'a [Row],
    count: usize,
    /// See [`Pricer::routes_at_best`].
    proven: &'a mut [Row],
    price: &'a mut Price,
}

impl<const HEIGHTS: bool> WithSimd for Routes<'_, '_, HEIGHTS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut suspects = Suspects::of(self.count);
        for part in 0..self.count.div_ceil(S::F64_LANES) {
            let (violation, cost) = self.pricer.route::<S, HEIGHTS>(
                simd,
                part,
                self.points,
                self.ground,
                &mut suspects,
                self.proven,
            );
            violation.store(&mut self.price.violation, part);
            cost.store(&mut self.price.cost, part);
        }
        let prices = std::slice::from_mut(self.price);
        self.pricer.settle(simd, &suspects, prices);
    }
}

/// Rows of legs whose suspects are measured together.
const AT_ONCE: usize = 64;

struct Legs<'a, 's, const FLIGHT: bool, const HEIGHTS: bool> {
    pricer: &'a Pricer<'s>,
    a: &'a [PointRow],
    b: &'a [PointRow],
    count: usize,
    prices: &'a mut [Price],
}

impl<const FLIGHT: bool, const HEIGHTS: bool> WithSimd for Legs<'_, '_, FLIGHT, HEIGHTS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut suspects = Suspects::of(0);
        let chunks = self.a.chunks(AT_ONCE).zip(self.b.chunks(AT_ONCE));
        let mut left = self.count;
        for ((a, b), prices) in chunks.zip(self.prices.chunks_mut(AT_ONCE)) {
            suspects.clear(left);
            left = left.saturating_sub(AT_ONCE * LANES);
            for (row, ends) in a.iter().zip(b).enumerate() {
                for part in 0..parts::<S>() {
                    let slot = row * LANES + part * S::F64_LANES;
                    if !suspects.wants(slot) {
                        break;
                    }
                    let ends = [ends.0, ends.1];
                    let (violation, cost) = self.pricer.single_leg::<S, FLIGHT, HEIGHTS>(
                        simd,
                        part,
                        ends,
                        slot,
                        &mut suspects,
                    );
                    violation.store(&mut prices[row].violation, part);
                    cost.store(&mut prices[row].cost, part);
                }
            }
            self.pricer.settle(simd, &suspects, prices);
        }
    }
}
