//! What several subjects need.

pub(crate) mod engines;
pub(crate) mod faulty_store;
pub(crate) mod plans;
pub(crate) mod stores;
