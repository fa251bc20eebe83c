//! OGC KML 2.2: path and waypoints at their altitude above mean sea level, threats as walls down to the ground.

use std::collections::HashMap;

use kml::types::{
    AltitudeMode, Coord, Element, Folder, Geometry, KmlDocument, KmlVersion, LineString,
    LinearRing, Placemark, Point, Polygon,
};
use kml::{Kml, KmlWriter};

use super::chart::{Chart, rounded};
use super::outline;
use super::words::for_xml;
use super::{Delivery, Options};
use crate::geometry::geodesy::LatLon;
use crate::geometry::{Point2, Point3};
use crate::threat::{Shape, Threat};

const NAMESPACE: &str = "http://www.opengis.net/kml/2.2";

/// Styles: id, line colour and width, polygon colour; colours are opacity, blue, green and red.
const STYLES: [(&str, &str, &str, &str); 2] = [
    ("path", "ffff7a00", "3", "40ff7a00"),
    ("threat", "ff1b02d0", "1", "5a1b02d0"),
];

/// Write a plan. Without a path, the waypoints are drawn.
pub(super) fn write(delivery: &Delivery, _: &Options) -> String {
    let waypoints = (0..delivery.waypoints.len()).map(|index| waypoint(delivery, index));
    let heights = delivery.course().iter();
    let heights = heights.map(|&point| delivery.chart().msl_m(point));
    let highest = heights.fold(f64::MIN, f64::max);
    let threats = delivery.scenario.threats.iter().enumerate();
    let threats = threats.map(|(index, threat)| self::threat(delivery, index, threat, highest));
    let mut elements = vec![
        Kml::Element(text("name", delivery.title())),
        Kml::Element(text("description", &delivery.summary())),
    ];
    elements.extend(STYLES.map(style));
    elements.push(Kml::Placemark(path(delivery)));
    elements.push(folder("Waypoints", waypoints));
    elements.push(folder("Threats", threats));
    let document = Kml::KmlDocument(KmlDocument {
        version: KmlVersion::V22,
        attrs: attribute("xmlns", NAMESPACE),
        elements: vec![Kml::Document {
            attrs: HashMap::new(),
            elements,
        }],
    });
    let mut bytes = b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_vec();
    KmlWriter::from_writer(&mut bytes)
        .write(&document)
        .expect("memory takes what is written");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("XML is written as UTF-8")
}

fn path(delivery: &Delivery) -> Placemark {
    let course = delivery.course().iter();
    let coords = course.map(|&point| coord(delivery.chart(), point));
    let last = delivery.passages(delivery.course());
    let last = last.last().expect("a course has points");
    let data = [
        ("length_m", rounded(last.distance_m, 1e3)),
        ("duration_s", rounded(last.time_s, 1e3)),
        ("fuel", rounded(last.fuel, 1e3)),
        ("cost", delivery.result.cost.total),
    ];
    placemark(
        delivery.title(),
        Some("#path"),
        &data.map(|(name, value)| (name, value.to_string())),
        Geometry::LineString(LineString {
            coords: coords.collect(),
            altitude_mode: AltitudeMode::Absolute,
            ..LineString::default()
        }),
    )
}

fn waypoint(delivery: &Delivery, index: usize) -> Placemark {
    let point = delivery.waypoints[index];
    let agl = rounded(delivery.agl(point), 1e3).to_string();
    placemark(
        &delivery.waypoint_name(index),
        None,
        &[("agl", agl)],
        Geometry::Point(Point {
            coord: coord(delivery.chart(), point),
            altitude_mode: AltitudeMode::Absolute,
            ..Point::default()
        }),
    )
}

/// A wall from the threat's top down to the ground, because KML has no floating volume. A threat without top ends at
/// the `highest` point of the route, or where it stands out of its ground; where its base is higher, as a lid there: all
/// below it may be flown.
fn threat(delivery: &Delivery, index: usize, threat: &Threat, highest: f64) -> Placemark {
    let chart = delivery.chart();
    let middle = outline::middle(threat);
    let height = |z: f64| chart.msl_m(Point3::new(middle.x, middle.y, z));
    let base = threat.base.map_or(f64::MIN, height);
    let (top, is_lid) = if let Some(top) = threat.top {
        (height(top), false)
    } else {
        let (_, over_ground) = outline::over_ground(&delivery.scenario.terrain, threat);
        let end = highest.max(height(over_ground));
        (end.max(base), base >= end)
    };
    let corner = |corner: Point2| {
        let LatLon { lat, lon } = chart.place(corner);
        Coord::new(lon, lat, Some(top))
    };
    let mut coords: Vec<Coord> = outline::ring(threat).into_iter().map(corner).collect();
    coords.push(coords[0]);
    let mut data = Vec::new();
    match &threat.shape {
        Shape::Cylinder(cylinder) => {
            let center = chart.place(cylinder.center);
            data.push(("kind", "cylinder".to_owned()));
            data.push(("center", format!("{},{}", center.lon, center.lat)));
            data.push(("radius", cylinder.radius.to_string()));
            data.push(("influence", cylinder.influence.to_string()));
        }
        Shape::Polygon(polygon) => {
            data.push(("kind", "polygon".to_owned()));
            data.push(("margin", polygon.margin().to_string()));
        }
    }
    data.extend(threat.base.map(|base| ("base", height(base).to_string())));
    data.extend(threat.top.map(|top| ("top", height(top).to_string())));
    placemark(
        &outline::name(threat, index),
        Some("#threat"),
        &data,
        Geometry::Polygon(Polygon {
            extrude: !is_lid,
            altitude_mode: AltitudeMode::Absolute,
            outer: LinearRing {
                coords,
                altitude_mode: AltitudeMode::Absolute,
                ..LinearRing::default()
            },
            ..Polygon::default()
        }),
    )
}

fn coord(chart: &Chart, point: Point3) -> Coord {
    let LatLon { lat, lon } = chart.place(point.xy());
    Coord::new(lon, lat, Some(chart.msl_m(point)))
}

fn folder(name: &str, placemarks: impl Iterator<Item = Placemark>) -> Kml {
    Kml::Folder(Folder {
        name: Some(name.to_owned()),
        elements: placemarks.map(Kml::Placemark).collect(),
        ..Folder::default()
    })
}

/// The library writes `styleUrl` after the geometry, which the schema does not allow; as a child it comes before.
fn placemark(
    name: &str,
    style: Option<&str>,
    data: &[(&str, String)],
    geometry: Geometry,
) -> Placemark {
    let data = data.iter().map(|(name, value)| Element {
        attrs: attribute("name", name),
        children: vec![text("value", value)],
        ..element("Data")
    });
    let extended = Element {
        children: data.collect(),
        ..element("ExtendedData")
    };
    let style = style.map(|address| text("styleUrl", address));
    Placemark {
        name: Some(for_xml(name)),
        children: style.into_iter().chain([extended]).collect(),
        geometry: Some(geometry),
        ..Placemark::default()
    }
}

fn style((id, line, width, fill): (&str, &str, &str, &str)) -> Kml {
    let group = |name, children| Element {
        children,
        ..element(name)
    };
    let line = group("LineStyle", vec![text("color", line), text("width", width)]);
    let fill = group("PolyStyle", vec![text("color", fill)]);
    Kml::Element(Element {
        attrs: attribute("id", id),
        ..group("Style", vec![line, fill])
    })
}

fn element(name: &str) -> Element {
    Element {
        name: name.to_owned(),
        ..Element::default()
    }
}

fn text(name: &str, content: &str) -> Element {
    Element {
        content: Some(for_xml(content)),
        ..element(name)
    }
}

/// A single attribute: the library would write several in hash order.
fn attribute(name: &str, value: &str) -> HashMap<String, String> {
    HashMap::from([(name.to_owned(), value.to_owned())])
}
