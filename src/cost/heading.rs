//! Eq. 8-9 by their meaning: limits on turning, on climbing, and on how short a leg may be.
//!
//! As printed, `arctan(dy / dx)` folds headings and calls a straight diagonal flight a turn.

use super::{Breach, Constraint, Model, Tolerance};
use crate::geometry::{Point3, Segment, wrap_angle};

/// The signed heading change at the start of each leg, radians, left positive; 0 on the first. A
/// leg without horizontal extent keeps the heading before it.
pub fn turns(route: &[Point3]) -> impl Iterator<Item = f64> + '_ {
    let mut heading = None;
    route.windows(2).map(move |ends| {
        let Some(own) = (Segment {
            a: ends[0],
            b: ends[1],
        })
        .heading() else {
            return 0.0;
        };
        let turn = heading.map_or(0.0, |before: f64| wrap_angle(own - before));
        heading = Some(own);
        turn
    })
}

impl Model<'_> {
    /// Report a leg that is too short, too steep, or turned into too sharply.
    pub(super) fn manoeuvres(
        &self,
        leg_idx: usize,
        leg: &Segment,
        turn: f64,
        tolerance: Tolerance,
        report: &mut impl FnMut(Breach),
    ) {
        let vehicle = &self.scenario.vehicle;
        let checks = [
            (
                Constraint::Turn,
                turn.abs().to_degrees() - vehicle.max_turn_deg,
                tolerance.angle_deg,
            ),
            (
                Constraint::Climb,
                leg.climb().abs().to_degrees() - vehicle.max_climb_deg,
                tolerance.angle_deg,
            ),
            (
                Constraint::Leg,
                vehicle.min_leg - leg.length(),
                tolerance.length_m,
            ),
        ];
        for (constraint, amount, allowed) in checks {
            if amount > allowed {
                report(Breach::on_leg(constraint, leg_idx, amount));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_signed_and_vertical_legs_keep_the_heading() {
        let check = |route: &[[f64; 3]], expected: &[f64]| {
            let route: Vec<Point3> = route.iter().map(|&p| Point3::from(p)).collect();
            for (turn, degrees) in turns(&route).zip(expected) {
                assert!(
                    (turn.to_degrees() - degrees).abs() < 1e-9,
                    "{turn} {degrees}"
                );
            }
            assert_eq!(turns(&route).count(), expected.len());
        };
        check(
            &[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [3.0, 1.0, 0.0]],
            &[0.0, 45.0, -45.0],
        );
        check(
            &[[0.0; 3], [-1.0, 0.1, 0.0], [-2.0, 0.0, 0.0]],
            &[0.0, 11.421_186_274_999_286],
        );
        check(
            &[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 5.0], [1.0, 1.0, 5.0]],
            &[0.0, 0.0, 90.0],
        );
        check(&[[0.0; 3], [0.0, 0.0, 5.0], [1.0, 0.0, 5.0]], &[0.0, 0.0]);
        check(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], &[0.0, 180.0]);
    }
}
