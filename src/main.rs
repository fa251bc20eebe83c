//! The `noctule` command.

use std::process::ExitCode;

/// What a request allocates is often freed by another thread, the one that writes among them. The C library's allocator
/// makes them wait for each other then, and takes an eighth more for an open stream.
#[global_allocator]
static ALLOCATOR: tikv_jemallocator::Jemalloc = tikv_jemallocator::Jemalloc;

fn main() -> ExitCode {
    noctule::cli::run()
}
