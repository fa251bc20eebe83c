//! Determines on which sides ways pass walls.

use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use crate::geometry::Point2;
use crate::seeding::bound::wall::Wall;

/// A ray from each wall, and a number for each ray. How often a way crosses each, counting crossings from its left
/// against those from its right, shows on which side it passes; so does the sum of their numbers, except with a
/// probability of one in 2^64.
#[derive(Debug)]
pub(super) struct Rays(Vec<(Point2, u64)>);

impl Rays {
    pub(super) fn of(walls: &[&Wall]) -> Self {
        let mut numbers = SplitMix64::seed_from_u64(0);
        let from = walls.iter().map(|wall| wall.centers()[0]);
        let mut rays: Vec<_> = from.map(|from| (from, numbers.next_u64())).collect();
        rays.sort_by(|(one, _), (other, _)| one.x.total_cmp(&other.x));
        Self(rays)
    }

    /// The sum of the numbers of all rays that are crossed between two places.
    pub(super) fn crossed(&self, [a, b]: [Point2; 2]) -> u64 {
        let (low, high) = (a.x.min(b.x), a.x.max(b.x));
        let between = self.0.partition_point(|(from, _)| from.x < low);
        let between = self.0[between..]
            .iter()
            .take_while(|(from, _)| from.x < high);
        // Rays that begin below.
        let crossed = between.filter(|(from, _)| (a - from).perp(&(b - from)) * (b.x - a.x) < 0.0);
        let sum = crossed.fold(0_u64, |sum, (_, number)| sum.wrapping_add(*number));
        if b.x > a.x { sum } else { sum.wrapping_neg() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sum of the rays crossed on a way over `places`.
    fn sum(rays: &Rays, places: &[[f64; 2]]) -> u64 {
        let pieces = places.windows(2);
        let crossed = pieces.map(|ends| rays.crossed([ends[0].into(), ends[1].into()]));
        crossed.fold(0, u64::wrapping_add)
    }

    #[test]
    fn ways_differ_only_by_the_points_between_them() {
        let rays = Rays(
            [(0.0, 0.0), (1.0, 3.0), (1.0, 5.0)]
                .map(|(x, y)| Point2::new(x, y))
                .into_iter()
                .zip([1, 10, 100])
                .collect(),
        );
        let direct = sum(&rays, &[[-4.0, 1.0], [4.0, 1.0]]);
        assert_eq!(direct, 1);
        // However the way is bent and subdivided, and with loops that return; reversed it is negated.
        for same in [
            vec![[-4.0, 1.0], [0.0, 2.9], [0.0, 0.5], [1.0, 0.5], [4.0, 1.0]],
            vec![
                [-4.0, 1.0],
                [3.0, 4.0],
                [-3.0, 4.0],
                [-3.0, 2.0],
                [4.0, 1.0],
            ],
        ] {
            assert_eq!(sum(&rays, &same), direct);
            let mut back = same;
            back.reverse();
            assert_eq!(sum(&rays, &back), direct.wrapping_neg());
        }
        assert_eq!(sum(&rays, &[[-4.0, 1.0], [0.0, -1.0], [4.0, 1.0]]), 0);
        assert_eq!(sum(&rays, &[[-4.0, 1.0], [1.0, 4.0], [4.0, 1.0]]), 11);
        assert_eq!(sum(&rays, &[[-4.0, 1.0], [1.0, 6.0], [4.0, 1.0]]), 111);
    }
}
