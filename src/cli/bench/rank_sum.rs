//! Whether one set of runs is better than another: the rank-sum test of Wilcoxon, Mann and Whitney.

use std::cmp::Ordering;

/// The outcome of a test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RankSum {
    /// Probability that a random one of the first set ranks before a random one of the second, ties counted
    /// half (Vargha and Delaney's A).
    pub(super) wins: f64,
    /// Two-sided, by the normal approximation with corrections for ties and continuity; good from
    /// about eight of each on.
    pub(super) p: f64,
}

/// Test `first` against `second`; less is better.
pub(super) fn rank_sum<T>(
    first: &[T],
    second: &[T],
    compare: impl Fn(&T, &T) -> Ordering,
) -> RankSum {
    let mut pooled: Vec<(&T, bool)> = first.iter().map(|item| (item, true)).collect();
    pooled.extend(second.iter().map(|item| (item, false)));
    pooled.sort_by(|one, other| compare(one.0, other.0));

    let (n1, n2) = (first.len() as f64, second.len() as f64);
    let n = n1 + n2;
    let (mut ranks, mut ties, mut before) = (0.0, 0.0, 0.0);
    for tied in pooled.chunk_by(|one, other| compare(one.0, other.0) == Ordering::Equal) {
        let count = tied.len() as f64;
        let rank = before + f64::midpoint(count, 1.0);
        ranks += rank * tied.iter().filter(|(_, of_first)| *of_first).count() as f64;
        ties += count * count * count - count;
        before += count;
    }
    // How many pairs the first set loses.
    let u = ranks - n1 * (n1 + 1.0) / 2.0;
    let variance = n1 * n2 / 12.0 * (n + 1.0 - ties / (n * (n - 1.0)));
    let distance = ((u - n1 * n2 / 2.0).abs() - 0.5).max(0.0);
    let p = if variance > 0.0 {
        libm::erfc(distance / (2.0 * variance).sqrt())
    } else {
        1.0
    };
    RankSum {
        wins: 1.0 - u / (n1 * n2),
        p,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against scipy 1.17: `mannwhitneyu(first, second, method="asymptotic")`.
    #[track_caller]
    fn check(first: &[f64], second: &[f64], u: f64, p: f64) {
        let test = rank_sum(first, second, f64::total_cmp);
        let pairs = (first.len() * second.len()) as f64;
        assert!((test.wins - (1.0 - u / pairs)).abs() < 1e-12, "{test:?}");
        assert!((test.p - p).abs() < 1e-12, "{test:?}");
        let turned = rank_sum(second, first, f64::total_cmp);
        assert!((turned.wins - u / pairs).abs() < 1e-12, "{turned:?}");
        assert!((turned.p - p).abs() < 1e-12, "{turned:?}");
    }

    #[test]
    fn the_rank_sum_test_agrees_with_scipy() {
        check(
            &[1.0, 2.0, 3.0, 4.0, 5.0],
            &[6.0, 7.0, 8.0, 9.0, 10.0],
            0.0,
            0.012_185_780_355_344_813,
        );
        check(
            &[1.0, 2.0, 2.0, 3.0],
            &[2.0, 3.0, 4.0, 4.0, 5.0],
            2.5,
            0.078_545_850_951_190_67,
        );
        check(
            &[503.2, 498.1, 510.7, 499.9, 505.5, 501.0, 497.3, 508.8],
            &[500.4, 502.2, 496.1, 499.0, 507.7, 503.9, 498.8, 495.5],
            42.0,
            0.318_425_066_706_816_14,
        );
        let ascending: Vec<f64> = (1..=30).map(f64::from).collect();
        let shifted: Vec<f64> = ascending.iter().map(|value| value + 4.5).collect();
        check(&ascending, &shifted, 325.0, 0.065_671_257_689_126_59);
    }

    #[test]
    fn equal_or_single_runs_give_no_evidence() {
        check(&[1.0; 3], &[1.0; 3], 4.5, 1.0);
        check(&[0.5], &[0.7], 0.0, 1.0);
    }
}
