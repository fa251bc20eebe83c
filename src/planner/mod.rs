//! From a scenario to a route: the one loop, and what comes out of it.
//!
//! Plain functions: no async, no store, no clock of their own.

mod outcome;

pub use outcome::{
    Bound, Clearance, ConvergencePoint, CostFigures, Incumbent, Leg, Measures, Outcome, Path, StopReason,
    Violation,
};

/// Follows a run. Called on the planning thread; must return quickly.
pub trait Observer {
    /// After each iteration, the first evaluation (iteration 0) included.
    fn iteration(&mut self, point: &ConvergencePoint);
    /// When the best route has improved.
    fn incumbent(&mut self, incumbent: &Incumbent);
}

/// Tells a run when to end and what time it is; asked once an iteration.
pub trait Stop {
    /// Whether somebody wants the run to end with the best route so far.
    fn requested(&self) -> bool;
    /// Milliseconds since the run began. It is reported, and compared to the request's time
    /// limit; no other decision may look at it.
    fn elapsed_ms(&self) -> f64;
}
