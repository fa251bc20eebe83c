//! SBA: TMS-SBA without the truncated mean, to show what that contributes.

use super::tms_sba::{PARAMETERS, TmsSba};
use super::{Algorithm, Objective, Optimizer, Parameter, Settings, Swarm};

/// The entry in the table of algorithms.
pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "sba",
    title: "Spherical-vector bat algorithm, without the truncated mean",
    source: "An Improved Spherical Vector and Truncated Mean Stabilization Based Bat Algorithm for UAV Path Planning, IEEE Access, 2023",
    parameters: SHARED,
    start: |settings, objective| Box::new(Sba(TmsSba::start(&completed(settings), objective))),
};

/// The constants of the bats, and those that only the truncated mean uses.
const SPLIT: (&[Parameter], &[Parameter]) = PARAMETERS.as_slice().split_at(PARAMETERS.len() - 2);
const SHARED: &[Parameter] = SPLIT.0;
const UNREAD: &[Parameter] = SPLIT.1;

struct Sba(TmsSba);

fn completed(settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    let unread = UNREAD.iter().map(|parameter| parameter.default);
    settings.parameters.extend(unread);
    settings
}

impl Optimizer for Sba {
    fn iterate(&mut self, objective: &mut dyn Objective, progress: f64) {
        self.0.fly(objective, progress);
    }

    fn swarm(&self) -> &Swarm {
        self.0.swarm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_it_leaves_out_is_the_truncated_mean() {
        let names: Vec<&str> = UNREAD.iter().map(|parameter| parameter.name).collect();
        assert_eq!(names, ["truncation", "expansion"]);
    }
}
