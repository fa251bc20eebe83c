//! Which threats first and last legs meet: passable ones only while the legs are at their heights. The argument is
//! section 7 of docs/BOUND.md.

use super::super::departure::leaving;
use super::super::wall::Wall;
use super::exposure;
use super::kind::End;
use super::slopes::Slopes;
use crate::geometry::{Point2, Rect, ring};
use crate::seeding::arc::point_segment;
use crate::seeding::outline::OutlineShape;

/// How legs climb.
#[derive(Debug, Clone, Copy)]
pub(super) enum Climb {
    /// In any way.
    Any,
    As(Slopes),
    /// So that no threat is ever passed.
    Along,
}

impl End<'_> {
    /// The walls that count for legs that climb in this way, each with the range, metres seen from above, in which it
    /// does.
    fn counting(&self, climb: Climb) -> impl Iterator<Item = (&Wall, [f64; 2])> {
        // The second half of the way belongs to the other end.
        let half = 0.5 * self.prices.direct();
        let both = self.walls.iter().zip(self.radii);
        let counts = both.map(move |(wall, radius)| {
            let range = match (radius, climb) {
                (Some(_), _) => [0.0, f64::INFINITY],
                (None, Climb::Along) => [0.0, half],
                (None, Climb::Any) => [0.0, wall.stays[self.which]],
                (None, Climb::As(slopes)) => {
                    let [up, down] = wall.climbs[self.which];
                    let [towards, away] = if self.is_below {
                        [up, down]
                    } else {
                        [down, up]
                    };
                    let [from, to] = slopes.at_heights([towards, away]);
                    [from, to.min(half)]
                }
            };
            (wall, range)
        });
        counts.filter(|(_, [from, to])| from < to)
    }

    /// The point of a leg to `at` after this many metres, or its end.
    fn at_most(&self, at: Point2, metres: f64) -> Point2 {
        let way = at - self.from;
        let length = way.norm();
        if metres < length {
            self.from + way * (metres / length)
        } else {
            at
        }
    }

    /// The least that is paid, after a leg of `length`, in the zones of walls that cannot be passed yet.
    pub(super) fn later(&self, length: f64) -> f64 {
        let passable = self
            .counting(Climb::Any)
            .filter(|(_, [_, stay])| stay.is_finite());
        let exposed = passable.map(|(wall, [_, stay])| {
            let first = |metres| leaving(wall, (self.from, 0.0), metres);
            first(stay) - first(stay.min(length))
        });
        self.prices.exposure * exposed.sum::<f64>()
    }

    /// Whether every leg that climbs in this way to within `spread` of `at` enters a core.
    pub(super) fn is_blocked(&self, at: Point2, spread: f64, climb: Climb) -> bool {
        let length = (at - self.from).norm();
        let counting = self.counting(climb);
        counting
            .filter(|(_, [from, _])| *from < length)
            .any(|(wall, range)| {
                let [from, to] = range.map(|metres| self.at_most(at, metres));
                match &wall.shape {
                    OutlineShape::Disc(center) => {
                        wall.core > spread && point_segment(*center, from, to) < wall.core - spread
                    }
                    OutlineShape::Ring(ring) if !may_meet(ring, (from, to)) => false,
                    OutlineShape::Ring(ring) => (1..=16).rev().any(|i| {
                        let point = from + (to - from) * (f64::from(i) / 16.0);
                        ring::contains(ring, point)
                            && ring::distance(ring, point) > spread + 2.0 * self.prices.tolerance
                    }),
                }
            })
    }

    /// The cost of the soft zones for all legs that climb in this way as far as `at` and within `half` radians of it:
    /// the first is a lower bound, the second is approximately the cost of the leg to `at`.
    pub(super) fn exposed(&self, at: Point2, half: f64, climb: Climb) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (wall, range) in self.counting(climb) {
            let reached = range.map(|metres| self.at_most(at, metres));
            for (sum, half) in sums.iter_mut().zip([half, 0.0]) {
                let within = exposure::between(wall, self.from, reached, half);
                *sum += self.prices.exposure * within;
            }
        }
        sums
    }
}

/// Whether the box round a way meets the one round `ring`.
fn may_meet(ring: &[Point2], (from, to): (Point2, Point2)) -> bool {
    let own = Rect::around(ring.iter().copied());
    let other = Rect::around([from, to]);
    own.zip(other).is_some_and(|(own, other)| own.meets(&other))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::super::super::super::tests::scenario;
    use super::super::super::prices::Prices;
    use super::super::super::widening;
    use super::super::kind::tests::end;
    use super::*;

    /// A leg that is below the top for 60 m is as exposed, and as blocked, as one of that length; a shorter one
    /// leaves exposure to the legs after it.
    #[test]
    fn a_leg_is_exposed_only_until_it_has_climbed_to_the_top() {
        let scenario = scenario(
            r#""threats": [{"kind": "cylinder", "center": {"x": 260, "y": 100}, "radius": 30, "influence": 100, "top": 60}]"#,
        );
        let prices = Prices::of(&scenario);
        let walls = widening::walls(&scenario, &prices);
        let end = end(&prices, &walls, &[None]);
        let to = |length: f64| end.from - Vector2::new(0.0, length);
        let exposed = |length: f64| end.exposed(to(length), 0.0, Climb::Any)[0];
        assert!(exposed(30.0) < exposed(60.0) && exposed(60.0) > 0.0);
        assert!((exposed(90.0) - exposed(60.0)).abs() < 1e-3);
        assert!(end.later(0.0) > end.later(30.0) && end.later(30.0) > 0.0);
        assert!(end.later(60.0) < 1e-4 * end.later(0.0));
        let over = end.from + Vector2::new(90.0, 0.0);
        assert!(
            end.is_blocked(over, 0.0, Climb::Any) && !end.is_blocked(to(90.0), 0.0, Climb::Any)
        );
    }
}
