//! A scenario document under construction.

use serde_json::json;

use super::edges;
use super::facts::{Facts, OF_A_THREAT, begin};
use super::flight::Flight;
use super::near::Near;
use super::place::Place;
use super::threat::{Made, Shape, Threats, circle, polygon};
use super::zones::{Widened, Zone};
use super::{Assumed, Conversion, ImportError, Most, Unused};

/// Most entries in the list of unused parts; the last one counts the rest.
const MOST_UNUSED: usize = 1000;

/// Why the heights of a polygon's corners are not used.
pub(super) const HEIGHTS_OF_A_POLYGON: &str = "the heights of a polygon: it is kept clear of at any height, unless its data have a base or a top";

/// Most corners of arcs and of long edges that are worked out: a short line of a file may stand for many of them.
const MOST_WORKED_OUT: usize = 50_000;

/// Usual altitude limit of unmanned aircraft, metres above ground.
const CEILING_M: f64 = 120.0;

/// What has been read from a file so far.
#[derive(Debug)]
pub(super) struct Draft {
    /// Name of the scenario.
    name: Option<String>,
    /// `msl` or `ellipsoid`.
    datum: &'static str,
    start: Option<(Place, f64)>,
    target: Option<(Place, f64)>,
    threats: Threats,
    /// Of the flight that the file is converted for, if its ends are known beforehand.
    near: Option<Near>,
    /// Threats that lie elsewhere.
    n_elsewhere: usize,
    widened: Widened,
    /// How many more corners of arcs and long edges may be worked out; 0 when there were more.
    room: usize,
    /// Metres per second.
    pub(super) cruise_speed: Option<f64>,
    /// Elevation of the ground, metres, if the file gives it.
    pub(super) elevation: Option<f64>,
    assumed: Vec<Assumed>,
    unused: Vec<Unused>,
    more_unused: usize,
}

impl Draft {
    /// For `flight`, whose ends count before those of the file.
    pub(super) fn new(datum: &'static str, most: Most, flight: &Flight) -> Self {
        let mut draft = Self {
            name: None,
            datum,
            start: None,
            target: None,
            threats: Threats::up_to(most),
            near: None,
            n_elsewhere: 0,
            widened: Widened::default(),
            room: MOST_WORKED_OUT,
            cruise_speed: None,
            elevation: None,
            assumed: Vec::new(),
            unused: Vec::new(),
            more_unused: 0,
        };
        for (name, end) in [("start", flight.start), ("target", flight.target)] {
            if let Some(end) = end {
                draft.end(name, "", end.place, end.alt);
            }
        }
        if let (Some(start), Some(target)) = (flight.start, flight.target) {
            let ends = [start, target].map(|end| end.place);
            draft.near = Some(Near::of(ends, flight.within_m));
        }
        draft
    }

    /// Name the scenario, if the file does.
    pub(super) fn call(&mut self, name: Option<&str>) {
        self.name = name.map(begin);
    }

    /// List a part of the file as unused.
    pub(super) fn leave(&mut self, place: impl Into<String>, reason: impl Into<String>) {
        if self.unused.len() < MOST_UNUSED {
            self.unused.push(Unused {
                place: place.into(),
                reason: reason.into(),
            });
        } else {
            self.more_unused += 1;
        }
    }

    /// List a part of the document as assumed, because the file does not give it.
    pub(super) fn assume(&mut self, pointer: &str, reason: impl Into<String>) {
        self.assumed.push(Assumed {
            pointer: pointer.to_owned(),
            reason: reason.into(),
        });
    }

    /// Whether the start or the target is set; one that the flight gives is from the beginning.
    pub(super) fn has(&self, end: &str) -> bool {
        let slot = if end == "start" {
            &self.start
        } else {
            &self.target
        };
        slot.is_some()
    }

    /// Set the start or the target; the first one found counts. `alt` is `None` if it is not known.
    pub(super) fn end(&mut self, end: &str, at: &str, place: Place, alt: Option<f64>) {
        let slot = if end == "start" {
            &mut self.start
        } else {
            &mut self.target
        };
        if slot.is_some() {
            return self.leave(at, format!("another point is the {end} already"));
        }
        *slot = Some((place, alt.unwrap_or(0.0)));
        if alt.is_none() {
            let reason = format!("0: no altitude of the {end} is given");
            self.assume(&format!("/{end}/alt"), reason);
        }
    }

    /// A point with its facts: the start, the target, or the centre of a circle. `alt` is `None` if the file gives no
    /// height.
    pub(super) fn point(&mut self, at: &str, facts: &Facts, place: Place, alt: Option<f64>) {
        if let Some(end) = facts.end() {
            self.leave_beside(at, facts, &["name"]);
            return self.end(end, at, place, alt);
        }
        match facts.number("radius") {
            Ok(Some(_)) => self.circle(at, facts, place),
            Ok(None) if facts.is_of_a_route() => {
                self.leave(at, "a waypoint of a route: a plan finds its own");
            }
            Ok(None) => {
                let why = "a point that is not named start or target and has no radius";
                self.leave(at, why);
            }
            Err(reason) => self.leave(at, reason),
        }
    }

    /// A circle with the radius in its facts.
    pub(super) fn circle(&mut self, at: &str, facts: &Facts, center: Place) {
        self.threat(at, facts, circle(facts, center));
    }

    /// A circle that is drawn as a ring, if these are the facts of one: they say its `center` and its `radius`.
    pub(super) fn drawn_circle(&mut self, at: &str, facts: &Facts) -> bool {
        let (Some([lon, lat]), Ok(Some(_))) = (facts.center(), facts.number("radius")) else {
            return false;
        };
        match Place::new(lon, lat) {
            Ok(center) => self.circle(at, facts, center),
            Err(reason) => self.leave(at, reason),
        }
        true
    }

    /// The outer ring of a polygon, closed or not.
    pub(super) fn polygon(&mut self, at: &str, facts: &Facts, ring: &[[f64; 2]]) {
        self.threat(at, facts, polygon(facts, ring));
    }

    /// A ring whose edges are straight in degrees, with corners on the long ones.
    pub(super) fn divided(&mut self, ring: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let places = ring.iter().map(|&[lon, lat]| Place { lat, lon });
        let is_near = self
            .near
            .as_ref()
            .is_none_or(|near| near.may_hold(places, 0.0));
        if is_near {
            edges::divided(ring, &mut self.room)
        } else {
            ring.to_vec()
        }
    }

    /// Whether a zone is to be worked out that has so many corners, all within `reach`: it may be near, and there is room.
    /// If there is not, the file is refused in the end.
    pub(super) fn has_room(&mut self, corners: usize, reach: &Shape) -> bool {
        if self.is_elsewhere(reach) {
            self.n_elsewhere += 1;
            return false;
        }
        self.room = self.room.saturating_sub(corners);
        self.room > 0
    }

    fn is_elsewhere(&self, shape: &Shape) -> bool {
        self.near.as_ref().is_some_and(|near| !near.meets(shape))
    }

    fn threat(&mut self, at: &str, facts: &Facts, made: Result<Made, String>) {
        match made {
            Ok(made) => {
                if self.keep(at, made) {
                    self.leave_beside(at, facts, &OF_A_THREAT);
                }
            }
            Err(reason) => self.leave(at, reason),
        }
    }

    /// A zone of airspace.
    pub(super) fn zone(&mut self, at: &str, zone: Zone) {
        match zone.threat() {
            Ok((made, widened)) => {
                if self.keep(at, made) {
                    self.widened.join(&widened);
                }
            }
            Err(reason) => self.leave(at, reason),
        }
    }

    /// Keep a threat, unless it lies elsewhere.
    fn keep(&mut self, at: &str, (threat, amiss): Made) -> bool {
        if self.is_elsewhere(&threat.shape) {
            self.n_elsewhere += 1;
            return false;
        }
        self.threats.add(threat);
        for reason in amiss {
            self.leave(at, reason);
        }
        true
    }

    fn leave_beside(&mut self, at: &str, facts: &Facts, used: &[&str]) {
        let beside = facts.beside(used);
        if !beside.is_empty() {
            self.leave(at, format!("said and not used: {}", beside.join(", ")));
        }
    }

    /// The refusal of the file, with what it contains instead of a scenario.
    pub(super) fn refused(mut self, detail: String) -> ImportError {
        self.count_the_rest();
        let unused = self.unused;
        ImportError::NoScenario { detail, unused }
    }

    fn assume_of_zones(&mut self) {
        if let Some(near) = &self.near {
            let (beyond, elsewhere) = (near.beyond_m(), self.n_elsewhere);
            let reason = format!(
                "{beyond:.0} m beyond start and target on each side; threats of the file that lie outside and are left out: {elsewhere}"
            );
            self.assume("/area", reason);
        }
        for reason in std::mem::take(&mut self.widened).reasons() {
            self.assume("/threats", reason);
        }
    }

    fn count_the_rest(&mut self) {
        if self.more_unused > 0 {
            self.unused.push(Unused {
                place: String::new(),
                reason: format!("{} more are not listed", self.more_unused),
            });
        }
    }

    /// Build the document.
    pub(super) fn finish(mut self) -> Result<Conversion, ImportError> {
        let (Some(start), Some(target)) = (self.start, self.target) else {
            let missing: Vec<_> = [("start", self.start), ("target", self.target)]
                .into_iter()
                .filter(|(_, end)| end.is_none())
                .map(|(name, _)| format!("no {name}"))
                .collect();
            let detail = format!(
                "{} in the file: a point of that name makes one in GeoJSON and KML, the options start and target do with any file",
                missing.join(" and ")
            );
            return Err(self.refused(detail));
        };
        if self.room == 0 {
            let detail = format!(
                "the arcs and long edges of the file have over {MOST_WORKED_OUT} corners: leave out what lies far from the flight"
            );
            return Err(self.refused(detail));
        }
        if let Some(excess) = self.threats.excess() {
            return Err(self.refused(excess));
        }
        self.count_the_rest();
        let elevation = self.elevation.unwrap_or(f64::INFINITY);
        let elevation = elevation.min(start.1).min(target.1);
        self.assume(
            "/altitude",
            format!("0 to {CEILING_M} m above ground: the file has no band"),
        );
        self.assume(
            "/terrain",
            format!("flat ground at {elevation} m: the file has none"),
        );
        self.assume_of_zones();
        let end =
            |(place, alt): (Place, f64)| json!({"lat": place.lat, "lon": place.lon, "alt": alt});
        let mut scenario = json!({
            "name": self.name,
            "frame": "wgs84",
            "altitude_datum": self.datum,
            "start": end(start),
            "target": end(target),
            "threats": self.threats.json(),
            "terrain": {"kind": "flat", "elevation": elevation},
            "altitude": {"min": 0.0, "max": CEILING_M},
        });
        if let Some(near) = &self.near {
            scenario["area"] = near.json();
        }
        if let Some(speed) = self.cruise_speed {
            scenario["vehicle"] = json!({"cruise_speed": speed});
        }
        Ok(Conversion {
            scenario,
            assumed: self.assumed,
            unused: self.unused,
        })
    }
}
