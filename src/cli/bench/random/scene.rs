//! Scenarios drawn at random, by families: each family asks another thing of the planner.

use serde_json::{Value, json};

use crate::optimizer::Random;

/// A kind of scenario.
pub(super) struct Family {
    pub(super) name: &'static str,
    /// What its scenarios have.
    pub(super) about: &'static str,
    draw: fn(&mut Scene),
}

/// All kinds.
pub(super) const FAMILIES: [Family; 10] = [
    Family {
        name: "discs",
        about: "3 to 12 discs with soft zones, weights and vehicle of the paper",
        draw: discs,
    },
    Family {
        name: "crowd",
        about: "20 to 60 discs, soft zones of 5 to 100 m, any weights",
        draw: crowd,
    },
    Family {
        name: "minefield",
        about: "40 to 80 discs that let something through between any two, in gaps of 3 m and more",
        draw: minefield,
    },
    Family {
        name: "passable",
        about: "1 to 20 discs, most with a base or a top within the band",
        draw: passable,
    },
    Family {
        name: "polygons",
        about: "1 to 8 polygons of 3 to 9 corners, and discs",
        draw: polygons,
    },
    Family {
        name: "takeoff",
        about: "discs and polygons, from the ground to the ground, below a band that begins at 20 to 120 m",
        draw: takeoff,
    },
    Family {
        name: "agility",
        about: "discs for a vehicle that turns by 12 to 45 degrees and climbs by 8 to 30, in legs no shorter than it likes",
        draw: agility,
    },
    Family {
        name: "zones",
        about: "wide soft zones, often over start and target, that may be worth crossing",
        draw: zones,
    },
    Family {
        name: "peaks",
        about: "3 to 12 peaks, and up to 6 discs",
        draw: peaks,
    },
    Family {
        name: "mixed",
        about: "all of these at once, on 50 m to 20 km, with 1 to 60 waypoints",
        draw: mixed,
    },
];

impl Family {
    /// The scenario document of `seed`, its planner as it is by default but for waypoints and seed.
    pub(super) fn scenario(&self, seed: u64) -> Value {
        let mut scene = Scene::new(Random::new(seed));
        (self.draw)(&mut scene);
        scene.document(&format!("{}-{seed}", self.name))
    }
}

/// A scenario in the making; lengths as in one whose area is a square kilometre, until it is scaled.
struct Scene {
    random: Random,
    start: [f64; 2],
    target: [f64; 2],
    /// Heights above the ground of start and target.
    heights: [f64; 2],
    threats: Vec<Threat>,
    peaks: Vec<Peak>,
    band: [f64; 2],
    turn_deg: f64,
    climb_deg: f64,
    min_leg: Option<f64>,
    weights: [f64; 3],
    waypoints: usize,
    scale: f64,
}

struct Threat {
    center: [f64; 2],
    /// Of the circle about it.
    radius: f64,
    margin: f64,
    /// Bearings and distances of a polygon's corners; none of a disc.
    corners: Vec<[f64; 2]>,
    base: Option<f64>,
    top: Option<f64>,
}

struct Peak {
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

/// Hard parts of threats are so far from start and target.
const CLEAR: f64 = 6.0;

fn discs(scene: &mut Scene) {
    for _ in 0..scene.between(3, 12) {
        let radius = scene.random.between(30.0, 90.0);
        scene.disc(radius, 30.0);
    }
}

fn crowd(scene: &mut Scene) {
    scene.any_weights();
    scene.waypoints = scene.between(3, 60);
    let margin = scene.random.between(5.0, 100.0);
    for _ in 0..scene.between(20, 60) {
        let radius = scene.random.between(15.0, 55.0);
        scene.disc(radius, margin);
    }
}

fn minefield(scene: &mut Scene) {
    scene.waypoints = scene.between(6, 40);
    let (gap, margin) = (
        scene.random.between(3.0, 20.0),
        scene.random.between(10.0, 45.0),
    );
    let count = scene.between(40, 80);
    // So many fit in by far; where one does not, another is drawn.
    for _ in 0..100 * count {
        if scene.threats.len() == count {
            break;
        }
        let radius = scene.random.between(15.0, 45.0);
        let before = scene.threats.len();
        scene.disc(radius, margin);
        let is_free = |one: &Threat, other: &Threat| {
            let [x, y] = [0, 1].map(|axis| one.center[axis] - other.center[axis]);
            libm::hypot(x, y) >= one.radius + other.radius + gap
        };
        let (others, last) = scene.threats.split_at(before);
        if last
            .iter()
            .any(|last| !others.iter().all(|other| is_free(last, other)))
        {
            scene.threats.pop();
        }
    }
}

fn passable(scene: &mut Scene) {
    scene.any_weights();
    scene.waypoints = scene.between(5, 30);
    for _ in 0..scene.between(1, 20) {
        let radius = scene.random.between(30.0, 120.0);
        let margin = scene.random.between(0.0, 40.0);
        scene.disc(radius, margin);
        scene.open_above_or_below();
    }
}

fn polygons(scene: &mut Scene) {
    scene.any_weights();
    scene.waypoints = scene.between(3, 30);
    for _ in 0..scene.between(1, 8) {
        scene.polygon();
    }
    for _ in 0..scene.between(0, 6) {
        let radius = scene.random.between(20.0, 60.0);
        scene.disc(radius, 20.0);
    }
}

fn takeoff(scene: &mut Scene) {
    polygons(scene);
    let (lowest, height) = (
        scene.random.between(20.0, 120.0),
        scene.random.between(60.0, 200.0),
    );
    scene.band = [lowest, lowest + height];
    scene.heights = [0.0; 2];
    scene.climb_deg = scene.random.between(25.0, 50.0);
}

fn agility(scene: &mut Scene) {
    discs(scene);
    scene.waypoints = scene.between(3, 20);
    scene.turn_deg = scene.random.between(12.0, 45.0);
    scene.climb_deg = scene.random.between(8.0, 30.0);
    scene.min_leg = Some(scene.random.between(5.0, 40.0));
}

fn zones(scene: &mut Scene) {
    scene.any_weights();
    scene.waypoints = scene.between(4, 30);
    for _ in 0..scene.between(3, 14) {
        let (radius, margin) = (
            scene.random.between(10.0, 60.0),
            scene.random.between(60.0, 250.0),
        );
        scene.disc(radius, margin);
    }
}

fn peaks(scene: &mut Scene) {
    scene.waypoints = scene.between(3, 30);
    scene.raise_peaks();
    for _ in 0..scene.between(0, 6) {
        let radius = scene.random.between(25.0, 60.0);
        scene.disc(radius, 30.0);
    }
}

fn mixed(scene: &mut Scene) {
    scene.any_weights();
    scene.waypoints = scene.between(1, 60);
    scene.scale = libm::pow(10.0, scene.random.between(-1.3, 1.3));
    scene.turn_deg = scene.random.between(25.0, 120.0);
    scene.climb_deg = scene.random.between(12.0, 60.0);
    if scene.chance(0.4) {
        scene.raise_peaks();
    }
    for _ in 0..scene.between(0, 25) {
        if scene.chance(0.25) {
            scene.polygon();
        } else {
            let (radius, margin) = (
                scene.random.between(15.0, 80.0),
                scene.random.between(0.0, 90.0),
            );
            scene.disc(radius, margin);
        }
        if scene.chance(0.3) {
            scene.open_above_or_below();
        }
    }
}

impl Scene {
    fn new(mut random: Random) -> Self {
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
    fn between(&mut self, low: usize, high: usize) -> usize {
        low + self.random.below(high - low + 1)
    }

    fn chance(&mut self, share: f64) -> bool {
        self.random.unit() < share
    }

    fn any_weights(&mut self) {
        self.weights = WEIGHTS[self.random.below(WEIGHTS.len())];
    }

    fn place(&mut self) -> [f64; 2] {
        [
            self.random.between(0.0, 1000.0),
            self.random.between(0.0, 1000.0),
        ]
    }

    /// Clear of start and target: smaller than asked for where they are near, or nowhere at all.
    fn disc(&mut self, radius: f64, margin: f64) {
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

    /// A star, its corners at growing bearings; as a disc clear of start and target.
    fn polygon(&mut self) {
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

    /// Most threats that were placed last can be passed above or below, most of these above.
    fn open_above_or_below(&mut self) {
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

    fn raise_peaks(&mut self) {
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

    fn document(&self, name: &str) -> Value {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::case::Case;

    /// Whatever the seed, a document that the reader takes; and the same one each time.
    #[test]
    fn every_scenario_is_valid_and_its_seeds_own() {
        for family in &FAMILIES {
            let documents: Vec<Value> = (1..=60).map(|seed| family.scenario(seed)).collect();
            for (document, seed) in documents.iter().zip(1..) {
                let case = Case::drawn(document.clone());
                case.as_it_is().unwrap_or_else(|error| panic!("{error:#}"));
                assert_eq!(document, &family.scenario(seed));
            }
            assert_ne!(documents[0]["start"], documents[1]["start"]);
        }
    }
}
