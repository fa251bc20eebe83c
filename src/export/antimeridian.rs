//! Cuts geometries that cross the 180th meridian, as RFC 7946 section 3.1.9 asks, and closes rings round a pole.
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

/// The same line, with positions exactly on the meridian moved to the side of their predecessor, or at the beginning
/// to the side of the first position beside it: crossing to the other side and back would be a step of length zero,
/// and a line that begins by crossing would have a piece without length.
fn on_one_side(places: &[Place]) -> Vec<Place> {
    let mut places = places.to_vec();
    let beside = places.iter().map(|place| place[0]);
    let beside = beside.into_iter().find(|lon| lon.abs() < 180.0);
    let mut before = beside.unwrap_or(places[0][0]);
    for place in &mut places {
        if place[0].abs() >= 180.0 {
            place[0] = 180.0_f64.copysign(before);
        }
        before = place[0];
    }
    places
}

/// A corner of a ring. Its degrees east continue beyond 180.
#[derive(Debug, Clone, PartialEq)]
struct Corner {
    place: Place,
    /// Turns round the earth, eastward, beyond the first corner.
    turns: f64,
}

impl Corner {
    /// Degrees east, continued.
    fn lon(&self) -> f64 {
        self.place[0] + 360.0 * self.turns
    }

    /// The corner where the edge to `next` meets a meridian, given in degrees east, continued; `None` if the edge
    /// stays on one side, or only ends on it.
    fn cut(&self, next: &Self, meridian: f64) -> Option<Self> {
        let (from, to) = (meridian - self.lon(), meridian - next.lon());
        if from * to >= 0.0 {
            return None;
        }
        let mut place = between(&self.place, &next.place, from / (from - to));
        place[0] = 180.0;
        let turns = (meridian - 180.0) / 360.0;
        Some(Self { place, turns })
    }
}

/// A counter-clockwise ring, without repeated first corner; in several parts if it crosses. A ring round a pole is
/// closed along the meridian and over the pole.
pub(super) fn ring(corners: &[Place]) -> GeometryValue {
    let mut parts = parts(corners);
    for part in &mut parts {
        part.extend(part.first().cloned());
    }
    if parts.len() == 1 {
        GeometryValue::new_polygon(parts)
    } else {
        GeometryValue::new_multi_polygon(parts.into_iter().map(|part| [part]))
    }
}

/// The parts of such a ring, each without repeated first corner.
pub(super) fn parts(corners: &[Place]) -> Vec<Vec<Position>> {
    let (mut corners, way) = unrolled(corners);
    if way.abs() > 0.0 {
        corners = over_a_pole(&corners, way);
    }
    let (west, east) = strips(&corners);
    for corner in &mut corners {
        corner.turns -= west;
    }
    if west >= east {
        return vec![positions(&corners, 0.0)];
    }
    let parts = (0..)
        .map(f64::from)
        .take_while(|strip| *strip <= east - west);
    let parts = parts.map(|strip| (strip, part(&corners, strip)));
    let parts = parts.filter(|(_, part)| part.len() > 2);
    parts.map(|(strip, part)| positions(&part, strip)).collect()
}

/// The corners with continued degrees, and the turns that the ring makes round the earth: 0, or 1 round the north pole
/// and -1 round the south pole.
fn unrolled(places: &[Place]) -> (Vec<Corner>, f64) {
    let mut turns = 0.0;
    let mut corners = Vec::with_capacity(places.len());
    for (here, next) in places.iter().zip(places.iter().cycle().skip(1)) {
        let place = here.clone();
        corners.push(Corner { place, turns });
        if crosses(here, next) {
            turns += 1.0_f64.copysign(here[0] - next[0]);
        }
    }
    (corners, turns)
}

/// A ring that makes `way` turns, 1 or -1, round the earth: from the 180th meridian once round to the same meridian,
/// and back over the pole. It begins where it meets this meridian nearest to the pole, so that nothing of the ring
/// lies between.
fn over_a_pole(corners: &[Corner], way: f64) -> Vec<Corner> {
    let n = corners.len();
    let later = |index: usize| Corner {
        turns: corners[index % n].turns + if index < n { 0.0 } else { way },
        ..corners[index % n].clone()
    };
    // Where the ring meets the meridian, and the indices of the corners from there round to the same place.
    let met = (0..n).filter_map(|index| {
        let (here, next) = (later(index), later(index + 1));
        let meridian = meridian_west_of(here.lon().max(next.lon()));
        if here.lon().total_cmp(&meridian).is_eq() {
            return Some((here, index + 1..index + n));
        }
        Some((here.cut(&next, meridian)?, index + 1..index + n + 1))
    });
    let nearest = met.max_by(|(one, _), (other, _)| {
        let [one, other] = [one, other].map(|corner| corner.place[1].abs());
        one.total_cmp(&other)
    });
    let (first, rest) = nearest.expect("a ring round a pole meets every meridian");
    let last = Corner {
        turns: first.turns + way,
        ..first.clone()
    };
    let pole = |corner: &Corner| {
        let mut pole = corner.clone();
        pole.place[1] = 90.0 * way;
        pole
    };
    let over = [pole(&last), pole(&first)];
    let mut round = vec![first];
    round.extend(rest.map(later));
    round.push(last);
    round.extend(over);
    round
}

/// The 180th meridian at `lon` or next to the west of it, in continued degrees.
fn meridian_west_of(lon: f64) -> f64 {
    360.0 * ((lon - 180.0) / 360.0).floor() + 180.0
}

/// The first and the last turn round the earth, counted at the 180th meridian, in which a ring has an area.
fn strips(corners: &[Corner]) -> (f64, f64) {
    let lons = corners.iter().map(Corner::lon);
    let (west, east) = lons.fold((f64::INFINITY, f64::NEG_INFINITY), |(west, east), lon| {
        (west.min(lon), east.max(lon))
    });
    (
        ((west + 180.0) / 360.0).floor(),
        ((east + 180.0) / 360.0).ceil() - 1.0,
    )
}

/// The part of a ring in one turn round the earth: Sutherland-Hodgman clipping at both ends of it.
fn part(corners: &[Corner], strip: f64) -> Vec<Corner> {
    let (west, east) = (360.0 * strip - 180.0, 360.0 * strip + 180.0);
    let part = clipped(corners, west, |lon| lon >= west);
    let part = clipped(&part, east, |lon| lon <= east);
    without_spurs(&part, &[west, east])
}

fn clipped(corners: &[Corner], meridian: f64, inside: impl Fn(f64) -> bool) -> Vec<Corner> {
    let mut kept = Vec::new();
    for (here, next) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        if inside(here.lon()) {
            kept.push(here.clone());
        }
        kept.extend(here.cut(next, meridian));
    }
    kept
}

/// The ring without corners in the middle of a way along one of `meridians`: where a ring only touches the meridian,
/// the part beyond would go there and back.
fn without_spurs(corners: &[Corner], meridians: &[f64]) -> Vec<Corner> {
    let n = corners.len();
    let is_along = |index: usize| {
        let around = [index + n - 1, index, index + 1].map(|index| corners[index % n].lon());
        meridians
            .iter()
            .any(|meridian| around.iter().all(|lon| lon.total_cmp(meridian).is_eq()))
    };
    let kept = (0..n).filter(|index| !is_along(*index));
    kept.map(|index| corners[index].clone()).collect()
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

/// The positions of a ring that lies in one turn round the earth.
fn positions(corners: &[Corner], strip: f64) -> Vec<Position> {
    let position = |corner: &Corner| {
        let mut place = corner.place.clone();
        place[0] += 360.0 * (corner.turns - strip);
        place.into()
    };
    corners.iter().map(position).collect()
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
    fn what_only_touches_the_meridian_is_whole() {
        check(
            &line(&[vec![180.0, 1.0], vec![180.0, 2.0], vec![-179.0, 3.0]]),
            r#"{"type":"LineString","coordinates":[[-180.0,1.0],[-180.0,2.0],[-179.0,3.0]]}"#,
        );
        check(
            &line(&[vec![-180.0, 1.0], vec![179.0, 2.0], vec![-179.0, 4.0]]),
            r#"{"type":"MultiLineString","coordinates":[[[180.0,1.0],[179.0,2.0],[180.0,3.0]],[[-180.0,3.0],[-179.0,4.0]]]}"#,
        );
        check(
            &ring(&[
                vec![179.0, 0.0],
                vec![180.0, 0.0],
                vec![180.0, 1.0],
                vec![-180.0, 2.0],
                vec![179.0, 2.0],
            ]),
            r#"{"type":"Polygon","coordinates":[[[179.0,0.0],[180.0,0.0],[180.0,1.0],[180.0,2.0],[179.0,2.0],[179.0,0.0]]]}"#,
        );
        check(
            &ring(&[vec![180.0, 0.0], vec![-179.0, 1.0], vec![-180.0, 2.0]]),
            r#"{"type":"Polygon","coordinates":[[[-180.0,0.0],[-179.0,1.0],[-180.0,2.0],[-180.0,0.0]]]}"#,
        );
    }

    /// Beyond the meridian, the corner that touches it has no area.
    #[test]
    fn halves_have_no_spurs() {
        check(
            &ring(&[
                vec![179.0, 0.0],
                vec![-179.0, 2.0],
                vec![179.0, 4.0],
                vec![180.0, 5.0],
                vec![179.0, 6.0],
            ]),
            r#"{"type":"MultiPolygon","coordinates":[[[[179.0,0.0],[180.0,1.0],[180.0,3.0],[179.0,4.0],[180.0,5.0],[179.0,6.0],[179.0,0.0]]],[[[-180.0,1.0],[-179.0,2.0],[-180.0,3.0],[-180.0,1.0]]]]}"#,
        );
    }

    #[test]
    fn a_ring_round_a_pole_is_closed_over_it() {
        check(
            &ring(&[vec![0.0, 89.0], vec![120.0, 88.0], vec![-120.0, 88.0]]),
            r#"{"type":"Polygon","coordinates":[[[-180.0,88.0],[-120.0,88.0],[0.0,89.0],[120.0,88.0],[180.0,88.0],[180.0,90.0],[-180.0,90.0],[-180.0,88.0]]]}"#,
        );
        check(
            &ring(&[vec![0.0, -89.0], vec![-120.0, -88.0], vec![120.0, -88.0]]),
            r#"{"type":"Polygon","coordinates":[[[180.0,-88.0],[120.0,-88.0],[0.0,-89.0],[-120.0,-88.0],[-180.0,-88.0],[-180.0,-90.0],[180.0,-90.0],[180.0,-88.0]]]}"#,
        );
        // A corner on the meridian, written either way.
        for side in [180.0, -180.0] {
            check(
                &ring(&[
                    vec![0.0, 89.0],
                    vec![90.0, 89.0],
                    vec![side, 88.0],
                    vec![-90.0, 89.0],
                ]),
                r#"{"type":"Polygon","coordinates":[[[-180.0,88.0],[-90.0,89.0],[0.0,89.0],[90.0,89.0],[180.0,88.0],[180.0,90.0],[-180.0,90.0],[-180.0,88.0]]]}"#,
            );
        }
    }

    /// The ring crosses the meridian three times: an arm of it reaches back across.
    #[test]
    fn an_arm_of_a_ring_round_a_pole_is_cut_off() {
        check(
            &ring(&[
                vec![0.0, 80.0],
                vec![120.0, 80.0],
                vec![-170.0, 70.0],
                vec![-170.0, 72.0],
                vec![170.0, 82.0],
                vec![-120.0, 87.0],
            ]),
            r#"{"type":"MultiPolygon","coordinates":[[[[-180.0,82.71428571428571],[-120.0,87.0],[0.0,80.0],[120.0,80.0],[180.0,71.42857142857143],[180.0,77.0],[170.0,82.0],[180.0,82.71428571428571],[180.0,90.0],[-180.0,90.0],[-180.0,82.71428571428571]]],[[[-180.0,71.42857142857143],[-170.0,70.0],[-170.0,72.0],[-180.0,77.0],[-180.0,71.42857142857143]]]]}"#,
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
