//! Options of the formats: one table, read from a query or a command line.

use jiff::{SignedDuration, Timestamp, Unit};

use super::error::OptionFault;
use super::{ALL, Format};

/// The values of all options.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Autopilot that flies a mission.
    pub firmware: Firmware,
    /// Reference of a mission's altitudes.
    pub altitude: Altitude,
    /// Greatest distance of a mission from the path, metres.
    pub tolerance_m: f64,
    /// Height of the take-off above the ground at the start, metres; 0 means no take-off.
    pub takeoff_m: f64,
    /// Whether a mission lands on the ground below the target.
    pub landing: bool,
    /// Time at which the vehicle is at the start.
    pub epoch: Timestamp,
    /// Whether a route that violates constraints may be written.
    pub allow_infeasible: bool,
}

/// Autopilot that flies a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Firmware {
    /// PX4.
    Px4,
    /// ArduPilot.
    ArduPilot,
}

/// Reference of a mission's altitudes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Altitude {
    /// The ground below the start, where the vehicle is armed.
    Relative,
    /// Mean sea level.
    Absolute,
    /// The ground below each item.
    Terrain,
}

/// The last digit of an instant in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Digit {
    /// As most readers know it.
    Millisecond,
    /// As fine as the samples of the fastest vehicle need.
    Microsecond,
}

/// Default epoch: no result knows when it will be flown.
const EPOCH: Timestamp = Timestamp::constant(946_684_800, 0);

/// Range of an epoch: every reader of the formats can represent it and the times that follow.
const EPOCHS: (Timestamp, Timestamp) = (
    Timestamp::constant(0, 0),
    Timestamp::constant(7_258_118_400, 0),
);

impl Default for Options {
    fn default() -> Self {
        Self {
            firmware: Firmware::Px4,
            altitude: Altitude::Relative,
            tolerance_m: 1.0,
            takeoff_m: 10.0,
            landing: false,
            epoch: EPOCH,
            allow_infeasible: false,
        }
    }
}

/// One row of the table of options.
#[derive(Debug)]
pub struct OptionRule {
    /// Name in a query.
    pub name: &'static str,
    /// Allowed values, for display.
    pub allowed: &'static str,
    /// Effect of the option.
    pub meaning: &'static str,
    set: fn(&mut Options, &str) -> Option<()>,
}

/// Every option of every format.
pub const OPTIONS: &[OptionRule] = &[
    OptionRule {
        name: "allow_infeasible",
        allowed: "true or false",
        meaning: "write a route in a format for flying even if it breaks constraints [default: false]",
        set: |options, value| set(&mut options.allow_infeasible, value.parse().ok()),
    },
    OptionRule {
        name: "altitude",
        allowed: "relative, absolute or terrain",
        meaning: "what altitudes are measured from: the ground at the start, mean sea level, or the ground below each item [default: relative]",
        set: |options, value| {
            let altitude = match value {
                "relative" => Some(Altitude::Relative),
                "absolute" => Some(Altitude::Absolute),
                "terrain" => Some(Altitude::Terrain),
                _ => None,
            };
            set(&mut options.altitude, altitude)
        },
    },
    OptionRule {
        name: "epoch",
        allowed: "an RFC 3339 instant from 1970 to 2199",
        meaning: "when the vehicle is at the start [default: 2000-01-01T00:00:00Z]",
        set: |options, value| set(&mut options.epoch, epoch(value)),
    },
    OptionRule {
        name: "firmware",
        allowed: "px4 or ardupilot",
        meaning: "the autopilot that flies the mission [default: px4]",
        set: |options, value| {
            let firmware = match value {
                "px4" => Some(Firmware::Px4),
                "ardupilot" => Some(Firmware::ArduPilot),
                _ => None,
            };
            set(&mut options.firmware, firmware)
        },
    },
    OptionRule {
        name: "landing",
        allowed: "true or false",
        meaning: "end the mission on the ground below the target [default: false]",
        set: |options, value| set(&mut options.landing, value.parse().ok()),
    },
    OptionRule {
        name: "takeoff",
        allowed: "metres from 0 to 1000",
        meaning: "first climb straight up to this height above the ground; 0 for a vehicle that is already in the air [default: 10]",
        set: |options, value| set(&mut options.takeoff_m, metres(value, 0.0..=1000.0)),
    },
    OptionRule {
        name: "tolerance",
        allowed: "metres from 0.01 to 1000",
        meaning: "how far the mission may deviate from the path [default: 1]",
        set: |options, value| set(&mut options.tolerance_m, metres(value, 0.01..=1000.0)),
    },
];

/// Accepted by every format: it only lifts a restriction, so it has no effect where there is none.
const ALWAYS: &str = "allow_infeasible";

fn set<T>(field: &mut T, value: Option<T>) -> Option<()> {
    *field = value?;
    Some(())
}

fn metres(value: &str, range: std::ops::RangeInclusive<f64>) -> Option<f64> {
    value.parse().ok().filter(|metres| range.contains(metres))
}

fn epoch(value: &str) -> Option<Timestamp> {
    let (first, end) = EPOCHS;
    value
        .parse()
        .ok()
        .filter(|instant| (first..end).contains(instant))
}

impl Options {
    /// The options of `format` from what a caller gave; others have their default.
    ///
    /// # Errors
    /// The first option that does not exist, is not supported by `format`, or has an invalid value.
    pub fn read<'a>(
        format: &Format,
        given: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, OptionFault> {
        let mut options = Self::default();
        for (name, value) in given {
            let fault = |detail| OptionFault {
                name: name.to_owned(),
                detail,
            };
            let rule = OPTIONS
                .iter()
                .find(|rule| rule.name == name)
                .ok_or_else(|| fault(unknown(name)))?;
            if name != ALWAYS && !format.options.contains(&name) {
                return Err(fault(foreign(name, format)));
            }
            (rule.set)(&mut options, value)
                .ok_or_else(|| fault(format!("{name} is {value:?}, must be {}", rule.allowed)))?;
        }
        Ok(options)
    }

    /// The instant `time_s` seconds after the epoch, to a millisecond or a microsecond.
    pub(super) fn instant(&self, time_s: f64, digit: Digit) -> Timestamp {
        let (parts, unit) = match digit {
            Digit::Millisecond => (1e3, Unit::Millisecond),
            Digit::Microsecond => (1e6, Unit::Microsecond),
        };
        // Beyond the range of instants, and well within the range of a duration.
        let count = (time_s.min(1e12) * parts).round();
        let since = SignedDuration::from_secs_f64(count / parts);
        let rounded = self
            .epoch
            .saturating_add(since)
            .ok()
            .and_then(|instant| instant.round(unit).ok());
        rounded.unwrap_or(Timestamp::MAX)
    }
}

fn unknown(name: &str) -> String {
    let names: Vec<_> = OPTIONS.iter().map(|rule| rule.name).collect();
    format!("{name} is no option, must be one of {}", names.join(", "))
}

fn foreign(name: &str, format: &Format) -> String {
    let known: Vec<_> = ALL
        .iter()
        .filter(|format| format.options.contains(&name))
        .map(|format| format.name)
        .collect();
    format!(
        "{name} is no option of {}, only of {}",
        format.name,
        known.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(format: &str, given: &[(&str, &str)], expected: Result<Options, &str>) {
        let format = Format::named(format).expect("a format");
        let read = Options::read(format, given.iter().copied());
        let read = read.map_err(|fault| fault.detail);
        assert_eq!(read, expected.map_err(str::to_owned), "{given:?}");
    }

    #[test]
    fn reads_what_the_format_knows_and_refuses_the_rest() {
        check("gpx", &[], Ok(Options::default()));
        check(
            "qgc",
            &[
                ("firmware", "ardupilot"),
                ("altitude", "terrain"),
                ("tolerance", "2.5"),
                ("takeoff", "0"),
                ("landing", "true"),
                ("allow_infeasible", "true"),
            ],
            Ok(Options {
                firmware: Firmware::ArduPilot,
                altitude: Altitude::Terrain,
                tolerance_m: 2.5,
                takeoff_m: 0.0,
                landing: true,
                epoch: EPOCH,
                allow_infeasible: true,
            }),
        );
        check(
            "json",
            &[("allow_infeasible", "true")],
            Ok(Options {
                allow_infeasible: true,
                ..Options::default()
            }),
        );
        for (format, name, value, detail) in [
            (
                "qgc",
                "firmware",
                "inav",
                "firmware is \"inav\", must be px4 or ardupilot",
            ),
            (
                "qgc",
                "tolerance",
                "0",
                "tolerance is \"0\", must be metres from 0.01 to 1000",
            ),
            (
                "qgc",
                "tolerance",
                "NaN",
                "tolerance is \"NaN\", must be metres from 0.01 to 1000",
            ),
            (
                "gpx",
                "firmware",
                "px4",
                "firmware is no option of gpx, only of qgc, wpl",
            ),
            (
                "czml",
                "epoch",
                "2300-01-01T00:00:00Z",
                "epoch is \"2300-01-01T00:00:00Z\", must be an RFC 3339 instant from 1970 to 2199",
            ),
        ] {
            check(format, &[(name, value)], Err(detail));
        }
    }

    #[test]
    fn every_option_belongs_to_a_format() {
        for rule in OPTIONS {
            let known = ALL.iter().any(|format| format.options.contains(&rule.name));
            assert!(known || rule.name == ALWAYS, "{}", rule.name);
        }
        for name in ALL.iter().flat_map(|format| format.options) {
            assert!(OPTIONS.iter().any(|rule| rule.name == *name), "{name}");
        }
    }
}
