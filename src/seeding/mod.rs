//! What the geometry of a scenario tells before any search.

mod bound;

pub use bound::lower_bound;
