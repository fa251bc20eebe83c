//! PSO: the particle swarm of Kennedy and Eberhart with Clerc and Kennedy's constriction.
//!
//! J. Kennedy and R. Eberhart, *Particle swarm optimization*, ICNN 1995; M. Clerc and J. Kennedy, *The particle
//! swarm: explosion, stability, and convergence in a multidimensional complex space*, IEEE Transactions on
//! Evolutionary Computation 6(1), 2002. Particles learn from the global best.

use super::particles::{Flight, Particles};
use super::{Algorithm, Objective, Optimizer, Parameter, Settings, parameter};

/// The entry in the table of algorithms.
pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "pso",
    title: "Particle swarm with constriction, over Cartesian waypoints",
    source: "M. Clerc and J. Kennedy, The particle swarm: explosion, stability, and convergence in a multidimensional complex space, IEEE Transactions on Evolutionary Computation 6(1), 2002",
    parameters: &PARAMETERS,
    start,
};

const PARAMETERS: [Parameter; 4] = [
    // With phi1 = phi2 = 2.05, Eq. 4 of Clerc and Kennedy gives 0.72984.
    parameter(
        "constriction",
        0.729_843_788,
        0.0,
        1.0,
        "constriction chi on the whole velocity",
    ),
    parameter(
        "cognitive",
        2.05,
        0.0,
        4.0,
        "most of the pull phi1 towards a particle's own best",
    ),
    parameter(
        "social",
        2.05,
        0.0,
        4.0,
        "most of the pull phi2 towards the best of all",
    ),
    // Half the range is the X_max of a box centred at the origin, recommended by Eberhart and Shi with a constriction
    // (Comparing inertia weights and constriction factors, CEC 2000).
    parameter(
        "v_max",
        0.5,
        0.001,
        1.0,
        "greatest velocity, as a share of each range",
    ),
];

/// At a bound the velocity reverses and halves, as in M. Clerc, Standard particle swarm optimisation, 2012;
/// unchanged, it would keep pressing against the bound.
const REBOUND: f64 = -0.5;

fn start(settings: &Settings, objective: &mut dyn Objective) -> Box<dyn Optimizer> {
    let [constriction, cognitive, social, v_max] = settings.parameters[..] else {
        unreachable!("the planner passes one value for each row of PARAMETERS");
    };
    let flight = Flight {
        inertia: constriction,
        damping: 1.0,
        cognitive: constriction * cognitive,
        social: constriction * social,
        v_max,
        rebound: REBOUND,
    };
    let (population, seed) = (settings.population, settings.seed);
    Box::new(Particles::start(population, seed, flight, objective))
}
