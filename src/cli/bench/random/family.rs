//! Families of scenarios drawn at random: each challenges the planner in a different way.

use serde_json::Value;

use super::scene::Scene;
use crate::optimizer::Random;

/// A kind of scenario.
pub(super) struct Family {
    pub(super) name: &'static str,
    /// What its scenarios have.
    pub(super) about: &'static str,
    draw: fn(&mut Scene),
}

/// All kinds.
pub(super) const FAMILIES: [Family; 13] = [
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
        name: "gaps",
        about: "6 to 15 discs, up to 40 m apart, soft zones of 20 to 40 m that overlap in the gaps",
        draw: gaps,
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
        name: "valleys",
        about: "6 to 30 such discs among 3 to 12 peaks",
        draw: valleys,
    },
    Family {
        name: "airspace",
        about: "1 to 6 outlines of 40 to 400 corners, some with a base or a top, and discs",
        draw: airspace,
    },
    Family {
        name: "mixed",
        about: "all of these at once, on 50 m to 20 km, with 1 to 60 waypoints",
        draw: mixed,
    },
];

impl Family {
    /// The scenario document of `seed`, with the default planner except for waypoints and seed.
    pub(super) fn scenario(&self, seed: u64) -> Value {
        let mut scene = Scene::new(Random::new(seed));
        (self.draw)(&mut scene);
        scene.document(&format!("{}-{seed}", self.name))
    }
}

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
    fill(scene, count, |scene| {
        let radius = scene.random.between(15.0, 45.0);
        scene.disc_apart(radius, margin, gap);
    });
}

fn gaps(scene: &mut Scene) {
    scene.waypoints = scene.between(5, 40);
    let count = scene.between(6, 15);
    near_to_each_other(scene, count);
}

/// Discs with gaps between them in which their soft zones overlap.
fn near_to_each_other(scene: &mut Scene, count: usize) {
    fill(scene, count, |scene| {
        let [radius, margin, gap] = [(25.0, 80.0), (20.0, 40.0), (0.0, 40.0)]
            .map(|(low, high)| scene.random.between(low, high));
        scene.disc_apart(radius, margin, gap);
    });
}

/// Draw until there are `count` threats: they easily fit, but not every one drawn does.
fn fill(scene: &mut Scene, count: usize, draw: impl Fn(&mut Scene)) {
    for _ in 0..100 * count {
        if scene.threats.len() == count {
            break;
        }
        draw(scene);
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

fn valleys(scene: &mut Scene) {
    scene.waypoints = scene.between(5, 40);
    scene.raise_peaks();
    let count = scene.between(6, 30);
    near_to_each_other(scene, count);
}

fn airspace(scene: &mut Scene) {
    scene.any_weights();
    scene.waypoints = scene.between(5, 30);
    for _ in 0..scene.between(1, 6) {
        scene.outline();
        if scene.chance(0.3) {
            scene.open_above_or_below();
        }
    }
    for _ in 0..scene.between(0, 6) {
        let radius = scene.random.between(20.0, 60.0);
        scene.disc(radius, 20.0);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::case::Case;

    /// For every seed the reader accepts the document, and it is the same each time.
    #[test]
    fn every_scenario_is_valid_and_reproducible_from_its_seed() {
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
