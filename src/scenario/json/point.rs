//! Pairs of numbers, and the area of the local frame.

use crate::geometry::{Point2, Rect};

use super::fault::Faults;
use super::ranges::{AREA, Range};
use super::value::{At, figure};

/// `{"x", "y"}`, each within `range`.
pub(super) fn pair(at: At<'_>, range: Range, faults: &mut Faults) -> Option<Point2> {
    let fields = at.fields(&["x", "y"], faults)?;
    let x = fields.number("x", range, faults);
    let y = fields.number("y", range, faults);
    Some(Point2::new(x?, y?))
}

/// `{"min", "max"}`, with a width and a height > 0.
pub(super) fn area(at: At<'_>, faults: &mut Faults) -> Option<Rect> {
    let fields = at.fields(&["min", "max"], faults)?;
    let min = fields.required("min", faults, |at, faults| pair(at, AREA, faults));
    let max = fields.required("max", faults, |at, faults| pair(at, AREA, faults));
    let (min, max) = (min?, max?);
    if min.x < max.x && min.y < max.y {
        return Some(Rect { min, max });
    }
    faults.add(at.path, "empty-area", || {
        format!(
            "area runs from ({}, {}) to ({}, {}), must have min < max in both x and y",
            figure(min.x),
            figure(min.y),
            figure(max.x),
            figure(max.y)
        )
    });
    None
}
