//! GPX 1.1: the path as a track with times, the waypoints as waypoints.

use geo_types::Point;
use gpx::{Gpx, GpxVersion, Metadata, Track, TrackSegment, Waypoint};
use time::OffsetDateTime;

use super::chart::Chart;
use super::options::Digit;
use super::words::for_xml;
use super::{Delivery, Options};
use crate::geometry::Point3;
use crate::geometry::geodesy::LatLon;

/// Write the path of a plan; without a path, the waypoints form the track.
pub(super) fn write(delivery: &Delivery, options: &Options) -> String {
    let chart = delivery.chart();
    let course = delivery.course();
    let passages = delivery.passages(course);
    let track = course.iter().zip(passages).map(|(&at, passage)| {
        let instant = options.instant(passage.time_s, Digit::Millisecond);
        let time = OffsetDateTime::from_unix_timestamp_nanos(instant.as_nanosecond());
        let mut point = mark(chart, at);
        point.time = Some(
            time.expect("both kinds of instants end with year 9999")
                .into(),
        );
        point
    });
    let waypoints = delivery.waypoints.iter().enumerate().map(|(index, &at)| {
        let mut point = mark(chart, at);
        point.name = Some(delivery.waypoint_name(index));
        point
    });
    let name = for_xml(delivery.title());
    let metadata = Metadata {
        name: Some(name.clone()),
        description: Some(for_xml(&delivery.summary())),
        ..Metadata::default()
    };
    let mut segment = TrackSegment::new();
    segment.points = track.collect();
    let mut track = Track::new();
    track.name = Some(name);
    track.segments = vec![segment];
    let document = Gpx {
        version: GpxVersion::Gpx11,
        creator: Some("Noctule".to_owned()),
        metadata: Some(metadata),
        waypoints: waypoints.collect(),
        tracks: vec![track],
        ..Gpx::default()
    };
    let mut text = Vec::new();
    gpx::write(&document, &mut text).expect("a document of this version is written to memory");
    text.push(b'\n');
    String::from_utf8(text).expect("XML is written as UTF-8")
}

fn mark(chart: &Chart, point: Point3) -> Waypoint {
    let LatLon { lat, lon } = chart.place(point.xy());
    // GPX longitudes are less than 180, so the 180th meridian is written as -180.
    let lon = if lon >= 180.0 { -180.0 } else { lon };
    let mut mark = Waypoint::new(Point::new(lon, lat));
    mark.elevation = Some(chart.msl_m(point));
    mark.geoidheight = Some(chart.undulation_m(point.xy()));
    mark
}
