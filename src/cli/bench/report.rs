//! The output of a measurement: pages for people, tables for programs, drawings.

use std::fs;
use std::io;
use std::path::Path;

use super::table::Table;
use crate::cli::files;

/// A finished measurement.
pub(super) struct Report {
    pub(super) title: String,
    /// What was run, and how to read it; a paragraph.
    pub(super) intro: String,
    pub(super) tables: Vec<Table>,
    /// Written as CSV only.
    pub(super) raw: Vec<Table>,
    pub(super) drawings: Vec<Drawing>,
}

/// A drawing with its caption.
pub(super) struct Drawing {
    /// Name of its file.
    pub(super) name: String,
    pub(super) caption: String,
    pub(super) svg: String,
}

impl Report {
    /// Write `NAME.md`, one CSV file a table, one SVG file a drawing.
    pub(super) fn save(&self, directory: &Path, name: &str) -> io::Result<()> {
        fs::create_dir_all(directory)?;
        for table in self.tables.iter().chain(&self.raw) {
            let file = format!("{name}-{}.csv", table.name);
            fs::write(directory.join(file), table.to_csv())?;
        }
        let mut page = vec![self.to_markdown()];
        for drawing in &self.drawings {
            let file = format!("{name}-{}.svg", drawing.name);
            fs::write(directory.join(&file), &drawing.svg)?;
            page.push(format!("![{}]({file})\n", drawing.caption));
        }
        fs::write(directory.join(format!("{name}.md")), page.join("\n"))
    }

    /// Write the page alone to standard output.
    pub(super) fn print(&self) -> anyhow::Result<()> {
        files::print(&self.to_markdown())
    }

    fn to_markdown(&self) -> String {
        let tables = self.tables.iter().map(Table::to_markdown);
        let mut parts = vec![format!("# {}\n\n{}\n", self.title, self.intro)];
        parts.extend(tables);
        parts.join("\n")
    }
}
