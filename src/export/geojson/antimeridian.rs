//! Cuts geometries that cross the 180th meridian, as RFC 7946 section 3.1.9 asks.
//!
//! Positions are degrees east, north and optionally a height. Consecutive positions are less than 180 degrees of
//! longitude apart, so a larger step crosses the meridian.

use geojson::{GeometryValue, Position};

type Place = Vec<f64>;

/// A line; in several pieces if it crosses.
pub(super) fn line(places: &[Place]) -> GeometryValue {
    let places = on_one_side(places);
    let mut pieces: Vec<Vec<Position>> = vec![Vec::new()];
    for (index, place) in places.iter().enumerate() {
        if let Some(before) = index.checked_sub(1).map(|before| &places[before])
            && crosses(before, place)
        {
            let side = 180.0_f64.copysign(before[0]);
            // The step without wrapping, and the fraction of it on the near side.
            let step = place[0] + 2.0 * side - before[0];
            let at = between(before, place, (side - before[0]) / step);
            push(&mut pieces, at.clone(), side);
            pieces.push(Vec::new());
            push(&mut pieces, at, -side);
        }
        push(&mut pieces, place.clone(), place[0]);
    }
    if pieces.len() == 1 {
        GeometryValue::new_line_string(pieces.remove(0))
    } else {
        pieces.retain(|piece| piece.len() > 1);
        GeometryValue::new_multi_line_string(pieces)
    }
}

/// The same line, with positions exactly on the meridian moved to the side of their predecessor: crossing to the
/// other side and back would be a step of length zero.
fn on_one_side(places: &[Place]) -> Vec<Place> {
    let mut places = places.to_vec();
    for index in 1..places.len() {
        let before = places[index - 1][0];
        if places[index][0].abs() >= 180.0 {
            places[index][0] = 180.0_f64.copysign(before);
        }
    }
    places
}

/// A ring, without repeated first corner; in two halves if it crosses.
pub(super) fn ring(corners: &[Place]) -> GeometryValue {
    let around = corners.iter().zip(corners.iter().cycle().skip(1));
    if !around.clone().any(|(here, next)| crosses(here, next)) {
        return GeometryValue::new_polygon([closed(corners.to_vec())]);
    }
    // Degrees east, continued beyond 180.
    let unrolled: Vec<Place> = corners
        .iter()
        .map(|corner| {
            let mut corner = corner.clone();
            corner[0] = corner[0].rem_euclid(360.0);
            corner
        })
        .collect();
    let west = half(&unrolled, |lon| 180.0 - lon);
    let mut east = half(&unrolled, |lon| lon - 180.0);
    for corner in &mut east {
        corner[0] -= 360.0;
    }
    let halves = [west, east].into_iter().filter(|half| half.len() > 2);
    GeometryValue::new_multi_polygon(halves.map(|half| [closed(half)]))
}

/// The part of a ring where `inside` of its degrees east is not negative: Sutherland-Hodgman clipping at one line.
fn half(corners: &[Place], inside: impl Fn(f64) -> f64) -> Vec<Place> {
    let mut kept = Vec::new();
    for (here, next) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (from, to) = (inside(here[0]), inside(next[0]));
        if from >= 0.0 {
            kept.push(here.clone());
        }
        if from * to < 0.0 {
            let share = from / (from - to);
            let mut at = between(here, next, share);
            at[0] = 180.0;
            kept.push(at);
        }
    }
    kept
}

fn crosses(one: &Place, other: &Place) -> bool {
    (one[0] - other[0]).abs() > 180.0
}

/// Interpolates all coordinates but the longitude, at a fraction of the step.
fn between(from: &Place, to: &Place, share: f64) -> Place {
    from.iter()
        .zip(to)
        .map(|(from, to)| from + (to - from) * share)
        .collect()
}

fn push(pieces: &mut [Vec<Position>], mut place: Place, lon: f64) {
    place[0] = lon;
    let piece = pieces.last_mut().expect("there is always a piece");
    piece.push(place.into());
}

fn closed(mut ring: Vec<Place>) -> Vec<Position> {
    ring.push(ring[0].clone());
    ring.into_iter().map(Into::into).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(geometry: &GeometryValue, expected: &str) {
        assert_eq!(geometry.to_string(), expected);
    }

    #[test]
    fn what_crosses_is_cut() {
        check(
            &line(&[vec![179.0, 1.0, 5.0], vec![-179.0, 3.0, 7.0]]),
            r#"{"type":"MultiLineString","coordinates":[[[179.0,1.0,5.0],[180.0,2.0,6.0]],[[-180.0,2.0,6.0],[-179.0,3.0,7.0]]]}"#,
        );
        check(
            &line(&[vec![-179.5, 1.0], vec![179.5, 1.0], vec![179.0, 1.0]]),
            r#"{"type":"MultiLineString","coordinates":[[[-179.5,1.0],[-180.0,1.0]],[[180.0,1.0],[179.5,1.0],[179.0,1.0]]]}"#,
        );
        check(
            &ring(&[
                vec![179.0, 0.0],
                vec![-179.0, 0.0],
                vec![-179.0, 1.0],
                vec![179.0, 1.0],
            ]),
            r#"{"type":"MultiPolygon","coordinates":[[[[179.0,0.0],[180.0,0.0],[180.0,1.0],[179.0,1.0],[179.0,0.0]]],[[[-180.0,0.0],[-179.0,0.0],[-179.0,1.0],[-180.0,1.0],[-180.0,0.0]]]]}"#,
        );
    }

    #[test]
    fn along_the_meridian_nothing_crosses() {
        check(
            &line(&[vec![180.0, 1.0], vec![-180.0, 2.0], vec![180.0, 3.0]]),
            r#"{"type":"LineString","coordinates":[[180.0,1.0],[180.0,2.0],[180.0,3.0]]}"#,
        );
        check(
            &line(&[
                vec![179.0, 1.0],
                vec![-180.0, 2.0],
                vec![180.0, 3.0],
                vec![179.0, 4.0],
            ]),
            r#"{"type":"LineString","coordinates":[[179.0,1.0],[180.0,2.0],[180.0,3.0],[179.0,4.0]]}"#,
        );
        check(
            &line(&[vec![179.0, 1.0], vec![-180.0, 2.0], vec![-179.0, 3.0]]),
            r#"{"type":"MultiLineString","coordinates":[[[179.0,1.0],[180.0,2.0],[180.0,2.0]],[[-180.0,2.0],[-179.0,3.0]]]}"#,
        );
    }

    #[test]
    fn what_does_not_is_whole() {
        check(
            &line(&[vec![10.0, 1.0, 5.0], vec![11.0, 3.0, 7.0]]),
            r#"{"type":"LineString","coordinates":[[10.0,1.0,5.0],[11.0,3.0,7.0]]}"#,
        );
        check(
            &ring(&[vec![0.0, 0.0], vec![1.0, 0.0], vec![0.0, 1.0]]),
            r#"{"type":"Polygon","coordinates":[[[0.0,0.0],[1.0,0.0],[0.0,1.0],[0.0,0.0]]]}"#,
        );
    }
}
