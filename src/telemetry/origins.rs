//! Which request a plan came from, so that log lines of its run can name it.

use std::collections::BTreeMap;

use parking_lot::Mutex;
use uuid::Uuid;

use super::traceparent::TraceParent;

/// Number of plans remembered; beyond it, the oldest are forgotten.
const REMEMBERED: usize = 10_000;

/// The request that a plan came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// Value of `x-request-id` in its answer.
    pub request_id: String,
    /// The trace that it belongs to.
    pub traceparent: Option<TraceParent>,
}

/// Origins of the plans that this process accepted, until they end here. Plans that end elsewhere, such as those run by
/// another node, are forgotten once they are among the oldest. The table is lost at a restart: plans accepted earlier
/// have no origin.
#[derive(Debug, Default)]
pub struct Origins(Mutex<BTreeMap<Uuid, Origin>>);

impl Origins {
    /// The plan called `plan` comes from `origin`.
    pub fn remember(&self, plan: Uuid, origin: Origin) {
        let mut known = self.0.lock();
        known.insert(plan, origin);
        if known.len() > REMEMBERED {
            // Ids begin with the time.
            known.pop_first();
        }
    }

    /// Where the plan called `plan` comes from, if that is known.
    #[must_use]
    pub fn of(&self, plan: Uuid) -> Option<Origin> {
        let known = self.0.lock();
        known.get(&plan).cloned()
    }

    /// The plan has ended, or is gone.
    pub fn forget(&self, plan: Uuid) {
        let mut known = self.0.lock();
        known.remove(&plan);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_origins_are_forgotten_first() {
        let origins = Origins::default();
        let origin = Origin {
            request_id: "r".to_owned(),
            traceparent: None,
        };
        let plans: Vec<Uuid> = (0..=REMEMBERED as u128).map(Uuid::from_u128).collect();
        for plan in &plans {
            origins.remember(*plan, origin.clone());
        }
        assert_eq!(origins.of(plans[0]), None);
        assert_eq!(origins.of(plans[1]), Some(origin));
        origins.forget(plans[1]);
        assert_eq!(origins.of(plans[1]), None);
    }
}
