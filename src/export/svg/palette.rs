//! The colours of the drawing, for white paper and for red-green colour blindness.

/// Text and axes.
pub(super) const INK: &str = "#1c2630";
/// Secondary text.
pub(super) const MUTED: &str = "#5b6671";
/// Thin lines of the axes.
pub(super) const RULE: &str = "#d5dade";
/// The route of a feasible plan.
pub(super) const ROUTE: &str = "#0a4da3";
/// The route of an infeasible plan; used for nothing else.
pub(super) const BROKEN: &str = "#d0021b";
/// Solid parts and soft zones of threats.
pub(super) const THREAT: &str = "#6a2c70";
/// The ground in the profile, and contour lines.
pub(super) const SOIL: &str = "#8d7757";

/// From the lowest to the highest ground.
const TINTS: [[f64; 3]; 6] = [
    [228.0, 236.0, 219.0],
    [237.0, 240.0, 221.0],
    [245.0, 239.0, 214.0],
    [237.0, 222.0, 191.0],
    [222.0, 199.0, 167.0],
    [205.0, 178.0, 151.0],
];

/// Tint of the ground at `share` (0 to 1) between the lowest and the highest.
pub(super) fn tint(share: f64) -> String {
    let mut place = share.clamp(0.0, 1.0) * (TINTS.len() - 1) as f64;
    let mut idx = 0;
    while place > 1.0 {
        place -= 1.0;
        idx += 1;
    }
    let mut text = "#".to_owned();
    for (below, above) in TINTS[idx].iter().zip(TINTS[idx + 1]) {
        let channel = (below + (above - below) * place).round();
        text.push_str(&hex(channel));
    }
    text
}

/// Two hexadecimal digits of a whole number from 0 to 255.
fn hex(channel: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between two tints, so from 0 to 255"
    )]
    let channel = channel as u8;
    format!("{channel:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tints_run_from_end_to_end() {
        for (share, expected) in [
            (-1.0, "#e4ecdb"),
            (0.0, "#e4ecdb"),
            (0.1, "#e9eedc"),
            (1.0, "#cdb297"),
            (2.0, "#cdb297"),
        ] {
            assert_eq!(tint(share), expected, "{share}");
        }
    }
}
