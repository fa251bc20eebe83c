//! How fast a key may send requests: one token bucket each.

use std::collections::{HashMap, HashSet};

use parking_lot::Mutex;
use tokio::time::Instant;

use super::allowance::{Allowance, Filling};

/// A bucket of `burst` tokens that fills at `per_second`; a request takes one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Above 0.
    pub per_second: f64,
    /// At least 1.
    pub burst: u32,
}

/// The buckets, by the names of their keys.
#[derive(Debug, Default)]
pub(super) struct Buckets(Mutex<HashMap<String, Bucket>>);

#[derive(Debug, Clone, Copy)]
struct Bucket {
    tokens: f64,
    filled: Instant,
}

/// The outcome of a request for a token.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Taken {
    rate: Rate,
    /// Tokens left in the bucket; below 1 with `granted` false when there was none to take.
    left: f64,
    pub(super) granted: bool,
}

impl Buckets {
    /// Take a token for the key called `name`.
    pub(super) fn take(&self, name: &str, rate: Rate, now: Instant) -> Taken {
        let full = f64::from(rate.burst);
        let mut buckets = self.0.lock();
        let bucket = buckets.entry(name.to_owned()).or_insert(Bucket {
            tokens: full,
            filled: now,
        });
        let passed = now.saturating_duration_since(bucket.filled).as_secs_f64();
        bucket.tokens = (bucket.tokens + passed * rate.per_second).min(full);
        bucket.filled = now;
        let granted = bucket.tokens >= 1.0;
        if granted {
            bucket.tokens -= 1.0;
        }
        Taken {
            rate,
            left: bucket.tokens,
            granted,
        }
    }

    /// Forget all buckets except those of `names`.
    pub(super) fn keep(&self, names: &HashSet<&str>) {
        let mut buckets = self.0.lock();
        buckets.retain(|name, _| names.contains(name.as_str()));
    }
}

impl Taken {
    /// Seconds until there is a token.
    pub(super) fn retry_after_s(&self) -> u64 {
        seconds((1.0 - self.left) / self.rate.per_second).max(1)
    }

    /// The bucket's contents as header fields.
    pub(super) fn allowance(&self) -> Allowance {
        let full = f64::from(self.rate.burst);
        Allowance {
            name: "requests",
            quota: u64::from(self.rate.burst),
            left: whole(self.left.floor()),
            filling: Some(Filling {
                window_s: seconds(full / self.rate.per_second),
                full_in_s: seconds((full - self.left) / self.rate.per_second),
            }),
        }
    }
}

fn seconds(seconds: f64) -> u64 {
    whole(seconds.ceil())
}

fn whole(number: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, at most a burst of 2^32 at a thousandth a second"
    )]
    let whole = number as u64;
    whole
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::http::HeaderMap;

    use super::*;

    const RATE: Rate = Rate {
        per_second: 0.5,
        burst: 3,
    };

    fn fields(taken: &Taken) -> [String; 2] {
        let mut headers = HeaderMap::new();
        taken.allowance().write(&mut headers);
        ["ratelimit-policy", "ratelimit"]
            .map(|name| headers[name].to_str().expect("visible ASCII").to_owned())
    }

    #[test]
    fn a_bucket_empties_at_once_and_fills_slowly() {
        let buckets = Buckets::default();
        let begin = Instant::now();
        let take = |after_ms| buckets.take("k", RATE, begin + Duration::from_millis(after_ms));
        let policy = "\"requests\";q=3;w=6";
        assert_eq!(fields(&take(0)), [policy, "\"requests\";r=2;t=2"]);
        assert_eq!(fields(&take(0)), [policy, "\"requests\";r=1;t=4"]);
        assert!(take(0).granted);
        let refused = take(500);
        assert!(!refused.granted);
        assert_eq!(refused.retry_after_s(), 2);
        assert_eq!(fields(&refused), [policy, "\"requests\";r=0;t=6"]);
        assert!(take(2_000).granted);
        assert!(!take(2_100).granted);
        assert!(take(600_000).granted, "full again, and no fuller");
        assert_eq!(fields(&take(600_000)), [policy, "\"requests\";r=1;t=4"]);
    }

    #[test]
    fn each_key_has_a_bucket_of_its_own() {
        let buckets = Buckets::default();
        let now = Instant::now();
        for _ in 0..3 {
            assert!(buckets.take("a", RATE, now).granted);
        }
        assert!(!buckets.take("a", RATE, now).granted);
        assert!(buckets.take("b", RATE, now).granted);
        buckets.keep(&HashSet::from(["a"]));
        assert!(!buckets.take("a", RATE, now).granted, "kept over a reload");
    }
}
