//! How the ground is sampled for drawing.

/// The `at`-th of `count` places that are evenly spaced from `from` to `to`; the last is `to` itself.
pub(super) fn between(from: f64, to: f64, at: usize, count: usize) -> f64 {
    let last = count - 1;
    if at == last {
        to
    } else {
        from + (to - from) * at as f64 / last as f64
    }
}

/// Rounded: no drawing shows less than a centimetre.
pub(super) fn to_the_centimetre(metres: f64) -> f64 {
    (metres * 100.0).round() / 100.0
}
