//! A drawing of a plan: the route seen from above with its profile below, on one sheet of SVG 1.1.
//!
//! Equal documents give the same bytes. Deliberately absent: scripts, styles and external resources, so that the file
//! can be opened, printed and mailed as it is.

mod axes;
mod canvas;
mod contour;
mod header;
mod labels;
mod palette;
mod plan_view;
mod profile;
mod relief;
mod scale;
mod sidebar;

use canvas::{Area, Canvas};
use relief::Relief;
use scale::MapScale;

use super::{Delivery, Options};
use crate::geometry::{Point3, Rect};
use crate::planner::Place;

/// Width of the sheet, pixels.
const WIDTH: f64 = 900.0;
/// Left of the frames: axis labels.
const LEFT: f64 = 70.0;
/// Right of everything.
const RIGHT: f64 = 18.0;
/// Width of the plan view's frame.
const PLAN_WIDTH: f64 = 620.0;
/// Below the plan view's frame: labels and scale bar.
const PLAN_FOOT: f64 = 62.0;
/// Height of the profile's frame.
const PROFILE_HEIGHT: f64 = 170.0;
/// Below the profile's frame.
const PROFILE_FOOT: f64 = 44.0;
/// Range of the height of the plan view's frame over its width; a longer or flatter area is shown with its
/// surroundings.
const ASPECT: (f64, f64) = (0.66, 1.05);

/// Draw a plan.
pub(super) fn write(delivery: &Delivery, _: &Options) -> String {
    let map = map(delivery, header::height(delivery));
    let profile_frame = Area {
        left: LEFT,
        top: map.frame.bottom() + PLAN_FOOT,
        width: WIDTH - LEFT - RIGHT,
        height: PROFILE_HEIGHT,
    };
    let mut canvas = Canvas::new(WIDTH, profile_frame.bottom() + PROFILE_FOOT);
    let everything = Area {
        left: 0.0,
        top: 0.0,
        width: WIDTH,
        height: profile_frame.bottom() + PROFILE_FOOT,
    };
    canvas.title(name(delivery));
    canvas.rect(&everything, "fill=\"#fff\"");
    header::draw(&mut canvas, delivery);
    let relief = Relief::of(&delivery.scenario.terrain, &map);
    plan_view::draw(&mut canvas, delivery, &relief, &map);
    sidebar::draw(&mut canvas, delivery, &relief, &map.frame);
    profile::draw(&mut canvas, delivery, profile_frame);
    canvas.finish()
}

/// Title of the sheet.
fn name(delivery: &Delivery) -> &str {
    let name = delivery.scenario.name.as_deref();
    name.unwrap_or("unnamed scenario")
}

/// Colour of a feasible or an infeasible route.
fn route_color(delivery: &Delivery) -> &'static str {
    if delivery.result.feasible {
        palette::ROUTE
    } else {
        palette::BROKEN
    }
}

/// Indices of each leg or each waypoint that violates a constraint.
fn broken(delivery: &Delivery, index: fn(Place) -> Option<usize>) -> Vec<usize> {
    let violations = delivery.result.checks.violations.iter();
    let mut indices: Vec<usize> = violations
        .filter_map(|violation| index(violation.place))
        .collect();
    indices.dedup();
    indices
}

/// The area and the route with some room around, within the range of aspect ratios.
fn map(delivery: &Delivery, top: f64) -> MapScale {
    let ends = [delivery.scenario.area.min, delivery.scenario.area.max];
    let route = delivery.waypoints.iter().map(Point3::xy);
    let shown = Rect::around(ends.into_iter().chain(route)).expect("an area has corners");
    let (width, height) = (shown.max.x - shown.min.x, shown.max.y - shown.min.y);
    let shown = shown.grown((0.02 * width.max(height)).max(0.5));
    let (width, height) = (shown.max.x - shown.min.x, shown.max.y - shown.min.y);
    let aspect = (height / width).clamp(ASPECT.0, ASPECT.1);
    let (wider, taller) = ((height / aspect).max(width), (width * aspect).max(height));
    let margin = nalgebra::Vector2::new(wider - width, taller - height) / 2.0;
    MapScale {
        view: Rect {
            min: shown.min - margin,
            max: shown.max + margin,
        },
        frame: Area {
            left: LEFT,
            top,
            width: PLAN_WIDTH,
            height: PLAN_WIDTH * taller / wider,
        },
    }
}

/// A number for display, with three or four significant digits.
fn figure(value: f64) -> String {
    let decimals = match value.abs() {
        size if size >= 1000.0 => 0,
        size if size >= 100.0 => 1,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

/// Metres for display.
fn metres(value: f64) -> String {
    let decimals = usize::from(value.abs() < 100.0);
    format!("{value:.decimals$} m")
}
