//! A place on the earth, as files give it.

use serde_json::{Value, json};

use crate::geometry::geodesy::LatLon;

/// Degrees, each in its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) lat: f64,
    pub(super) lon: f64,
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

impl From<LatLon> for Place {
    fn from(LatLon { lat, lon }: LatLon) -> Self {
        Self { lat, lon }
    }
}

impl From<Place> for LatLon {
    fn from(Place { lat, lon }: Place) -> Self {
        Self { lat, lon }
    }
}
