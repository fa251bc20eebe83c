//! What state a plan must be in for a change to be made: `If-Match` and `If-None-Match`, RFC 9110 section 13.1.

use std::convert::Infallible;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderValue, header};

use super::entity_tags::EntityTags;
use super::problem::Problem;
use super::status::etag;
use crate::job::{Plan, PlanId};
use crate::store::StoreError;

/// The conditions in the two headers.
pub(super) struct Precondition {
    one_of: Option<EntityTags>,
    none_of: Option<EntityTags>,
}

impl Precondition {
    /// Refuses unless `plan` is as the caller expects.
    ///
    /// Deviation: `If-Match` compares weakly too. Plans' tags are weak only because the bytes of a document may differ,
    /// and a strong comparison would never match any of them.
    pub(super) fn check(&self, plan: &Plan) -> Result<(), Problem> {
        let tag = etag(plan);
        if self.holds(Some(&tag)) {
            return Ok(());
        }
        let tag = tag.to_str().expect("digits are visible ASCII");
        Err(Problem::PreconditionFailed(format!(
            "plan {} has the entity tag {tag}, which If-Match or If-None-Match rules out",
            plan.id
        )))
    }

    /// What `change` does to `plan`, or to what that has become meanwhile, if it is as the caller expects. Only a plan of
    /// the revision that was looked at is changed, if the caller expects anything.
    pub(super) async fn heeded<T, F>(
        &self,
        mut plan: Plan,
        change: impl Fn(Option<u64>) -> F,
    ) -> Result<T, Problem>
    where
        F: Future<Output = Result<T, StoreError>>,
    {
        loop {
            self.check(&plan)?;
            let expects = self.one_of.is_some() || self.none_of.is_some();
            match change(expects.then_some(plan.revision)).await {
                Err(StoreError::Changed(now)) => plan = *now,
                done => return Ok(done?),
            }
        }
    }

    /// Refuses if the caller expects anything of a plan that was removed.
    pub(super) fn check_removed(&self, id: PlanId) -> Result<(), Problem> {
        if self.holds(None) {
            return Ok(());
        }
        Err(Problem::PreconditionFailed(format!(
            "plan {id} was removed, so it has none of the entity tags of If-Match"
        )))
    }

    fn holds(&self, tag: Option<&HeaderValue>) -> bool {
        let among = |tags: &EntityTags| tag.is_some_and(|tag| tags.contain(tag));
        self.one_of.as_ref().is_none_or(among) && !self.none_of.as_ref().is_some_and(among)
    }
}

impl<S: Sync> FromRequestParts<S> for Precondition {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self {
            one_of: EntityTags::of(&parts.headers, header::IF_MATCH),
            none_of: EntityTags::known(&parts.headers),
        })
    }
}
