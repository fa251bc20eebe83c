//! The measurements of a delivered route, continuous rather than at samples.

use std::borrow::Cow;

use super::{Clearance, Leg, Measures, Place, Violation};
use crate::cost::{Breach, Constraint, Model, turns};
use crate::geometry::{Point3, Segment};
use crate::scenario::Quadrature;
use crate::terrain::HeightRange;
use crate::threat::Threat;

/// What is proven where threats reach from one side of the area to the other, or all round an end.
const NO_WAY: &str =
    "; no route keeps clear of the threats: they leave no way from start to target within the area";

/// The legs of `route`.
pub(super) fn legs(route: &[Point3]) -> Vec<Leg> {
    let leg = |(leg, turn): (Segment, f64)| Leg {
        length: leg.length(),
        turn_deg: turn.to_degrees(),
        climb_deg: leg.climb().to_degrees(),
    };
    segments(route).zip(turns(route)).map(leg).collect()
}

/// The certificate of `route`, which may consist of waypoints or of a path's samples.
pub(super) fn measure(model: &Model, route: &[Point3]) -> Measures {
    let threats = model.scenario.threats.iter().enumerate();
    let flown = flown(route);
    let every_leg: Vec<usize> = (0..route.len() - 1).collect();
    let heights = segments(route)
        .filter_map(|leg| model.free_heights(&leg))
        .reduce(HeightRange::join);
    let greatest = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    Measures {
        clearance: threats
            .map(|(threat_idx, threat)| Clearance {
                threat: threat_idx,
                name: threat.name.clone(),
                distance: least_clearance(threat, route, &flown, &every_leg),
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

/// Add to what is said of threats that no other route passes them either.
pub(super) fn say_closed(violations: &mut [Violation]) {
    let of_threats = violations
        .iter_mut()
        .filter(|violation| violation.kind == Constraint::Threat.name());
    for violation in of_threats {
        violation.message.push_str(NO_WAY);
    }
}

fn describe(model: &Model, breach: &Breach) -> Violation {
    let vehicle = &model.scenario.vehicle;
    let place = match breach.constraint {
        Constraint::Area => Place::Waypoint(breach.index),
        Constraint::Threat
        | Constraint::Altitude
        | Constraint::Terrain
        | Constraint::Turn
        | Constraint::Climb
        | Constraint::Leg => Place::Leg(breach.index),
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
        Constraint::Climb => format!(
            "{place} is {amount} steeper than {} deg",
            vehicle.max_climb_deg
        ),
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

/// The horizontal distance flown up to each point of `route`, metres.
fn flown(route: &[Point3]) -> Vec<f64> {
    let mut way = 0.0;
    std::iter::once(0.0)
        .chain(segments(route).map(|leg| {
            way += leg.horizontal_length();
            way
        }))
        .collect()
}

/// The least clearance of the legs of `route`, by branch and bound: no point is nearer to a threat than a neighbouring
/// point, less the distance between them.
fn least_clearance(
    threat: &Threat,
    route: &[Point3],
    flown: &[f64],
    every_leg: &[usize],
) -> Option<f64> {
    let leg = |idx: usize| Segment {
        a: route[idx],
        b: route[idx + 1],
    };
    let is_at_its_height =
        |&idx: &usize| leg(idx).between_heights(threat.base, threat.top).is_some();
    let at_its_height = if threat.base.is_none() && threat.top.is_none() {
        Cow::Borrowed(every_leg)
    } else {
        Cow::Owned(every_leg.iter().copied().filter(is_at_its_height).collect())
    };
    let mut least = f64::INFINITY;
    // Runs of those legs, with lower bounds of their clearance.
    let mut open = vec![(&at_its_height[..], f64::NEG_INFINITY)];
    while let Some((legs, bound)) = open.pop() {
        if bound >= least {
            continue;
        }
        if let [] | [_] = legs {
            let clearances = legs.iter().filter_map(|&idx| threat.clearance(&leg(idx)));
            least = clearances.fold(least, f64::min);
            continue;
        }
        let (before, after) = legs.split_at(legs.len() / 2);
        let middle = after[0];
        let here = threat.distance(route[middle].xy());
        let bounded = |legs: &'_ [usize]| {
            let from = flown[middle] - flown[legs[0]];
            let to = flown[legs[legs.len() - 1] + 1] - flown[middle];
            // The distance is a sum; allow a hair for rounding.
            here - from.max(to) * (1.0 + 1e-9) - 1e-9
        };
        let mut halves = [(before, bounded(before)), (after, bounded(after))];
        halves.sort_by(|one, other| other.1.total_cmp(&one.1));
        open.extend(halves);
    }
    least.is_finite().then_some(least)
}

fn segments(route: &[Point3]) -> impl Iterator<Item = Segment> + '_ {
    route.windows(2).map(|ends| Segment {
        a: ends[0],
        b: ends[1],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;

    #[test]
    fn the_clearance_is_the_least_over_all_legs() {
        let mut scenario = scenario();
        scenario.threats[1].top = Some(60.0);
        scenario.threats[2].base = Some(1e4);
        let route: Vec<Point3> = (0..500_i32)
            .map(|step| {
                let (t, wave) = (f64::from(step), f64::from(step % 37));
                Point3::new(
                    2.0 * t,
                    1000.0 - 1.7 * t + wave,
                    40.0 + 3.0 * f64::from(step % 11),
                )
            })
            .collect();
        let measures = measure(&Model::new(&scenario), &route);
        for (entry, threat) in measures.clearance.iter().zip(&scenario.threats) {
            let expected = segments(&route)
                .filter_map(|leg| threat.clearance(&leg))
                .reduce(f64::min);
            assert_eq!(entry.distance, expected);
        }
        assert_eq!(measures.clearance[2].distance, None);
    }
}
