//! Who the caller is, and what they may see.

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

use super::AppState;
use super::auth::{Digest, Key, Scope, Unauthorized};
use super::problem::Problem;
use crate::job::{Owner, Plan, PlanId};
use crate::store::{Store, StoreError};

/// The caller of a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Caller {
    /// The owner of the key that came with the request; `None` where no keys are in use.
    pub(super) owner: Option<Owner>,
    /// Whether this caller may see everybody's plans.
    pub(super) sees_all: bool,
    /// Active plans that this caller may have.
    pub(super) quota: Option<u64>,
    /// The sum of the caller's key.
    pub(super) key: Option<Digest>,
}

impl Caller {
    /// Where no keys are in use, everybody may do everything.
    pub(super) const ANYBODY: Self = Self {
        owner: None,
        sees_all: true,
        quota: None,
        key: None,
    };

    /// The holder of this key.
    pub(super) fn of(key: &Key) -> Self {
        Self {
            owner: Some(key.owner.clone()),
            sees_all: key.may(Scope::Admin),
            quota: key.active_plans,
            key: Some(key.digest()),
        }
    }

    /// The record of a plan that this caller may see; others' plans do not exist for them.
    pub(super) async fn plan(&self, store: &dyn Store, id: PlanId) -> Result<Plan, Problem> {
        match store.get(id).await {
            Ok(plan) if self.may_see(plan.owner.as_ref()) => Ok(plan),
            Err(StoreError::Gone(tombstone)) if self.may_see(tombstone.owner.as_ref()) => {
                Err(StoreError::Gone(tombstone).into())
            }
            Ok(_) | Err(StoreError::Gone(_)) => Err(Problem::no_such_plan(id)),
            Err(error) => Err(error.into()),
        }
    }

    fn may_see(&self, owner: Option<&Owner>) -> bool {
        self.sees_all || (owner.is_some() && self.owner.as_ref() == owner)
    }
}

impl FromRequestParts<AppState> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, Problem> {
        match parts.extensions.get() {
            Some(caller) => Ok(Self::clone(caller)),
            None if state.access.is_guarded() => Err(Problem::Unauthorized(Unauthorized::Nothing)),
            None => Ok(Self::ANYBODY),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_visible_to_its_owner_and_to_callers_who_see_all() {
        let named = |name: &str| Caller {
            owner: Some(name.to_owned()),
            sees_all: false,
            quota: None,
            key: None,
        };
        let (alice, bob) = ("alice".to_owned(), "bob".to_owned());
        assert!(named("alice").may_see(Some(&alice)));
        assert!(!named("alice").may_see(Some(&bob)));
        assert!(
            !named("alice").may_see(None),
            "of a time when nobody had a key"
        );
        assert!(Caller::ANYBODY.may_see(None) && Caller::ANYBODY.may_see(Some(&bob)));
    }
}
