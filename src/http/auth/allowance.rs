//! What is left of a limit, as header fields: draft-ietf-httpapi-ratelimit-headers-10.

use std::fmt::Write as _;

use axum::http::{HeaderMap, HeaderName, HeaderValue};

const RATELIMIT: HeaderName = HeaderName::from_static("ratelimit");
const RATELIMIT_POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");

/// What is left of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::http) struct Allowance {
    /// Name of the limit.
    pub(in crate::http) name: &'static str,
    /// Maximum number.
    pub(in crate::http) quota: u64,
    /// How many more are allowed now.
    pub(in crate::http) left: u64,
    /// For a limit that refills with time alone.
    pub(in crate::http) filling: Option<Filling>,
}

/// How a limit refills.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::http) struct Filling {
    /// Seconds from empty to full.
    pub(in crate::http) window_s: u64,
    /// Seconds until it is full.
    pub(in crate::http) full_in_s: u64,
}

impl Allowance {
    /// A limit that is reached, and frees up when something ends: nobody knows when, so there is no `t`.
    pub(in crate::http) fn none_left(name: &'static str, quota: u64) -> Self {
        Self {
            name,
            quota,
            left: 0,
            filling: None,
        }
    }

    /// Put in front of what the fields say about other limits.
    pub(in crate::http) fn write(&self, headers: &mut HeaderMap) {
        let mut policy = format!("\"{}\";q={}", self.name, self.quota);
        let mut limit = format!("\"{}\";r={}", self.name, self.left);
        if let Some(filling) = self.filling {
            let written = write!(policy, ";w={}", filling.window_s)
                .and_then(|()| write!(limit, ";t={}", filling.full_in_s));
            written.expect("a string takes all");
        }
        for (name, mut value) in [(RATELIMIT_POLICY, policy), (RATELIMIT, limit)] {
            if let Some(others) = headers.get(&name).and_then(|others| others.to_str().ok()) {
                value = format!("{value}, {others}");
            }
            let value = HeaderValue::from_str(&value).expect("visible ASCII");
            headers.insert(name, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_limits_are_written_as_one_list() {
        let mut headers = HeaderMap::new();
        let field = |headers: &HeaderMap, name| headers[name].to_str().expect("ASCII").to_owned();
        Allowance::none_left("plans", 2).write(&mut headers);
        assert_eq!(field(&headers, RATELIMIT_POLICY), "\"plans\";q=2");
        assert_eq!(field(&headers, RATELIMIT), "\"plans\";r=0");
        let requests = Allowance {
            name: "requests",
            quota: 3,
            left: 1,
            filling: Some(Filling {
                window_s: 6,
                full_in_s: 4,
            }),
        };
        requests.write(&mut headers);
        assert_eq!(
            field(&headers, RATELIMIT_POLICY),
            "\"requests\";q=3;w=6, \"plans\";q=2"
        );
        assert_eq!(
            field(&headers, RATELIMIT),
            "\"requests\";r=1;t=4, \"plans\";r=0"
        );
    }
}
