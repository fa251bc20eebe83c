//! Tables, for people as Markdown and for programs as CSV.

use std::fmt::Write;

/// One entry.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Text(String),
    /// With this many digits after the point for people, all of them for programs.
    Number(f64, usize),
    /// In per cent for people.
    Share(f64),
    /// A probability; people want to know whether it is small.
    Probability(f64),
    Missing,
}

impl Cell {
    pub(super) fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    pub(super) fn count(count: usize) -> Self {
        Self::Number(count as f64, 0)
    }

    pub(super) fn number(value: Option<f64>, digits: usize) -> Self {
        value.map_or(Self::Missing, |value| Self::Number(value, digits))
    }

    fn for_people(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(value, digits) => format!("{value:.digits$}"),
            Self::Share(share) => format!("{:.0} %", share * 100.0),
            Self::Probability(p) if *p < 0.001 => "< 0.001".to_owned(),
            Self::Probability(p) => format!("{p:.3}"),
            Self::Missing => "-".to_owned(),
        }
    }

    fn for_programs(&self) -> String {
        match self {
            Self::Text(text) if text.contains([',', '"', '\n']) => {
                format!("\"{}\"", text.replace('"', "\"\""))
            }
            Self::Text(text) => text.clone(),
            Self::Number(value, _) | Self::Share(value) | Self::Probability(value) => {
                value.to_string()
            }
            Self::Missing => String::new(),
        }
    }
}

/// Rows under one heading.
#[derive(Debug, Clone)]
pub(super) struct Table {
    /// Name of its file.
    pub(super) name: &'static str,
    pub(super) title: String,
    /// What the figures mean; a paragraph.
    pub(super) note: String,
    pub(super) columns: Vec<&'static str>,
    pub(super) rows: Vec<Vec<Cell>>,
}

impl Table {
    /// With its heading and its note.
    pub(super) fn to_markdown(&self) -> String {
        let mut page = format!("## {}\n\n{}\n\n", self.title, self.note);
        let line = |cells: &mut dyn Iterator<Item = String>| {
            let cells: Vec<String> = cells.map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        page += &line(&mut self.columns.iter().map(|&column| column.to_owned()));
        let left = matches!(self.rows.first(), Some(row) if matches!(row[0], Cell::Text(_)));
        let rule = |(idx, _)| if idx == 0 && left { "---" } else { "---:" }.to_owned();
        page += &line(&mut self.columns.iter().enumerate().map(rule));
        for row in &self.rows {
            page += &line(&mut row.iter().map(Cell::for_people));
        }
        page
    }

    /// RFC 4180 except for the line ends.
    pub(super) fn to_csv(&self) -> String {
        let mut page = String::new();
        let columns = self.columns.iter().map(|&column| Cell::text(column));
        for row in std::iter::once(&columns.collect()).chain(&self.rows) {
            let cells: Vec<String> = row.iter().map(Cell::for_programs).collect();
            writeln!(page, "{}", cells.join(",")).expect("a String takes everything");
        }
        page
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_written_as_markdown_and_csv() {
        let table = Table {
            name: "small",
            title: "Small".to_owned(),
            note: "A note.".to_owned(),
            columns: vec!["scenario", "mean, m", "feasible", "p"],
            rows: vec![
                vec![
                    Cell::text("a, \"b\""),
                    Cell::Number(1.234_567, 2),
                    Cell::Share(0.5),
                    Cell::Probability(1e-5),
                ],
                vec![
                    Cell::text("a|c"),
                    Cell::number(None, 2),
                    Cell::Share(1.0),
                    Cell::Probability(0.0421),
                ],
            ],
        };
        let markdown = "## Small\n\nA note.\n\n| scenario | mean, m | feasible | p |\n| --- | ---: | ---: | ---: |\n\
            | a, \"b\" | 1.23 | 50 % | < 0.001 |\n| a\\|c | - | 100 % | 0.042 |\n";
        assert_eq!(table.to_markdown(), markdown);
        let csv = "scenario,\"mean, m\",feasible,p\n\"a, \"\"b\"\"\",1.234567,0.5,0.00001\na|c,,1,0.0421\n";
        assert_eq!(table.to_csv(), csv);
    }
}
