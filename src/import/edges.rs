//! Edges that are straight in degrees, as those of GeoJSON (RFC 7946, section 3.1.1) and of an autopilot's fences are.
//! A scenario's are straight on a plane: along a parallel of 50 km the two are 50 m apart at 47 degrees. So long edges
//! are divided, until they are no farther apart than matters.

use crate::geometry::geodesy::{LatLon, TangentPlane, wrapped};

/// How far apart they may be, metres.
const APART_M: f64 = 0.5;

/// Most times that an edge is halved.
const MOST_HALVINGS: u32 = 8;

/// Of the earth, metres, rounded up.
const RADIUS_M: f64 = 6.4e6;

/// Degrees east and north.
type Corner = [f64; 2];

/// `ring`, closed or not, with more corners on its long edges, as long as there is `room` for them. One that is no ring,
/// or reaches beyond the earth, is as it was.
pub(super) fn divided(ring: &[Corner], room: &mut usize) -> Vec<Corner> {
    let is_on_earth = |[lon, lat]: &Corner| lon.abs() <= 180.0 && lat.abs() <= 90.0;
    let least = if ring.first() == ring.last() { 4 } else { 3 };
    if ring.len() < least || !ring.iter().all(is_on_earth) {
        return ring.to_vec();
    }
    let mut corners = Vec::with_capacity(ring.len());
    let next = ring.iter().cycle().skip(1);
    for (from, to) in ring.iter().zip(next) {
        corners.push(*from);
        divide((*from, *to), MOST_HALVINGS, room, &mut corners);
    }
    corners
}

/// Add the corners between two others.
fn divide(
    (from, to): (Corner, Corner),
    halvings: u32,
    room: &mut usize,
    corners: &mut Vec<Corner>,
) {
    let east = wrapped(to[0] - from[0]);
    let middle = [wrapped(from[0] + east / 2.0), f64::midpoint(from[1], to[1])];
    if halvings == 0 || *room == 0 || is_straight(from, to, middle, east) {
        return;
    }
    *room -= 1;
    divide((from, middle), halvings - 1, room, corners);
    corners.push(middle);
    divide((middle, to), halvings - 1, room, corners);
}

/// Whether the edge between two corners passes near enough by the `middle` of their degrees; they are `east` degrees apart.
fn is_straight(from: Corner, to: Corner, middle: Corner, east: f64) -> bool {
    let (east, north) = (
        east.abs().to_radians(),
        (to[1] - from[1]).abs().to_radians(),
    );
    // No edge is farther off; most are so short that nothing else need be worked out.
    if RADIUS_M * (east * east / 16.0 + east * north / 4.0) < APART_M {
        return true;
    }
    let place = |[lon, lat]: Corner| LatLon { lat, lon };
    let plane = TangentPlane::at(place(middle), 0.0);
    let [from, to] = [from, to].map(|corner| plane.local(place(corner)));
    let way = to - from;
    way.perp(&from.coords).abs() <= APART_M * way.norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_edges_along_a_parallel_get_corners_and_others_do_not() {
        let count = |ring: &[Corner]| divided(ring, &mut 1000).len();
        // 30 m, and a degree along a meridian and along the equator.
        assert_eq!(count(&[[8.0, 47.0], [8.0004, 47.0], [8.0, 47.0003]]), 3);
        let equator = [[8.0, 0.0], [9.0, 0.0], [9.0, 0.01], [8.0, 0.01]];
        assert_eq!(count(&equator), 4);
        // 76 km at 47 degrees: parts of 4.7 km, which are half a metre off.
        let square = [
            [8.0, 47.0],
            [9.0, 47.0],
            [9.0, 48.0],
            [8.0, 48.0],
            [8.0, 47.0],
        ];
        let corners = divided(&square, &mut 1000);
        assert_eq!(corners.len(), 5 + 15 + 15);
        let along = corners.iter().filter(|corner| corner[1] <= 47.0);
        assert_eq!(along.count(), 2 + 15 + 1);
        // No ring, and beyond the earth.
        assert_eq!(count(&[[8.0, 47.0], [9.0, 47.0], [8.0, 47.0]]), 3);
        assert_eq!(count(&[[8.0, 97.0], [9.0, 47.0], [8.0, 47.5]]), 3);
    }

    #[test]
    fn what_is_left_of_each_edge_is_straight_enough() {
        let ring = [[179.5, -60.0], [-179.2, -60.4], [-179.9, -59.1]];
        let corners = divided(&ring, &mut 1000);
        let next = corners.iter().cycle().skip(1);
        for (from, to) in corners.iter().zip(next) {
            let plane = TangentPlane::at(
                LatLon {
                    lat: from[1],
                    lon: from[0],
                },
                0.0,
            );
            let way = plane
                .local(LatLon {
                    lat: to[1],
                    lon: to[0],
                })
                .coords;
            for share in [0.25, 0.5, 0.75] {
                let lon = wrapped(from[0] + wrapped(to[0] - from[0]) * share);
                let lat = from[1] + (to[1] - from[1]) * share;
                let at = plane.local(LatLon { lat, lon }).coords;
                assert!(way.perp(&at).abs() / way.norm() < 0.51, "{from:?} {to:?}");
            }
        }
    }

    #[test]
    fn a_ring_round_a_pole_does_not_grow_without_bound() {
        let ring: Vec<Corner> = (0..4)
            .map(|corner| [f64::from(corner) * 90.0 - 180.0, 89.9])
            .collect();
        assert!(divided(&ring, &mut 10_000).len() <= 4 << MOST_HALVINGS);
        let mut room = 100;
        assert_eq!((divided(&ring, &mut room).len(), room), (104, 0));
    }
}
