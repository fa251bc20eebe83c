//! The last micrometres: from a route that is nearly within its limits to one that is.

use std::iter::repeat;

use super::equations::{Equations, advance};
use super::legs::LEGS_EACH;
use super::limits::{Limit, Limits};
use super::{Newton, Place};

/// Maximum number of steps that bring a route within its limits.
const MENDS: usize = 8;

/// Margin left when a route is brought back within its limits, as a share of the way.
const MARGIN: f64 = 5e-9;

/// Weight of a square metre of movement relative to a square metre beyond a limit.
const LEAST: f64 = 1e-9;

impl Newton<'_, '_> {
    /// Move `places` as little as needed to bring them within `all` limits: Gauss-Newton on the breaches.
    pub(super) fn mend(&mut self, places: &mut [Place], limits: &Limits, all: &[Limit]) {
        let margin = MARGIN * self.way();
        let free = places.len() - 2;
        // A limit that was exceeded once must not be again: from then on it is held exactly, on both sides.
        let mut held = vec![false; all.len()];
        for _ in 0..MENDS {
            if self.is_stopped() {
                break;
            }
            let slopes = self.legs().slopes(places);
            self.evaluations += LEGS_EACH;
            let route = self.route(places);
            let mut equations = Equations::new(free);
            let mut is_beyond = false;
            for (leg, slopes) in slopes.iter().enumerate() {
                if slopes.beyond > 0.0 {
                    is_beyond = true;
                    equations.bring_back(leg, &slopes.away, slopes.beyond + margin);
                }
            }
            for (limit, held) in all.iter().zip(&mut held) {
                let beyond = limits.beyond(*limit, places, &route);
                *held |= beyond > -margin;
                if *held {
                    is_beyond |= beyond > 0.0;
                    let slope = limits.slope(*limit, places, &route);
                    equations.bring_back(slope.first, &slope.gradient, beyond + margin);
                }
            }
            if !is_beyond {
                break;
            }
            let Some(step) = equations.matrix.solve(repeat(LEAST), &equations.down) else {
                break;
            };
            advance(places, &step);
        }
    }
}
