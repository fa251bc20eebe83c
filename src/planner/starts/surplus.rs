//! Finds the surplus waypoints of a route that are missed least.

use crate::cost::Model;
use crate::geometry::{LEVEL, Point3};
use crate::optimizer::Fitness;
use crate::planner::price::change;

/// Remove the waypoint that is missed least, or replace two by one, until `waypoints` free ones are left.
pub(super) fn leave_out(model: &Model, route: &mut Vec<Point3>, waypoints: usize) {
    let points = waypoints + 2;
    if route.len() <= points {
        return;
    }
    let mut omissions: Vec<Omission> = (1..route.len() - 1)
        .map(|idx| Omission::of(model, route, idx))
        .collect();
    while route.len() > points {
        let least = (1..omissions.len()).fold(0, |least, next| {
            if omissions[next].change.beats(&omissions[least].change) {
                next
            } else {
                least
            }
        });
        let (idx, omission) = (least + 1, omissions.remove(least));
        route.remove(idx);
        if let Some(corner) = omission.instead {
            route[idx] = corner;
        }
        // Of the others, only those whose neighbourhood has changed.
        let sees = idx.saturating_sub(Omission::AFTER).max(1)..idx + Omission::BEFORE + 1;
        for near in sees.start..sees.end.min(route.len() - 1) {
            omissions[near - 1] = Omission::of(model, route, near);
        }
    }
}

/// The best way to remove a waypoint.
struct Omission {
    change: Fitness,
    /// The point that replaces it and the next one.
    instead: Option<Point3>,
}

impl Omission {
    /// Number of points considered before the waypoint.
    const BEFORE: usize = 2;
    /// Maximum number of points considered after it.
    const AFTER: usize = 3;

    fn of(model: &Model, route: &[Point3], idx: usize) -> Self {
        let count = route.len();
        let before = idx.saturating_sub(Self::BEFORE);
        let after = (idx + Self::AFTER).min(count);
        let without: Vec<Point3> = (before..after)
            .filter(|&other| other != idx)
            .map(|other| route[other])
            .collect();
        let plainly = Self {
            change: change(model, &route[before..after], &without),
            instead: None,
        };
        let corner = (idx + 2 < count)
            .then(|| crossing(route[idx - 1], route[idx], route[idx + 1], route[idx + 2]))
            .flatten();
        let Some(corner) = corner else {
            return plainly;
        };
        let after = (idx + Self::AFTER + 1).min(count);
        let with: Vec<Point3> = (before..after)
            .filter(|&other| other != idx + 1)
            .map(|other| if other == idx { corner } else { route[other] })
            .collect();
        let change = change(model, &route[before..after], &with);
        if change.beats(&plainly.change) {
            Self {
                change,
                instead: Some(corner),
            }
        } else {
            plainly
        }
    }
}

/// Where the leg from `a` to `b`, extended, meets the leg from `c` to `d`, extended backwards.
fn crossing(a: Point3, b: Point3, c: Point3, d: Point3) -> Option<Point3> {
    let (ahead, back, gap) = (b.xy() - a.xy(), c.xy() - d.xy(), c.xy() - b.xy());
    let area = ahead.perp(&back);
    // Legs without extent have no direction.
    if area.abs() <= LEVEL * (ahead.norm() + back.norm()) {
        return None;
    }
    // b + ahead s = c + back t
    let (s, t) = (gap.perp(&back) / area, gap.perp(&ahead) / area);
    if s < 0.0 || t < 0.0 || s * ahead.norm() > 10.0 * gap.norm() {
        return None;
    }
    let at = b.xy() + ahead * s;
    Some(Point3::new(at.x, at.y, 0.5 * (b.z + c.z)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::price::price;
    use crate::planner::starts::with_waypoints;
    use crate::planner::tests::{route, scenario};

    #[test]
    fn the_least_useful_waypoint_is_left_out() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let many = route(&[
            [150.0, 400.0, 100.0],
            [225.0, 650.0, 100.0],
            [300.0, 900.0, 100.0],
        ]);
        let few = with_waypoints(&model, many.clone(), 2);
        let without_the_middle = [many[0], many[1], many[3], many[4]];
        assert!(!price(&model, &without_the_middle).beats(&price(&model, &few)));
    }

    /// Removing one at a time examines every waypoint again at each step.
    #[test]
    fn leaving_out_many_equals_leaving_out_one_by_one() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let free: Vec<[f64; 3]> = (0..60_u32)
            .map(|i| {
                let (t, wave) = (f64::from(i) / 60.0, f64::from(i * 7 % 11));
                [
                    150.0 + 600.0 * t - 9.0 * wave,
                    100.0 + 700.0 * t + 6.0 * wave,
                    90.0 + wave,
                ]
            })
            .collect();
        let mut one_by_one = route(&free);
        while one_by_one.len() > 5 {
            let waypoints = one_by_one.len() - 3;
            one_by_one = with_waypoints(&model, one_by_one, waypoints);
            assert_eq!(one_by_one, with_waypoints(&model, route(&free), waypoints));
        }
    }

    #[test]
    fn leaving_out_coinciding_waypoints_gives_finite_coordinates() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let many = route(&[[500.0, 480.0, 100.0]; 6]);
        let few = with_waypoints(&model, many, 1);
        assert!(
            few.iter()
                .all(|point| point.coords.iter().all(|x| x.is_finite()))
        );
    }
}
