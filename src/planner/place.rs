//! Which part of a route a violation is about.

use std::fmt;
use std::str::FromStr;

/// A part of a route by its index: `leg 3` or `waypoint 2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A waypoint; 0 is the start.
    Waypoint(usize),
    /// The leg from the waypoint of the same index to the next.
    Leg(usize),
}

impl Place {
    const WAYPOINT: &'static str = "waypoint";
    const LEG: &'static str = "leg";

    /// The waypoint, if it is one.
    #[must_use]
    pub fn waypoint(self) -> Option<usize> {
        match self {
            Self::Waypoint(index) => Some(index),
            Self::Leg(_) => None,
        }
    }

    /// The leg, if it is one.
    #[must_use]
    pub fn leg(self) -> Option<usize> {
        match self {
            Self::Leg(index) => Some(index),
            Self::Waypoint(_) => None,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Waypoint(index) => write!(f, "{} {index}", Self::WAYPOINT),
            Self::Leg(index) => write!(f, "{} {index}", Self::LEG),
        }
    }
}

impl FromStr for Place {
    type Err = String;

    /// # Errors
    /// What it is, and what it must be.
    fn from_str(text: &str) -> Result<Self, String> {
        let read = || {
            let (part, index) = text.split_once(' ')?;
            let index = index.parse().ok()?;
            match part {
                Self::WAYPOINT => Some(Self::Waypoint(index)),
                Self::LEG => Some(Self::Leg(index)),
                _ => None,
            }
        };
        read().ok_or_else(|| format!("a place is {text:?}, must be such as leg 3 or waypoint 2"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_read_as_it_is_written() {
        for (place, text) in [(Place::Waypoint(2), "waypoint 2"), (Place::Leg(0), "leg 0")] {
            assert_eq!(place.to_string(), text);
            assert_eq!(text.parse(), Ok(place));
        }
        for text in ["", "leg", "leg ", "leg -1", "leg 1 2", "path 1", "leg1"] {
            let refused = text.parse::<Place>().expect_err(text);
            assert!(refused.contains("must be such as leg 3"), "{refused}");
        }
    }
}
