//! Maps of airspace, whatever their format: what lies elsewhere, and where a flight begins and ends.

mod eurocae;
mod openair;

use super::*;

/// From one side of the zones below to the other.
fn flight() -> Flight {
    Flight {
        start: "47.30,8.40,500".parse().ok(),
        target: "47.50, 8.70 ,450".parse().ok(),
        within_m: None,
    }
}

fn zones(text: &str) -> Conversion {
    let text = text.as_bytes();
    super::super::convert(text, Syntax::of(text), MOST, &flight()).expect("a scenario")
}

/// An airspace of OpenAir with a circle of one nautical mile.
fn circle(class: &str, name: &str, floor: &str, ceiling: &str, center: &str) -> String {
    format!("AC {class}\nAN {name}\nAL {floor}\nAH {ceiling}\nV X={center}\nDC 1\n\n")
}

const MIDDLE: &str = "47:24:00 N 008:33:00 E";

/// The reasons of what is assumed of the threats.
fn of_threats(conversion: &Conversion) -> Vec<&str> {
    let of_threats = conversion.assumed.iter();
    let of_threats = of_threats.filter(|assumed| assumed.pointer == "/threats");
    of_threats.map(|assumed| assumed.reason.as_str()).collect()
}

#[test]
fn what_lies_elsewhere_is_left_out_and_the_area_says_so() {
    let file = [
        circle("R", "near", "GND", "FL100", MIDDLE),
        circle("R", "far", "GND", "FL100", "49:00:00 N 008:33:00 E"),
        circle(
            "R",
            "other side of the earth",
            "GND",
            "FL100",
            "47:24:00 S 171:27:00 W",
        ),
    ]
    .concat();
    let read = zones(&file);
    assert_eq!(read.scenario["threats"].as_array().map(Vec::len), Some(1));
    let area = read
        .assumed
        .iter()
        .find(|assumed| assumed.pointer == "/area");
    assert_eq!(
        area.expect("an area").reason,
        "15869 m beyond start and target on each side; threats of the file that lie outside and are left out: 2"
    );
    let area = &read.scenario["area"];
    let degrees = |corner: &str, name: &str| area[corner][name].as_f64().expect("a number");
    assert!((47.15..47.17).contains(&degrees("min", "lat")), "{area}");
    assert!((8.18..8.20).contains(&degrees("min", "lon")), "{area}");
    assert!((47.63..47.65).contains(&degrees("max", "lat")), "{area}");
    assert!((8.90..8.92).contains(&degrees("max", "lon")), "{area}");
    // Wide enough for the second.
    let flight = Flight {
        within_m: Some(170e3),
        ..flight()
    };
    let read = super::super::convert(file.as_bytes(), Syntax::Lines, MOST, &flight);
    let threats = &read.expect("a scenario").scenario["threats"];
    assert_eq!(threats.as_array().map(Vec::len), Some(2));
}

#[test]
fn a_flight_across_the_antimeridian_has_zones_on_both_sides() {
    let file = [
        circle("R", "west", "GND", "FL100", "17:00:00 S 179:58:00 E"),
        circle("R", "east", "GND", "FL100", "17:00:00 S 179:58:00 W"),
    ]
    .concat();
    let flight = Flight {
        start: "-17,179.9,100".parse().ok(),
        target: "-17,-179.9,100".parse().ok(),
        within_m: Some(5000.0),
    };
    let read = super::super::convert(file.as_bytes(), Syntax::Lines, MOST, &flight);
    let scenario = read.expect("a scenario").scenario;
    assert_eq!(scenario["threats"].as_array().map(Vec::len), Some(2));
    let lon = |corner: &str| scenario["area"][corner]["lon"].as_f64().expect("a number");
    assert!((179.8..179.9).contains(&lon("min")) && (-179.9..-179.8).contains(&lon("max")));
}

#[test]
fn ends_of_the_request_count_before_those_of_the_file() {
    let file = json!([
        geojson::point("start", json!([8.0, 47.0, 10])),
        geojson::point("target", json!([8.1, 47.0, 10]))
    ]);
    let file = json!({"type": "FeatureCollection", "features": file});
    let flight = Flight {
        start: "47.1,8.2".parse().ok(),
        ..Flight::default()
    };
    let read = super::super::convert(file.to_string().as_bytes(), Syntax::Json, MOST, &flight);
    let read = read.expect("a scenario");
    assert_eq!(
        read.scenario["start"],
        json!({"lat": 47.1, "lon": 8.2, "alt": 0.0})
    );
    assert_eq!(read.scenario["target"]["lon"], 8.1);
    assert_eq!(read.scenario["area"], json!(null));
    assert_eq!(
        unused(&read),
        ["/features/0: another point is the start already"]
    );
    assert_eq!(read.assumed[0].pointer, "/start/alt");
}

#[test]
fn a_map_without_ends_is_refused_and_told_how_to_give_them() {
    let file = circle("R", "range", "GND", "FL100", MIDDLE);
    let refused = convert(file.as_bytes(), Syntax::of(file.as_bytes())).expect_err("no ends");
    assert_eq!(
        refused.to_string(),
        "no start and no target in the file: a point of that name makes one in GeoJSON and KML, the options start and target do with any file"
    );
}

#[test]
fn ends_are_degrees_and_metres() {
    for text in [
        "",
        "47.3",
        "47.3;8.4",
        "47.3,8.4,1,2",
        "x,8",
        "47.3,8.4,NaN",
        "47.3,8.4,inf",
        "NaN,8",
        "8.4,247.3",
        "98.4,7",
    ] {
        let refused = text.parse::<End>().expect_err(text);
        assert_eq!(
            refused,
            "must be latitude,longitude or latitude,longitude,altitude, in degrees (-90 to 90, -180 to 180) and metres"
        );
    }
    assert!("-90, 180".parse::<End>().is_ok());
}

#[test]
fn files_may_be_in_utf_16_or_latin_1() {
    let latin = circle("R", "Z?RICH", "GND", "FL100", MIDDLE);
    let latin: Vec<u8> = latin
        .bytes()
        .map(|byte| if byte == b'?' { 0xdc } else { byte })
        .collect();
    let read = super::super::convert(&latin, Syntax::of(&latin), MOST, &flight());
    assert_eq!(
        read.expect("a scenario").scenario["threats"][0]["name"],
        "ZÜRICH"
    );
    let kml = "<kml><Document><name>Flug über</name></Document></kml>";
    for (mark, bytes) in [
        ([0xff, 0xfe], u16::to_le_bytes as fn(u16) -> [u8; 2]),
        ([0xfe, 0xff], u16::to_be_bytes),
    ] {
        let units = kml.encode_utf16().flat_map(bytes);
        let wide: Vec<u8> = mark.into_iter().chain(units).collect();
        let read = super::super::convert(&wide, Syntax::of(&wide), MOST, &flight());
        assert_eq!(read.expect("a scenario").scenario["name"], "Flug über");
    }
}
