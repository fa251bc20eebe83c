//! The settings in effect, for every command that heeds them.

use anyhow::anyhow;

use crate::config::{self, Flags, Loaded};

/// The settings of these flags, of the environment, and of the file that the flags name.
pub(super) fn of_environment(flags: &Flags) -> anyhow::Result<Loaded> {
    config::load(flags, |name| std::env::var_os(name))
        .map_err(|faults| anyhow!("wrong configuration\n  {}", faults.join("\n  ")))
}
