//! The edges of the plan view: ticks, their numbers, the scale bar and the north arrow.

use super::canvas::{Canvas, Font, Spot, polyline, ring};
use super::palette::{INK, MUTED};
use super::scale::{MapScale, Steps};
use crate::export::Delivery;
use crate::geometry::Point2;
use crate::scenario::Frame;

/// Ticks, their labels, the scale bar and the north arrow.
pub(super) fn draw(canvas: &mut Canvas, delivery: &Delivery, map: &MapScale) {
    let (frame, view) = (&map.frame, &map.view);
    let steps = Steps::of((view.max.x - view.min.x).max(view.max.y - view.min.y), 9.0);
    let line = format!("stroke=\"{INK}\"");
    let font = Font::new(11.0, MUTED);
    for x in steps.within(view.min.x, view.max.x) {
        let (at, _) = map.spot(Point2::new(x, view.min.y));
        canvas.line_between((at, frame.bottom()), (at, frame.bottom() + 5.0), &line);
        let place = (at, frame.bottom() + 18.0);
        canvas.text(place, &font.anchor("middle"), &steps.label(x));
    }
    for y in steps.within(view.min.y, view.max.y) {
        let (_, at) = map.spot(Point2::new(view.min.x, y));
        canvas.line_between((frame.left - 5.0, at), (frame.left, at), &line);
        let place = (frame.left - 9.0, at + 4.0);
        canvas.text(place, &font.anchor("end"), &steps.label(y));
    }
    let title = Font::new(11.0, MUTED).anchor("middle");
    let (east_title, north_title) = titles(&delivery.scenario.frame);
    canvas.turned_text(
        (16.0, frame.top + frame.height / 2.0),
        -90.0,
        &title,
        &north_title,
    );
    let foot = frame.bottom() + 36.0;
    canvas.text((frame.left + frame.width / 2.0, foot), &title, &east_title);

    let bar = Steps::of(view.max.x - view.min.x, 10.0);
    let length = bar.step * map.pixels_per_metre();
    let (left, right) = (frame.right() - length, frame.right());
    let data = [
        (left, foot - 8.0),
        (left, foot - 3.0),
        (right, foot - 3.0),
        (right, foot - 8.0),
    ];
    canvas.path(
        &polyline(&data),
        &format!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.3\""),
    );
    let words = format!("{} m", bar.label(bar.step));
    canvas.text((left - 6.0, foot), &font.anchor("end"), &words);
    north(canvas, (frame.left + 4.0, foot - 4.0));
}

fn north(canvas: &mut Canvas, (x, y): Spot) {
    let arrow = [
        (x, y - 9.0),
        (x + 4.5, y + 5.0),
        (x, y + 2.0),
        (x - 4.5, y + 5.0),
    ];
    canvas.path(&ring(&arrow), &format!("fill=\"{MUTED}\""));
    canvas.text((x + 9.0, y + 4.0), &Font::new(11.0, MUTED).bold(), "N");
}

/// Titles of the two axes; for a plan in degrees they are relative to the tangent point.
fn titles(frame: &Frame) -> (String, String) {
    let Some(wgs84) = frame.wgs84() else {
        return ("east, m".to_owned(), "north, m".to_owned());
    };
    let origin = wgs84.plane.origin();
    let degrees = |value: f64, [positive, negative]: [&str; 2]| {
        let side = if value < 0.0 { negative } else { positive };
        format!("{:.5}\u{b0} {side}", value.abs())
    };
    (
        format!("east of {}, m", degrees(origin.lon, ["E", "W"])),
        format!("north of {}, m", degrees(origin.lat, ["N", "S"])),
    )
}
