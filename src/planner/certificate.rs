//! What is measured of a delivered route, continuously and not at samples.

use super::{Clearance, Leg, Measures, Violation};
use crate::cost::{Breach, Constraint, Model, turns};
use crate::geometry::{Point3, Segment};
use crate::scenario::Quadrature;
use crate::terrain::HeightRange;

/// The legs of `route`.
pub(super) fn legs(route: &[Point3]) -> Vec<Leg> {
    let leg = |(leg, turn): (Segment, f64)| Leg {
        length: leg.length(),
        turn_deg: turn.to_degrees(),
        climb_deg: leg.climb().to_degrees(),
    };
    segments(route).zip(turns(route)).map(leg).collect()
}

/// The certificate of `route`, be it of waypoints or of a path's samples.
pub(super) fn measure(model: &Model, route: &[Point3]) -> Measures {
    let threats = model.scenario.threats.iter().enumerate();
    let heights = segments(route)
        .filter_map(|leg| model.free_heights(&leg))
        .reduce(HeightRange::join);
    let greatest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, value| most.max(value.abs()));
    Measures {
        clearance: threats
            .map(|(threat_idx, threat)| Clearance {
                threat: threat_idx,
                name: threat.name.clone(),
                distance: segments(route)
                    .filter_map(|leg| threat.clearance(&leg))
                    .reduce(f64::min),
            })
            .collect(),
        min_agl: heights.map(|range| range.min),
        max_agl: heights.map(|range| range.max),
        max_turn_deg: greatest(&mut turns(route)).to_degrees(),
        max_climb_deg: greatest(&mut segments(route).map(|leg| leg.climb())).to_degrees(),
        min_leg: segments(route)
            .map(|leg| leg.length())
            .fold(f64::INFINITY, f64::min),
    }
}

/// Every constraint that the waypoints of `route` break, in order of the legs.
pub(super) fn violations(model: &Model, route: &[Point3]) -> Vec<Violation> {
    let mut found = Vec::new();
    model.assess(route, Quadrature::Integral, model.tolerance, |breach| {
        found.push(describe(model, &breach));
    });
    found
}

fn describe(model: &Model, breach: &Breach) -> Violation {
    let vehicle = &model.scenario.vehicle;
    let place = match breach.constraint {
        Constraint::Area => format!("waypoint {}", breach.index),
        _ => format!("leg {}", breach.index),
    };
    let amount = format!("{:.3} {}", breach.amount, breach.constraint.unit());
    let message = match breach.constraint {
        Constraint::Threat => {
            let threat_idx = breach.threat.expect("a breach of a threat names it");
            let name = model.scenario.threats[threat_idx].name.as_deref();
            let name = name.map_or_else(String::new, |name| format!(" ({name})"));
            format!("{place} enters threat {threat_idx}{name} by {amount}")
        }
        Constraint::Altitude => format!("{place} leaves the altitude band by {amount}"),
        Constraint::Terrain => format!("{place} goes below the ground by {amount}"),
        Constraint::Turn => format!(
            "{place} is turned into {amount} beyond {} deg",
            vehicle.max_turn_deg
        ),
        Constraint::Climb => format!("{place} is {amount} steeper than {} deg", vehicle.max_climb_deg),
        Constraint::Leg => format!("{place} is {amount} shorter than {} m", vehicle.min_leg),
        Constraint::Area => format!("{place} lies {amount} outside the area"),
    };
    Violation {
        kind: breach.constraint.name(),
        place,
        amount: breach.amount,
        message,
    }
}

fn segments(route: &[Point3]) -> impl Iterator<Item = Segment> + '_ {
    route.windows(2).map(|ends| Segment {
        a: ends[0],
        b: ends[1],
    })
}
