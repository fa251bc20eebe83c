//! The settings in effect, for every command that heeds them.

use std::path::PathBuf;

use anyhow::{Context as _, anyhow};

use crate::config::{self, Config, Flags, Loaded};

/// The settings of these flags, of the environment, and of the file that the flags name.
pub(super) fn of_environment(flags: &Flags) -> anyhow::Result<Loaded> {
    config::load(flags, |name| std::env::var_os(name))
        .map_err(|faults| anyhow!("wrong configuration\n  {}", faults.join("\n  ")))
}

/// A line about each variable that has no effect because of its spelling.
pub(super) fn misspelt() -> Vec<String> {
    let names = std::env::vars_os().filter_map(|(name, _)| name.into_string().ok());
    config::misspelt(names)
}

/// The directory of the plans.
pub(super) fn data_dir(config: &Config) -> anyhow::Result<PathBuf> {
    let data_dir = config.data_dir.clone();
    data_dir.context("the user has no home; name a directory with --data-dir")
}
