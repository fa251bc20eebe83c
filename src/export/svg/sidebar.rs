//! The column beside the plan view: the legend, the tints of heights, and key figures of the result.

use super::canvas::{Area, Canvas, Font, Spot};
use super::palette::{BROKEN, INK, MUTED, ROUTE, RULE, SOIL, tint};
use super::plan_view::{
    AREA_EDGE, BROKEN_LEG, LIMITED, SOFT, SOLID, STRAIGHT, is_limited, start, target, waypoint,
};
use super::profile::{ALLOWED, ALLOWED_EDGE};
use super::relief::Relief;
use super::{RIGHT, WIDTH, figure, metres};
use crate::export::Delivery;

/// Between the plan view's frame and the sidebar.
const GAP: f64 = 22.0;
/// Line height of the legend and of the figures.
const LEGEND_LINE: f64 = 19.0;
const FIGURE_LINE: f64 = 17.0;

pub(super) fn draw(canvas: &mut Canvas, delivery: &Delivery, relief: &Relief, plan: &Area) {
    let column = Area {
        left: plan.right() + GAP,
        width: WIDTH - RIGHT - plan.right() - GAP,
        ..*plan
    };
    let mut y = column.top + 8.0;
    for (words, mark) in legend(delivery) {
        mark(canvas, (column.left + 13.0, y));
        let place = (column.left + 34.0, y + 4.0);
        canvas.text(place, &Font::new(12.0, INK), words);
        y += LEGEND_LINE;
    }
    y = heights(canvas, relief, &column, y + 6.0);
    figures(canvas, delivery, &column, y + 22.0);
}

type Mark = fn(&mut Canvas, Spot);

/// The marks that occur in the drawing.
fn legend(delivery: &Delivery) -> Vec<(&'static str, Mark)> {
    let threats = &delivery.scenario.threats;
    let feasible = delivery.result.feasible;
    let rows: [(bool, &'static str, Mark); 11] = [
        (true, "start", start),
        (true, "target", target),
        (delivery.path.is_some(), "path flown", |canvas, at| {
            across(
                canvas,
                at,
                &format!("stroke=\"{ROUTE}\" stroke-width=\"3\""),
            );
        }),
        (feasible, "waypoints and legs", |canvas, at| {
            across(canvas, at, STRAIGHT);
            waypoint(canvas, at);
        }),
        (!feasible, "least violating route", |canvas, at| {
            across(
                canvas,
                at,
                &format!("stroke=\"{BROKEN}\" stroke-width=\"2\""),
            );
            waypoint(canvas, at);
        }),
        (!feasible, "leg in violation", |canvas, at| {
            across(
                canvas,
                at,
                &format!("stroke=\"{BROKEN}\" stroke-width=\"2\""),
            );
            across(canvas, at, BROKEN_LEG);
        }),
        (
            threats.iter().any(|threat| !is_limited(threat)),
            "threat",
            |canvas, at| {
                canvas.circle(at, 6.0, SOLID);
            },
        ),
        (
            threats.iter().any(is_limited),
            "limited in height",
            |canvas, at| {
                canvas.circle(at, 6.0, LIMITED);
            },
        ),
        (!threats.is_empty(), "soft zone", |canvas, at| {
            canvas.circle(at, 7.0, SOFT);
        }),
        (true, "allowed heights", |canvas, at| {
            canvas.rect(&Area::about(at, (26.0, 10.0)), ALLOWED);
            for edge in [-5.0, 5.0] {
                across(canvas, (at.0, at.1 + edge), ALLOWED_EDGE);
            }
        }),
        (true, "edge of the area", |canvas, at| {
            across(canvas, at, AREA_EDGE);
        }),
    ];
    let shown = rows.into_iter().filter(|(occurs, ..)| *occurs);
    shown.map(|(_, words, mark)| (words, mark)).collect()
}

fn across(canvas: &mut Canvas, (x, y): Spot, style: &str) {
    canvas.line_between((x - 13.0, y), (x + 13.0, y), style);
}

/// A bar of tints; returns the `y` below it.
fn heights(canvas: &mut Canvas, relief: &Relief, column: &Area, y: f64) -> f64 {
    let font = Font::new(11.0, MUTED);
    let (min, max) = relief.range;
    let levels: Vec<f64> = relief.levels().collect();
    if levels.is_empty() {
        let words = format!("level ground at {}", metres(min));
        canvas.text((column.left, y + 10.0), &font, &words);
        return y + 14.0;
    }
    let x = |height: f64| column.left + (height - min) / (max - min) * column.width;
    let mut edges = vec![min];
    edges.extend(levels);
    edges.push(max);
    for (idx, ends) in edges.windows(2).enumerate() {
        // The ground below all contour lines has the lowest tint.
        let fill = if idx == 0 {
            tint(0.0)
        } else {
            relief.tint_above(ends[0])
        };
        let band = Area {
            left: x(ends[0]),
            top: y,
            width: x(ends[1]) - x(ends[0]),
            height: 11.0,
        };
        canvas.rect(&band, &format!("fill=\"{fill}\""));
    }
    let bar = Area {
        left: column.left,
        top: y,
        width: column.width,
        height: 11.0,
    };
    canvas.rect(
        &bar,
        &format!("fill=\"none\" stroke=\"{SOIL}\" stroke-width=\"0.7\""),
    );
    let foot = y + 24.0;
    canvas.text((column.left, foot), &font, &format!("{min:.0}"));
    let middle = (column.left + column.width / 2.0, foot);
    canvas.text(middle, &font.anchor("middle"), "ground, m");
    canvas.text(
        (column.left + column.width, foot),
        &font.anchor("end"),
        &format!("{max:.0}"),
    );
    let words = format!(
        "contour lines every {} m",
        relief.interval.label(relief.interval.step)
    );
    canvas.text((column.left, foot + 15.0), &font, &words);
    foot + 15.0
}

fn figures(canvas: &mut Canvas, delivery: &Delivery, column: &Area, top: f64) {
    let result = &delivery.result;
    let legs = &result.checks.waypoints;
    let measures = result.checks.path.as_ref().unwrap_or(legs);
    let gap = result.bound.gap.map(|gap| format!("{:.1} %", 100.0 * gap));
    let heights = measures
        .min_agl
        .zip(measures.max_agl)
        .map(|(min, max)| format!("{min:.0} to {max:.0} m"));
    let duration = result
        .path
        .as_ref()
        .map(|path| format!("{:.0} s", path.duration_s));
    let rows = [
        ("fuel", Some(figure(result.cost.fuel))),
        ("threats", Some(figure(result.cost.threat))),
        ("altitude", Some(figure(result.cost.altitude))),
        ("cost", Some(figure(result.cost.total))),
        ("lower bound", Some(figure(result.bound.lower))),
        ("gap at most", gap),
        ("above ground", heights),
        (
            "sharpest turn",
            Some(format!("{:.1}\u{b0}", legs.max_turn_deg)),
        ),
        (
            "steepest climb",
            Some(format!("{:.1}\u{b0}", measures.max_climb_deg)),
        ),
        ("flight time", duration),
    ];
    let mut y = top;
    let right = column.left + column.width;
    for (words, value) in rows {
        let Some(value) = value else { continue };
        if words == "cost" {
            let rule = y - FIGURE_LINE + 5.0;
            canvas.line_between(
                (column.left, rule),
                (right, rule),
                &format!("stroke=\"{RULE}\""),
            );
        }
        canvas.text((column.left, y), &Font::new(12.0, MUTED), words);
        let font = Font::new(12.0, INK).anchor("end");
        let font = if words == "cost" { font.bold() } else { font };
        canvas.text((right, y), &font, &value);
        y += FIGURE_LINE;
    }
}
