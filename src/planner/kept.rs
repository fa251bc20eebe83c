//! By how much legs are known to leave the heights asked of them; most keep them.
//!
//! Most legs of a candidate are those of the route that it comes from, to the last bit, and what was measured
//! once need not be measured again. A leg that is forgotten is measured anew, so that nothing depends on what
//! is remembered but time.

use crate::geometry::Point3;

/// Legs that there is room for, at least and at most.
const FEWEST: usize = 1 << 10;
const MOST: usize = 1 << 16;

/// The bits of both ends.
type Ends = [u64; 6];

/// No leg has it: no coordinate is such a number.
const NONE: Ends = [u64::MAX; 6];

/// An odd number whose bits are spread evenly.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

/// Each leg has one place; of those that share it the last is known.
pub(super) struct Kept {
    places: Vec<(Ends, f64)>,
}

impl Kept {
    /// With room for about `legs`.
    pub(super) fn of(legs: usize) -> Self {
        let places = (2 * legs).next_power_of_two().clamp(FEWEST, MOST);
        Self {
            places: vec![(NONE, 0.0); places],
        }
    }

    /// The violation of the leg from `a` to `b`, if it is known.
    pub(super) fn violation(&self, a: Point3, b: Point3) -> Option<f64> {
        let ends = ends(a, b);
        let (known, violation) = self.places[self.place(&ends)];
        (known == ends).then_some(violation)
    }

    /// Remember the violation of the leg from `a` to `b`.
    pub(super) fn note(&mut self, a: Point3, b: Point3, violation: f64) {
        let ends = ends(a, b);
        let place = self.place(&ends);
        self.places[place] = (ends, violation);
    }

    fn place(&self, ends: &Ends) -> usize {
        let mixed = ends.iter().fold(0_u64, |mixed, bits| {
            (mixed.rotate_left(29) ^ bits).wrapping_mul(FACTOR)
        });
        (mixed >> 32) as usize & (self.places.len() - 1)
    }
}

fn ends(a: Point3, b: Point3) -> Ends {
    [a.x, a.y, a.z, b.x, b.y, b.z].map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_is_known_by_every_bit_of_both_ends() {
        let mut kept = Kept::of(100);
        let point = |x: f64| Point3::new(x, 2.0 * x, 3.0);
        for idx in 0..20 {
            let (a, b) = (point(f64::from(idx)), point(f64::from(idx) + 0.5));
            assert_eq!(kept.violation(a, b), None);
            kept.note(a, b, f64::from(idx));
            assert_eq!(kept.violation(a, b), Some(f64::from(idx)));
            assert_eq!(kept.violation(b, a), None);
            for axis in 0..3 {
                let mut other = b;
                other[axis] = other[axis].next_up();
                assert_eq!(kept.violation(a, other), None);
            }
        }
    }
}
