//! Where commands find the datasets that a scenario refers to.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use crate::catalogue::Mounted;
use crate::planner;
use crate::scenario::json::Rules;
use crate::scenario::limits::Limits;

#[derive(Args)]
pub(super) struct Ground {
    /// Directory of datasets that the scenario may name, each by its file name without the extension
    #[arg(long, env = "NOCTULE_TERRAIN_DIR", value_name = "DIR")]
    terrain_dir: Option<PathBuf>,
}

impl Ground {
    /// The rules for a scenario that uses them.
    pub(super) fn rules(&self, limits: Limits) -> anyhow::Result<Rules> {
        let rules = planner::rules(limits);
        Ok(match &self.terrain_dir {
            Some(directory) => rules.with_datasets(Arc::new(Mounted::open(directory)?)),
            None => rules,
        })
    }
}
