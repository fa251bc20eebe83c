//! The path as a table, one row per sample, for spreadsheets and scripts.

use super::delivery::Passage;
use super::{Delivery, Options};
use crate::geometry::Point3;
use crate::geometry::geodesy::LatLon;

/// Write the path of a plan, or the waypoints if it has no path.
pub(super) fn write(delivery: &Delivery, _: &Options) -> String {
    let positions: &[&str] = if delivery.chart.is_some() {
        &["lat", "lon", "alt_msl", "alt_ellipsoid"]
    } else {
        &["x", "y", "z"]
    };
    let kind = if delivery.path.is_some() {
        "path"
    } else {
        "waypoint"
    };
    let course = delivery.course();
    let mut table = csv::Writer::from_writer(Vec::new());
    let mut record = |fields: Vec<String>| {
        table
            .write_record(&fields)
            .expect("lines of one length are written to memory");
    };
    let head = ["kind", "index"].iter().chain(positions);
    let head = head.chain(&["agl", "distance_m", "time_s", "fuel"]);
    record(head.map(ToString::to_string).collect());
    for ((index, &point), passage) in course.iter().enumerate().zip(delivery.passages(course)) {
        let mut fields = vec![kind.to_owned(), index.to_string()];
        fields.extend(position(delivery, point).iter().map(ToString::to_string));
        fields.extend(way(delivery, point, passage));
        record(fields);
    }
    let text = table.into_inner().expect("memory takes what is written");
    String::from_utf8(text).expect("numbers and names are UTF-8")
}

fn position(delivery: &Delivery, point: Point3) -> Vec<f64> {
    match &delivery.chart {
        None => vec![point.x, point.y, point.z],
        Some(chart) => {
            let LatLon { lat, lon } = chart.place(point.xy());
            vec![lat, lon, chart.msl_m(point), chart.ellipsoid_m(point)]
        }
    }
}

fn way(delivery: &Delivery, point: Point3, passage: Passage) -> [String; 4] {
    let figures = [
        delivery.agl(point),
        passage.distance_m,
        passage.time_s,
        passage.fuel,
    ];
    figures.map(|figure| super::chart::rounded(figure, 1e3).to_string())
}
