//! How much a test does: what fits CI, or all that docs/RELIABILITY.md speaks of.

use proptest::test_runner::Config;

/// How much to do; all of it under `NOCTULE_SIEGE=full`.
pub(crate) fn size<T>(in_ci: T, full: T) -> T {
    if std::env::var_os("NOCTULE_SIEGE").is_some_and(|size| size == "full") {
        full
    } else {
        in_ci
    }
}

/// How many cases a property is tried on: as many as `PROPTEST_CASES` says, if it is set.
pub(crate) fn cases(in_ci: u32, full: u32) -> Config {
    let asked = Config::default();
    if std::env::var_os("PROPTEST_CASES").is_some() {
        return asked;
    }
    Config {
        cases: size(in_ci, full),
        ..asked
    }
}
