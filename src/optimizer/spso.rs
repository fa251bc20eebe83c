//! SPSO: Phung and Ha's particle swarm over spherical vectors.
//!
//! M. D. Phung and Q. P. Ha, *Safety-enhanced UAV path planning with spherical vector-based particle swarm
//! optimization*, Applied Soft Computing 107, 2021; constants as in their published code. The coding is part of the
//! objective.
//!
//! Deviation: they redraw the initial population until one path is free of collisions, because an infinite cost gives
//! no direction. Here violations are measured, so it is drawn once.

use super::particles::{Flight, Particles};
use super::{Algorithm, Objective, Optimizer, Parameter, Settings, parameter};

/// The entry in the table of algorithms.
pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "spso",
    title: "Spherical-vector particle swarm",
    source: "M. D. Phung and Q. P. Ha, Safety-enhanced UAV path planning with spherical vector-based particle swarm optimization, Applied Soft Computing 107, 2021",
    parameters: &PARAMETERS,
    start,
};

const PARAMETERS: [Parameter; 5] = [
    parameter("inertia", 1.0, 0.0, 2.0, "inertia weight w at the start"),
    parameter(
        "inertia_damping",
        0.98,
        0.5,
        1.0,
        "factor on the inertia weight after each iteration",
    ),
    parameter(
        "cognitive",
        1.5,
        0.0,
        4.0,
        "most of the pull c1 towards a particle's own best",
    ),
    parameter(
        "social",
        1.5,
        0.0,
        4.0,
        "most of the pull c2 towards the best of all",
    ),
    parameter(
        "v_max",
        0.5,
        0.001,
        1.0,
        "greatest velocity, as a share of each range",
    ),
];

/// At a bound the velocity is reflected.
const REBOUND: f64 = -1.0;

fn start(settings: &Settings, objective: &mut dyn Objective) -> Box<dyn Optimizer> {
    let [inertia, damping, cognitive, social, v_max] = settings.parameters[..] else {
        unreachable!("the planner passes one value for each row of PARAMETERS");
    };
    let flight = Flight {
        inertia,
        damping,
        cognitive,
        social,
        v_max,
        rebound: REBOUND,
    };
    let (population, seed) = (settings.population, settings.seed);
    Box::new(Particles::start(population, seed, flight, objective))
}
