//! The configuration file: TOML, each value with its line number.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::setting::Setting;
use super::value::Given;

/// A value in the file.
pub(super) struct Entry<'a> {
    /// The setting it is for.
    pub(super) setting: &'a Setting,
    /// As given in the file.
    pub(super) given: Given,
    /// From 1.
    pub(super) line: usize,
}

/// A fault in a file, and its line.
pub(super) struct FileFault {
    /// From 1.
    pub(super) line: usize,
    /// Names the key concerned.
    pub(super) detail: String,
}

/// The values in a file, and everything in it that is not one.
pub(super) fn read<'a>(text: &str, settings: &'a [Setting]) -> (Vec<Entry<'a>>, Vec<FileFault>) {
    let mut reader = Reader {
        text,
        settings,
        entries: Vec::new(),
        faults: Vec::new(),
    };
    match DeTable::parse(text) {
        Ok(top) => reader.table("", top.get_ref()),
        Err(error) => {
            let start = error.span().map_or(0, |span| span.start);
            reader.fault(start, error.message().to_owned());
        }
    }
    // In file order; the parser returns tables in alphabetical order.
    reader.entries.sort_by_key(|entry| entry.line);
    reader.faults.sort_by_key(|fault| fault.line);
    (reader.entries, reader.faults)
}

struct Reader<'a, 'text> {
    text: &'text str,
    settings: &'a [Setting],
    entries: Vec<Entry<'a>>,
    faults: Vec<FileFault>,
}

impl Reader<'_, '_> {
    /// Read the table called `name`; the top level of the file has an empty name.
    fn table(&mut self, name: &'static str, table: &DeTable) {
        for (key, value) in table {
            let start = key.span().start;
            let key = key.get_ref().as_ref();
            let known = |setting: &&Setting| setting.path() == (name, key);
            let as_table = || {
                let tables = self.settings.iter().map(|setting| setting.path().0);
                tables
                    .filter(|_| name.is_empty())
                    .find(|table| *table == key && !table.is_empty())
            };
            if let Some(setting) = self.settings.iter().find(known) {
                let (given, line) = (given(value), self.line(start));
                self.entries.push(Entry {
                    setting,
                    given,
                    line,
                });
            } else if let Some(table) = as_table() {
                match value.get_ref() {
                    DeValue::Table(inner) => self.table(table, inner),
                    _ => self.fault(
                        start,
                        format!("{key} must be a table with {}", self.known(table)),
                    ),
                }
            } else {
                let dot = if name.is_empty() { "" } else { "." };
                self.fault(
                    start,
                    format!(
                        "{name}{dot}{key} is unknown, must be one of {}",
                        self.known(name)
                    ),
                );
            }
        }
    }

    /// The keys of a table; at the top level, table names too.
    fn known(&self, table: &str) -> String {
        let mut names: Vec<&str> = Vec::new();
        for (its_table, key) in self.settings.iter().map(Setting::path) {
            let name = if its_table == table { key } else { its_table };
            if (its_table == table || table.is_empty()) && !names.contains(&name) {
                names.push(name);
            }
        }
        names.join(", ")
    }

    fn line(&self, start: usize) -> usize {
        1 + self.text[..start].matches('\n').count()
    }

    fn fault(&mut self, start: usize, detail: String) {
        let line = self.line(start);
        self.faults.push(FileFault { line, detail });
    }
}

fn given(value: &Spanned<DeValue>) -> Given {
    let other = |value: &DeValue| Given::Other(value.type_str());
    match value.get_ref() {
        DeValue::String(text) => Given::Text(text.to_string()),
        DeValue::Boolean(truth) => Given::Bool(*truth),
        value @ DeValue::Integer(number) => {
            let number = i128::from_str_radix(number.as_str(), number.radix());
            number.map_or_else(|_| other(value), Given::Integer)
        }
        value @ DeValue::Float(number) => {
            let number = number.as_str().parse();
            number.map_or_else(|_| other(value), Given::Float)
        }
        value @ DeValue::Array(items) => {
            let texts = items
                .iter()
                .map(|item| item.get_ref().as_str().map(str::to_owned));
            let texts: Option<Vec<String>> = texts.collect();
            texts.map_or_else(|| other(value), Given::List)
        }
        value => other(value),
    }
}
