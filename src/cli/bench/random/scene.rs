//! A scenario under construction: draws its ends, threats and peaks, and makes the document.

use serde_json::{Value, json};

use crate::optimizer::Random;

/// A scenario under construction; lengths as for an area of a square kilometre, until it is scaled.
pub(super) struct Scene {
    pub(super) random: Random,
    pub(super) start: [f64; 2],
    pub(super) target: [f64; 2],
    /// Heights above the ground of start and target.
    pub(super) heights: [f64; 2],
    pub(super) threats: Vec<Threat>,
    pub(super) peaks: Vec<Peak>,
    pub(super) band: [f64; 2],
    pub(super) turn_deg: f64,
    pub(super) climb_deg: f64,
    pub(super) min_leg: Option<f64>,
    pub(super) weights: [f64; 3],
    pub(super) waypoints: usize,
    pub(super) scale: f64,
}

pub(super) struct Threat {
    center: [f64; 2],
    /// Radius of the surrounding circle.
    radius: f64,
    margin: f64,
    /// Bearings and distances of a polygon's corners; empty for a disc.
    corners: Vec<[f64; 2]>,
    base: Option<f64>,
    top: Option<f64>,
}

pub(super) struct Peak {
    center: [f64; 2],
    height: f64,
    spread: [f64; 2],
}

/// Fuel, threat, altitude: the paper's, and others.
const WEIGHTS: [[f64; 3]; 6] = [
    [0.5, 1.0, 1.0],
    [1.0, 1.0, 1.0],
    [1.0, 0.2, 0.1],
    [0.2, 2.0, 0.5],
    [1.0, 0.0, 0.0],
    [0.3, 1.0, 3.0],
];

/// Least distance of threats' hard parts from start and target.
const CLEAR: f64 = 6.0;

impl Scene {
    pub(super) fn new(mut random: Random) -> Self {
        let mut corner = |low, high| [random.between(low, high), random.between(low, high)];
        let (start, target) = (corner(50.0, 280.0), corner(720.0, 950.0));
        let heights = [random.between(0.0, 150.0), random.between(0.0, 150.0)];
        Self {
            random,
            start,
            target,
            heights,
            threats: Vec::new(),
            peaks: Vec::new(),
            band: [0.0, 200.0],
            turn_deg: 60.0,
            climb_deg: 45.0,
            min_leg: None,
            weights: WEIGHTS[0],
            waypoints: 10,
            scale: 1.0,
        }
    }

    /// A whole number, both ends included.
    pub(super) fn between(&mut self, low: usize, high: usize) -> usize {
        low + self.random.below(high - low + 1)
    }

    pub(super) fn chance(&mut self, share: f64) -> bool {
        self.random.unit() < share
    }

    pub(super) fn any_weights(&mut self) {
        self.weights = WEIGHTS[self.random.below(WEIGHTS.len())];
    }

    fn place(&mut self) -> [f64; 2] {
        [
            self.random.between(0.0, 1000.0),
            self.random.between(0.0, 1000.0),
        ]
    }

    /// Clear of start and target: smaller than requested where they are near, or not placed at all.
    pub(super) fn disc(&mut self, radius: f64, margin: f64) {
        let center = self.place();
        let room = [self.start, self.target]
            .map(|end| libm::hypot(end[0] - center[0], end[1] - center[1]) - CLEAR);
        let radius = radius.min(room[0]).min(room[1]);
        if radius > 1.0 {
            self.threats.push(Threat {
                center,
                radius,
                margin,
                corners: Vec::new(),
                base: None,
                top: None,
            });
        }
    }

    /// As a disc, or not placed where another threat is nearer than `gap`.
    pub(super) fn disc_apart(&mut self, radius: f64, margin: f64, gap: f64) {
        let before = self.threats.len();
        self.disc(radius, margin);
        let is_near = |one: &Threat, other: &Threat| {
            let [x, y] = [0, 1].map(|axis| one.center[axis] - other.center[axis]);
            libm::hypot(x, y) < one.radius + other.radius + gap
        };
        let (others, last) = self.threats.split_at(before);
        if last
            .iter()
            .any(|last| others.iter().any(|other| is_near(last, other)))
        {
            self.threats.truncate(before);
        }
    }

    /// A star, its corners at growing bearings; as a disc clear of start and target.
    pub(super) fn polygon(&mut self) {
        let (radius, margin) = (
            self.random.between(40.0, 140.0),
            self.random.between(0.0, 40.0),
        );
        let (count, first) = (self.between(3, 9), self.random.unit());
        let before = self.threats.len();
        self.disc(radius, margin);
        let Some(threat) = self.threats.get_mut(before) else {
            return;
        };
        for idx in 0..count {
            let turns = (idx as f64 + first + self.random.between(0.0, 0.6)) / count as f64;
            let distance = threat.radius * self.random.between(0.5, 1.0);
            threat.corners.push([turns, distance]);
        }
    }

    /// Airspace: many corners along waves round its middle; as a disc clear of start and target.
    pub(super) fn outline(&mut self) {
        let (radius, margin) = (
            self.random.between(40.0, 180.0),
            self.random.between(0.0, 40.0),
        );
        let count = self.between(40, 400);
        let most = self.random.between(0.0, 0.5);
        let waves: Vec<[f64; 3]> = (2..10)
            .map(f64::from)
            .map(|wave| {
                [
                    wave,
                    self.random.between(0.0, most) / wave,
                    self.random.unit(),
                ]
            })
            .collect();
        let before = self.threats.len();
        self.disc(radius, margin);
        let Some(threat) = self.threats.get_mut(before) else {
            return;
        };
        let farthest = 1.0 + waves.iter().map(|[_, height, _]| height).sum::<f64>();
        for idx in 0..count {
            let turns = idx as f64 / count as f64;
            let up = |[wave, height, phase]: &[f64; 3]| {
                height * libm::cos(std::f64::consts::TAU * (wave * turns + phase))
            };
            let away = 1.0 + waves.iter().map(up).sum::<f64>();
            threat
                .corners
                .push([turns, threat.radius * away / farthest]);
        }
    }

    /// Make most of the threats placed last passable above or below, most of these above.
    pub(super) fn open_above_or_below(&mut self) {
        let (top, base) = (
            self.random.between(0.2, 0.9) * self.band[1],
            self.random.between(0.3, 0.9) * self.band[1],
        );
        let kind = self.random.unit();
        if let Some(threat) = self.threats.last_mut() {
            if kind < 0.55 {
                threat.top = Some(top);
            } else if kind < 0.75 {
                threat.base = Some(base);
            }
        }
    }

    pub(super) fn raise_peaks(&mut self) {
        self.band = [60.0, 260.0];
        for _ in 0..self.between(3, 12) {
            let peak = Peak {
                center: self.place(),
                height: self.random.between(80.0, 320.0),
                spread: [
                    self.random.between(50.0, 150.0),
                    self.random.between(50.0, 150.0),
                ],
            };
            self.peaks.push(peak);
        }
    }

    fn ground(&self, at: [f64; 2]) -> f64 {
        let height = |peak: &Peak| {
            let [x, y] = [0, 1].map(|axis| (at[axis] - peak.center[axis]) / peak.spread[axis]);
            peak.height * libm::exp(-x * x - y * y)
        };
        self.peaks.iter().map(height).sum()
    }

    pub(super) fn document(&self, name: &str) -> Value {
        let scale = self.scale;
        let point = |at: [f64; 2]| json!({"x": at[0] * scale, "y": at[1] * scale});
        let end = |at: [f64; 2], height: f64| {
            let z = (self.ground(at) + height) * scale;
            json!({"x": at[0] * scale, "y": at[1] * scale, "z": z})
        };
        let peak = |peak: &Peak| {
            json!({
                "center": point(peak.center), "height": peak.height * scale, "spread": point(peak.spread),
            })
        };
        let mut vehicle = json!({"max_turn_deg": self.turn_deg, "max_climb_deg": self.climb_deg});
        if let Some(min_leg) = self.min_leg {
            vehicle["min_leg"] = (min_leg * scale).into();
        }
        let peaks: Vec<Value> = self.peaks.iter().map(peak).collect();
        let terrain = if peaks.is_empty() {
            json!({"kind": "flat"})
        } else {
            json!({"kind": "peaks", "base": 0, "peaks": peaks})
        };
        let threats: Vec<Value> = self
            .threats
            .iter()
            .map(|threat| threat.document(scale))
            .collect();
        json!({
            "name": name,
            "start": end(self.start, self.heights[0]),
            "target": end(self.target, self.heights[1]),
            "area": {"min": point([0.0, 0.0]), "max": point([1000.0, 1000.0])},
            "threats": threats,
            "terrain": terrain,
            "altitude": {"min": self.band[0] * scale, "max": self.band[1] * scale},
            "vehicle": vehicle,
            "weights": {"fuel": self.weights[0], "threat": self.weights[1], "altitude": self.weights[2]},
            "planner": {"waypoints": self.waypoints, "seed": 1},
        })
    }
}

impl Threat {
    fn document(&self, scale: f64) -> Value {
        let height = |height: Option<f64>| height.map(|height| height * scale);
        let at = |x: f64, y: f64| json!({"x": x * scale, "y": y * scale});
        let mut document = if self.corners.is_empty() {
            json!({
                "kind": "cylinder",
                "center": at(self.center[0], self.center[1]),
                "radius": self.radius * scale,
                "influence": (self.radius + self.margin) * scale,
            })
        } else {
            let corner = |&[turns, distance]: &[f64; 2]| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * turns);
                at(
                    self.center[0] + distance * cos,
                    self.center[1] + distance * sin,
                )
            };
            let vertices: Vec<Value> = self.corners.iter().map(corner).collect();
            json!({"kind": "polygon", "vertices": vertices, "margin": self.margin * scale})
        };
        document["base"] = height(self.base).into();
        document["top"] = height(self.top).into();
        document
    }
}
