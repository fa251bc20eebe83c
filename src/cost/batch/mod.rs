//! Many routes priced at once, in lanes.
//!
//! [`Pricer`] asks of [`LANES`] routes side by side what [`Model::assess`] asks of one, and comes to
//! the same within rounding: what it cannot settle in lanes (a leg that breaks the band above a grid,
//! a polygon nearby) it leaves to the scalar code, lane by lane. A lane's bits depend on its own route alone,
//! not on its neighbours nor on the width of the processor.

#[cfg(test)]
mod equality;
mod heights;
mod index;
mod leg;
mod peaks;
mod pyramid;
mod route;
mod stretch;
mod suspects;
mod threats;

pub use crate::geometry::lane::{LANES, Row};

use pulp::{Arch, Simd, WithSimd};

use super::{Model, Tolerance};
use crate::geometry::Point3;
use crate::geometry::lane::parts;
use crate::scenario::Quadrature;
use heights::Heights;
use leg::Point;
use route::Limits;
use suspects::Suspects;
use threats::Threats;

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
    /// Of nothing.
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
    /// Whether it matters only that a leg leaves the band, not how far.
    verdict: bool,
    quadrature: Quadrature,
    limits: Limits,
    threats: Threats,
    heights: Heights,
    arch: Arch,
}

impl<'s> Pricer<'s> {
    /// Prices routes as `model` does by `quadrature`, counting breaches beyond `tolerance`.
    #[must_use]
    pub fn new(model: &Model<'s>, quadrature: Quadrature, tolerance: Tolerance) -> Self {
        Self {
            limits: Limits::of(model.scenario),
            threats: Threats::of(model.scenario),
            heights: Heights::of(model, tolerance),
            model: model.clone(),
            tolerance,
            verdict: false,
            quadrature,
            arch: Arch::new(),
        }
    }

    /// Does not measure how far a leg leaves the band once it is seen to: for a search that has no
    /// use for such a leg. Where there is no violation, and all else, stays as it is.
    #[must_use]
    pub fn verdicts(mut self) -> Self {
        self.verdict = true;
        self
    }

    /// Price [`LANES`] routes of as many points: start, free waypoints, target.
    ///
    /// # Panics
    /// With fewer than two points.
    #[must_use]
    pub fn routes(&self, points: &[PointRow]) -> Price {
        assert!(points.len() >= 2, "a route has a start and a target");
        let mut price = Price::ZERO;
        self.arch.dispatch(Routes {
            pricer: self,
            points,
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
        assert!(a.len() == prices.len() && b.len() == prices.len());
        self.arch.dispatch(Legs {
            pricer: self,
            a,
            b,
            prices,
        });
    }

    /// Raise points whose heights are above ground by the ground's elevation.
    pub fn raise(&self, points: &mut [PointRow]) {
        self.arch.dispatch(Raise {
            pricer: self,
            points,
        });
    }
}

struct Raise<'a, 's> {
    pricer: &'a Pricer<'s>,
    points: &'a mut [PointRow],
}

impl WithSimd for Raise<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for point in self.points {
            for part in 0..parts::<S>() {
                let own = Point::load(simd, point, part);
                let ground = self.pricer.elevation(simd, part, point);
                (own.z + ground).store(&mut point.z, part);
            }
        }
    }
}

struct Routes<'a, 's> {
    pricer: &'a Pricer<'s>,
    points: &'a [PointRow],
    price: &'a mut Price,
}

impl WithSimd for Routes<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut suspects = Suspects::default();
        for part in 0..parts::<S>() {
            let (violation, cost) = self.pricer.route(simd, part, self.points, &mut suspects);
            violation.store(&mut self.price.violation, part);
            cost.store(&mut self.price.cost, part);
        }
        self.pricer.settle(simd, &suspects, |slot, violation| {
            self.price.violation[slot] += violation;
        });
    }
}

/// Rows of legs whose suspects wait for each other.
const AT_ONCE: usize = 64;

struct Legs<'a, 's> {
    pricer: &'a Pricer<'s>,
    a: &'a [PointRow],
    b: &'a [PointRow],
    prices: &'a mut [Price],
}

impl WithSimd for Legs<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut suspects = Suspects::default();
        let chunks = self.a.chunks(AT_ONCE).zip(self.b.chunks(AT_ONCE));
        for ((a, b), prices) in chunks.zip(self.prices.chunks_mut(AT_ONCE)) {
            suspects.clear();
            for (row, ends) in a.iter().zip(b).enumerate() {
                for part in 0..parts::<S>() {
                    let slot = row * LANES + part * S::F64_LANES;
                    let ends = [ends.0, ends.1];
                    let (violation, cost) =
                        self.pricer
                            .single_leg(simd, part, ends, slot, &mut suspects);
                    violation.store(&mut prices[row].violation, part);
                    cost.store(&mut prices[row].cost, part);
                }
            }
            self.pricer.settle(simd, &suspects, |slot, violation| {
                prices[slot / LANES].violation[slot % LANES] += violation;
            });
        }
    }
}
