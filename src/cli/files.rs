//! Files that commands read and write, including the formats of results.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;

use anyhow::{Context, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;

use crate::export::{self, Format, OPTIONS, Options};

/// What a result is written as.
#[derive(Args)]
pub(super) struct Choice {
    /// Format of the result [default: by the extension of --out, else json]
    #[arg(long, value_parser = PossibleValuesParser::new(export::ALL.iter().map(|format| format.name)))]
    format: Option<String>,
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = option, help = help())]
    options: Vec<(String, String)>,
}

/// A format with its options.
pub(super) struct Chosen {
    pub(super) format: &'static Format,
    pub(super) options: Options,
}

fn option(text: &str) -> Result<(String, String), String> {
    let (name, value) = text
        .split_once('=')
        .ok_or_else(|| format!("{text} is no NAME=VALUE"))?;
    Ok((name.to_owned(), value.to_owned()))
}

fn help() -> String {
    let rows = OPTIONS
        .iter()
        .map(|rule| format!("{}: {}, {}", rule.name, rule.allowed, rule.meaning));
    let rows: Vec<_> = rows.collect();
    format!(
        "An option of the format; each may be given once:\n{}",
        rows.join("\n")
    )
}

impl Choice {
    /// Refuse an option that is given twice, as the service does.
    fn check_once(&self) -> anyhow::Result<()> {
        let mut names = BTreeSet::new();
        for (name, _) in &self.options {
            if !names.insert(name) {
                bail!("--set: {name} is given twice");
            }
        }
        Ok(())
    }

    /// The format of each of `outs`, or of standard output when there are none.
    pub(super) fn of(&self, outs: &[&Path]) -> anyhow::Result<Vec<Chosen>> {
        let formats: Vec<&'static Format> = match (&self.format, outs) {
            (Some(_), [_, _, ..]) => {
                bail!(
                    "--format names one format, but --out is given several times: without --format, each file has the format of its extension"
                )
            }
            (Some(name), _) => vec![Format::named(name).expect("clap lets only names through")],
            (None, []) => vec![&export::ALL[0]],
            (None, outs) => outs.iter().map(|out| by_extension(out)).collect(),
        };
        self.check_once()?;
        let known = |format: &Format, name: &str| format.options.contains(&name);
        let mut chosen = Vec::new();
        for &format in &formats {
            // An option applies to those formats that know it.
            let given = self.options.iter().filter(|(name, _)| {
                known(format, name) || !formats.iter().any(|format| known(format, name))
            });
            let given = given.map(|(name, value)| (name.as_str(), value.as_str()));
            let options = Options::read(format, given).context("--set")?;
            // Known before the search, so not reported after it.
            format.fits(&options).context("--set")?;
            chosen.push(Chosen { format, options });
        }
        Ok(chosen)
    }
}

fn by_extension(out: &Path) -> &'static Format {
    let default = &export::ALL[0];
    let Some(extension) = out.extension() else {
        return default;
    };
    let extension = extension.to_string_lossy();
    let named = || Format::named(&extension.to_ascii_lowercase());
    Format::of_extension(&extension)
        .or_else(named)
        .unwrap_or_else(|| {
            let known = export::ALL.iter().map(|format| format.extension);
            eprintln!(
                "{}: no format has the extension {extension}, so it is {}; known are {}, and --format names one",
                out.display(),
                default.name,
                known.collect::<Vec<_>>().join(", ")
            );
            default
        })
}

/// The bytes of a file; `-` is standard input.
pub(super) fn read(file: &Path) -> anyhow::Result<Vec<u8>> {
    let read = || {
        if file == Path::new("-") {
            let mut text = Vec::new();
            io::stdin().lock().read_to_end(&mut text)?;
            return Ok(text);
        }
        fs::read(file)
    };
    read().with_context(|| format!("cannot read {}", file.display()))
}

/// Write a document as lines; `None` and `-` are standard output.
pub(super) fn write(out: Option<&Path>, document: &str) -> anyhow::Result<()> {
    let document = document.strip_suffix('\n').unwrap_or(document);
    let lines = format!("{document}\n");
    match out.filter(|file| *file != Path::new("-")) {
        Some(file) => {
            fs::write(file, lines).with_context(|| format!("cannot write {}", file.display()))
        }
        None => print(&lines),
    }
}

/// Write to standard output. A reader that stops early, such as `head`, has what it wants.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("cannot write to standard output"),
    }
}
