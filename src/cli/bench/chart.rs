//! Curves of cost over iterations, as SVG.

use std::fmt::Write;

/// One curve: a value an iteration, none while there is none.
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) values: Vec<Option<f64>>,
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 440.0;
/// Left, top, right and bottom of the field.
const FIELD: [f64; 4] = [64.0, 44.0, 640.0, 390.0];
const TICKS: usize = 5;

/// Colours that most colour-blind readers tell apart (Okabe and Ito, Color universal design, 2008).
const COLOURS: [&str; 7] = [
    "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000",
];

/// The drawing; costs on a logarithmic scale.
pub(super) fn draw(title: &str, curves: &[Curve]) -> String {
    let values = || {
        curves
            .iter()
            .flat_map(|curve| curve.values.iter().flatten())
    };
    let least = values().copied().reduce(f64::min).unwrap_or(1.0).max(1e-9);
    let greatest = values().copied().fold(least * 1.01, f64::max);
    let last = curves.iter().map(|curve| curve.values.len()).max();
    let last = last.unwrap_or(0).saturating_sub(1).max(1);
    let [left, top, right, bottom] = FIELD;
    let x = |iteration: f64| left + (right - left) * iteration / last as f64;
    let span = libm::log(greatest / least);
    let y = |cost: f64| bottom - (bottom - top) * libm::log(cost.max(least) / least) / span;

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\n\
         <text x=\"{left}\" y=\"24\" font-size=\"15\">{}</text>\n",
        escaped(title)
    );
    let mut element =
        |markup: String| writeln!(svg, "{markup}").expect("a String takes everything");
    for step in 0..=TICKS {
        let share = step as f64 / TICKS as f64;
        let cost = rounded(least * libm::exp(span * share));
        let at = y(cost);
        element(format!(
            "<line x1=\"{left}\" y1=\"{at:.1}\" x2=\"{right}\" y2=\"{at:.1}\" stroke=\"#dddddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{cost}</text>",
            left - 8.0,
            at + 4.0
        ));
        let iteration = (last as f64 * share).round();
        element(format!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{iteration}</text>",
            x(iteration),
            bottom + 18.0
        ));
    }
    element(format!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">iteration</text>",
        f64::midpoint(left, right),
        bottom + 38.0
    ));
    for (idx, curve) in curves.iter().enumerate() {
        let colour = COLOURS[idx % COLOURS.len()];
        let points: Vec<String> = curve
            .values
            .iter()
            .enumerate()
            .filter_map(|(iteration, value)| {
                value.map(|cost| format!("{:.1},{:.1}", x(iteration as f64), y(cost)))
            })
            .collect();
        element(format!(
            "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" points=\"{}\"/>",
            points.join(" ")
        ));
        let at = top + 20.0 * idx as f64 + 8.0;
        element(format!(
            "<line x1=\"{:.1}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\" stroke=\"{colour}\" stroke-width=\"2\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            right + 14.0,
            right + 36.0,
            right + 42.0,
            at + 4.0,
            escaped(&curve.name)
        ));
    }
    svg + "</svg>\n"
}

/// Rounded to three digits.
fn rounded(value: f64) -> f64 {
    let scale = libm::pow(10.0, 2.0 - libm::floor(libm::log10(value)));
    (value * scale).round() / scale
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_is_well_formed_and_within_its_field() {
        let curves = [
            Curve {
                name: "a<b".to_owned(),
                values: vec![None, Some(900.0), Some(500.0)],
            },
            Curve {
                name: "none".to_owned(),
                values: vec![None; 3],
            },
        ];
        let svg = draw("R&D", &curves);
        let tree = roxmltree::Document::parse(&svg).expect("well-formed");
        let lines: Vec<&str> = tree
            .descendants()
            .filter(|node| node.has_tag_name("polyline"))
            .filter_map(|node| node.attribute("points"))
            .collect();
        assert_eq!(lines, ["352.0,44.0 640.0,390.0", ""]);
        let texts: Vec<&str> = tree.descendants().filter_map(|node| node.text()).collect();
        assert!(texts.contains(&"R&D") && texts.contains(&"a<b") && texts.contains(&"900"));
        // An empty drawing is still valid.
        assert!(roxmltree::Document::parse(&draw("", &[])).is_ok());
    }
}
