//! How a kind of legs is divided where that may raise the bound most: by headings, by lengths or by slopes.

use super::kind::{End, Kind};
use super::slopes::Slopes;

impl End<'_> {
    /// Possible gain from examining `kind` more closely.
    pub(super) fn gain(&self, kind: &Kind) -> f64 {
        if kind.is_rough {
            f64::INFINITY
        } else {
            kind.turned.max(self.longer(kind)).max(kind.sloped)
        }
    }

    /// Possible gain from dividing the lengths of `kind`.
    fn longer(&self, kind: &Kind) -> f64 {
        // What is flown in the zone round the other end is not divided.
        if kind.lengths[0] >= self.apart {
            return 0.0;
        }
        self.steepness([kind.lengths[0]; 2], kind.exposed, kind.slopes) - kind.steepness
    }

    /// `kind` divided into parts, not yet priced.
    pub(super) fn parts(&self, kind: &Kind) -> Vec<Kind> {
        let longer = self.longer(kind);
        if kind.sloped > kind.turned.max(longer) {
            let all = Slopes::parts(self.steepest).into_iter();
            let part = |slopes| Kind {
                slopes: Some(slopes),
                sloped: 0.0,
                ..*kind
            };
            return all.map(part).collect();
        }
        if kind.turned >= longer {
            let half = 0.5 * kind.half;
            let part = |side: f64| Kind {
                heading: kind.heading + side * half,
                half,
                ..*kind
            };
            return vec![part(-1.0), part(1.0)];
        }
        let [shortest, longest] = kind.lengths;
        let between = self.between(kind).clamp(shortest, longest);
        let cut = [[shortest, between], [between, longest]];
        cut.map(|lengths| Kind { lengths, ..*kind }).to_vec()
    }

    /// The length at which `kind` is divided.
    fn between(&self, kind: &Kind) -> f64 {
        let [shortest, longest] = kind.lengths;
        if kind.slopes.is_some() {
            return if longest.is_finite() {
                0.5 * (shortest + longest)
            } else {
                (2.0 * shortest)
                    .max(self.height / self.steepest.min(1.0))
                    .max(1.0)
            };
        }
        if let Some(ramp) = self.ramp {
            let bends = [ramp.reach, ramp.run(self.height)];
            let mut within = bends
                .into_iter()
                .filter(|at| shortest < *at && *at < longest);
            if let Some(bend) = within.next() {
                return bend;
            }
            if shortest >= ramp.reach {
                return 0.5 * (shortest + longest);
            }
        }
        let steepest = self.gently(shortest, kind.exposed);
        self.length_of(0.5 * (steepest + kind.steepness), kind.exposed)
    }
}
