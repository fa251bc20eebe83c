//! The `noctule` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    noctule::cli::run()
}
