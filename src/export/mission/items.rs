//! Commands for an autopilot, one per item.

use super::reduce::{Shape, reduce};
use crate::cost::{Model, Tolerance};
use crate::export::chart::{Chart, rounded};
use crate::export::{Altitude, Delivery, ExportError, Firmware, Options};
use crate::geometry::geodesy::LatLon;
use crate::geometry::{Point3, Segment};
use crate::planner::keeps_limits;

/// MAVLink commands (`MAV_CMD`).
pub(super) const NAV_WAYPOINT: u16 = 16;
const NAV_LAND: u16 = 21;
const NAV_TAKEOFF: u16 = 22;
const DO_CHANGE_SPEED: u16 = 178;

/// MAVLink frames (`MAV_FRAME`).
pub(super) const FRAME_GLOBAL: u8 = 0;
const FRAME_MISSION: u8 = 2;
const FRAME_RELATIVE: u8 = 3;
const FRAME_TERRAIN: u8 = 10;

/// MAVLink's integer coordinates are in 1 / this degrees: a centimetre.
const DEGREES: f64 = 1e7;

/// Most items, whose numbers and count have 16 bits. `ArduPilot` counts home as one more.
const MOST: usize = 65_534;

/// A mission: where the vehicle is armed, and its commands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mission {
    /// On the ground below the start.
    pub(super) home: Place,
    /// In order.
    pub(super) items: Vec<Item>,
    /// Corners of the flown route, local metres.
    pub(super) route: Vec<Point3>,
}

/// One command.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Item {
    pub(super) command: u16,
    pub(super) frame: u8,
    /// The first four parameters; `None` leaves one to the autopilot.
    pub(super) params: [Option<f64>; 4],
    /// `None` for a command without a position.
    pub(super) place: Option<Place>,
}

/// Position of an item.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) lat: f64,
    pub(super) lon: f64,
    /// In the item's frame, metres.
    pub(super) altitude_m: f64,
    /// Above mean sea level, metres.
    pub(super) msl_m: f64,
    /// Above ground, metres.
    pub(super) agl_m: f64,
}

/// The mission of a plan, with as few items as the tolerance allows.
pub(super) fn mission(delivery: &Delivery, options: &Options) -> Result<Mission, ExportError> {
    let chart = delivery.chart();
    let route = route(delivery, options)?;
    let scribe = Scribe {
        delivery,
        chart,
        options,
        home: on_ground(delivery, route[0]),
    };
    let mut items = Vec::new();
    let climbs = options.takeoff_m > 0.0;
    if climbs {
        items.push(scribe.item(
            NAV_TAKEOFF,
            [Some(0.0), Some(0.0), Some(0.0), None],
            route[0],
        ));
    }
    items.push(Item {
        command: DO_CHANGE_SPEED,
        frame: FRAME_MISSION,
        // Ground speed; the throttle stays as it is.
        params: [
            Some(1.0),
            Some(delivery.scenario.vehicle.cruise_speed),
            Some(-1.0),
            Some(0.0),
        ],
        place: None,
    });
    let waypoints = &route[usize::from(climbs)..];
    let straight_on = [Some(0.0), Some(0.0), Some(0.0), None];
    items.extend(
        waypoints
            .iter()
            .map(|&point| scribe.item(NAV_WAYPOINT, straight_on, point)),
    );
    if options.landing {
        let target = route[route.len() - 1];
        items.push(scribe.item(NAV_LAND, straight_on, on_ground(delivery, target)));
    }
    if items.len() > MOST {
        return Err(ExportError::Unflyable(format!(
            "a mission of {} items, must have {MOST} at most: a wider tolerance needs fewer",
            items.len()
        )));
    }
    Ok(Mission {
        home: scribe.place(scribe.home, FRAME_GLOBAL),
        items,
        route,
    })
}

struct Scribe<'d> {
    delivery: &'d Delivery,
    chart: &'d Chart,
    options: &'d Options,
    /// Local metres.
    home: Point3,
}

impl Scribe<'_> {
    fn item(&self, command: u16, params: [Option<f64>; 4], point: Point3) -> Item {
        let frame = match (self.options.altitude, self.options.firmware) {
            (Altitude::Relative, _) => FRAME_RELATIVE,
            (Altitude::Terrain, Firmware::ArduPilot) => FRAME_TERRAIN,
            // PX4 has no such frame; its ground station stores the height beside the altitude.
            (Altitude::Absolute, _) | (Altitude::Terrain, Firmware::Px4) => FRAME_GLOBAL,
        };
        Item {
            command,
            frame,
            params,
            place: Some(self.place(point, frame)),
        }
    }

    fn place(&self, point: Point3, frame: u8) -> Place {
        let LatLon { lat, lon } = self.chart.place(point.xy());
        let msl_m = self.chart.msl_m(point);
        let agl_m = rounded(self.delivery.agl(point), 1e3);
        let altitude_m = match frame {
            FRAME_RELATIVE => {
                let above_home = self.chart.above_sea(point) - self.chart.above_sea(self.home);
                rounded(above_home, 1e3)
            }
            FRAME_TERRAIN => agl_m,
            _ => msl_m,
        };
        Place {
            lat: rounded(lat, DEGREES),
            lon: rounded(lon, DEGREES),
            altitude_m,
            msl_m,
            agl_m,
        }
    }
}

fn on_ground(delivery: &Delivery, point: Point3) -> Point3 {
    let elevation = delivery.scenario.terrain.elevation(point.xy());
    Point3::new(point.x, point.y, elevation)
}

/// The corners of the flown route; the first one is in the air above the start.
fn route(delivery: &Delivery, options: &Options) -> Result<Vec<Point3>, ExportError> {
    let course = raised(delivery, options);
    if !delivery.result.feasible {
        // The caller insists on an infeasible route, so there are no constraints to keep.
        return Ok(course);
    }
    let model = Model::new(&delivery.scenario);
    if !keeps_limits(&model, &course) {
        return Err(ExportError::Unflyable(format!(
            "a take-off to {} m above ground leads into what the route keeps clear of: takeoff=0 leaves it out",
            options.takeoff_m
        )));
    }
    let first = course[0];
    if options.takeoff_m > 0.0 && !is_open(delivery, first) {
        return Err(ExportError::Unflyable(
            "a threat lies below the start: takeoff=0 leaves the take-off out".to_owned(),
        ));
    }
    if options.landing && !is_open(delivery, course[course.len() - 1]) {
        return Err(ExportError::Unflyable(
            "a threat lies below the target: landing=false leaves the landing out".to_owned(),
        ));
    }
    let shape = Shape {
        tolerance_m: options.tolerance_m,
        follows_ground: options.altitude == Altitude::Terrain,
    };
    Ok(reduce(&delivery.scenario, &course, shape))
}

/// The flown course from the end of the take-off: at take-off height until the route has climbed to it, but not above
/// the highest point of the route.
fn raised(delivery: &Delivery, options: &Options) -> Vec<Point3> {
    let mut course = delivery.course().to_vec();
    let highest = course.iter().map(|point| point.z).fold(f64::MIN, f64::max);
    let ground = on_ground(delivery, course[0]).z;
    let level = (ground + options.takeoff_m).min(highest);
    if options.takeoff_m > 0.0 {
        let low = course.iter_mut().take_while(|point| point.z < level);
        low.for_each(|point| point.z = level);
    }
    course
}

/// Whether no threat lies between `point` and the ground.
fn is_open(delivery: &Delivery, point: Point3) -> bool {
    let down = Segment {
        a: on_ground(delivery, point),
        b: point,
    };
    let tolerance = Tolerance::of(&delivery.scenario).length_m;
    let threats = &delivery.scenario.threats;
    threats.iter().all(|threat| {
        threat
            .clearance(&down)
            .is_none_or(|clear| clear >= -tolerance)
    })
}
