//! When an undelivered webhook is tried again.

/// Pauses after the first, the second, ... try, seconds; a day in all.
const PAUSES_S: [i64; 8] = [
    5,
    60,
    10 * 60,
    30 * 60,
    90 * 60,
    4 * 3600,
    7 * 3600,
    11 * 3600,
];

/// Milliseconds from the `tries`th try to the next one; `None` when it was the last. `jitter`, from 0 to 1, shifts it
/// by up to a fifth either way, so that webhooks that failed together are not retried together.
pub(super) fn pause_ms(tries: u32, jitter: f64) -> Option<i64> {
    let position = usize::try_from(tries).ok()?.checked_sub(1)?;
    let pause_s = *PAUSES_S.get(position)?;
    #[expect(clippy::cast_possible_truncation, reason = "below a day")]
    let pause_ms = (pause_s as f64 * 1000.0 * (0.8 + 0.4 * jitter)) as i64;
    Some(pause_ms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retry_pauses_grow_and_total_one_day() {
        assert_eq!(pause_ms(1, 0.5), Some(5_000));
        assert_eq!(pause_ms(1, 0.0), Some(4_000));
        assert_eq!(pause_ms(1, 1.0), Some(6_000));
        let all: Vec<i64> = (1..).map_while(|tries| pause_ms(tries, 0.5)).collect();
        assert!(all.is_sorted(), "{all:?}");
        let hours = all.iter().sum::<i64>() / 3_600_000;
        assert_eq!((all.len(), hours), (8, 24));
    }
}
