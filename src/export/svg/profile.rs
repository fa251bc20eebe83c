//! Heights along the route: ground, altitude band, threats on the way, and the flown path.

use super::canvas::{Area, Canvas, Font, Spot, num, polyline, ring};
use super::palette::{INK, MUTED, SOIL};
use super::plan_view::{BROKEN_LEG, LINE, grid_line, start, target, thinned, waypoint};
use super::scale::Steps;
use super::{broken, route_color};
use crate::export::Delivery;
use crate::geometry::{Point2, Point3};
use crate::planner::Place;
use crate::threat::Threat;

/// Number of places along the route at which ground and threats are sampled.
const STATIONS: usize = 400;

/// A place along the route.
struct Station {
    /// Horizontal distance along the route from the start, metres.
    way: f64,
    at: Point2,
    /// Elevation of the ground, metres in the frame.
    ground: f64,
}

/// Maps distance and height to the sheet.
struct Scale {
    frame: Area,
    way: f64,
    /// Lowest and highest height shown, metres.
    heights: (f64, f64),
}

impl Scale {
    fn spot(&self, way: f64, height: f64) -> Spot {
        let share = (height - self.heights.0) / (self.heights.1 - self.heights.0);
        (
            self.frame.left + way / self.way * self.frame.width,
            self.frame.bottom() - share * self.frame.height,
        )
    }

    /// Vertical exaggeration.
    fn exaggeration(&self) -> f64 {
        let across = self.frame.width / self.way;
        self.frame.height / (self.heights.1 - self.heights.0) / across
    }
}

pub(super) fn draw(canvas: &mut Canvas, delivery: &Delivery, frame: Area) {
    let course = delivery.course();
    let ways = ways(course);
    let stations = stations(delivery, course, &ways);
    let scale = Scale {
        frame,
        way: ways.last().copied().unwrap_or_default().max(1e-3),
        heights: heights(delivery, &stations),
    };
    canvas.rect(&frame, "fill=\"#fafbfc\"");
    axes(canvas, &scale, delivery);
    canvas.group("clipPath", "id=\"profile\"", |canvas| {
        canvas.rect(&frame, "");
    });
    canvas.group("g", "clip-path=\"url(#profile)\"", |canvas| {
        band(canvas, delivery, &stations, &scale);
        canvas.group("g", CROSSED, |canvas| {
            for threat in &delivery.scenario.threats {
                crossings(canvas, threat, &stations, &scale);
            }
        });
        ground(canvas, &stations, &scale);
    });
    let spots: Vec<Spot> = course
        .iter()
        .zip(&ways)
        .map(|(point, way)| scale.spot(*way, point.z))
        .collect();
    flown(canvas, delivery, &spots, &stations, &scale);
    canvas.rect(&frame, &format!("fill=\"none\" stroke=\"{INK}\""));
}

/// Horizontal distance along the route from the start to each point, metres.
fn ways(course: &[Point3]) -> Vec<f64> {
    let mut way = 0.0;
    let mut ways = vec![0.0];
    for ends in course.windows(2) {
        way += (ends[1].xy() - ends[0].xy()).norm();
        ways.push(way);
    }
    ways
}

fn stations(delivery: &Delivery, course: &[Point3], ways: &[f64]) -> Vec<Station> {
    let all = ways.last().copied().unwrap_or_default();
    let mut leg = 0;
    let station = |idx: usize| {
        let way = all * idx as f64 / (STATIONS - 1) as f64;
        while leg + 2 < course.len() && ways[leg + 1] < way {
            leg += 1;
        }
        let length = ways[leg + 1] - ways[leg];
        let t = if length > 0.0 {
            ((way - ways[leg]) / length).min(1.0)
        } else {
            0.0
        };
        let at = course[leg].xy() + (course[leg + 1].xy() - course[leg].xy()) * t;
        Station {
            way,
            at,
            ground: delivery.scenario.terrain.elevation(at),
        }
    };
    (0..STATIONS).map(station).collect()
}

/// Range of heights for ground and route, and for the altitude band unless it would flatten both.
fn heights(delivery: &Delivery, stations: &[Station]) -> (f64, f64) {
    let band = delivery.scenario.altitude;
    let ground = stations.iter().map(|station| station.ground);
    let route = delivery
        .course()
        .iter()
        .chain(&delivery.waypoints)
        .map(|point| point.z);
    let (min, max) = ground
        .chain(route)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), height| {
            (min.min(height), max.max(height))
        });
    let span = (max - min).max(1.0);
    let ceiling = stations
        .iter()
        .map(|station| station.ground + band.max)
        .fold(max, f64::max);
    let top = ceiling.min(max + span);
    let span = top - min;
    (min - 0.10 * span, top + 0.06 * span)
}

fn axes(canvas: &mut Canvas, scale: &Scale, delivery: &Delivery) {
    let frame = &scale.frame;
    let font = Font::new(11.0, MUTED);
    let steps = Steps::of(scale.heights.1 - scale.heights.0, 6.0);
    for height in steps.within(scale.heights.0, scale.heights.1) {
        let (_, y) = scale.spot(0.0, height);
        grid_line(canvas, (frame.left, y), (frame.right(), y));
        let place = (frame.left - 9.0, y + 4.0);
        canvas.text(place, &font.anchor("end"), &steps.label(height));
    }
    let steps = Steps::of(scale.way, 10.0);
    let line = format!("stroke=\"{INK}\"");
    for way in steps.within(0.0, scale.way) {
        let (x, _) = scale.spot(way, 0.0);
        canvas.line_between((x, frame.bottom()), (x, frame.bottom() + 5.0), &line);
        let place = (x, frame.bottom() + 18.0);
        canvas.text(place, &font.anchor("middle"), &steps.label(way));
    }
    let title = font.anchor("middle");
    let middle = frame.top + frame.height / 2.0;
    canvas.turned_text((16.0, middle), -90.0, &title, "height, m");
    let along = if delivery.path.is_some() {
        "path"
    } else {
        "waypoints"
    };
    let words = format!(
        "along the {along}, m (heights \u{d7} {})",
        num(scale.exaggeration())
    );
    let foot = (frame.left + frame.width / 2.0, frame.bottom() + 35.0);
    canvas.text(foot, &title, &words);
}

/// Style of a soft zone crossed by the route.
const CROSSED: &str = "fill=\"#6a2c70\" fill-opacity=\"0.18\"";
/// Style of the altitude band.
pub(super) const ALLOWED: &str = "fill=\"#8fb8d8\" fill-opacity=\"0.28\"";
/// Style of the band's edges.
pub(super) const ALLOWED_EDGE: &str = "fill=\"none\" stroke=\"#8fb8d8\" stroke-dasharray=\"5 3\"";

fn band(canvas: &mut Canvas, delivery: &Delivery, stations: &[Station], scale: &Scale) {
    let band = delivery.scenario.altitude;
    let [floor, ceiling] = [band.min, band.max].map(|above| over_ground(stations, above, scale));
    let allowed: Vec<Spot> = floor.iter().chain(ceiling.iter().rev()).copied().collect();
    canvas.path(&ring(&allowed), ALLOWED);
    for edge in [&floor, &ceiling] {
        canvas.path(&polyline(edge), ALLOWED_EDGE);
    }
}

fn ground(canvas: &mut Canvas, stations: &[Station], scale: &Scale) {
    let mut soil = over_ground(stations, 0.0, scale);
    soil.push((scale.frame.right(), scale.frame.bottom()));
    soil.push((scale.frame.left, scale.frame.bottom()));
    canvas.path(
        &ring(&soil),
        &format!("fill=\"#dccdb2\" stroke=\"{SOIL}\" stroke-width=\"1.2\""),
    );
}

/// The line `above` metres over the ground.
fn over_ground(stations: &[Station], above: f64, scale: &Scale) -> Vec<Spot> {
    let stations = stations.iter();
    stations
        .map(|station| scale.spot(station.way, station.ground + above))
        .collect()
}

/// Where the route passes through the soft zone, seen from above, drawn from the threat's base to its top.
fn crossings(canvas: &mut Canvas, threat: &Threat, stations: &[Station], scale: &Scale) {
    let unlimited = Threat {
        base: None,
        top: None,
        ..threat.clone()
    };
    let extent = unlimited.extent();
    let reached = |station: &Station| {
        extent.contains(station.at)
            && unlimited.intensity(Point3::new(station.at.x, station.at.y, 0.0)) > 0.0
    };
    let (low, high) = scale.heights;
    let bottom = threat.base.unwrap_or(low).max(low);
    let top = threat.top.unwrap_or(high).min(high);
    if bottom >= top {
        return;
    }
    for within in stations.chunk_by(|a, b| reached(a) == reached(b)) {
        let (first, last) = (&within[0], &within[within.len() - 1]);
        if reached(first) {
            let (left, upper) = scale.spot(first.way, top);
            let (right, lower) = scale.spot(last.way, bottom);
            let area = Area {
                left,
                top: upper,
                width: (right - left).max(1.0),
                height: lower - upper,
            };
            canvas.rect(&area, "");
        }
    }
}

fn flown(
    canvas: &mut Canvas,
    delivery: &Delivery,
    course: &[Spot],
    stations: &[Station],
    scale: &Scale,
) {
    let color = route_color(delivery);
    canvas.path(
        &polyline(&thinned(course)),
        &format!("{LINE} stroke=\"{color}\" stroke-width=\"2.5\""),
    );
    let marks: Vec<Spot> = if delivery.path.is_some() {
        let ways = abreast(&delivery.waypoints, stations);
        let points = delivery.waypoints.iter().zip(ways);
        points
            .map(|(point, way)| scale.spot(way, point.z))
            .collect()
    } else {
        for leg in broken(delivery, Place::leg) {
            if let Some(ends) = course.get(leg..leg + 2) {
                canvas.path(&polyline(ends), BROKEN_LEG);
            }
        }
        course.to_vec()
    };
    let last = marks.len() - 1;
    for (idx, mark) in marks.into_iter().enumerate() {
        match idx {
            0 => start(canvas, mark),
            _ if idx == last => target(canvas, mark),
            _ => waypoint(canvas, mark),
        }
    }
}

/// Distance along the path at which each waypoint is passed: the stations, in order, with the least sum of squared
/// distances to the waypoints, by dynamic programming.
fn abreast(waypoints: &[Point3], stations: &[Station]) -> Vec<f64> {
    let count = stations.len();
    let mut best = vec![0.0; count];
    let mut choices = Vec::with_capacity(waypoints.len());
    for waypoint in waypoints {
        // Least sum with this waypoint passed at or before each station, and that station.
        let mut chosen = vec![0; count];
        let mut least = (f64::INFINITY, 0);
        for (idx, station) in stations.iter().enumerate() {
            let sum = best[idx] + (station.at - waypoint.xy()).norm_squared();
            if sum < least.0 {
                least = (sum, idx);
            }
            (best[idx], chosen[idx]) = least;
        }
        choices.push(chosen);
    }
    let mut at = count - 1;
    let mut ways: Vec<f64> = choices
        .iter()
        .rev()
        .map(|chosen| {
            at = chosen[at];
            stations[at].way
        })
        .collect();
    ways.reverse();
    ways
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waypoints_keep_their_order_on_a_path_that_comes_back() {
        let stations: Vec<Station> = (0..=20)
            .map(|idx| {
                let way = f64::from(idx);
                let x = if way <= 10.0 { way } else { 20.0 - way };
                Station {
                    way,
                    at: Point2::new(x, 0.0),
                    ground: 0.0,
                }
            })
            .collect();
        let at = |x: f64| Point3::new(x, 1.0, 0.0);
        let ways = abreast(
            &[at(0.0), at(9.0), at(10.0), at(9.0), at(2.0), at(0.0)],
            &stations,
        );
        assert_eq!(ways, [0.0, 9.0, 10.0, 11.0, 18.0, 20.0]);
    }
}
