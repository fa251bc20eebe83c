//! KML: placemarks named start and target; polygons, and points with a radius, as threats. Heights are above mean sea
//! level.
//!
//! A document type is refused, because its entities can expand without bound, and so is what would take the parser
//! long; links are not followed.

use roxmltree::{Document, Node, ParsingOptions};
use serde_json::{Map, Value};

use super::draft::{Draft, HEIGHTS_OF_A_POLYGON};
use super::facts::Facts;
use super::flight::Flight;
use super::place::Place;
use super::{Conversion, ImportError, Most, antimeridian, xml};

/// Most XML nodes: elements, texts and comments. The limit on the file's size bounds them too.
const MOST_NODES: u32 = 2_000_000;

/// Deepest nesting of geometries.
const DEEPEST: usize = 16;

/// Elements beside placemarks that a scenario cannot represent.
const NOT_READ: [&str; 6] = [
    "GroundOverlay",
    "Model",
    "NetworkLink",
    "PhotoOverlay",
    "ScreenOverlay",
    "Tour",
];

/// Convert a KML document to a scenario.
pub(super) fn convert(text: &[u8], most: Most, flight: &Flight) -> Result<Conversion, ImportError> {
    let text = std::str::from_utf8(text)
        .map_err(|error| ImportError::NotXml(format!("the file is not UTF-8: {error}")))?;
    xml::check(text).map_err(ImportError::NotXml)?;
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: MOST_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| ImportError::NotXml(error.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "kml" {
        let found = root.tag_name().name();
        return Err(ImportError::no_scenario(format!(
            "the root element is {found}, must be kml"
        )));
    }
    let mut draft = Draft::new("msl", most, flight);
    let container = root.children().find(|node| is(node, "Document"));
    let name = container.and_then(|node| text_of(&node, "name"));
    draft.call(name.as_deref());
    let mut rows = Rows {
        text,
        pos: 0,
        row: 1,
    };
    for node in root.descendants() {
        if is(&node, "Placemark") {
            placemark(&mut draft, &node, rows.of(&node));
        } else if let Some(name) = NOT_READ.iter().find(|name| is(&node, name)) {
            let at = format!("line {}", rows.of(&node));
            draft.leave(at, format!("a {name}, which is not read"));
        }
    }
    draft.finish()
}

/// Line numbers of nodes in document order, each counted on from the one before.
struct Rows<'t> {
    text: &'t str,
    pos: usize,
    row: usize,
}

impl Rows<'_> {
    fn of(&mut self, node: &Node) -> usize {
        let begin = node.range().start;
        self.row += self.text[self.pos..begin].matches('\n').count();
        self.pos = begin;
        self.row
    }
}

fn placemark(draft: &mut Draft, node: &Node, row: usize) {
    let facts = facts(node);
    let at = format!("line {row}: {}", facts.name().unwrap_or("Placemark"));
    let mut shapes = node.children().filter(is_shape).peekable();
    if shapes.peek().is_none() {
        draft.leave(&at, "a placemark without geometry");
    }
    let mut placemark = Placemark {
        at,
        facts,
        rings: Vec::new(),
    };
    for shape in shapes {
        placemark.geometry(draft, &shape, 0);
    }
    let Placemark { at, facts, rings } = placemark;
    for (_, ring) in antimeridian::joined(&rings) {
        draft.polygon(&at, &facts, &ring);
    }
}

/// A placemark while its geometries are read.
struct Placemark {
    at: String,
    facts: Facts,
    /// Outer rings of its polygons: those that were cut at the 180th meridian are joined when all are known.
    rings: Vec<Vec<[f64; 2]>>,
}

fn is_shape(node: &Node) -> bool {
    const SHAPES: [&str; 7] = [
        "LineString",
        "LinearRing",
        "MultiGeometry",
        "MultiTrack",
        "Point",
        "Polygon",
        "Track",
    ];
    SHAPES.iter().any(|name| is(node, name))
}

impl Placemark {
    fn geometry(&mut self, draft: &mut Draft, node: &Node, depth: usize) {
        let (at, facts) = (&self.at, &self.facts);
        if is(node, "Polygon") && draft.drawn_circle(at, facts) {
            return;
        }
        match node.tag_name().name() {
            "Point" => point(draft, at, facts, node),
            "Polygon" => {
                leave_heights(draft, at, facts, node);
                self.rings.extend(outer(draft, at, node));
            }
            "MultiGeometry" if depth < DEEPEST => {
                for inner in node.children().filter(is_shape) {
                    self.geometry(draft, &inner, depth + 1);
                }
            }
            "MultiGeometry" => draft.leave(at, "geometries nested deeper than 16 levels"),
            _ => draft.leave(at, "a line: points and polygons make a scenario"),
        }
    }
}

fn point(draft: &mut Draft, at: &str, facts: &Facts, node: &Node) {
    let place = match coordinates(node).as_deref() {
        Ok([[lon, lat, alt]]) => Place::new(*lon, *lat).map(|place| (place, *alt)),
        Ok(many) => Err(format!("a point of {} coordinates", many.len())),
        Err(reason) => Err(reason.clone()),
    };
    let (place, alt) = match place {
        Ok(place) => place,
        Err(reason) => return draft.leave(at, reason),
    };
    let mode = text_of(node, "altitudeMode").unwrap_or_else(|| "clampToGround".to_owned());
    if let Some(end) = facts.end()
        && mode != "absolute"
    {
        let height = if mode == "relativeToGround" { alt } else { 0.0 };
        draft.assume(
            &format!("/{end}/alt"),
            format!("{height}, the height above ground: the altitude mode is {mode}, and the ground is not known"),
        );
        return draft.point(at, facts, place, Some(height));
    }
    draft.point(at, facts, place, Some(alt));
}

/// Tell that the heights of a polygon are not read: whether they are those of its roof or of its floor, and above which
/// ground, the file does not say.
fn leave_heights(draft: &mut Draft, at: &str, facts: &Facts, node: &Node) {
    let mode = text_of(node, "altitudeMode");
    let has_heights = mode.is_some_and(|mode| mode != "clampToGround");
    if has_heights && !facts.says_any(&["kind", "base", "top"]) {
        draft.leave(at, HEIGHTS_OF_A_POLYGON);
    }
}

/// The outer ring of a polygon.
fn outer(draft: &mut Draft, at: &str, node: &Node) -> Option<Vec<[f64; 2]>> {
    let boundary = |name| node.children().find(move |child| is(child, name));
    let holes = node.children().filter(|child| is(child, "innerBoundaryIs"));
    for (index, _) in holes.enumerate() {
        let hole = format!("{at}: hole {index}");
        draft.leave(hole, "the hole of a polygon: all of it is kept clear of");
    }
    let ring = boundary("outerBoundaryIs")
        .and_then(|outer| outer.children().find(|child| is(child, "LinearRing")));
    let corners = ring.map_or_else(
        || Err("a polygon without a ring".to_owned()),
        |ring| coordinates(&ring),
    );
    match corners {
        Ok(corners) => Some(corners.iter().map(|[lon, lat, _]| [*lon, *lat]).collect()),
        Err(reason) => {
            draft.leave(at, reason);
            None
        }
    }
}

/// Longitude, latitude and altitude; the altitude is 0 if omitted.
fn coordinates(node: &Node) -> Result<Vec<[f64; 3]>, String> {
    let text = text_of(node, "coordinates").ok_or("no coordinates")?;
    let tuple = |tuple: &str| {
        let numbers: Result<Vec<f64>, _> = tuple.split(',').map(str::parse).collect();
        let numbers = numbers
            .ok()
            .filter(|numbers| numbers.iter().all(|n| n.is_finite()));
        match numbers.as_deref() {
            Some([lon, lat]) => Ok([*lon, *lat, 0.0]),
            Some([lon, lat, alt]) => Ok([*lon, *lat, *alt]),
            _ => Err(format!(
                "coordinates are {:?}, must be longitude,latitude,altitude",
                tuple.chars().take(60).collect::<String>()
            )),
        }
    };
    text.split_whitespace().map(tuple).collect()
}

/// Name and extended data.
///
/// Elements nested deeper than data can be are skipped: with placemarks nested in each other's data, the innermost
/// would otherwise be read once per level.
fn facts(placemark: &Node) -> Facts {
    let mut said = Map::new();
    let mut say = |node: &Node, value: Option<String>| {
        if let (Some(name), Some(value)) = (node.attribute("name"), value) {
            said.insert(name.to_owned(), Value::String(value));
        }
    };
    let extended = placemark.children().filter(|node| is(node, "ExtendedData"));
    for node in extended.flat_map(|extended| extended.children()) {
        if is(&node, "Data") {
            say(&node, text_of(&node, "value"));
        } else if is(&node, "SchemaData") {
            for simple in node.children().filter(|child| is(child, "SimpleData")) {
                say(&simple, Some(text_in(&simple)));
            }
        }
    }
    if let Some(name) = text_of(placemark, "name") {
        said.insert("name".to_owned(), Value::String(name));
    }
    Facts::of(said)
}

fn is(node: &Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// The text of a child, trimmed.
fn text_of(node: &Node, name: &str) -> Option<String> {
    let child = node.children().find(|child| is(child, name))?;
    Some(text_in(&child).trim().to_owned())
}

/// All text right within `node`; comments, which the library has texts of too, are none.
fn text_in(node: &Node) -> String {
    let parts = node.children().filter(Node::is_text);
    parts.filter_map(|part| part.text()).collect()
}
