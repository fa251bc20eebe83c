//! Points, legs and curves in a local frame: metres, `x` east, `y` north, `z` up.
//!
//! Deliberately absent: threats, terrain and vehicles.

pub mod bspline;
pub mod geodesy;
pub mod geoid;
pub mod lane;
mod quadratic;
mod rect;
pub mod ring;
mod segment;
pub mod simple;
mod simplify;

pub use quadratic::Quadratic;
pub use rect::Rect;
pub use segment::{LEVEL, Segment};
pub use simplify::{Change, Side, simplified};

/// A point of the horizontal plane, metres.
pub type Point2 = nalgebra::Point2<f64>;

/// A point in space, metres.
pub type Point3 = nalgebra::Point3<f64>;

/// A horizontal displacement, metres.
pub type Vector2 = nalgebra::Vector2<f64>;

/// `angle` wrapped into (-pi, pi].
#[must_use]
pub fn wrap_angle(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turns = (angle / TAU).round();
    let wrapped = angle - turns * TAU;
    if wrapped <= -PI {
        wrapped + TAU
    } else {
        wrapped
    }
}
