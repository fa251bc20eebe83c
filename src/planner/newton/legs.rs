//! What each leg costs, and how that changes with its ends: differences of prices that lanes find side by side.

use super::Place;
use crate::cost::batch::{LANES, PointRow, Price, Pricer, Row};
use crate::geometry::Point3;
use nalgebra::{Cholesky, Matrix6, SymmetricEigen};

/// East, north and up, of both ends of a leg.
pub(super) const ENDS: usize = 6;

/// Places around a waypoint: itself, a step in both directions along each axis, and a step along two.
const AROUND: usize = 10;

/// Places along two axes by these.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Legs for the first derivatives, from places of the one waypoint to places of the next: itself, then each
/// coordinate a step on and back.
const FIRST: [(usize, usize); 13] = [
    (0, 0),
    (1, 0),
    (3, 0),
    (5, 0),
    (0, 1),
    (0, 3),
    (0, 5),
    (2, 0),
    (4, 0),
    (6, 0),
    (0, 2),
    (0, 4),
    (0, 6),
];

/// Those for the mixed second ones, with the coordinates.
const MIXED: [(usize, usize, usize, usize); 15] = [
    (0, 1, 7, 0),
    (0, 2, 8, 0),
    (1, 2, 9, 0),
    (3, 4, 0, 7),
    (3, 5, 0, 8),
    (4, 5, 0, 9),
    (0, 3, 1, 1),
    (0, 4, 1, 3),
    (0, 5, 1, 5),
    (1, 3, 3, 1),
    (1, 4, 3, 3),
    (1, 5, 3, 5),
    (2, 3, 5, 1),
    (2, 4, 5, 3),
    (2, 5, 5, 5),
];

/// Legs priced for the derivatives of one.
pub(super) const LEGS_EACH: u64 = (FIRST.len() + MIXED.len()) as u64;

/// Negative curvature of no more than this share of the greatest counts as zero.
const FLAT: f64 = 1e-2;

/// A leg by its ends.
#[derive(Clone, Copy)]
pub(super) struct Slopes {
    /// Gradient of the cost.
    pub(super) gradient: [f64; ENDS],
    /// Curvature of the cost; both halves.
    pub(super) curvature: [[f64; ENDS]; ENDS],
    /// How far the leg breaks limits that do not depend on the vehicle: threats, band and ground, metres.
    pub(super) beyond: f64,
    /// Gradient of `beyond`.
    pub(super) away: [f64; ENDS],
}

/// Looks at legs a step of `step` metres apart.
pub(super) struct Legs<'p, 's> {
    pub(super) pricer: &'p Pricer<'s>,
    pub(super) step: f64,
    pub(super) min_leg: f64,
    /// As [`Pricer`] counts short legs.
    pub(super) tolerance: f64,
}

impl Legs<'_, '_> {
    /// The cost of every leg of `route`, and how far it is beyond limits.
    pub(super) fn prices(&self, route: &[Point3]) -> Vec<(f64, f64)> {
        let ends: Vec<[Point3; 2]> = route.windows(2).map(|ends| [ends[0], ends[1]]).collect();
        self.price(&ends, true)
    }

    /// How every leg changes; of each of `places` the slope of the ground is noted.
    pub(super) fn slopes(&self, places: &mut [Place]) -> Vec<Slopes> {
        let around = self.around(places);
        let legs = places.len() - 1;
        let first: Vec<[Point3; 2]> = (0..legs)
            .flat_map(|leg| FIRST.map(|(a, b)| [around[leg][a], around[leg + 1][b]]))
            .collect();
        let mixed: Vec<[Point3; 2]> = (0..legs)
            .flat_map(|leg| MIXED.map(|(.., a, b)| [around[leg][a], around[leg + 1][b]]))
            .collect();
        let (first, mixed) = (self.price(&first, true), self.price(&mixed, false));
        let legs = first.chunks(FIRST.len()).zip(mixed.chunks(MIXED.len()));
        legs.map(|(first, mixed)| self.differences(first, mixed))
            .collect()
    }

    fn differences(&self, first: &[(f64, f64)], mixed: &[(f64, f64)]) -> Slopes {
        let (own, step) = (first[0], self.step);
        let mut slopes = Slopes {
            gradient: [0.0; ENDS],
            curvature: [[0.0; ENDS]; ENDS],
            beyond: own.1,
            away: [0.0; ENDS],
        };
        for axis in 0..ENDS {
            let (on, back) = (first[1 + axis], first[1 + ENDS + axis]);
            slopes.gradient[axis] = (on.0 - back.0) / (2.0 * step);
            slopes.curvature[axis][axis] = (on.0 - 2.0 * own.0 + back.0) / (step * step);
            slopes.away[axis] = (on.1 - back.1) / (2.0 * step);
        }
        for (&(i, j, ..), both) in MIXED.iter().zip(mixed) {
            let apart = first[1 + i].0 + first[1 + j].0;
            let value = (both.0 - apart + own.0) / (step * step);
            (slopes.curvature[i][j], slopes.curvature[j][i]) = (value, value);
        }
        slopes.curvature = convex(&slopes.curvature);
        slopes
    }

    /// Of every waypoint the places about it, raised to its height above ground; start and target have none but their own.
    fn around(&self, places: &mut [Place]) -> Vec<[Point3; AROUND]> {
        let last = places.len() - 1;
        let step = self.step;
        let mut around: Vec<[Point3; AROUND]> = Vec::with_capacity(places.len());
        for (idx, place) in places.iter().enumerate() {
            let mut own = [place.at; AROUND];
            if idx > 0 && idx < last {
                for axis in 0..3 {
                    own[1 + 2 * axis][axis] += step;
                    own[2 + 2 * axis][axis] -= step;
                }
                for (pair, (one, other)) in PAIRS.into_iter().enumerate() {
                    own[7 + pair][one] += step;
                    own[7 + pair][other] += step;
                }
            }
            around.push(own);
        }
        let all: Vec<Point3> = around[1..last].iter().flatten().copied().collect();
        let ground = ground(self.pricer, &all);
        for ((own, ground), place) in around[1..last]
            .iter_mut()
            .zip(ground.chunks(AROUND))
            .zip(&mut places[1..last])
        {
            for (point, elevation) in own.iter_mut().zip(ground) {
                point.z += elevation;
            }
            let slope = |axis: usize| (ground[1 + 2 * axis] - ground[2 + 2 * axis]) / (2.0 * step);
            place.slope = [slope(0), slope(1)];
        }
        around
    }

    /// Cost of each leg; and, if `limits` are asked for, how far it breaks those that do not depend on the vehicle.
    fn price(&self, ends: &[[Point3; 2]], limits: bool) -> Vec<(f64, f64)> {
        let [from, to] = [0, 1].map(|end| PointRow::of(ends.iter().map(|ends| ends[end])));
        let mut prices = vec![Price::ZERO; from.len()];
        if limits {
            self.pricer.first_legs(&from, &to, ends.len(), &mut prices);
        } else {
            self.pricer.legs_at_best(&from, &to, &mut prices);
        }
        let of = |(idx, ends): (usize, &[Point3; 2])| {
            let (price, lane) = (&prices[idx / LANES], idx % LANES);
            let short = self.min_leg - (ends[1] - ends[0]).norm();
            let short = if short > self.tolerance { short } else { 0.0 };
            let beyond = price.violation[lane] - short;
            (
                price.cost[lane],
                if beyond > NOTHING { beyond } else { 0.0 },
            )
        };
        ends.iter().enumerate().map(of).collect()
    }
}

/// `curvature` without its negative part. Where a leg touches the edge of a soft zone, its cost has no second
/// derivative, and differences along both of two coordinates may see a zone that those along each do not.
fn convex(curvature: &[[f64; ENDS]; ENDS]) -> [[f64; ENDS]; ENDS] {
    let matrix = Matrix6::from_fn(|i, j| curvature[i][j]);
    let greatest = matrix.diagonal().amax();
    if Cholesky::new(matrix + Matrix6::identity() * (FLAT * greatest)).is_some() {
        return *curvature;
    }
    let mut eigen = SymmetricEigen::new(matrix);
    for value in &mut eigen.eigenvalues {
        *value = value.max(0.0);
    }
    let convex = eigen.recompose();
    std::array::from_fn(|i| std::array::from_fn(|j| convex[(i, j)]))
}

/// Less than this is rounding, metres.
const NOTHING: f64 = 1e-9;

/// The elevation of the ground below `points`.
pub(super) fn ground(pricer: &Pricer, points: &[Point3]) -> Vec<f64> {
    let mut found: Vec<Row> = Vec::new();
    pricer.ground(&PointRow::of(points.iter().copied()), &mut found);
    let each = found.into_iter().flatten();
    each.take(points.len()).collect()
}
