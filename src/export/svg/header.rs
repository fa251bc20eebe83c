//! The lines above the plan view: the request and the result.

use super::canvas::{Area, Canvas, Font};
use super::palette::{BROKEN, INK, MUTED};
use super::{LEFT, RIGHT, WIDTH, figure, metres, name};
use crate::export::Delivery;

/// Pixels from the top of the sheet to the plan view's frame.
pub(super) fn height(delivery: &Delivery) -> f64 {
    if delivery.result.feasible {
        78.0
    } else {
        114.0
    }
}

pub(super) fn draw(canvas: &mut Canvas, delivery: &Delivery) {
    let width = WIDTH - LEFT - RIGHT;
    let title = Font::new(20.0, INK).bold();
    canvas.text((LEFT, 36.0), &title, &title.fit(name(delivery), width));
    let facts = Font::new(13.0, MUTED);
    canvas.text(
        (LEFT, 58.0),
        &facts,
        &facts.fit(&facts_line(delivery), width),
    );
    if !delivery.result.feasible {
        let banner = Area {
            left: LEFT,
            top: 72.0,
            width,
            height: 28.0,
        };
        canvas.rect(&banner, &format!("rx=\"3\" fill=\"{BROKEN}\""));
        let font = Font::new(13.0, "#fff").bold();
        let words = font.fit(&verdict(delivery), width - 24.0);
        canvas.text((LEFT + 12.0, 90.5), &font, &words);
    }
}

/// Such as `tms-sba, seed 4 · cost 471.2 · length 921 m · least clearance 3.1 m (threat 2)`.
fn facts_line(delivery: &Delivery) -> String {
    let result = &delivery.result;
    let length = match &result.path {
        Some(path) => path.length,
        None => result.legs.iter().map(|leg| leg.length).sum(),
    };
    [
        format!("{}, seed {}", result.algorithm, result.seed),
        format!("cost {}", figure(result.cost.total)),
        format!("length {}", metres(length)),
        clearance(delivery),
    ]
    .join(" \u{b7} ")
}

fn clearance(delivery: &Delivery) -> String {
    let checks = &delivery.result.checks;
    let measures = checks.path.as_ref().unwrap_or(&checks.waypoints);
    if measures.clearance.is_empty() {
        return "no threats".to_owned();
    }
    let distances = measures.clearance.iter();
    let least = distances
        .filter_map(|clearance| clearance.distance.map(|distance| (distance, clearance)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match least {
        None => "passes over or under every threat".to_owned(),
        Some((distance, clearance)) => {
            let name = match &clearance.name {
                Some(name) => name.clone(),
                None => format!("threat {}", clearance.threat),
            };
            format!("least clearance {} ({name})", metres(distance))
        }
    }
}

/// Why a route is infeasible.
fn verdict(delivery: &Delivery) -> String {
    let violations = &delivery.result.checks.violations;
    let Some(first) = violations.first() else {
        return "NOT FEASIBLE".to_owned();
    };
    let rest = match violations.len() {
        1 => String::new(),
        count => format!(" (and {} more)", count - 1),
    };
    format!("NOT FEASIBLE: {}{rest}", first.message)
}
