//! What several subjects need.

pub(crate) mod plans;
pub(crate) mod stores;
