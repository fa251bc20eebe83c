//! What a guided search has that a plain one lacks: routes to start from, and moves of a route.

use super::coding::{Cartesian, Spherical};
use super::moves::Moves;
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Random;

/// One of this many members comes from anywhere; the others are near a seed.
const STRANGERS: usize = 4;

/// Number of moves by which a member differs from its seed.
const MOVES: usize = 3;

/// How far such a move may go, as a share of the way.
const REACH: f64 = 0.3;

/// Draws the first members of a swarm in space and walks about routes.
pub(super) struct Guide<'s> {
    space: Cartesian<'s>,
    moves: Moves<'s>,
    /// Strangers are drawn in the spherical coding, whose random routes are flyable.
    spherical: Spherical<'s>,
    /// Positions of the routes to start from.
    seeds: Vec<Vec<f64>>,
    /// Members drawn so far.
    drawn: usize,
    route: Vec<Point3>,
    vectors: Vec<f64>,
}

impl<'s> Guide<'s> {
    /// A guide from `seeds`, at least one, all with the same number of waypoints.
    pub(super) fn new(model: &Model<'s>, seeds: &[Vec<Point3>]) -> Self {
        let waypoints = seeds[0].len() - 2;
        let space = Cartesian::with_ends(model, waypoints);
        let spherical = Spherical::new(model.scenario, waypoints);
        let encode = |route: &Vec<Point3>| {
            let mut position = vec![0.0; space.bounds().dimension()];
            space.encode(route, &mut position);
            position
        };
        Self {
            seeds: seeds.iter().map(encode).collect(),
            space,
            moves: Moves::new(model),
            vectors: vec![0.0; spherical.bounds().dimension()],
            spherical,
            drawn: 0,
            route: Vec::new(),
        }
    }

    /// Write the next first member into `position`: the seeds, then neighbours of each in turn, and
    /// strangers among them.
    pub(super) fn draw(&mut self, random: &mut Random, position: &mut [f64]) {
        let (idx, count) = (self.drawn, self.seeds.len());
        self.drawn += 1;
        if idx >= count && idx % STRANGERS == STRANGERS - 1 {
            self.spherical.bounds().draw(random, &mut self.vectors);
            self.spherical.decode(&self.vectors, &mut self.route);
            self.space.encode(&self.route, position);
        } else {
            position.copy_from_slice(&self.seeds[idx % count]);
            for _ in 0..if idx < count { 0 } else { MOVES } {
                self.moves.move_a_part(position, random, REACH);
            }
        }
    }

    /// Write a neighbour of `base` into `candidate`.
    pub(super) fn walk(&self, random: &mut Random, base: &[f64], size: f64, candidate: &mut [f64]) {
        candidate.copy_from_slice(base);
        self.moves.move_a_part(candidate, random, size);
    }
}
