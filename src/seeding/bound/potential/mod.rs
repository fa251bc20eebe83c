//! A lower bound for routes that must cross soft zones: a potential that nowhere rises faster than
//! what a metre costs. The argument is section 6 of docs/BOUND.md.

mod density;
mod first;
mod marching;
mod mesh;
mod region;

use super::super::outline::OutlineShape;
use super::super::taut::TautString;
use super::WORTHWHILE;
use super::event::ramp;
use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::{Point2, Rect, Vector2};
use density::Kind;
use marching::{EXEMPT, Potential};
use mesh::Mesh;
use region::{sums, widened, within};

/// Triangles of a mesh that is made finer, at most, but for those at the edge.
const MOST_TRIANGLES: usize = 16_000;

/// Triangles that are marched over in all before the mesh is no longer made finer.
const MOST_IN_ALL: usize = 80_000;

/// Times that the mesh is made finer, at most.
const MOST_LEVELS: usize = 6;

/// Share of what is proven by which a finer mesh must have proven more, for a yet finer one to be worth it.
const LEAST_GAIN: f64 = 0.02;

/// How many times what is missing a route may cost, by what is gained each time, that a finer mesh is to allow for.
const MARGIN: f64 = 3.0;

/// A string this many times as dear as what is known promises more, whatever is estimated.
const FAR: f64 = 1.5;

/// Share of the direct way by which a string may leave the area: a way within it is about as long.
const OUTSIDE: f64 = 0.01;

/// Points on a string at which soft zones are looked up.
const SAMPLES: u32 = 256;

/// Whether there are soft zones, at prices and between ends for which a potential can prove something.
pub(super) fn applies(walls: &[Wall], prices: &Prices) -> bool {
    prices.exposure > 0.0
        && prices.direct() > 1e5 * prices.tolerance
        && whole(walls).any(|wall| wall.influence > wall.core)
}

/// Those that reach over all heights.
fn whole(walls: &[Wall]) -> impl Iterator<Item = &Wall> {
    walls.iter().filter(|wall| wall.toll.is_none())
}

/// What no route undercuts at the prices of fuel and soft zones, seen from above, where it `applies`; 0 where that
/// is not expected to exceed `known`, which no route undercuts either. A string costs what is `promised`.
pub(super) fn bound(
    walls: &[Wall],
    prices: &Prices,
    area: &Rect,
    (known, promised): (f64, f64),
    stop: &dyn Fn() -> bool,
) -> f64 {
    let mut scene = Scene {
        walls: whole(walls).cloned().collect(),
        prices,
        area: area.grown(prices.tolerance),
        cap: f64::INFINITY,
    };
    let mesh = scene.first();
    let estimate = scene.estimate(mesh.clone());
    // The first mesh is too coarse for narrow gaps, through which an estimate leaks.
    let is_near = prices.climbing_at(estimate) < WORTHWHILE * known && promised < FAR * known;
    if is_near || stop() {
        return 0.0;
    }
    let proven = scene.refine(mesh, estimate, known, stop);
    // Nothing leads to the target.
    if proven.is_finite() { proven } else { 0.0 }
}

/// What a string costs seen from above, about; infinite where it leaves the area, of which strings know nothing.
pub(super) fn price(walls: &[Wall], prices: &Prices, area: &Rect, string: &TautString) -> f64 {
    let depth = |at: Point2| -> f64 {
        whole(walls)
            .map(|wall| (wall.influence - wall.distance(at)).max(0.0))
            .sum()
    };
    let middle = |part| string.at((f64::from(part) + 0.5) / f64::from(SAMPLES));
    let outside = OUTSIDE * prices.direct();
    if (0..SAMPLES).any(|part| area.excess(middle(part)) > outside) {
        return f64::INFINITY;
    }
    let depths: f64 = (0..SAMPLES).map(|part| depth(middle(part))).sum();
    string.length * (prices.fuel + prices.exposure * depths / f64::from(SAMPLES))
}

struct Scene<'a> {
    walls: Vec<Wall>,
    prices: &'a Prices,
    area: Rect,
    /// What a route costs at least that leaves the mesh.
    cap: f64,
}

/// A potential, with what it proves.
struct Marched {
    potential: Potential,
    /// What it may be too high near its end.
    lost: f64,
    /// What no route between the ends undercuts that stays within the mesh.
    across: f64,
}

impl Scene<'_> {
    /// What is proven by meshes that are made finer where routes that are cheap enough can lead.
    fn refine(
        &mut self,
        mut mesh: Mesh,
        estimate: f64,
        known: f64,
        stop: &dyn Fn() -> bool,
    ) -> f64 {
        let (mut proven, mut before, mut marched) = (0.0_f64, 0.0, 0);
        for level in 0..=MOST_LEVELS {
            density::price(&mut mesh, &self.walls, self.prices, Kind::Proven);
            let from_start = self.march(&mesh, 0);
            let here = from_start.across;
            proven = proven.max(here.min(self.cap));
            // What is missing halves each time, about.
            let gained = match level {
                0 => (1.3 * estimate - here).max(0.1 * here),
                // The first meshes are so coarse that a finer one may prove less.
                1 => (here - before).max(0.05 * here),
                _ => here - before,
            };
            before = here;
            marched += 2 * mesh.triangles().count();
            let promised = self.prices.climbing_at(here + 1.2 * gained);
            if level == MOST_LEVELS
                || marched > MOST_IN_ALL
                || here >= self.cap
                || gained < LEAST_GAIN * here
                || promised < known
                || stop()
            {
                break;
            }
            let sums = sums(&mesh, &from_start, &self.march(&mesh, 1), self.prices);
            let wanted = here + MARGIN * gained.max(0.05 * here);
            // The first mesh is small enough to be made finer as it is, unless the area is wide for the way.
            let room = if level == 0 {
                MOST_TRIANGLES / 3
            } else {
                MOST_TRIANGLES / 4
            };
            let allowed = wanted.clamp(within(&sums, MOST_TRIANGLES / 8), within(&sums, room));
            if allowed < (1.0 + LEAST_GAIN) * here {
                break;
            }
            let (kept, cap) = widened(&mesh, &sums, allowed);
            self.cap = self.cap.min(cap);
            let is_within = |middle, side| Mesh::is_within(&self.area, middle, side);
            let Some(finer) = mesh.finer(&kept, is_within) else {
                break;
            };
            mesh = finer;
        }
        proven
    }

    /// What the cheapest route costs, about.
    fn estimate(&self, mut mesh: Mesh) -> f64 {
        density::price(&mut mesh, &self.walls, self.prices, Kind::Estimated);
        let [start, target] = mesh.ends();
        let (potential, _) = Potential::first(&mesh, start, &|length| self.out(0, length));
        potential.values[target]
    }

    /// What leaving the circle of that radius round an end costs at least.
    fn out(&self, end: usize, length: f64) -> f64 {
        let at = self.prices.ends[end].xy();
        let (mut alone, mut others) = (0.0, 0.0);
        let (mut depths, mut pull, mut bend) = (0.0, Vector2::zeros(), 0.0);
        for wall in &self.walls {
            let away = wall.distance(at);
            let depth = wall.influence - away;
            let ramp = ramp(depth, 1.0, length);
            alone += ramp;
            if let OutlineShape::Disc(center) = wall.shape
                && depth > length
                && away > 0.0
            {
                depths += depth;
                pull += (center - at) / away;
                bend += 0.5 / away;
            } else {
                others += ramp;
            }
        }
        // |x - c| <= d - x n + x^2 / (2 d): discs on opposite sides of an end make up for each other.
        let squared = length * length;
        let together =
            others + depths * length - 0.5 * pull.norm() * squared - bend * squared * length / 3.0;
        self.prices.fuel * length + self.prices.exposure * alone.max(together)
    }

    fn march(&self, mesh: &Mesh, end: usize) -> Marched {
        let ends = mesh.ends();
        let potential = Potential::march(mesh, ends[end], |length| self.out(end, length));
        // Below a paraboloid that leaves the cap at the circle where the exemption ends.
        let exempt = EXEMPT * mesh.side;
        let cap = self.out(end, exempt);
        let slope = (self.out(end, 1.01 * exempt) - self.out(end, 0.99 * exempt)) / (0.02 * exempt);
        let curved = (0.5 * slope / exempt).max(0.0);
        let above = marching::capped()
            .map(|sides| {
                let length = sides * mesh.side;
                self.out(end, length) - cap - curved * (length * length - exempt * exempt)
            })
            .fold(0.0, f64::max);
        let lost = above + 7.0 / 18.0 * curved * mesh.side * mesh.side;
        let across = potential.mean(mesh, ends[1 - end]) - lost;
        Marched {
            potential,
            lost,
            across,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::tests::read;
    use super::super::around;
    use super::*;
    use crate::scenario::Scenario;

    /// From (200, 500) to (800, 500), `fuel` a metre, in a square of a kilometre.
    fn scenario(fuel: f64, threats: &str) -> Scenario {
        read(&format!(
            r#"{{ "frame": "local",
                "start": {{ "x": 200, "y": 500, "z": 100 }}, "target": {{ "x": 800, "y": 500, "z": 100 }},
                "area": {{ "min": {{ "x": 0, "y": 0 }}, "max": {{ "x": 1000, "y": 1000 }} }},
                "altitude": {{ "min": 0, "max": 200 }},
                "vehicle": {{ "max_turn_deg": 60, "max_climb_deg": 45, "fuel_per_km": 1000 }},
                "weights": {{ "fuel": {fuel}, "threat": 1, "altitude": 1 }},
                "planner": {{ "algorithm": "tms-sba" }}, "threats": [{threats}] }}"#
        ))
    }

    fn disc(x: f64, y: f64, radius: f64, influence: f64) -> String {
        format!(
            r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {influence}}}"#
        )
    }

    fn proven(scenario: &Scenario) -> f64 {
        let prices = Prices::of(scenario);
        let walls = around::walls(scenario, &prices);
        bound(&walls, &prices, &scenario.area, (0.0, 0.0), &|| false)
    }

    /// The cheapest way over a lattice of `NODES` nodes a side with legs in 32 directions, each
    /// summed up in its middle parts: dearer than the cheapest way of all, but for that sum.
    fn over_lattice(scenario: &Scenario) -> f64 {
        const NODES: i32 = 51;
        let spacing = 20.0;
        let prices = Prices::of(scenario);
        let walls = around::walls(scenario, &prices);
        let price = |a: Point2, b: Point2| {
            let parts = 8;
            let sum: f64 = (0..parts)
                .map(|part| {
                    let at = a + (b - a) * ((f64::from(part) + 0.5) / f64::from(parts));
                    let depths = walls.iter().map(|wall| {
                        let away = wall.distance(at);
                        if away < wall.core {
                            f64::INFINITY
                        } else {
                            (wall.influence - away).max(0.0)
                        }
                    });
                    prices.fuel + prices.exposure * depths.sum::<f64>()
                })
                .sum();
            sum / f64::from(parts) * (b - a).norm()
        };
        let at = |[i, j]: [i32; 2]| Point2::new(f64::from(i) * spacing, f64::from(j) * spacing);
        let index =
            |[i, j]: [i32; 2]| usize::try_from(j * NODES + i).expect("it lies in the lattice");
        let mut best = vec![f64::INFINITY; usize::try_from(NODES * NODES).expect("positive")];
        let mut heap = std::collections::BinaryHeap::new();
        best[index([10, 25])] = 0.0;
        heap.push((std::cmp::Reverse(0_u64), [10, 25]));
        while let Some((std::cmp::Reverse(key), [i, j])) = heap.pop() {
            if key != best[index([i, j])].to_bits() {
                continue;
            }
            for di in -4..=4_i32 {
                for dj in -4..=4_i32 {
                    let next = [i + di, j + dj];
                    if next.iter().all(|place| (0..NODES).contains(place)) {
                        let cost = best[index([i, j])] + price(at([i, j]), at(next));
                        if cost < best[index(next)] {
                            best[index(next)] = cost;
                            heap.push((std::cmp::Reverse(cost.to_bits()), next));
                        }
                    }
                }
            }
        }
        best[index([40, 25])]
    }

    #[test]
    fn a_soft_zone_far_from_the_way_leaves_the_fuel_of_the_straight_line() {
        let scenario = scenario(1.0, &disc(500.0, 930.0, 10.0, 20.0));
        let proven = proven(&scenario);
        assert!(proven <= 600.0 && proven > 0.98 * 600.0, "{proven}");
    }

    #[test]
    fn a_little_below_the_cheapest_way() {
        let check = |fuel: f64, threats: &[String], share: f64| {
            let scenario = scenario(fuel, &threats.join(", "));
            let (proven, found) = (proven(&scenario), over_lattice(&scenario));
            assert!(proven <= found * (1.0 + 1e-3), "{proven} {found}");
            assert!(proven >= share * found, "{proven} {found}");
        };
        // One soft zone over both ends, without and with a core in the way.
        check(1.0, &[disc(500.0, 560.0, 1.0, 600.0)], 0.87);
        check(1.0, &[disc(500.0, 510.0, 80.0, 400.0)], 0.86);
        // Ends in zones of their own.
        let ends = [
            disc(230.0, 500.0, 20.0, 150.0),
            disc(800.0, 460.0, 25.0, 120.0),
        ];
        check(0.5, &ends, 0.84);
        // A wall of zones that overlap.
        let wall: Vec<String> = (0..9)
            .map(|i| disc(500.0, 60.0 + 110.0 * f64::from(i), 30.0, 110.0))
            .collect();
        check(0.5, &wall, 0.55);
    }

    /// From vertex to vertex, the mean over cells rises by no more than the way costs, summed up finely.
    #[test]
    fn no_step_rises_by_more_than_it_costs() {
        let scenario = scenario(
            0.2,
            &[
                disc(240.0, 510.0, 20.0, 150.0),
                disc(520.0, 480.0, 60.0, 200.0),
                disc(780.0, 530.0, 10.0, 70.0),
                r#"{"kind": "polygon", "margin": 90, "vertices": [{"x": 300, "y": 250}, {"x": 480, "y": 250},
                    {"x": 480, "y": 350}, {"x": 400, "y": 290}, {"x": 300, "y": 350}]}"#
                    .to_owned(),
            ]
            .join(", "),
        );
        let prices = Prices::of(&scenario);
        let mut scene = Scene {
            walls: around::walls(&scenario, &prices),
            prices: &prices,
            area: scenario.area,
            cap: f64::INFINITY,
        };
        let mut mesh = scene.first();
        density::price(&mut mesh, &scene.walls, &prices, Kind::Proven);
        let depth = |at: Point2| -> f64 {
            let depth = |wall: &Wall| (wall.influence - wall.distance(at)).max(0.0);
            scene.walls.iter().map(depth).sum()
        };
        let is_free = |at: Point2| {
            let mut walls = scene.walls.iter();
            walls.all(|wall| wall.distance(at) > wall.core)
        };
        for end in [0, 1] {
            let potential = scene.march(&mesh, end).potential;
            let from = prices.ends[end].xy();
            let is_whole = |vertex: usize| {
                !mesh.is_edge(vertex)
                    && mesh
                        .round(vertex)
                        .iter()
                        .all(|near| mesh.limits[near.0] > 0.0)
                    && (mesh.at(vertex) - from).norm() > (EXEMPT + 1.0) * mesh.side
            };
            let (mut checked, mut steepest) = (0, 0.0_f64);
            for vertex in (0..potential.values.len()).filter(|vertex| is_whole(*vertex)) {
                for (_, [next, _]) in mesh.round(vertex) {
                    let [a, b] = [vertex, next].map(|vertex| mesh.at(vertex));
                    let points = (0..32).map(|i| a + (b - a) * ((f64::from(i) + 0.5) / 32.0));
                    if !is_whole(next) || !points.clone().all(is_free) {
                        continue;
                    }
                    let rise = potential.mean(&mesh, next) - potential.mean(&mesh, vertex);
                    let depths: f64 = points.map(depth).sum();
                    let cost = mesh.side * (prices.fuel + prices.exposure * depths / 32.0);
                    assert!(rise <= cost * (1.0 + 1e-4), "{rise} {cost} from {a} to {b}");
                    steepest = steepest.max(rise / cost);
                    checked += 1;
                }
            }
            assert!(checked > 5000 && steepest > 0.9, "{checked} {steepest}");
        }
    }

    #[test]
    fn a_way_that_costs_as_much_as_is_known_is_not_looked_at() {
        let scenario = scenario(1.0, &disc(500.0, 930.0, 10.0, 20.0));
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let proven = bound(&walls, &prices, &scenario.area, (600.0, 600.0), &|| false);
        assert!(proven.abs() < f64::EPSILON, "{proven}");
        let stopped = bound(&walls, &prices, &scenario.area, (0.0, 0.0), &|| true);
        assert!(stopped <= 600.0, "{stopped}");
    }
}
