//! What a step over the grid costs.

use super::grid::{ONWARD, step};
use super::ground::{Ground, Range};
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::planner::price::pricer;
use crate::planner::starts::{lifted, net};

/// Steps priced between two checks whether to stop.
const UNWATCHED: usize = 4_096;

/// The costs of steps. Both directions of a step cost the same.
pub(super) struct Tolls {
    /// Of a metre flown at the middle of the band.
    pub(super) metre: f64,
    /// More for each metre that is flown a metre above or below that: waypoints are spread over the way.
    off_middle: f64,
    /// Of the exposure to threats, for each cell and each step from it onward; nothing where there are none.
    exposures: Vec<[f64; ONWARD]>,
    pub(super) legs_priced: u64,
}

impl Tolls {
    /// `None` once `is_over`.
    pub(super) fn new(model: &Model, ground: &Ground, is_over: &dyn Fn() -> bool) -> Option<Self> {
        let scenario = model.scenario;
        let waypoints = scenario.planner.waypoints as f64;
        let mut tolls = Self {
            metre: metre(scenario),
            off_middle: scenario.weights.altitude * waypoints / scenario.direct(),
            exposures: Vec::new(),
            legs_priced: 0,
        };
        if !scenario.threats.is_empty() {
            tolls.price(model, ground, is_over)?;
        }
        Some(tolls)
    }

    /// Price the exposure in the middle of the band.
    fn price(&mut self, model: &Model, ground: &Ground, is_over: &dyn Fn() -> bool) -> Option<()> {
        let pricer = pricer(model).verdicts();
        let [columns, rows] = ground.size;
        let place =
            |cell: [usize; 2]| lifted(model.scenario, ground.at(2 * cell[0], 2 * cell[1]), 0.5);
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
        let places: Vec<Point3> = cells.clone().map(place).collect();
        let steps = cells.flat_map(|cell| {
            (0..ONWARD).filter_map(move |direction| {
                let to = step(ground, cell, direction)?.to;
                let ends = [cell, to].map(|[column, row]| row * columns + column);
                Some((direction, (ends[0], ends[1])))
            })
        });
        let steps: Vec<(usize, (usize, usize))> = steps.collect();
        self.exposures = vec![[0.0; ONWARD]; places.len()];
        for steps in steps.chunks(UNWATCHED) {
            if is_over() {
                return None;
            }
            let ends: Vec<_> = steps.iter().map(|(_, ends)| *ends).collect();
            let priced = net::priced(&places, &ends, |from, to, prices| {
                pricer.legs_at_best(from, to, prices);
            });
            for (&(direction, (from, to)), priced) in steps.iter().zip(priced) {
                let fuel = self.metre * (places[to] - places[from]).norm();
                self.exposures[from][direction] = (priced.cost - fuel).max(0.0);
            }
        }
        self.legs_priced = steps.len() as u64;
        Some(())
    }

    /// Of a metre flown somewhere within `heights`, of those `allowed` there.
    pub(super) fn per_metre(&self, [low, high]: Range, [floor, ceiling]: Range) -> f64 {
        let middle = 0.5 * (floor + ceiling);
        self.metre + self.off_middle * (low - middle).max(middle - high).max(0.0)
    }

    /// Of the exposure on the step between two cells, given by their numbers, that is number `direction` from the first.
    pub(super) fn exposure(&self, [from, to]: [usize; 2], direction: usize) -> f64 {
        self.exposures
            .get(from.min(to))
            .map_or(0.0, |exposures| exposures[direction % ONWARD])
    }
}
