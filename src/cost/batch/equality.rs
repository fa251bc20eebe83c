//! Lanes agree with the scalar code for any scenario and routes, and give the same bits on any processor and
//! beside any neighbouring lanes.

use proptest::prelude::*;
use pulp::Arch;

use super::{LANES, PointRow, Price, Pricer};
use crate::cost::{Constraint, Model};
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::geometry::{Point2, Point3, Rect};
use crate::scenario::json::{self, AlgorithmRule, Rules};
use crate::scenario::limits::Limits;
use crate::scenario::{Quadrature, Scenario};
use crate::terrain::dem::{Crs, Lattice, Raster};
use crate::terrain::{Dem, Flat, Grid, Peak, Peaks, Terrain};
use crate::threat::{Cylinder, Polygon, Shape, Threat};

/// Successive choices drawn by a proptest case.
struct Choices(std::vec::IntoIter<f64>);

impl Choices {
    fn share(&mut self) -> f64 {
        self.0.next().expect("there are enough choices")
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.share() * (high - low)
    }

    fn one_in(&mut self, count: f64) -> bool {
        self.share() * count < 1.0
    }

    fn place(&mut self) -> Point2 {
        Point2::new(self.between(-50.0, 1050.0), self.between(-50.0, 1050.0))
    }

    fn terrain(&mut self) -> Terrain {
        let kind = self.share();
        if kind < 0.3 {
            return Terrain::Flat(Flat {
                elevation: self.between(-10.0, 10.0),
            });
        }
        if kind < 0.7 {
            let peaks = (0..6).map(|_| {
                // Some of them needles, ridges and table mountains.
                let narrow = if self.one_in(6.0) { 1.0 } else { 20.0 };
                let wide = if self.one_in(6.0) { 5000.0 } else { 150.0 };
                Peak {
                    center: self.place(),
                    height: self.between(-60.0, 250.0),
                    spread: Point2::new(self.between(narrow, wide), self.between(narrow, wide)),
                }
            });
            return Terrain::Peaks(Peaks {
                peaks: peaks.collect(),
                base: 5.0,
            });
        }
        if kind > 0.85 {
            return self.file();
        }
        let elevations = (0..144).map(|_| self.between(0.0, 80.0));
        Terrain::Grid(Grid {
            elevations: elevations.collect(),
            origin: Point2::new(0.0, 0.0),
            cell: 1000.0 / 11.0,
            columns: 12,
            rows: 12,
        })
    }

    /// An elevation raster that is not parallel to the scenario's axes.
    fn file(&mut self) -> Terrain {
        let corner = LatLon {
            lat: self.between(-70.0, 70.0),
            lon: 8.0,
        };
        let plane = TangentPlane::at(corner, 0.0);
        let [across, along] = [0, 1].map(|_| self.between(30.0, 150.0));
        let metre = 1.0 / 111_000.0;
        let step = [
            across * metre / libm::cos(corner.lat.to_radians()),
            -along * metre,
        ];
        // Enough of the shortest cells to span the routes.
        let [columns, rows] = [44; 2];
        let raster = Raster {
            lattice: Lattice {
                crs: Crs::wgs84(),
                columns,
                rows,
                first: [
                    corner.lon - step[0] * (100.0 / across),
                    corner.lat - step[1] * (1100.0 / along),
                ],
                step,
            },
            offset: [0, 0],
            elevations: (0..columns * rows)
                .map(|idx| ((idx * idx * 37) % 83) as f32)
                .collect(),
        };
        let area = Rect {
            min: Point2::new(0.0, 0.0),
            max: Point2::new(1000.0, 1000.0),
        };
        let dem = Dem::new(raster, &plane, area, 20.0).expect("the raster is wider than the area");
        Terrain::Dem(dem.into())
    }

    fn threat(&mut self, small: bool) -> Threat {
        let center = self.place();
        let size = if small { 0.2 } else { 1.0 };
        let shape = if self.one_in(4.0) {
            let corner = |angle: f64, away: f64| {
                center + nalgebra::Vector2::new(libm::cos(angle), libm::sin(angle)) * away
            };
            // Some are convex, some have bays narrower or wider than their soft zones.
            let count = 3.0 + (9.0 * self.share()).floor();
            let least = if self.one_in(3.0) { 85.0 } else { 20.0 };
            let step = std::f64::consts::TAU / count;
            let angles = (0..12).map(f64::from).take_while(|idx| *idx < count);
            let corners = angles.map(|idx| corner(step * idx, size * self.between(least, 90.0)));
            Shape::Polygon(Polygon::new(
                corners.collect(),
                size * self.between(0.0, 40.0),
            ))
        } else {
            let radius = size * self.between(5.0, 80.0);
            Shape::Cylinder(Cylinder {
                center,
                radius,
                influence: radius + size * self.between(0.0, 50.0),
            })
        };
        let limit =
            |choices: &mut Self, low, high| choices.one_in(3.0).then(|| choices.between(low, high));
        Threat {
            name: None,
            shape,
            base: limit(self, 0.0, 80.0),
            top: limit(self, 90.0, 200.0),
        }
    }

    /// The reader supplies the parts that do not matter here; the rest is random.
    fn scenario(&mut self) -> Scenario {
        let algorithm = AlgorithmRule {
            name: "any",
            parameters: Vec::new(),
        };
        let rules = Rules::new(Limits::default(), vec![algorithm]);
        let document =
            br#"{"frame":"local","start":{"x":0,"y":0,"z":0},"target":{"x":9,"y":0,"z":0},
            "altitude":{"min":0,"max":9},"area":{"min":{"x":0,"y":0},"max":{"x":1000,"y":1000}},"planner":{"algorithm":"any"}}"#;
        let mut scenario = json::read(document, &rules, 1).expect("the document has no fault");
        scenario.terrain = self.terrain();
        // So few that each is examined, and in one word of a set, in two, and in more.
        let many = self.one_in(3.0);
        let count = match (many, self.one_in(2.0), self.one_in(2.0)) {
            (false, true, _) => 5,
            (false, false, _) => 8,
            (true, true, true) => 40,
            (true, true, false) => 90,
            (true, false, _) => 180,
        };
        let threats = (0..count).map(|_| self.threat(many));
        scenario.threats = threats.collect();
        scenario.altitude.min = if self.one_in(3.0) {
            0.0
        } else {
            self.between(0.0, 60.0)
        };
        scenario.altitude.max = scenario.altitude.min + self.between(40.0, 250.0);
        scenario.vehicle.max_turn_deg = if self.one_in(6.0) {
            180.0
        } else {
            self.between(5.0, 120.0)
        };
        scenario.vehicle.max_climb_deg = self.between(5.0, 70.0);
        scenario.vehicle.min_leg = self.between(0.0, 30.0);
        scenario.area = Rect {
            min: Point2::new(0.0, 0.0),
            max: Point2::new(1000.0, 1000.0),
        };
        if self.one_in(2.0) {
            scenario.planner.quadrature = Quadrature::Paper;
        }
        let end = |choices: &mut Self, scenario: &Scenario| {
            let place = Point2::new(choices.between(0.0, 1000.0), choices.between(0.0, 1000.0));
            let height = if choices.one_in(2.0) {
                0.0
            } else {
                choices.between(0.0, 300.0)
            };
            place
                .coords
                .push(scenario.terrain.elevation(place) + height)
                .into()
        };
        scenario.start = end(self, &scenario);
        scenario.target = end(self, &scenario);
        scenario
    }

    /// From start to target, mostly along plausible ways.
    fn route(&mut self, scenario: &Scenario) -> Vec<Point3> {
        let spread =
            [1.0, 30.0, 300.0][usize::from(self.one_in(2.0)) + usize::from(self.one_in(2.0))];
        let mut route = vec![scenario.start];
        for idx in 1..=6 {
            let way = scenario.target - scenario.start;
            let before = route[idx - 1];
            let place = scenario.start + way * (idx as f64 / 7.0);
            let shift = [self.between(-spread, spread), self.between(-spread, spread)];
            let mut point = Point3::new(place.x + shift[0], place.y + shift[1], 0.0);
            let band = scenario.altitude;
            point.z = scenario.terrain.elevation(point.xy()) + self.between(band.min, band.max);
            if self.one_in(12.0) {
                // Straight up, a tiny step, or almost none. For steps in between, both codes lose digits: the
                // distance past an axis is then a small difference of large numbers.
                point = before;
                point.z += [20.0, 0.0][usize::from(self.one_in(2.0))];
                point.x += [0.01, 1e-10][usize::from(self.one_in(3.0))];
            }
            if self.one_in(20.0) {
                point.z += self.between(-200.0, 200.0);
            }
            route.push(point);
        }
        route.push(scenario.target);
        route
    }
}

fn rows(routes: &[Vec<Point3>]) -> Vec<PointRow> {
    let row = |idx: usize| {
        let mut row = PointRow::splat(routes[0][idx]);
        for (lane, route) in routes.iter().enumerate() {
            row.set(lane, route[idx]);
        }
        row
    };
    (0..routes[0].len()).map(row).collect()
}

fn bits(price: &Price) -> [[u64; LANES]; 2] {
    [
        price.violation.map(f64::to_bits),
        price.cost.map(f64::to_bits),
    ]
}

/// A SIMD width between one number and the processor's widest, if there is one.
fn narrower() -> Arch {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return Arch::V3(simd);
    }
    Arch::Scalar
}

fn close(value: f64, expected: f64) -> bool {
    (value - expected).abs() <= 1e-9 * expected.max(1.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 2, ..ProptestConfig::default() })]

    #[test]
    fn lanes_agree_with_the_scalar_code(
        choices in prop::collection::vec(0.0..1.0f64, 5000),
    ) {
        let mut choices = Choices(choices.into_iter());
        let scenario = choices.scenario();
        let model = Model::new(&scenario);
        let quadrature = scenario.planner.quadrature;
        let tolerance = model.tolerance.scaled(0.5);
        let pricer = Pricer::new(&model, quadrature, tolerance);
        let verdicts = pricer.clone().verdicts();
        let scalar = Pricer { arch: Arch::Scalar, ..pricer.clone() };
        let narrow = Pricer { arch: narrower(), ..pricer.clone() };
        let routes: Vec<_> = (0..LANES).map(|_| choices.route(&scenario)).collect();
        let points = rows(&routes);
        let together = pricer.routes(&points);
        prop_assert_eq!(bits(&together), bits(&scalar.routes(&points)));
        prop_assert_eq!(bits(&together), bits(&narrow.routes(&points)));
        let mut ground = Vec::new();
        pricer.ground(&points[1..points.len() - 1], &mut ground);
        let mut proven = Vec::new();
        let at_best = pricer.routes_at_best(&points, &ground, LANES, &mut proven);
        prop_assert_eq!(at_best.cost.map(f64::to_bits), together.cost.map(f64::to_bits));
        let least = pricer.least_costs(&points, &ground);
        prop_assert_eq!(least.map(f64::to_bits), scalar.least_costs(&points, &ground).map(f64::to_bits));
        let first = pricer.first_routes(&points, 3);
        for lane in 0..LANES {
            prop_assert!(at_best.violation[lane] <= together.violation[lane]);
            prop_assert!(least[lane] <= together.cost[lane]);
            prop_assert!(lane >= 3 || bits(&first).map(|row| row[lane]) == bits(&together).map(|row| row[lane]));
        }
        for (lane, route) in routes.iter().enumerate() {
            let mut violation = 0.0;
            let mut by_leg = vec![(0.0, 0.0); route.len() - 1];
            let mut enters = vec![false; route.len() - 1];
            let figures = model.assess(route, quadrature, tolerance, |breach| {
                violation += breach.amount;
                if !matches!(breach.constraint, Constraint::Turn | Constraint::Area) {
                    by_leg[breach.index].0 += breach.amount;
                }
                if breach.constraint == Constraint::Threat {
                    enters[breach.index] = true;
                }
            });
            prop_assert!(close(together.violation[lane], violation), "{} {violation}", together.violation[lane]);
            prop_assert!(close(together.cost[lane], figures.total), "{} {figures:?}", together.cost[lane]);
            prop_assert!(close(least[lane], figures.fuel + figures.altitude), "{} {figures:?}", least[lane]);
            // Neighbouring lanes have no influence.
            let alone = pricer.routes(&rows(&vec![route.clone(); LANES]));
            prop_assert_eq!(bits(&alone).map(|row| row[0]), bits(&together).map(|row| row[lane]));
            for (leg_idx, ends) in route.windows(2).enumerate() {
                by_leg[leg_idx].1 = model.figures(ends, quadrature).total;
            }
            let mut prices = vec![Price::ZERO; by_leg.len()];
            pricer.legs(&points[..route.len() - 1], &points[1..], &mut prices);
            for (price, (violation, cost)) in prices.iter().zip(&by_leg) {
                prop_assert!(close(price.violation[lane], *violation), "{} {violation}", price.violation[lane]);
                prop_assert!(close(price.cost[lane], *cost), "{} {cost}", price.cost[lane]);
            }
            let [mut at_best, mut heights] = [0, 1].map(|_| vec![Price::ZERO; by_leg.len()]);
            pricer.legs_at_best(&points[..route.len() - 1], &points[1..], &mut at_best);
            let (from, to) = (&points[..route.len() - 1], &points[1..]);
            pricer.heights_of_legs(from, to, usize::MAX, &mut heights);
            for (heights, proven) in heights.iter().zip(&proven) {
                prop_assert!(proven[lane] <= 0.0 || heights.violation[lane] <= 0.0);
            }
            for ((price, at_best), heights) in prices.iter().zip(&at_best).zip(&heights) {
                let both = at_best.violation[lane] + heights.violation[lane];
                prop_assert!(close(both, price.violation[lane]), "{both} {}", price.violation[lane]);
                prop_assert!(at_best.violation[lane] <= price.violation[lane]);
                prop_assert_eq!(at_best.cost[lane].to_bits(), price.cost[lane].to_bits());
            }
            let mut found = vec![Price::ZERO; prices.len()];
            verdicts.legs(&points[..route.len() - 1], &points[1..], &mut found);
            for ((verdict, price), enters) in found.iter().zip(&prices).zip(enters) {
                prop_assert_eq!(verdict.violation[lane] > 0.0, price.violation[lane] > 0.0);
                prop_assert!(verdict.violation[lane] <= price.violation[lane] + 1e-3);
                if enters {
                    prop_assert!(verdict.cost[lane] <= price.cost[lane]);
                } else {
                    prop_assert_eq!(verdict.cost[lane].to_bits(), price.cost[lane].to_bits());
                }
            }
        }
    }
}
