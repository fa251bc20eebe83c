//! The last micrometres: from a route that is all but within its limits to one that is.

use std::iter::repeat;

use super::equations::{Equations, advance};
use super::legs::LEGS_EACH;
use super::limits::{Limit, Limits};
use super::{Newton, Place};

/// Steps that bring a route within its limits, at most.
const MENDS: usize = 8;

/// Limits that a route is brought back within are kept by this share of the way.
const MARGIN: f64 = 5e-9;

/// Of a square metre beyond a limit the share that a square metre of moving counts as.
const LEAST: f64 = 1e-9;

impl Newton<'_, '_> {
    /// Move `places` as little as brings them within `all` limits: Gauss and Newton's method on what is beyond.
    pub(super) fn mend(&mut self, places: &mut [Place], limits: &Limits, all: &[Limit]) {
        let margin = MARGIN * self.way();
        let free = places.len() - 2;
        // What was beyond once must not be again: its limit is kept as it is, to either side.
        let mut held = vec![false; all.len()];
        for _ in 0..MENDS {
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
