//! A scenario document under construction.

use serde_json::{Value, json};

use super::facts::{Facts, OF_A_THREAT, begin};
use super::threat::{Threat, Threats, circle, polygon};
use super::{Assumed, Conversion, ImportError, Most, Unused};

/// Most entries in the list of unused parts; the last one counts the rest.
const MOST_UNUSED: usize = 1000;

/// Usual altitude limit of unmanned aircraft, metres above ground.
const CEILING_M: f64 = 120.0;

/// A place on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) lat: f64,
    pub(super) lon: f64,
}

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
    /// Metres per second.
    pub(super) cruise_speed: Option<f64>,
    /// Elevation of the ground, metres, if the file gives it.
    pub(super) elevation: Option<f64>,
    assumed: Vec<Assumed>,
    unused: Vec<Unused>,
    more_unused: usize,
}

impl Place {
    /// From degrees east and north.
    pub(super) fn new(lon: f64, lat: f64) -> Result<Self, String> {
        if !(-180.0..=180.0).contains(&lon) {
            return Err(format!("longitude is {lon}, must be from -180 to 180"));
        }
        if !(-90.0..=90.0).contains(&lat) {
            return Err(format!("latitude is {lat}, must be from -90 to 90"));
        }
        Ok(Self { lat, lon })
    }

    pub(super) fn json(self) -> Value {
        json!({"lat": self.lat, "lon": self.lon})
    }
}

impl Draft {
    pub(super) fn new(datum: &'static str, most: Most) -> Self {
        Self {
            name: None,
            datum,
            start: None,
            target: None,
            threats: Threats::up_to(most),
            cruise_speed: None,
            elevation: None,
            assumed: Vec::new(),
            unused: Vec::new(),
            more_unused: 0,
        }
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

    /// Set the start or the target; the first one found counts.
    pub(super) fn end(&mut self, end: &str, at: &str, place: Place, alt: f64) {
        let slot = if end == "start" {
            &mut self.start
        } else {
            &mut self.target
        };
        if slot.is_some() {
            self.leave(at, format!("another point is the {end} already"));
        } else {
            *slot = Some((place, alt));
        }
    }

    /// A point with its facts: the start, the target, or the centre of a circle. `alt` is `None` if the file gives no
    /// height.
    pub(super) fn point(&mut self, at: &str, facts: &Facts, place: Place, alt: Option<f64>) {
        if let Some(end) = facts.end() {
            self.leave_beside(at, facts, &["name"]);
            if alt.is_none() {
                let pointer = format!("/{end}/alt");
                self.assume(
                    &pointer,
                    format!("0: the {end} has no altitude in the file"),
                );
            }
            return self.end(end, at, place, alt.unwrap_or(0.0));
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
        match circle(facts, center) {
            Ok(threat) => self.threat(at, facts, threat),
            Err(reason) => self.leave(at, reason),
        }
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
        match polygon(facts, ring) {
            Ok(threat) => self.threat(at, facts, threat),
            Err(reason) => self.leave(at, reason),
        }
    }

    fn threat(&mut self, at: &str, facts: &Facts, threat: Threat) {
        self.leave_beside(at, facts, &OF_A_THREAT);
        self.threats.add(threat);
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
                "{} in the file: a point of that name makes one",
                missing.join(" and ")
            );
            return Err(self.refused(detail));
        };
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
