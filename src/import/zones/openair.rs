//! OpenAir: airspaces in lines of text, each from a line `AC` to the next.
//!
//! The library reads one airspace at a time, so that one that it cannot read takes nothing from the next.

use std::f64::consts::TAU;

use openair::{
    Airspace, AirspaceType, Altitude, Class, Coord, Direction, Geometry, PolygonSegment,
};

use super::super::draft::Draft;
use super::super::flight::Flight;
use super::super::place::Place;
use super::super::threat::Shape;
use super::super::{Conversion, ImportError, Most, text};
use super::arc::Arc;
use super::{Height, Outline, from_feet};
use crate::geometry::geodesy::wrapped;
use crate::geometry::{Point2, ring};

/// Metres of a nautical mile, exactly.
const MILE_M: f64 = 1852.0;

/// Whether a text may be OpenAir: its first line that is not empty is a comment or a record.
pub(in super::super) fn is_one(text: &[u8]) -> bool {
    let begin = text.trim_ascii_start();
    match begin {
        [b'*', ..] => true,
        [first, second, third, ..] => {
            first.is_ascii_uppercase() && second.is_ascii_uppercase() && third.is_ascii_whitespace()
        }
        _ => false,
    }
}

/// Convert a file to a scenario.
pub(in super::super) fn convert(
    bytes: &[u8],
    most: Most,
    flight: &Flight,
) -> Result<Conversion, ImportError> {
    let text = text::read(bytes);
    let airspaces = airspaces(&text);
    if airspaces.is_empty() {
        return Err(ImportError::no_scenario(
            "no airspace: text is read as OpenAir, where each begins with a line AC",
        ));
    }
    let mut draft = Draft::new("msl", most, flight);
    for (row, lines) in airspaces {
        let mut read = openair::parse(lines.as_bytes());
        let at = format!("line {row}");
        match read.next() {
            Some(Ok(airspace)) => add(&mut draft, &at, &airspace, lines),
            Some(Err(reason)) => draft.leave(at, unread(reason, row, lines)),
            None => draft.leave(at, "no airspace"),
        }
    }
    draft.finish()
}

/// Why an airspace with these `lines`, of which the first has the number `row`, is not read. Of a record that the library
/// does not know, its `reason` has the letters alone, without what stands between them; told is the line as written.
fn unread(reason: String, row: usize, lines: &str) -> String {
    let letters = reason.strip_prefix("Parse error (unexpected \"");
    let letters = letters.and_then(|letters| letters.strip_suffix("\")"));
    let begins_so = |line: &str| {
        let written = line.chars().filter(|letter| !letter.is_whitespace());
        letters.is_some_and(|letters| written.take(2).eq(letters.chars()))
    };
    let mut numbered = lines.lines().enumerate();
    match numbered.find(|(_, line)| begins_so(line)) {
        Some((index, line)) => {
            let line = super::super::facts::begin(line.trim());
            format!(
                "line {} is {line:?}, a record that is not read",
                row + index
            )
        }
        None => reason,
    }
}

/// The lines of each airspace, with the number of the first.
fn airspaces(text: &str) -> Vec<(usize, &str)> {
    let mut begins: Vec<(usize, usize)> = Vec::new();
    let mut pos = 0;
    for (index, line) in text.split_inclusive('\n').enumerate() {
        let record = line.trim_start().as_bytes();
        if let [b'A', b'C', rest, ..] = record
            && rest.is_ascii_whitespace()
        {
            begins.push((index + 1, pos));
        }
        pos += line.len();
    }
    let ends = begins.iter().skip(1).map(|(_, pos)| *pos);
    let ends = ends.chain([text.len()]);
    let of = |((row, begin), end): (&(usize, usize), usize)| (*row, &text[*begin..end]);
    begins.iter().zip(ends).map(of).collect()
}

/// Add an airspace, which was read from these `lines`.
fn add(draft: &mut Draft, at: &str, airspace: &Airspace, lines: &str) {
    let at = match &airspace.name {
        Some(name) => format!("{at}: {}", super::super::facts::begin(name)),
        None => at.to_owned(),
    };
    if let Some(open) = open(airspace) {
        return draft.leave(at, open);
    }
    let outlines = match outline(draft, &airspace.geom) {
        Ok(outline) => Ok(vec![outline]),
        Err(Unread::Elsewhere) => return,
        Err(Unread::Amiss(reason)) => Err(reason),
    };
    let heights = [
        height(&airspace.lower_bound, -lost(lines, "AL")),
        height(&airspace.upper_bound, lost(lines, "AH")),
    ];
    super::add(draft, &at, airspace.name.as_deref(), outlines, heights);
}

/// How many feet the library may have lost of a height that a `record` gives, at most: it rounds metres to whole feet.
fn lost(lines: &str, record: &str) -> f64 {
    let mut heights = lines
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix(record));
    let is_in_metres = |height: &str| {
        let unit = height.trim_start_matches(|sign: char| !sign.is_ascii_alphabetic());
        let rest = unit.strip_prefix(['m', 'M']);
        rest.is_some_and(|rest| !rest.starts_with(|sign: char| sign.is_ascii_alphabetic()))
    };
    if heights.any(is_in_metres) { 0.5 } else { 0.0 }
}

/// Why an airspace need not be kept clear of, if so. The type, where there is one, says more than the class.
fn open(airspace: &Airspace) -> Option<&'static str> {
    match &airspace.type_ {
        Some(
            AirspaceType::FlightInformationRegion
            | AirspaceType::UpperFlightInformationRegion
            | AirspaceType::FlightInformationServiceSector
            | AirspaceType::RemoteCommunicationSector
            | AirspaceType::TransponderRecommendedZone
            | AirspaceType::VisualFlightRulesRoute
            | AirspaceType::VisualFlightRulesSector,
        ) => Some("a region or a sector of information, which closes nothing"),
        None
        | Some(
            AirspaceType::NoType
            | AirspaceType::Airway
            | AirspaceType::ControlArea
            | AirspaceType::LowerTrafficArea
            | AirspaceType::TerminalManoeuvringArea
            | AirspaceType::UpperTrafficArea,
        ) => matches!(airspace.class, Class::E | Class::F | Class::G)
            .then_some("class E, F or G, which needs no clearance"),
        Some(_) => None,
    }
}

/// The height with so many feet `more` where it is one above mean sea level.
fn height(altitude: &Altitude, more: f64) -> Height {
    match altitude {
        Altitude::Gnd | Altitude::Unlimited | Altitude::FeetAgl(0) => Height::Open,
        Altitude::FeetAmsl(feet) => Height::AboveSea(from_feet(f64::from(*feet) + more)),
        Altitude::FlightLevel(level) => Height::Level(from_feet(f64::from(*level) * 100.0)),
        Altitude::FeetAgl(_) | Altitude::Other(_) => Height::Unknown,
    }
}

fn place(coord: &Coord) -> Result<Place, String> {
    Place::new(coord.lng, coord.lat)
}

/// From nautical miles, with the digits of the file.
fn metres(miles: f32) -> f64 {
    let written: f64 = miles
        .to_string()
        .parse()
        .unwrap_or_else(|_| f64::from(miles));
    written * MILE_M
}

/// Why an outline is not read: it lies elsewhere, or there is no room for it, which the draft has noted; or it cannot be.
enum Unread {
    Elsewhere,
    Amiss(String),
}

impl From<String> for Unread {
    fn from(reason: String) -> Self {
        Self::Amiss(reason)
    }
}

fn outline(draft: &mut Draft, geometry: &Geometry) -> Result<Outline, Unread> {
    match geometry {
        Geometry::Circle {
            centerpoint,
            radius,
        } => Ok(Outline::Circle(place(centerpoint)?, metres(*radius))),
        Geometry::Polygon { segments } => {
            let parts: Result<Vec<Part>, String> = segments.iter().map(Part::of).collect();
            let parts = parts?;
            let of_arcs = parts.iter().map(Part::worked_out);
            if !draft.has_room(of_arcs.sum(), &reach(&parts)) {
                return Err(Unread::Elsewhere);
            }
            Ok(Outline::Ring(ring_of(&parts)))
        }
    }
}

/// A part of an outline.
enum Part {
    Corner(Place),
    Arc(Arc),
}

impl Part {
    fn of(segment: &PolygonSegment) -> Result<Self, String> {
        let is_clockwise = |direction: Direction| direction == Direction::Cw;
        Ok(match segment {
            PolygonSegment::Point(coord) => Self::Corner(place(coord)?),
            PolygonSegment::Arc(arc) => Self::Arc(Arc::between(
                place(&arc.centerpoint)?,
                place(&arc.start)?,
                place(&arc.end)?,
                is_clockwise(arc.direction),
            )?),
            PolygonSegment::ArcSegment(arc) => {
                let radius = metres(arc.radius);
                let [from, to] = [arc.angle_start, arc.angle_end]
                    .map(|degrees| [f64::from(degrees) * TAU / 360.0, radius]);
                Self::Arc(Arc::new(
                    place(&arc.centerpoint)?,
                    from,
                    to,
                    is_clockwise(arc.direction),
                )?)
            }
        })
    }

    /// How many corners have to be worked out for it.
    fn worked_out(&self) -> usize {
        match self {
            Self::Corner(_) => 0,
            Self::Arc(arc) => arc.count(),
        }
    }

    fn corners(&self, outside: bool) -> Vec<Place> {
        match self {
            Self::Corner(corner) => vec![*corner],
            Self::Arc(arc) => arc.corners(outside),
        }
    }
}

/// What holds all parts: their corners and centres, and as much round these as the largest arc needs.
fn reach(parts: &[Part]) -> Shape {
    let place = |part: &Part| match part {
        Part::Corner(corner) => *corner,
        Part::Arc(arc) => arc.center(),
    };
    let reach_m = |part: &Part| match part {
        Part::Corner(_) => 0.0,
        Part::Arc(arc) => arc.reach_m(),
    };
    Shape::Polygon {
        vertices: parts.iter().map(place).collect(),
        margin: parts.iter().map(reach_m).fold(0.0, f64::max),
    }
}

/// The corners of all parts. An arc bulges out where it turns the same way as the whole ring does.
fn ring_of(parts: &[Part]) -> Vec<Place> {
    let on_arcs: Vec<Vec<Place>> = parts.iter().map(|part| part.corners(false)).collect();
    let is_clockwise = is_clockwise(&on_arcs.concat());
    let corners = parts.iter().zip(on_arcs).map(|(part, on_arc)| match part {
        Part::Arc(arc) if arc.is_clockwise() == is_clockwise => arc.corners(true),
        _ => on_arc,
    });
    corners.flatten().collect()
}

/// By its degrees, those of longitude as long as at its first corner.
fn is_clockwise(ring: &[Place]) -> bool {
    let Some(first) = ring.first() else {
        return false;
    };
    let shrink = libm::cos(first.lat.to_radians());
    let at = |place: &Place| {
        let east = wrapped(place.lon - first.lon);
        Point2::new(east * shrink, place.lat - first.lat)
    };
    ring::twice_area(&ring.iter().map(at).collect::<Vec<_>>()) < 0.0
}
