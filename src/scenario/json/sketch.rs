//! A first pass over a document in degrees that finds roughly where everything lies. The plane and the default area
//! follow from it, before any place can be mapped to the plane.
//!
//! Whatever cannot be read is skipped here; later readers report it.

use crate::geometry::geodesy::{LatLon, LatLonBox, wrapped};

use super::fields::Fields;
use super::ranges::{ALTITUDE, CLIMB, COORDINATE, LATITUDE, LONGITUDE};
use super::tree::{Node, float};
use super::vehicle::{climb_through, climbing_room};

/// Greatest latitude accepted, north or south, degrees.
pub(super) const MAX_LATITUDE: f64 = 89.0;
/// Greatest width and height of an area, metres.
pub(super) const MAX_WIDTH_M: f64 = 200e3;

/// A default area takes at most this fraction of [`MAX_WIDTH_M`].
const FITTING: f64 = 0.99;
/// Least padding of the default area on each side, metres.
pub(super) const MIN_PADDING_M: f64 = 10.0;
/// Metres per degree of latitude, approximately.
const DEGREE_M: f64 = 111_320.0;
/// Corners of a default area are rounded to 1 / this degrees, for readability.
pub(super) const GRAIN: f64 = 1e6;

/// Approximate location of everything in a document.
#[derive(Debug, Clone)]
pub(super) struct Sketch {
    /// The start and the target, if they can be read.
    pub(super) ends: Vec<LatLon>,
    /// Mean altitude of start and target, metres above the datum; 0 if neither can be read.
    pub(super) mean_alt: f64,
    /// Room beyond start and target to climb to the middle of the band, metres.
    climb_m: f64,
    /// Origin of longitudes, so that the antimeridian needs no special case.
    reference: f64,
    south: f64,
    north: f64,
    /// Degrees east of `reference`.
    west: f64,
    east: f64,
}

impl Sketch {
    pub(super) fn of(fields: &Fields<'_>) -> Self {
        let ends = ["start", "target"].map(|name| fields.find(name));
        let alts: Vec<f64> = ends
            .iter()
            .filter_map(|end| number(end.as_ref()?.get("alt")?))
            .filter(|alt| COORDINATE.contains(*alt))
            .collect();
        let ends: Vec<LatLon> = ends.into_iter().filter_map(|end| place(end?)).collect();
        let reference = spots(fields).next().map_or(0.0, |spot| spot.place.lon);
        let mut sketch = Self {
            climb_m: climb(fields, &ends, &alts),
            ends,
            mean_alt: alts.iter().sum::<f64>() / alts.len().max(1) as f64,
            reference,
            south: f64::INFINITY,
            north: f64::NEG_INFINITY,
            west: f64::INFINITY,
            east: f64::NEG_INFINITY,
        };
        for spot in spots(fields) {
            sketch.add(spot.place, spot.reach_m);
        }
        if sketch.south > sketch.north {
            sketch.add(LatLon { lat: 0.0, lon: 0.0 }, 0.0);
        }
        sketch
    }

    fn add(&mut self, place: LatLon, reach_m: f64) {
        let lat_reach = reach_m / DEGREE_M;
        let lon_reach = lat_reach / shrink(place.lat);
        let lon = wrapped(place.lon - self.reference);
        self.south = self.south.min(place.lat - lat_reach);
        self.north = self.north.max(place.lat + lat_reach);
        self.west = self.west.min(lon - lon_reach);
        self.east = self.east.max(lon + lon_reach);
    }

    /// The area of a document that gives none: the box around the start, the target and every threat with its soft
    /// zone, padded on every side by a quarter of its diagonal or the room to climb, whichever is greater. Where it
    /// would be longer than an area may be one way, it is padded less that way, but by at least 10 m.
    pub(super) fn area(&self) -> LatLonBox {
        let shrink = shrink(f64::midpoint(self.south, self.north));
        let height = (self.north - self.south) * DEGREE_M;
        let width = (self.east - self.west) * DEGREE_M * shrink;
        let diagonal = (width * width + height * height).sqrt();
        let wanted = (diagonal / 4.0).max(self.climb_m);
        let padding = |length: f64| {
            let room = (FITTING * MAX_WIDTH_M - length) / 2.0;
            wanted.min(room).max(MIN_PADDING_M) / DEGREE_M
        };
        let (lat, lon) = (padding(height), padding(width) / shrink);
        LatLonBox {
            min: LatLon {
                lat: down(self.south - lat).max(-90.0),
                lon: wrapped(down(self.reference + self.west - lon)),
            },
            max: LatLon {
                lat: up(self.north + lat).min(90.0),
                lon: wrapped(up(self.reference + self.east + lon)),
            },
        }
    }
}

/// The next multiple of the grain, from `degrees` upwards.
pub(super) fn up(degrees: f64) -> f64 {
    (degrees * GRAIN).ceil() / GRAIN
}

/// The next multiple of the grain, from `degrees` downwards.
pub(super) fn down(degrees: f64) -> f64 {
    (degrees * GRAIN).floor() / GRAIN
}

/// A place that a default area must contain, with its reach around it.
struct Spot {
    part: Part,
    place: LatLon,
    reach_m: f64,
}

/// A field of the document, and the index of the item in it.
pub(super) type Part = (&'static str, Option<usize>);

/// The start, the target, and every center and vertex of a threat.
fn spots<'a>(fields: &'a Fields<'_>) -> impl Iterator<Item = Spot> + 'a {
    let ends = ["start", "target"].into_iter();
    let ends = ends.filter_map(|name| {
        Some(Spot {
            part: (name, None),
            place: place(fields.find(name)?)?,
            reach_m: 0.0,
        })
    });
    let threats = items(fields.find("threats")).iter().enumerate();
    ends.chain(threats.flat_map(|(threat_idx, threat)| {
        let reach_m = ["influence", "radius", "margin"]
            .iter()
            .find_map(|name| number(threat.get(name)?))
            .filter(|reach| (0.0..=MAX_WIDTH_M).contains(reach))
            .unwrap_or(0.0);
        let centers = threat.get("center").into_iter();
        let vertices = items(threat.get("vertices")).iter();
        let places = centers.chain(vertices).filter_map(place);
        places.map(move |place| Spot {
            part: ("threats", Some(threat_idx)),
            place,
            reach_m,
        })
    }))
}

/// The part that reaches farthest from the start.
pub(super) fn farthest(fields: &Fields<'_>) -> Option<Part> {
    let start = spots(fields).next()?.place;
    outermost(fields, |spot| start.distance_m(spot.place) + spot.reach_m)
}

/// The part that reaches nearest to a pole.
pub(super) fn nearest_to_a_pole(fields: &Fields<'_>) -> Option<Part> {
    outermost(fields, |spot| {
        spot.place.lat.abs() + spot.reach_m / DEGREE_M
    })
}

fn outermost(fields: &Fields<'_>, how_far: impl Fn(&Spot) -> f64) -> Option<Part> {
    spots(fields)
        .max_by(|a, b| how_far(a).total_cmp(&how_far(b)))
        .map(|spot| spot.part)
}

/// [`climbing_room`] between `ends` at `alts`; 0 if one of them cannot be read.
fn climb(fields: &Fields<'_>, ends: &[LatLon], alts: &[f64]) -> f64 {
    let (&[start, target], &[from, to]) = (ends, alts) else {
        return 0.0;
    };
    let north = target.lat - start.lat;
    let east = wrapped(target.lon - start.lon) * shrink(start.lat);
    let max_climb_deg = fields
        .find("vehicle")
        .and_then(|vehicle| number(vehicle.get("max_climb_deg")?))
        .filter(|climb| CLIMB.contains(*climb));
    let climb_m = match level_middle(fields) {
        Some(middle) => climb_through([from, to], [middle, middle]),
        None => (to - from).abs(),
    };
    climbing_room(climb_m, libm::hypot(north, east) * DEGREE_M, max_climb_deg)
}

/// The middle of the altitude band in the frame, if the ground is level.
fn level_middle(fields: &Fields<'_>) -> Option<f64> {
    let band = fields.find("altitude")?;
    let end = |name: &str| number(band.get(name)?).filter(|end| ALTITUDE.contains(*end));
    let ground = match fields.find("terrain") {
        None => 0.0,
        Some(terrain) => match terrain.get("kind")? {
            Node::Text(kind) if **kind == *"flat" => {
                let elevation = terrain.get("elevation").map_or(Some(0.0), number);
                elevation.filter(|elevation| COORDINATE.contains(*elevation))?
            }
            _ => return None,
        },
    };
    Some(ground + f64::midpoint(end("min")?, end("max")?))
}

/// Ratio of a degree of longitude to a degree of latitude, approximately; never 0.
fn shrink(lat: f64) -> f64 {
    libm::cos(lat.to_radians()).max(0.01)
}

fn items<'a>(node: Option<&'a Node<'a>>) -> &'a [Node<'a>] {
    match node {
        Some(Node::Array(items)) => items,
        _ => &[],
    }
}

/// `{"lat", "lon"}` within their ranges.
pub(super) fn place(node: &Node) -> Option<LatLon> {
    let lat = number(node.get("lat")?)?;
    let lon = number(node.get("lon")?)?;
    (LATITUDE.contains(lat) && LONGITUDE.contains(lon)).then_some(LatLon { lat, lon })
}

/// The number, of any size.
pub(super) fn number(node: &Node) -> Option<f64> {
    match node {
        Node::Number(number) => Some(float(number)),
        _ => None,
    }
}
