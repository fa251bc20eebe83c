//! The text of a drawing: elements, numbers and escaped strings, without knowledge of routes.

use std::fmt::Write as _;

/// A point of the sheet, pixels, `y` downwards.
pub(super) type Spot = (f64, f64);

/// An upright rectangle of the sheet, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// The rectangle of `size` centred at `at`.
    pub(super) fn about(at: Spot, (width, height): (f64, f64)) -> Self {
        Self {
            left: at.0 - width / 2.0,
            top: at.1 - height / 2.0,
            width,
            height,
        }
    }

    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right()
            && other.left < self.right()
            && self.top < other.bottom()
            && other.top < self.bottom()
    }

    pub(super) fn encloses(&self, other: &Self) -> bool {
        self.left <= other.left
            && self.top <= other.top
            && self.right() >= other.right()
            && self.bottom() >= other.bottom()
    }
}

/// Appearance of a piece of text.
#[derive(Debug, Clone, Copy)]
pub(super) struct Font {
    pub(super) size: f64,
    pub(super) fill: &'static str,
    /// `start`, `middle` or `end`.
    pub(super) anchor: &'static str,
    pub(super) bold: bool,
    /// Outlined in white, so that it is readable on any background.
    pub(super) halo: bool,
}

impl Font {
    pub(super) const fn new(size: f64, fill: &'static str) -> Self {
        Self {
            size,
            fill,
            anchor: "start",
            bold: false,
            halo: false,
        }
    }

    pub(super) const fn anchor(mut self, anchor: &'static str) -> Self {
        self.anchor = anchor;
        self
    }

    pub(super) const fn bold(mut self) -> Self {
        self.bold = true;
        self
    }

    pub(super) const fn halo(mut self) -> Self {
        self.halo = true;
        self
    }

    /// Estimated size of `text`, pixels; slightly more than common sans-serif fonts need.
    pub(super) fn measure(&self, text: &str) -> (f64, f64) {
        let ems: f64 = text.chars().map(ems).sum();
        let weight = if self.bold { 1.07 } else { 1.0 };
        (ems * self.size * weight, self.size * 1.15)
    }

    /// `text`, or as much of its beginning as fits into `width` pixels.
    pub(super) fn fit(&self, text: &str, width: f64) -> String {
        let text = printable(text);
        if self.measure(&text).0 <= width {
            return text;
        }
        let mut kept = String::new();
        for letter in text.chars() {
            kept.push(letter);
            if self.measure(&kept).0 + self.size > width {
                kept.pop();
                break;
            }
        }
        format!("{}\u{2026}", kept.trim_end())
    }
}

/// Width of a character relative to the font size.
fn ems(letter: char) -> f64 {
    match letter {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '!' | '|' | '\'' => 0.32,
        ' ' | 'f' | 'r' | 't' | '(' | ')' | '[' | ']' | '/' | '-' | '\u{b7}' => 0.40,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '\u{2026}' => 0.98,
        'A'..='Z' | '=' | '+' | '<' | '>' | '~' | '#' => 0.74,
        '\u{0}'..='\u{24f}' => 0.62,
        '\u{250}'..='\u{10ff}' => 0.72,
        _ => 1.1,
    }
}

/// The document under construction.
pub(super) struct Canvas {
    text: String,
}

impl Canvas {
    pub(super) fn new(width: f64, height: f64) -> Self {
        let (width, height) = (num(width), num(height));
        Self {
            text: format!(
                "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" \
                 version=\"1.1\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
                 font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n"
            ),
        }
    }

    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>");
        self.text
    }

    /// An element without content; `attributes` are the program's own and need no escaping.
    pub(super) fn element(&mut self, name: &str, attributes: &str) {
        self.line(&format!("<{name} {attributes}/>"));
    }

    /// An element whose content is written by `fill`.
    pub(super) fn group(&mut self, name: &str, attributes: &str, fill: impl FnOnce(&mut Self)) {
        let space = if attributes.is_empty() { "" } else { " " };
        self.line(&format!("<{name}{space}{attributes}>"));
        fill(self);
        self.line(&format!("</{name}>"));
    }

    /// Title of the document or of the enclosing group; viewers show it as a tooltip.
    pub(super) fn title(&mut self, words: &str) {
        self.line(&format!("<title>{}</title>", escaped(words)));
    }

    /// One line of text with its baseline at `at`.
    pub(super) fn text(&mut self, at: Spot, font: &Font, words: &str) {
        self.turned_text(at, 0.0, font, words);
    }

    /// One line of text, rotated clockwise by `degrees` about `at`.
    pub(super) fn turned_text(&mut self, at: Spot, degrees: f64, font: &Font, words: &str) {
        let (x, y) = (num(at.0), num(at.1));
        let mut style = format!("x=\"{x}\" y=\"{y}\" font-size=\"{}\"", num(font.size));
        if degrees != 0.0 {
            let _ = write!(style, " transform=\"rotate({} {x} {y})\"", num(degrees));
        }
        if font.anchor != "start" {
            let _ = write!(style, " text-anchor=\"{}\"", font.anchor);
        }
        if font.bold {
            style.push_str(" font-weight=\"bold\"");
        }
        let words = escaped(words);
        if font.halo {
            self.line(&format!(
                "<text {style} fill=\"none\" stroke=\"#fff\" stroke-width=\"3\" stroke-opacity=\"0.8\" \
                 stroke-linejoin=\"round\">{words}</text>"
            ));
        }
        self.line(&format!(
            "<text {style} fill=\"{}\">{words}</text>",
            font.fill
        ));
    }

    pub(super) fn rect(&mut self, area: &Area, style: &str) {
        let [x, y, w, h] = [area.left, area.top, area.width, area.height].map(num);
        self.element(
            "rect",
            &format!("x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" {style}"),
        );
    }

    pub(super) fn circle(&mut self, at: Spot, radius: f64, style: &str) {
        let [x, y, r] = [at.0, at.1, radius].map(num);
        self.element(
            "circle",
            &format!("cx=\"{x}\" cy=\"{y}\" r=\"{r}\" {style}"),
        );
    }

    pub(super) fn line_between(&mut self, from: Spot, to: Spot, style: &str) {
        self.path(&polyline(&[from, to]), style);
    }

    pub(super) fn path(&mut self, data: &str, style: &str) {
        self.element("path", &format!("d=\"{data}\" {style}"));
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }
}

/// Path data of an open line; points that round to the same position are merged.
pub(super) fn polyline(points: &[Spot]) -> String {
    let mut data = String::new();
    // In tenths of a pixel, relative to the last written point, so that rounding errors do not accumulate.
    let mut last: Option<(f64, f64)> = None;
    for point in points {
        let here = (tenths(point.0), tenths(point.1));
        match last {
            None => {
                let _ = write!(data, "M{} {}l", num(here.0 / 10.0), num(here.1 / 10.0));
            }
            Some(last) => {
                let step = (here.0 - last.0, here.1 - last.1);
                if step == (0.0, 0.0) {
                    continue;
                }
                let y = num(step.1 / 10.0);
                let gap = if y.starts_with('-') { "" } else { " " };
                let lead = if data.ends_with('l') { "" } else { " " };
                let _ = write!(data, "{lead}{}{gap}{y}", num(step.0 / 10.0));
            }
        }
        last = Some(here);
    }
    if data.ends_with('l') {
        // A single position: a dot, if drawn with round caps.
        data.push_str("0 0");
    }
    data
}

/// Path data of a closed ring.
pub(super) fn ring(points: &[Spot]) -> String {
    format!("{}z", polyline(points))
}

fn tenths(pixels: f64) -> f64 {
    // Far off the sheet nothing is visible, and SVG viewers keep only single precision.
    (pixels.clamp(-1e6, 1e6) * 10.0).round()
}

/// Rounded to a tenth, in as few characters as possible.
pub(super) fn num(value: f64) -> String {
    let text = format!("{:.1}", tenths(value) / 10.0);
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

/// `words` without characters that XML 1.0 forbids or that would reorder the text around it.
fn printable(words: &str) -> String {
    let kept = |letter: &char| {
        !letter.is_control()
            && !matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
            && !matches!(letter, '\u{fffe}' | '\u{ffff}')
    };
    let spaced = |letter| {
        if matches!(letter, '\t' | '\n' | '\r') {
            ' '
        } else {
            letter
        }
    };
    words.chars().map(spaced).filter(kept).collect()
}

fn escaped(words: &str) -> String {
    printable(words)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, expected) in [
            (0.0, "0"),
            (-0.04, "0"),
            (12.0, "12"),
            (0.25, "0.3"),
            (-2.55, "-2.6"),
            (1e12, "1000000"),
        ] {
            assert_eq!(num(value), expected);
        }
    }

    #[test]
    fn lines_are_relative_and_skip_what_does_not_move() {
        let line = [(1.0, 2.0), (1.01, 2.01), (3.0, 1.0), (3.5, 1.25)];
        assert_eq!(polyline(&line), "M1 2l2-1 0.5 0.3");
        assert_eq!(polyline(&line[..1]), "M1 2l0 0");
        assert_eq!(ring(&line[2..]), "M3 1l0.5 0.3z");
    }

    #[test]
    fn words_are_escaped_and_stripped() {
        assert_eq!(
            escaped("a\u{0}b<c>&\u{1b}\u{202e}\u{fffe}\td"),
            "ab&lt;c&gt;&amp; d"
        );
    }

    #[test]
    fn long_words_are_cut() {
        let font = Font::new(10.0, "#000");
        assert_eq!(font.fit("short", 100.0), "short");
        let cut = font.fit("a name that goes on and on", 60.0);
        assert!(
            cut.ends_with('\u{2026}') && font.measure(&cut).0 <= 65.0,
            "{cut}"
        );
    }
}
