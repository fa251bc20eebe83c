//! Scenarios and routes that the planner's tests start from.

use crate::geometry::{Point2, Point3, Rect};
use crate::scenario::{AltitudeBand, Frame, PlannerSettings, Scenario, Seeding, Vehicle, Weights};
use crate::terrain::{Flat, Peak, Peaks, Terrain};
use crate::threat::{Cylinder, Polygon, Shape, Threat};

/// Mountains, each given as centre x and y, height, width and depth.
pub(in crate::planner) fn peaks(base: f64, peaks: &[[f64; 5]]) -> Terrain {
    let peak = |&[x, y, height, wide, deep]: &[f64; 5]| Peak {
        center: Point2::new(x, y),
        height,
        spread: Point2::new(wide, deep),
    };
    let peaks = peaks.iter().map(peak).collect();
    Terrain::Peaks(Peaks { base, peaks })
}

/// The same scenario among hills, with a band of 30 to 150 m above ground.
pub(in crate::planner) fn hilly_scenario() -> Scenario {
    let mut scenario = scenario();
    let round = |x, y, height, spread| [x, y, height, spread, 0.8 * spread];
    let hills = [
        round(420.0, 360.0, 180.0, 90.0),
        round(600.0, 500.0, 240.0, 110.0),
        round(300.0, 600.0, 150.0, 70.0),
        round(520.0, 690.0, -60.0, 60.0),
    ];
    scenario.terrain = peaks(-20.0, &hills);
    scenario.altitude = AltitudeBand {
        min: 30.0,
        max: 150.0,
    };
    scenario
}

/// From the top of a mountain that is too steep to fly straight down to the plain, or up.
pub(in crate::planner) fn mountain(height: f64, is_down: bool) -> Scenario {
    let mut scenario = scenario();
    scenario.threats.clear();
    scenario.terrain = peaks(0.0, &[[300.0, 500.0, height, 150.0, 150.0]]);
    scenario.altitude = AltitudeBand {
        min: 30.0,
        max: 120.0,
    };
    scenario.vehicle.max_climb_deg = 20.0;
    scenario.planner.waypoints = 16;
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    let on_ground = |x, y| Point3::new(x, y, scenario.terrain.elevation(Point2::new(x, y)));
    let ends = [on_ground(300.0, 500.0), on_ground(900.0, 600.0)];
    [scenario.start, scenario.target] = if is_down { ends } else { [ends[1], ends[0]] };
    scenario
}

/// From the top of the first of these mountains down to `height` beyond all of them, without threats, planned with
/// sixteen waypoints and few bats.
pub(in crate::planner) fn descent(mountains: &[[f64; 5]], height: f64) -> Scenario {
    let mut scenario = scenario();
    let [x, y, top, ..] = mountains[0];
    scenario.threats.clear();
    scenario.terrain = peaks(0.0, mountains);
    scenario.start = Point3::new(x, y, top);
    scenario.target = Point3::new(900.0, y, height);
    scenario.area.max.x = 1100.0;
    scenario.altitude = AltitudeBand {
        min: 20.0,
        max: 120.0,
    };
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    scenario.planner.waypoints = 16;
    (scenario.planner.population, scenario.planner.iterations) = (30, 30);
    scenario
}

/// A disc with a soft zone of 30 m.
pub(in crate::planner) fn radar(x: f64, y: f64, radius: f64) -> Threat {
    disc([x, y, radius, radius + 30.0])
}

/// A disc given as centre x and y, radius and influence.
pub(in crate::planner) fn disc([x, y, radius, influence]: [f64; 4]) -> Threat {
    Threat {
        name: Some(format!("radar at {x}, {y}")),
        shape: Shape::Cylinder(Cylinder {
            center: Point2::new(x, y),
            radius,
            influence,
        }),
        base: None,
        top: None,
    }
}

/// A wall that reaches from one x to another, and from one y to another, at all heights.
pub(in crate::planner) fn wall(x: [f64; 2], y: [f64; 2]) -> Threat {
    soft_wall(x, y, 0.0)
}

/// The same with a soft zone.
pub(in crate::planner) fn soft_wall(
    [west, east]: [f64; 2],
    [south, north]: [f64; 2],
    margin: f64,
) -> Threat {
    let corners = [(west, south), (east, south), (east, north), (west, north)];
    outlined(corners.map(|(x, y)| Point2::new(x, y)).to_vec(), margin)
}

/// A threat with these corners and a soft zone of `margin`, at all heights.
pub(in crate::planner) fn outlined(corners: Vec<Point2>, margin: f64) -> Threat {
    Threat {
        name: None,
        shape: Shape::Polygon(Polygon::new(corners, margin)),
        base: None,
        top: None,
    }
}

/// Airspace with a soft zone of 30 m and this many corners: five lobes round x and y, some `radius` from there.
pub(in crate::planner) fn lobed([x, y, radius]: [f64; 3], corners: usize) -> Threat {
    let step = std::f64::consts::TAU / corners as f64;
    let corner = |idx: usize| {
        let (sin, cos) = libm::sincos(step * idx as f64);
        let away = radius * (1.0 + 0.2 * libm::sin(5.0 * step * idx as f64));
        Point2::new(x + away * cos, y + away * sin)
    };
    outlined((0..corners).map(corner).collect(), 30.0)
}

/// Let `scenario` be planned with all that helps, and few bats.
pub(in crate::planner) fn search_briefly(scenario: &mut Scenario) {
    let settings = &mut scenario.planner;
    settings.seeding = Seeding::Tangent;
    settings.polish = true;
    (settings.population, settings.iterations) = (30, 30);
}

/// Such a zone of two hundred corners between start and target, planned with few bats.
pub(in crate::planner) fn airspace() -> Scenario {
    let mut scenario = scenario();
    scenario.threats = vec![lobed([480.0, 450.0, 150.0], 200)];
    search_briefly(&mut scenario);
    scenario
}

/// The start of the scenario with three radars, the given free waypoints, and its target.
pub(in crate::planner) fn route(free: &[[f64; 3]]) -> Vec<Point3> {
    let scenario = scenario();
    let free = free.iter().map(|&point| Point3::from(point));
    std::iter::once(scenario.start)
        .chain(free)
        .chain([scenario.target])
        .collect()
}

/// Three radars on flat ground, as in the first scenario of the paper.
pub(in crate::planner) fn scenario() -> Scenario {
    Scenario {
        frame: Frame::Local,
        name: None,
        start: Point3::new(200.0, 100.0, 0.0),
        target: Point3::new(800.0, 800.0, 150.0),
        area: Rect {
            min: Point2::new(0.0, 0.0),
            max: Point2::new(1000.0, 1000.0),
        },
        threats: vec![
            radar(350.0, 250.0, 60.0),
            radar(500.0, 480.0, 70.0),
            radar(680.0, 620.0, 60.0),
        ],
        terrain: Terrain::Flat(Flat { elevation: 0.0 }),
        altitude: AltitudeBand {
            min: 0.0,
            max: 200.0,
        },
        vehicle: Vehicle {
            max_turn_deg: 60.0,
            max_climb_deg: 45.0,
            min_leg: 8.4,
            cruise_speed: 15.0,
            fuel_per_km: 1000.0,
        },
        weights: Weights {
            fuel: 0.5,
            threat: 1.0,
            altitude: 1.0,
        },
        planner: PlannerSettings {
            waypoints: 10,
            population: 60,
            iterations: 60,
            seed: 7,
            ..PlannerSettings::plain()
        },
    }
}

/// Walls across the area with gates at alternating ends, and few waypoints to get through them.
pub(in crate::planner) fn slalom() -> Scenario {
    let mut scenario = scenario();
    let at = |x| Point3::new(x, 500.0, 100.0);
    (scenario.start, scenario.target) = (at(50.0), at(950.0));
    scenario.threats = vec![
        wall([300.0, 310.0], [-100.0, 850.0]),
        wall([500.0, 510.0], [150.0, 1100.0]),
        wall([700.0, 710.0], [-100.0, 850.0]),
    ];
    scenario.vehicle.max_turn_deg = 70.0;
    scenario.planner.waypoints = 9;
    scenario.planner.seeding = Seeding::Tangent;
    scenario.planner.polish = true;
    scenario
}

/// Evenly spaced waypoints on the straight way.
pub(in crate::planner) fn straight(scenario: &Scenario) -> Vec<Point3> {
    let legs = scenario.planner.waypoints + 1;
    let way = scenario.target - scenario.start;
    (0..=legs)
        .map(|idx| scenario.start + way * (idx as f64 / legs as f64))
        .collect()
}
