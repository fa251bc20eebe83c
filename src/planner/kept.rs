//! A cache of how far legs leave the allowed heights; most keep them.
//!
//! Most legs of a candidate are bit for bit those of the route that it comes from, and need not be measured again. A
//! leg that is forgotten is measured anew, so that nothing but time depends on what is remembered.

use crate::geometry::Point3;

/// Least and greatest capacity, in legs.
const FEWEST: usize = 1 << 10;
const MOST: usize = 1 << 16;

/// An end of a leg: its bits, and those mixed into one number, once for both legs that it joins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct End {
    bits: [u64; 3],
    mixed: u64,
}

/// No leg has this key: no coordinate is such a number.
const NONE: [u64; 6] = [u64::MAX; 6];

/// An odd number whose bits are spread evenly.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

impl End {
    pub(super) fn at(point: Point3) -> Self {
        let bits = [point.x, point.y, point.z].map(f64::to_bits);
        let mixed = bits.iter().fold(0_u64, |mixed, bits| {
            (mixed.rotate_left(29) ^ bits).wrapping_mul(FACTOR)
        });
        Self { bits, mixed }
    }
}

/// A cache in which each leg has one slot; of legs that share it the last is known.
pub(super) struct Kept {
    /// The bits of both ends, and the violation.
    places: Vec<([u64; 6], f64)>,
}

impl Kept {
    /// With room for about this many `legs`.
    pub(super) fn of(legs: usize) -> Self {
        let places = (2 * legs).next_power_of_two().clamp(FEWEST, MOST);
        Self {
            places: vec![(NONE, 0.0); places],
        }
    }

    /// The violation of the leg from `a` to `b`, if it is known.
    pub(super) fn violation(&self, a: End, b: End) -> Option<f64> {
        let (known, violation) = &self.places[self.place(a, b)];
        let differs = |differs: u64, (known, bits): (&u64, &u64)| differs | (known ^ bits);
        let ends = a.bits.iter().chain(&b.bits);
        (known.iter().zip(ends).fold(0, differs) == 0).then_some(*violation)
    }

    /// Remember the violation of the leg from `a` to `b`.
    pub(super) fn note(&mut self, a: End, b: End, violation: f64) {
        let place = self.place(a, b);
        let ([ax, ay, az], [bx, by, bz]) = (a.bits, b.bits);
        self.places[place] = ([ax, ay, az, bx, by, bz], violation);
    }

    fn place(&self, a: End, b: End) -> usize {
        let mixed = (a.mixed.rotate_left(29) ^ b.mixed).wrapping_mul(FACTOR);
        (mixed >> 32) as usize & (self.places.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_is_found_only_by_the_exact_bits_of_both_ends() {
        let mut kept = Kept::of(100);
        let point = |x: f64| Point3::new(x, 2.0 * x, 3.0);
        let violation = |kept: &Kept, a, b| kept.violation(End::at(a), End::at(b));
        for idx in 0..20 {
            let (a, b) = (point(f64::from(idx)), point(f64::from(idx) + 0.5));
            assert_eq!(violation(&kept, a, b), None);
            kept.note(End::at(a), End::at(b), f64::from(idx));
            assert_eq!(violation(&kept, a, b), Some(f64::from(idx)));
            assert_eq!(violation(&kept, b, a), None);
            for axis in 0..3 {
                let mut other = b;
                other[axis] = other[axis].next_up();
                assert_eq!(violation(&kept, a, other), None);
            }
        }
    }
}
