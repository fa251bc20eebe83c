//! Whether a string can continue along a way, and whether that is worthwhile.

use super::Search;
use super::place::Place;
use super::way::{Step, Way};
use crate::geometry::ring;
use crate::seeding::arc::{Arc, Rounding, Sense, Tangent, tangent};
use crate::seeding::obstacles::Corner;

impl Search<'_> {
    pub(super) fn rounding(&self, place: Place) -> Rounding {
        let end = |center| Rounding {
            center,
            radius: 0.0,
            sense: Sense::Left,
        };
        match place {
            Place::Start => end(self.obstacles.ends[0]),
            Place::Target => end(self.obstacles.ends[1]),
            Place::Corner(corner, left) => Rounding {
                center: self.obstacles.corners[corner].center,
                radius: self.obstacles.corners[corner].radius,
                sense: if left { Sense::Left } else { Sense::Right },
            },
        }
    }

    pub(super) fn corner(&self, place: Place) -> Option<&Corner> {
        match place {
            Place::Corner(corner, _) => Some(&self.obstacles.corners[corner]),
            Place::Start | Place::Target => None,
        }
    }

    /// The straight part from the circle of one place to that of the next, if a string can bend in that way at both.
    pub(super) fn straight(&self, from: Place, to: Place) -> Option<Tangent> {
        let straight = tangent(&self.rounding(from), &self.rounding(to))?;
        for place in [from, to] {
            if let (Some(corner), Place::Corner(_, left)) = (self.corner(place), place)
                && let Some(edges) = corner.edges
            {
                // The edges must be on the side towards which the string bends.
                let side = if left { 1.0 } else { -1.0 };
                if edges
                    .iter()
                    .any(|edge| straight.along.perp(edge) * side < -1e-9)
                {
                    return None;
                }
            }
        }
        Some(straight)
    }

    /// The part along the circle of `step` up to `straight`, if a string can continue in that way.
    pub(super) fn arc(&self, step: &Step, straight: &Tangent) -> Option<Arc> {
        let on = self.rounding(step.place);
        let arc = match &step.before {
            None => {
                let away = outward(&on, straight);
                Arc::new(on, away, away)
            }
            Some((_, _, before)) => Arc::new(on, outward(&on, before), outward(&on, straight)),
        };
        // A string does not turn back at the corner of a ring either.
        let turns_back = self.corner(step.place).is_some_and(|c| c.edges.is_some())
            && arc.turn > std::f64::consts::PI + 1e-9;
        (!turns_back).then_some(arc)
    }

    pub(super) fn in_the_way_of(
        &mut self,
        from: Place,
        arc: &Arc,
        to: Place,
        way: &Tangent,
    ) -> Option<usize> {
        let own = |place| self.corner(place).map_or(&[][..], |corner| &corner.bodies);
        if let Some(outline) = self.obstacles.blocks_arc(arc, own(from)) {
            return Some(outline);
        }
        if let Some(known) = self.blocked.get(&(from, to)) {
            return *known;
        }
        let both: Vec<usize> = own(from).iter().chain(own(to)).copied().collect();
        let found = self.obstacles.blocks_segment(way.from, way.to, &both);
        self.blocked.insert((from, to), found);
        found
    }

    /// Whether a string that leaves along `arc` winds round a corner needlessly, or crosses an earlier part of itself.
    /// It may come back, further on, to a circle from which others protrude.
    pub(super) fn crosses_itself(&self, way: &Way, arc: &Arc, straight: &Tangent) -> bool {
        let signed = |arc: &Arc| arc.on.sense.sign() * arc.turn;
        let mut step = way.step;
        // How much the string has turned since it came to the step, and on the circle itself.
        let (mut turned, mut own) = (signed(arc), signed(arc));
        loop {
            if self.steps[step].place == way.to {
                let sense = self.rounding(way.to).sense.sign();
                let (since, all) = (sense * (turned - own), sense * turned);
                if since < 0.0 || all >= std::f64::consts::TAU {
                    return true;
                }
            }
            let Some((before, arc, earlier)) = &self.steps[step].before else {
                return false;
            };
            if ring::crossing((earlier.from, earlier.to), (straight.from, straight.to)).is_some() {
                return true;
            }
            own = signed(arc);
            turned += own;
            step = *before;
        }
    }

    /// Whether `k` earlier arrivals at `place` reach this one's point along the circle without being longer, so that
    /// whatever this one becomes, they become something better.
    pub(super) fn is_dominated(&self, place: Place, straight: &Tangent, length: f64) -> bool {
        let Some(earlier) = self.arrivals.get(&place) else {
            return false;
        };
        let on = self.rounding(place);
        let here = outward(&on, straight);
        let own = self.corner(place).map_or(&[][..], |corner| &corner.bodies);
        let better = earlier.iter().filter(|&&step| {
            let Some((_, _, before)) = &self.steps[step].before else {
                return false;
            };
            let arc = Arc::new(on, outward(&on, before), here);
            self.steps[step].length + arc.length() <= length
                && self.obstacles.blocks_arc(&arc, own).is_none()
                && !self.obstacles.leaves_area(&arc)
        });
        better.take(self.k).count() >= self.k
    }
}

/// From the centre of the circle to where the tangent touches it.
fn outward(on: &Rounding, tangent: &Tangent) -> nalgebra::Vector2<f64> {
    nalgebra::Vector2::new(tangent.along.y, -tangent.along.x) * on.sense.sign()
}
