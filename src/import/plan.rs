//! QGroundControl plans: the mission's ends as start and target, exclusion fences as threats. Altitudes are above
//! mean sea level.

use std::ops::RangeInclusive;

use serde_json::{Map, Value};

use super::draft::Draft;
use super::facts::{Facts, begin, shown};
use super::flight::Flight;
use super::place::Place;
use super::{Conversion, ImportError, Most, antimeridian};

/// MAVLink commands (`MAV_CMD`) that have a position: waypoints and similar, then take-offs and landings.
const WAYPOINTS: [u64; 6] = [16, 17, 18, 19, 31, 82];
const TAKEOFFS: [u64; 2] = [22, 84];
const LANDINGS: [u64; 2] = [21, 85];
const CHANGE_SPEED: u64 = 178;

/// MAVLink speed types (`SPEED_TYPE`): airspeed and ground speed, which are equal without wind. The others are for
/// climbs and descents.
const ALONG: [f64; 2] = [0.0, 1.0];

/// Vehicles of MAVLink's `MAV_TYPE` with wings: fixed wings, and those that take off upright and then fly on wings
/// (VTOL). They fly at their cruise speed, all others at their hover speed.
const FIXED_WING: u64 = 1;
const VTOLS: RangeInclusive<u64> = 19..=25;

/// Where the vehicle starts from, and heights of many items count from.
#[derive(Debug, Clone, Copy)]
struct Home<'d> {
    place: Place,
    /// Metres above mean sea level, if it is a number.
    alt: &'d Value,
}

/// Why an inclusion fence is not used.
const STAY_WITHIN: &str = "a fence to stay within, where a scenario has a box, its area";

/// An item that has a position.
#[derive(Debug, Clone, Copy)]
struct Stop<'d> {
    index: usize,
    item: &'d Value,
    place: Place,
    /// At the start or the end of the mission.
    on_ground: bool,
}

impl Stop<'_> {
    fn at(&self) -> String {
        place_of_item(self.index)
    }

    /// Its altitude counts from home's.
    fn is_from_home(&self) -> bool {
        self.on_ground || is_above_home(self.item)
    }

    /// Metres above mean sea level, or why they are not known, which matters at the ends alone.
    fn altitude(&self, home: Option<Home>) -> Result<f64, String> {
        if self.on_ground {
            home_altitude(home)
        } else {
            altitude(self.item, home)
        }
    }
}

fn place_of_item(index: usize) -> String {
    format!("/mission/items/{index}")
}

/// Convert a plan to a scenario.
pub(super) fn convert(
    document: &Value,
    most: Most,
    flight: &Flight,
) -> Result<Conversion, ImportError> {
    let mission = &document["mission"];
    let Some(items) = mission["items"].as_array() else {
        return Err(ImportError::no_scenario(
            "a plan has mission.items, a list; this one has none",
        ));
    };
    let mut draft = Draft::new("msl", most, flight);
    let home = home(mission);
    draft.elevation = home.and_then(|home| home.alt.as_f64());
    draft.cruise_speed = speed(mission);
    let stops = stops(&mut draft, items, home);
    let has_ends = draft.has("start") && draft.has("target");
    if stops.is_empty() && !has_ends {
        let detail = "the mission has no item with a position: its first and its last one make start and target";
        return Err(draft.refused(detail.to_owned()));
    }
    if let Err(reason) = ends(&mut draft, home, &stops) {
        return Err(draft.refused(reason));
    }
    fences(&mut draft, &document["geoFence"]);
    let rally = document["rallyPoints"]["points"].as_array();
    for index in 0..rally.map_or(0, Vec::len) {
        let at = format!("/rallyPoints/points/{index}");
        draft.leave(at, "a rally point, which no scenario has");
    }
    draft.finish()
}

/// The home of a mission; one at 0 degrees north and east is what a program writes that does not know it.
fn home(mission: &Value) -> Option<Home<'_>> {
    let home = &mission["plannedHomePosition"];
    let [lat, lon] = [home[0].as_f64()?, home[1].as_f64()?];
    let place = Place::new(lon, lat)
        .ok()
        .filter(|_| (lat, lon) != (0.0, 0.0))?;
    let alt = &home[2];
    Some(Home { place, alt })
}

/// Metres above mean sea level; a mission without home is taken to begin at 0 m.
fn home_altitude(home: Option<Home>) -> Result<f64, String> {
    let Some(Home { alt, .. }) = home else {
        return Ok(0.0);
    };
    alt.as_f64().ok_or_else(|| {
        let alt = shown(alt);
        format!("counts from home, whose altitude is {alt}, must be a number")
    })
}

fn speed(mission: &Value) -> Option<f64> {
    let kind = mission["vehicleType"].as_u64();
    let has_wings = kind.is_some_and(|kind| kind == FIXED_WING || VTOLS.contains(&kind));
    let name = if has_wings {
        "cruiseSpeed"
    } else {
        "hoverSpeed"
    };
    mission[name].as_f64().filter(|speed| *speed > 0.0)
}

fn stops<'d>(draft: &mut Draft, items: &'d [Value], home: Option<Home>) -> Vec<Stop<'d>> {
    let mut stops = Vec::new();
    let mut flown: Option<(String, f64)> = None;
    for (index, item) in items.iter().enumerate() {
        let at = place_of_item(index);
        if item["type"] != "SimpleItem" {
            let kind = begin(item["complexItemType"].as_str().unwrap_or("unknown"));
            draft.leave(at, format!("a complex item ({kind}), which is not read"));
            continue;
        }
        let used = match item["command"].as_u64().unwrap_or_default() {
            command if moves(command) => {
                stop(index, item, command, home).map(|stop| stops.push(stop))
            }
            CHANGE_SPEED => changed_speed(item).map(|speed| {
                if let Some((earlier, before)) = flown.replace((at.clone(), speed))
                    && (before - speed).abs() > 0.0
                {
                    draft.leave(
                        earlier,
                        "a speed that a later item changes, where a scenario has one",
                    );
                }
            }),
            command => Err(format!("command {command}, which no scenario has")),
        };
        if let Err(reason) = used {
            draft.leave(at, reason);
        }
    }
    if let Some((_, speed)) = flown {
        draft.cruise_speed = Some(speed);
    }
    stops
}

fn moves(command: u64) -> bool {
    let moves = [&WAYPOINTS[..], &TAKEOFFS, &LANDINGS];
    moves.iter().any(|commands| commands.contains(&command))
}

/// Speed along the route, metres per second.
fn changed_speed(item: &Value) -> Result<f64, String> {
    let [kind, speed] = [0, 1].map(|index| &item["params"][index]);
    if !kind.as_f64().is_some_and(|kind| ALONG.contains(&kind)) {
        return Err(format!(
            "a speed of type {}, must be 0 (air) or 1 (ground)",
            shown(kind)
        ));
    }
    let along = speed.as_f64().filter(|speed| *speed > 0.0);
    along.ok_or_else(|| format!("speed is {}, must be > 0", shown(speed)))
}

fn stop<'d>(
    index: usize,
    item: &'d Value,
    command: u64,
    home: Option<Home>,
) -> Result<Stop<'d>, String> {
    let param = |index: usize| item["params"][index].as_f64();
    let is_landing = LANDINGS.contains(&command);
    // A take-off says how high to climb, and a landing mostly nothing.
    let on_ground = TAKEOFFS.contains(&command) || (is_landing && !lands_elsewhere(item));
    let somewhere = param(4).zip(param(5)).filter(|place| *place != (0.0, 0.0));
    let place = match (somewhere, home) {
        (Some((lat, lon)), _) => Place::new(lon, lat)?,
        // Without a position, an autopilot takes off and lands where it is.
        (None, Some(Home { place, .. })) if on_ground || is_landing => place,
        (None, _) => return Err("an item without a place".to_owned()),
    };
    Ok(Stop {
        index,
        item,
        place,
        on_ground,
    })
}

/// Whether a landing says at which altitude the ground is; 0 says nothing.
fn lands_elsewhere(item: &Value) -> bool {
    matches!(item["frame"].as_u64(), Some(0 | 3 | 5 | 6))
        && item["params"][6].as_f64().is_some_and(|alt| alt != 0.0)
}

fn is_above_home(item: &Value) -> bool {
    matches!(item["frame"].as_u64(), Some(3 | 6))
}

/// Metres above mean sea level of an item in the air. Beside a height above terrain, a ground station keeps the
/// altitude that it amounts to; it is null while the ground is not known.
fn altitude(item: &Value, home: Option<Home>) -> Result<f64, String> {
    let height = &item["params"][6];
    let number = height.as_f64();
    let none = || format!("has the altitude {}, must be a number", shown(height));
    let number = || number.ok_or_else(none);
    match item["frame"].as_u64() {
        Some(0 | 5) => number(),
        _ if is_above_home(item) => Ok(sum(home_altitude(home)?, number()?)),
        Some(frame @ (10 | 11)) => {
            let above_sea = &item["AMSLAltAboveTerrain"];
            above_sea.as_f64().ok_or_else(|| {
                let (height, above_sea) = (shown(height), shown(above_sea));
                format!(
                    "is {height} m above terrain (frame {frame}), and AMSLAltAboveTerrain is {above_sea}, must be its altitude above sea"
                )
            })
        }
        _ => Err(format!(
            "has frame {}, must be 0, 3, 5, 6, 10 or 11",
            shown(&item["frame"])
        )),
    }
}

/// Of two altitudes, metres, without what binary fractions add: 0.1 and 0.2 are 0.3. No file means less than a
/// micrometre.
fn sum(one: f64, other: f64) -> f64 {
    let sum = one + other;
    let rounded = (sum * 1e6).round() / 1e6;
    if rounded.is_finite() { rounded } else { sum }
}

/// The mission's first and last stop; a single stop is the target, reached from home. Where the flight gives an end, that
/// of the mission is only listed, whatever its altitude.
///
/// # Errors
/// When the altitude of one that is needed, or of the home that it counts from, is not known: without it, the next stop
/// would be taken for the end.
fn ends(draft: &mut Draft, home: Option<Home>, stops: &[Stop]) -> Result<(), String> {
    let set = |draft: &mut Draft, end: &str, stop: &Stop| -> Result<(), String> {
        let at = stop.at();
        if draft.has(end) {
            draft.end(end, &at, stop.place, None);
            return Ok(());
        }
        let alt = stop.altitude(home);
        let alt = alt.map_err(|reason| format!("the {end}, {at}, {reason}"))?;
        let pointer = format!("/{end}/alt");
        if stop.is_from_home() && home.is_none() {
            let why = "the file has no home, which is taken to be at 0 m";
            draft.assume(&pointer, format!("{alt}: {why}"));
        } else if stop.on_ground {
            draft.assume(&pointer, format!("{alt}, on the ground as home is"));
        }
        draft.end(end, &at, stop.place, Some(alt));
        Ok(())
    };
    match (stops, home) {
        ([], _) => {}
        ([only], Some(Home { place, alt })) => {
            let at = "/mission/plannedHomePosition";
            let known = alt.as_f64();
            if known.is_none() && !draft.has("start") {
                let alt = shown(alt);
                return Err(format!(
                    "the start, {at}, has the altitude {alt}, must be a number"
                ));
            }
            draft.end("start", at, place, known);
            set(draft, "target", only)?;
        }
        ([only], None) => set(draft, "target", only)?,
        ([first, between @ .., last], _) => {
            set(draft, "start", first)?;
            set(draft, "target", last)?;
            for stop in between {
                draft.leave(stop.at(), "a stop on the way: a plan finds its own");
            }
        }
    }
    Ok(())
}

fn fences(draft: &mut Draft, fence: &Value) {
    let list = |name: &str| fence[name].as_array().map_or(&[][..], Vec::as_slice);
    // Fences of version 1 have one polygon.
    if !list("polygon").is_empty() {
        draft.leave("/geoFence/polygon", STAY_WITHIN);
    }
    for (index, circle) in list("circles").iter().enumerate() {
        let at = format!("/geoFence/circles/{index}");
        if excludes(draft, &at, circle) {
            let shape = &circle["circle"];
            let center = &shape["center"];
            let facts = Facts::of(Map::from_iter([(
                "radius".to_owned(),
                shape["radius"].clone(),
            )]));
            let numbers = center[1].as_f64().zip(center[0].as_f64());
            let place = numbers.ok_or_else(|| "a circle without center".to_owned());
            match place.and_then(|(lon, lat)| Place::new(lon, lat)) {
                Ok(place) => draft.circle(&at, &facts, place),
                Err(reason) => draft.leave(&at, reason),
            }
        }
    }
    polygons(draft, list("polygons"));
}

/// A fence cannot cross the 180th meridian, so one that is cut there is two, which no name ties together.
fn polygons(draft: &mut Draft, fences: &[Value]) {
    let place = |index: usize| format!("/geoFence/polygons/{index}");
    let (mut indices, mut rings) = (Vec::new(), Vec::new());
    for (index, fence) in fences.iter().enumerate() {
        let at = place(index);
        if excludes(draft, &at, fence) {
            let corners = fence["polygon"].as_array();
            let corner = |corner: &Value| Some([corner[1].as_f64()?, corner[0].as_f64()?]);
            let ring: Option<Vec<[f64; 2]>> = corners.into_iter().flatten().map(corner).collect();
            match ring {
                Some(ring) => {
                    indices.push(index);
                    rings.push(ring);
                }
                None => draft.leave(&at, "a corner that is not latitude and longitude"),
            }
        }
    }
    for (first, ring) in antimeridian::joined(&rings) {
        let ring = draft.divided(&ring);
        draft.polygon(&place(indices[first]), &Facts::default(), &ring);
    }
}

/// Whether a fence is an exclusion fence; an inclusion fence is listed as unused.
fn excludes(draft: &mut Draft, at: &str, fence: &Value) -> bool {
    let excludes = fence["inclusion"] == false;
    if !excludes {
        draft.leave(at, STAY_WITHIN);
    }
    excludes
}
