//! Seeded random numbers, identical on every machine.
//!
//! xoshiro256++ seeded through `SplitMix64`. Floats are computed with arithmetic that IEEE 754 defines exactly and
//! with `libm`, independent of the platform's libraries.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Random {
    generator: Xoshiro256PlusPlus,
}

impl Random {
    /// The stream of `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            generator: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Uniform in [`low`, `high`).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Normal with mean 0 and standard deviation 1 (Box-Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }

    /// Two independent normal numbers, for little more than the cost of one.
    pub fn normals(&mut self) -> [f64; 2] {
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.unit());
        [radius * cos, radius * sin]
    }

    /// Uniform in 0..`count`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "unit() < 1, so the product is below count"
    )]
    pub fn below(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// These bits must never change: a seed is part of a request.
    #[test]
    fn the_stream_of_a_seed_is_fixed() {
        let mut random = Random::new(7);
        let first: Vec<u64> = (0..3).map(|_| random.unit().to_bits()).collect();
        assert_eq!(
            first,
            [
                4_588_139_100_750_830_880,
                4_595_369_147_474_192_204,
                4_604_638_570_713_848_459
            ]
        );
    }

    #[test]
    fn normal_has_its_moments() {
        let mut random = Random::new(1);
        let one_by_one: Vec<f64> = (0..100_000).map(|_| random.normal()).collect();
        let in_pairs: Vec<[f64; 2]> = (0..100_000).map(|_| random.normals()).collect();
        for draws in [
            one_by_one,
            in_pairs.iter().map(|pair| pair[0]).collect(),
            in_pairs.iter().map(|pair| pair[1]).collect(),
        ] {
            let mean = draws.iter().sum::<f64>() / draws.len() as f64;
            let variance =
                draws.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / draws.len() as f64;
            assert!(
                mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03,
                "{mean} {variance}"
            );
        }
        let products = in_pairs.iter().map(|pair| pair[0] * pair[1]);
        let covariance = products.sum::<f64>() / in_pairs.len() as f64;
        assert!(covariance.abs() < 0.02, "{covariance}");
    }
}
