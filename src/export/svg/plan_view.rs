//! The route seen from above, north up, with ground and threats.

use super::axes;
use super::canvas::{Area, Canvas, Font, Spot, polyline, ring};
use super::labels::Labels;
use super::palette::{BROKEN, INK, RULE, THREAT};
use super::relief::Relief;
use super::scale::MapScale;
use super::{broken, route_color};
use crate::export::Delivery;
use crate::geometry::{Point2, Point3};
use crate::planner::Place;
use crate::threat::{Shape, Threat};

/// Style of a line drawn below another one for contrast.
const CASING: &str =
    "fill=\"none\" stroke=\"#fff\" stroke-opacity=\"0.75\" stroke-linejoin=\"round\"";
/// Style of every line of the route.
pub(super) const LINE: &str = "fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\"";

pub(super) fn draw(canvas: &mut Canvas, delivery: &Delivery, relief: &Relief, map: &MapScale) {
    let frame = &map.frame;
    canvas.group("clipPath", "id=\"plan\"", |canvas| canvas.rect(frame, ""));
    canvas.group("g", "clip-path=\"url(#plan)\"", |canvas| {
        relief.draw(canvas, frame);
        outside(canvas, delivery, map);
        threats(canvas, &delivery.scenario.threats, map);
        route(canvas, delivery, map);
    });
    canvas.rect(frame, &format!("fill=\"none\" stroke=\"{INK}\""));
    axes::draw(canvas, delivery, map);

    let mut labels = Labels::within(*frame);
    for line in [Some(&delivery.waypoints), delivery.path.as_ref()]
        .into_iter()
        .flatten()
    {
        labels.reserve_line(&thinned(&spots(line, map)));
    }
    let [nw, ne, se, sw] = area_corners(delivery, map);
    labels.reserve_line(&[nw, ne, se, sw, nw]);
    end_names(canvas, delivery, map, &mut labels);
    threat_names(canvas, &delivery.scenario.threats, map, &mut labels);
    waypoint_numbers(canvas, delivery, map, &mut labels);
    relief.label(canvas, &mut labels);
}

fn spots(points: &[Point3], map: &MapScale) -> Vec<Spot> {
    points.iter().map(|point| map.spot(point.xy())).collect()
}

/// The area's edge, and a veil over what is outside of it.
fn outside(canvas: &mut Canvas, delivery: &Delivery, map: &MapScale) {
    let frame = &map.frame;
    let sheet = [
        (frame.left, frame.top),
        (frame.right(), frame.top),
        (frame.right(), frame.bottom()),
        (frame.left, frame.bottom()),
    ];
    let inner = ring(&area_corners(delivery, map));
    canvas.path(
        &format!("{}{inner}", ring(&sheet)),
        "fill=\"#fff\" fill-opacity=\"0.6\" fill-rule=\"evenodd\"",
    );
    canvas.path(&inner, AREA_EDGE);
}

fn area_corners(delivery: &Delivery, map: &MapScale) -> [Spot; 4] {
    let area = &delivery.scenario.area;
    let (west, north) = map.spot(Point2::new(area.min.x, area.max.y));
    let (east, south) = map.spot(Point2::new(area.max.x, area.min.y));
    [(west, north), (east, north), (east, south), (west, south)]
}

/// Style of the area's edge.
pub(super) const AREA_EDGE: &str =
    "fill=\"none\" stroke=\"#5b6671\" stroke-width=\"1\" stroke-dasharray=\"7 3 1.5 3\"";

/// All soft zones are drawn below all solid parts.
fn threats(canvas: &mut Canvas, threats: &[Threat], map: &MapScale) {
    let seen: Vec<&Threat> = threats
        .iter()
        .filter(|threat| map.view.meets(&threat.extent()))
        .collect();
    canvas.group("g", SOFT, |canvas| {
        for threat in &seen {
            soft_zone(canvas, threat, map);
        }
    });
    for (limited, style) in [(false, SOLID), (true, LIMITED)] {
        let chosen = seen.iter().filter(|threat| is_limited(threat) == limited);
        canvas.group("g", style, |canvas| {
            for threat in chosen {
                core(canvas, threat, map);
            }
        });
    }
}

/// Styles of the parts of threats.
pub(super) const SOFT: &str =
    "fill=\"#6a2c70\" stroke=\"#6a2c70\" stroke-linejoin=\"round\" opacity=\"0.18\"";
pub(super) const SOLID: &str =
    "fill=\"#6a2c70\" fill-opacity=\"0.62\" stroke=\"#6a2c70\" stroke-width=\"1.2\"";
pub(super) const LIMITED: &str = "fill=\"#6a2c70\" fill-opacity=\"0.36\" stroke=\"#6a2c70\" \
                                  stroke-width=\"1.4\" stroke-dasharray=\"5 3\"";

pub(super) fn is_limited(threat: &Threat) -> bool {
    threat.base.is_some() || threat.top.is_some()
}

fn soft_zone(canvas: &mut Canvas, threat: &Threat, map: &MapScale) {
    let scale = map.pixels_per_metre();
    match &threat.shape {
        Shape::Cylinder(disc) => {
            if disc.influence > disc.radius {
                let radius = disc.influence * scale;
                canvas.circle(map.spot(disc.center), radius, "stroke=\"none\"");
            }
        }
        Shape::Polygon(polygon) => {
            if polygon.margin() > 0.0 {
                // A stroke of twice the margin with round joins extends exactly by the margin.
                let width = super::canvas::num(2.0 * polygon.margin() * scale);
                let data = outline(polygon.vertices(), map);
                canvas.path(&data, &format!("stroke-width=\"{width}\""));
            }
        }
    }
}

fn core(canvas: &mut Canvas, threat: &Threat, map: &MapScale) {
    let draw = |canvas: &mut Canvas| match &threat.shape {
        Shape::Cylinder(disc) => {
            canvas.circle(
                map.spot(disc.center),
                disc.radius * map.pixels_per_metre(),
                "",
            );
        }
        Shape::Polygon(polygon) => canvas.path(&outline(polygon.vertices(), map), ""),
    };
    match &threat.name {
        None => draw(canvas),
        Some(name) => canvas.group("g", "", |canvas| {
            canvas.title(name);
            draw(canvas);
        }),
    }
}

fn outline(vertices: &[Point2], map: &MapScale) -> String {
    let spots: Vec<Spot> = vertices.iter().map(|vertex| map.spot(*vertex)).collect();
    ring(&spots)
}

fn route(canvas: &mut Canvas, delivery: &Delivery, map: &MapScale) {
    let waypoints = spots(&delivery.waypoints, map);
    if let Some(path) = &delivery.path {
        let data = polyline(&thinned(&spots(path, map)));
        canvas.path(&data, &format!("{CASING} stroke-width=\"6\""));
        canvas.path(
            &data,
            &format!(
                "{LINE} stroke=\"{}\" stroke-width=\"3\"",
                route_color(delivery)
            ),
        );
        let straight = polyline(&waypoints);
        canvas.path(&straight, STRAIGHT);
    } else {
        let straight = polyline(&waypoints);
        let color = route_color(delivery);
        canvas.path(&straight, &format!("{CASING} stroke-width=\"5\""));
        canvas.path(
            &straight,
            &format!("{LINE} stroke=\"{color}\" stroke-width=\"2\""),
        );
        for leg in broken(delivery, Place::leg) {
            if let Some(ends) = waypoints.get(leg..leg + 2) {
                canvas.path(&polyline(ends), BROKEN_LEG);
            }
        }
    }
    let broken = broken(delivery, Place::waypoint);
    for (idx, spot) in waypoints.iter().enumerate() {
        if broken.contains(&idx) {
            canvas.circle(
                *spot,
                8.0,
                &format!("fill=\"none\" stroke=\"{BROKEN}\" stroke-width=\"3\""),
            );
        }
        if idx > 0 && idx + 1 < waypoints.len() {
            waypoint(canvas, *spot);
        }
    }
    start(canvas, waypoints[0]);
    target(canvas, waypoints[waypoints.len() - 1]);
}

/// Style of the straight legs of a feasible plan.
pub(super) const STRAIGHT: &str =
    "fill=\"none\" stroke=\"#1c2630\" stroke-width=\"1\" stroke-dasharray=\"4 3\"";
/// Style of a leg that violates a constraint.
pub(super) const BROKEN_LEG: &str = "fill=\"none\" stroke=\"#d0021b\" stroke-width=\"6\" \
                                     stroke-opacity=\"0.55\" stroke-linecap=\"round\"";

pub(super) fn waypoint(canvas: &mut Canvas, at: Spot) {
    canvas.circle(
        at,
        3.2,
        &format!("fill=\"#fff\" stroke=\"{INK}\" stroke-width=\"1.2\""),
    );
}

pub(super) fn start(canvas: &mut Canvas, at: Spot) {
    canvas.circle(
        at,
        6.0,
        &format!("fill=\"{INK}\" stroke=\"#fff\" stroke-width=\"1.5\""),
    );
}

pub(super) fn target(canvas: &mut Canvas, at: Spot) {
    canvas.circle(
        at,
        7.0,
        &format!("fill=\"#fff\" stroke=\"{INK}\" stroke-width=\"2\""),
    );
    canvas.circle(at, 3.0, &format!("fill=\"{INK}\""));
}

/// A line without the points that are within two thirds of a pixel of their predecessor.
pub(super) fn thinned(line: &[Spot]) -> Vec<Spot> {
    let mut kept: Vec<Spot> = Vec::new();
    for (idx, spot) in line.iter().enumerate() {
        let near = kept.last().is_some_and(|last| {
            let (dx, dy) = (spot.0 - last.0, spot.1 - last.1);
            dx * dx + dy * dy < 0.45
        });
        if near && idx + 1 < line.len() {
            continue;
        }
        kept.push(*spot);
    }
    kept
}

fn end_names(canvas: &mut Canvas, delivery: &Delivery, map: &MapScale, labels: &mut Labels) {
    let font = Font::new(12.0, INK).bold().halo();
    let ends = [
        (delivery.scenario.start, "start"),
        (delivery.scenario.target, "target"),
    ];
    for (point, _) in ends {
        labels.reserve(Area::about(map.spot(point.xy()), (16.0, 16.0)));
    }
    for (point, words) in ends {
        let around = around(map.spot(point.xy()), font.measure(words), 13.0);
        put(canvas, labels, &font, words, around);
    }
}

fn waypoint_numbers(canvas: &mut Canvas, delivery: &Delivery, map: &MapScale, labels: &mut Labels) {
    let calm = Font::new(10.0, INK).halo();
    let alarmed = Font::new(11.0, BROKEN).bold().halo();
    let [legs, places] = [Place::leg, Place::waypoint].map(|index| broken(delivery, index));
    let waypoints = &delivery.waypoints;
    let inner = waypoints.len() - 1;
    for (idx, point) in waypoints.iter().enumerate().take(inner).skip(1) {
        // A leg's violations are those of the waypoint that it leads to, as in `geojson`.
        let font = if places.contains(&idx) || legs.contains(&(idx - 1)) {
            &alarmed
        } else {
            &calm
        };
        let words = idx.to_string();
        let around = around(map.spot(point.xy()), font.measure(&words), 5.0);
        put(canvas, labels, font, &words, around);
    }
}

fn threat_names(canvas: &mut Canvas, threats: &[Threat], map: &MapScale, labels: &mut Labels) {
    let light = Font::new(11.0, "#fff").anchor("middle");
    let dark = Font::new(11.0, THREAT).anchor("middle").halo();
    let small = Font::new(10.0, THREAT).anchor("middle").halo();
    for threat in threats {
        let name = threat.name.as_deref().unwrap_or_default();
        let name = dark.fit(name, 150.0);
        let heights = heights(threat);
        let (name_size, heights_size) = (dark.measure(&name), small.measure(&heights));
        let lines = [(&name, name_size), (&heights, heights_size)];
        let filled = lines.iter().filter(|(words, _)| !words.trim().is_empty());
        let size = filled.fold((0.0, 0.0), |size: (f64, f64), (_, line)| {
            (size.0.max(line.0), size.1 + line.1)
        });
        if size.1 == 0.0 {
            continue;
        }
        let (middle, reach) = core_box(threat, map);
        let within = Area::about(middle, size);
        let fits = reach.0 * reach.0 + reach.1 * reach.1 >= size.0 * size.0 + size.1 * size.1
            && reach.0 >= size.0
            && is_disc(threat);
        let inside = fits && !is_limited(threat) && labels.is_free(&within);
        let beside = [
            (0.0, reach.1 / 2.0 + 3.0 + size.1 / 2.0),
            (0.0, -reach.1 / 2.0 - 3.0 - size.1 / 2.0),
            (reach.0 / 2.0 + 4.0 + size.0 / 2.0, 0.0),
            (-reach.0 / 2.0 - 4.0 - size.0 / 2.0, 0.0),
        ];
        let beside = beside.map(|(dx, dy)| Area::about((middle.0 + dx, middle.1 + dy), size));
        let candidates = if inside {
            vec![within]
        } else {
            // The core of a threat limited in height has enough contrast for dark text.
            let own = (fits || reach.0 >= size.0).then_some(within);
            own.into_iter().chain(beside).collect()
        };
        if let Some(place) = labels.place(candidates) {
            let x = place.left + place.width / 2.0;
            let mut y = place.top;
            for (words, (_, height)) in lines {
                if words.trim().is_empty() {
                    continue;
                }
                let font = match (inside, words == &name) {
                    (true, _) => &light,
                    (false, true) => &dark,
                    (false, false) => &small,
                };
                canvas.text((x, y + 0.8 * height), font, words);
                y += height;
            }
        }
    }
}

fn is_disc(threat: &Threat) -> bool {
    matches!(threat.shape, Shape::Cylinder(_))
}

/// Centre and size of the box around the solid part.
fn core_box(threat: &Threat, map: &MapScale) -> (Spot, (f64, f64)) {
    let extent = match &threat.shape {
        Shape::Cylinder(disc) => threat.extent().grown(disc.radius - disc.influence),
        Shape::Polygon(polygon) => threat.extent().grown(-polygon.margin()),
    };
    let ((left, bottom), (right, top)) = (map.spot(extent.min), map.spot(extent.max));
    let middle = (f64::midpoint(left, right), f64::midpoint(top, bottom));
    (middle, (right - left, bottom - top))
}

/// Such as `below 1150 m`.
fn heights(threat: &Threat) -> String {
    match (threat.base, threat.top) {
        (None, None) => String::new(),
        (None, Some(top)) => format!("below {top:.0} m"),
        (Some(base), None) => format!("above {base:.0} m"),
        (Some(base), Some(top)) => format!("{base:.0} to {top:.0} m"),
    }
}

/// Positions for text of `size` around `at`, at distance `gap`.
fn around(at: Spot, size: (f64, f64), gap: f64) -> [Area; 8] {
    let (dx, dy) = (gap + size.0 / 2.0, gap + size.1 / 2.0);
    let near = 0.75;
    [
        (dx, 0.0),
        (0.0, -dy),
        (0.0, dy),
        (-dx, 0.0),
        (near * dx + 2.0, -near * dy - 2.0),
        (near * dx + 2.0, near * dy + 2.0),
        (-near * dx - 2.0, -near * dy - 2.0),
        (-near * dx - 2.0, near * dy + 2.0),
    ]
    .map(|(dx, dy)| Area::about((at.0 + dx, at.1 + dy), size))
}

fn put(canvas: &mut Canvas, labels: &mut Labels, font: &Font, words: &str, places: [Area; 8]) {
    if let Some(place) = labels.place(places) {
        let x = place.left + place.width / 2.0;
        let baseline = place.top + place.height / 2.0 + 0.36 * font.size;
        canvas.text((x, baseline), &font.anchor("middle"), words);
    }
}

/// A faint line across a frame.
pub(super) fn grid_line(canvas: &mut Canvas, from: Spot, to: Spot) {
    canvas.line_between(from, to, &format!("stroke=\"{RULE}\""));
}
