//! How much a test does: an amount that fits CI, or the full size of docs/RELIABILITY.md.

use proptest::test_runner::Config;

/// The amount of work; the full amount under `NOCTULE_SIEGE=full`.
pub(crate) fn size<T>(in_ci: T, full: T) -> T {
    if std::env::var_os("NOCTULE_SIEGE").is_some_and(|size| size == "full") {
        full
    } else {
        in_ci
    }
}

/// The number of cases of a property; `PROPTEST_CASES` takes precedence if set.
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
