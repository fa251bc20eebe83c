//! The layers of the crate: each room imports only from the rooms above it and names only its own libraries.

use std::fs;
use std::path::{Path, PathBuf};

/// What a room may import from the crate.
enum Imports {
    /// Any room in a row above its own.
    Above,
    /// Only these, wherever they stand.
    Only(&'static [&'static str]),
}
use Imports::{Above, Only};

/// From the ground up: geometry knows nothing of flying, the optimizers nothing of routes, the engine nothing
/// of stored plans, and no room knows the command line. Flags and logs stand below the engine: everything that
/// may change a result is in the request.
const ROOMS: [(&str, Imports); 20] = [
    ("digest", Only(&[])),
    ("durable", Only(&[])),
    ("geometry", Only(&[])),
    ("terrain", Above),
    ("threat", Above),
    ("scenario", Above),
    ("cost", Above),
    ("optimizer", Only(&[])),
    ("seeding", Above),
    ("planner", Above),
    ("export", Above),
    ("import", Only(&["geometry"])),
    ("job", Above),
    ("config", Only(&["scenario"])),
    ("telemetry", Only(&["config"])),
    ("catalogue", Above),
    ("store", Above),
    ("worker", Above),
    ("http", Above),
    ("cli", Above),
];

/// Libraries that only the listed rooms may name.
const LIBRARIES: [(&str, &[&str]); 15] = [
    ("axum", &["http", "cli"]),
    ("hyper", &["http", "cli"]),
    ("hyper_util", &["http", "cli"]),
    ("http_body_util", &["http", "cli"]),
    ("tower", &["http", "cli"]),
    ("tower_http", &["http", "cli"]),
    ("tokio", &["store", "worker", "http", "cli"]),
    ("rusqlite", &["store"]),
    ("prometheus_client", &["telemetry"]),
    ("opentelemetry", &["telemetry"]),
    ("anyhow", &["cli"]),
    ("tiff_reader", &["terrain"]),
    ("geotiff_core", &["terrain"]),
    ("proj4rs", &["terrain"]),
    ("crs_definitions", &["terrain"]),
];

#[test]
fn every_room_imports_only_from_rooms_above_it() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        faults.extend(imports_out_of_rank(&path, &text));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_library_is_named_only_in_its_own_rooms() {
    let mut faults = Vec::new();
    for (path, text) in sources() {
        faults.extend(libraries_out_of_place(&path, &text));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_table_lists_exactly_the_existing_rooms() {
    let mut there: Vec<String> = sources()
        .iter()
        .map(|(path, _)| room_of(path).to_owned())
        .collect();
    there.sort_unstable();
    there.dedup();
    let mut listed = ROOMS.map(|(room, _)| room);
    listed.sort_unstable();
    assert_eq!(there, listed);
}

#[test]
fn the_checker_finds_imports_out_of_rank() {
    #[track_caller]
    fn check(path: &str, text: &str, expected: &[&str]) {
        let found = imports_out_of_rank(Path::new(path), text);
        let expected: Vec<String> = expected
            .iter()
            .map(|target| format!("{path} imports {target}"))
            .collect();
        assert_eq!(found, expected, "{text}");
    }
    // Above, or within the room.
    check("cost/fuel.rs", "use crate::geometry::Point3;", &[]);
    check(
        "cost/fuel.rs",
        "use crate::cost::Route; use super::Route;",
        &[],
    );
    check(
        "cost/fuel.rs",
        "pub(crate) fn a() {} use crate::VERSION;",
        &[],
    );
    // Below, in every spelling.
    check("cost/fuel.rs", "use crate::planner::plan;", &["planner"]);
    check("cost/fuel.rs", "use crate::planner;", &["planner"]);
    check(
        "cost/fuel.rs",
        "pub use crate :: planner :: plan ;",
        &["planner"],
    );
    check(
        "cost/fuel.rs",
        "fn a() -> crate::job::Plan { b() }",
        &["job"],
    );
    check(
        "cost/fuel.rs",
        "use crate::{geometry::{Point3, http}, job::{Plan, State}, cli};",
        &["job", "cli"],
    );
    check("cost/mod.rs", "use super::planner::plan;", &["planner"]);
    check(
        "cost/fuel.rs",
        "use super::super::planner::plan;",
        &["planner"],
    );
    check(
        "cost/mod.rs",
        "mod tests { use super::super::planner; }",
        &["planner"],
    );
    check(
        "telemetry.rs",
        "use super::{config, store::Store};",
        &["store"],
    );
    // A module may have the name of a room.
    check("scenario/json/fields.rs", "use super::planner::read;", &[]);
    check(
        "scenario/json/mod.rs",
        "mod tests { use super::planner::read; }",
        &[],
    );
    check(
        "scenario/json/mod.rs",
        "mod tests { } use super::super::job;",
        &["job"],
    );
    // Rooms that may import nothing, or only one other.
    check(
        "optimizer/swarm.rs",
        "use crate::geometry::Point3;",
        &["geometry"],
    );
    check("telemetry.rs", "use crate::config::LogFormat;", &[]);
    check("planner/mod.rs", "use crate::config::Serve;", &["config"]);
    // Not code.
    check(
        "cost/fuel.rs",
        "/// Called by [`crate::planner::plan`].\nfn a() {}",
        &[],
    );
    check(
        "cost/fuel.rs",
        "/* use /* of */ crate::job; */ fn a() {}",
        &[],
    );
    check(
        "cost/fuel.rs",
        r##"const A: &str = r#"" use crate::job; "#;"##,
        &[],
    );
    check(
        "cost/fuel.rs",
        r#"const A: &str = "\" use crate::job;";"#,
        &[],
    );
    check(
        "cost/fuel.rs",
        "fn a<'a>(b: &'a u8) { c('\"', '\\''); } use crate::job;",
        &["job"],
    );
}

#[test]
fn the_checker_finds_libraries_out_of_place() {
    #[track_caller]
    fn check(path: &str, text: &str, expected: &[&str]) {
        let found = libraries_out_of_place(Path::new(path), text);
        let expected: Vec<String> = expected
            .iter()
            .map(|library| format!("{path} names {library}"))
            .collect();
        assert_eq!(found, expected, "{text}");
    }
    check("http/mod.rs", "use axum::Router;", &[]);
    check("store/mod.rs", "use axum::Router;", &["axum"]);
    check("store/sqlite/mod.rs", "use rusqlite::Connection;", &[]);
    check("http/mod.rs", "use rusqlite as sql;", &["rusqlite"]);
    check(
        "planner/mod.rs",
        "fn a() { ::tokio::spawn(b); }",
        &["tokio"],
    );
    check("job/mod.rs", "#[tokio::test]\nasync fn a() {}", &["tokio"]);
    check("worker/mod.rs", "use anyhow::Context;", &["anyhow"]);
    // Words that only look like libraries.
    check(
        "planner/mod.rs",
        "let tower = 1; self.axum(); crate::planner::hyper::a();",
        &[],
    );
}

/// The rooms that `text` names and its room may not import.
fn imports_out_of_rank(path: &Path, text: &str) -> Vec<String> {
    let room = room_of(path);
    let rank = |room: &str| ROOMS.iter().position(|(name, _)| *name == room);
    let own = rank(room).unwrap_or_else(|| panic!("{} is in no room of the table", path.display()));
    let may_import = |target: usize| match &ROOMS[own].1 {
        Above => target <= own,
        Only(targets) => target == own || targets.contains(&ROOMS[target].0),
    };
    named_of_the_crate(path, &tokens(text))
        .into_iter()
        .filter(|target| rank(target).is_some_and(|target| !may_import(target)))
        .map(|target| format!("{} imports {target}", path.display()))
        .collect()
}

/// The libraries that `text` names and its room may not name.
fn libraries_out_of_place(path: &Path, text: &str) -> Vec<String> {
    let room = room_of(path);
    let tokens = tokens(text);
    let word = |at: Option<usize>| at.and_then(|at| tokens.get(at)).map_or("", String::as_str);
    let names = |library: &str| {
        (0..tokens.len()).any(|at| {
            let inside_a_path = word(at.checked_sub(1)) == "::" && is_word(word(at.checked_sub(2)));
            let is_a_path = word(Some(at + 1)) == "::" || word(at.checked_sub(1)) == "use";
            tokens[at] == library && is_a_path && !inside_a_path
        })
    };
    LIBRARIES
        .iter()
        .filter(|(library, rooms)| !rooms.contains(&room) && names(library))
        .map(|(library, _)| format!("{} names {library}", path.display()))
        .collect()
}

/// The names directly below the crate root in the paths of a file: `a` and `b` in `crate::a` and in
/// `crate::{a::c, b}`, or reached through enough steps of `super`.
fn named_of_the_crate<'a>(path: &Path, tokens: &'a [String]) -> Vec<&'a str> {
    // `cost/mod.rs` and `config.rs` are one step below the root, `cost/fuel.rs` is two.
    let file_depth = path.components().count() - usize::from(path.ends_with("mod.rs"));
    let mut named = Vec::new();
    // For each open brace, whether it opens a module.
    let mut braces = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        match tokens[at].as_str() {
            "{" => braces.push(at >= 2 && tokens[at - 2] == "mod"),
            "}" => drop(braces.pop()),
            "crate" => named.extend(first_segments(&tokens[at + 1..])),
            "super" => {
                let supers = 1 + tokens[at + 1..]
                    .chunks_exact(2)
                    .take_while(|pair| pair[0] == "::" && pair[1] == "super")
                    .count();
                at += 2 * (supers - 1);
                let depth = file_depth + braces.iter().filter(|of_module| **of_module).count();
                if supers == depth {
                    named.extend(first_segments(&tokens[at + 1..]));
                }
            }
            _ => (),
        }
        at += 1;
    }
    named
}

/// The first segments of the paths that follow `crate` or `super`.
fn first_segments(rest: &[String]) -> Vec<&str> {
    match rest {
        [colons, open, list @ ..] if colons == "::" && open == "{" => {
            let mut depth = 0;
            let mut starts = true;
            let mut segments = Vec::new();
            for token in list {
                match token.as_str() {
                    "{" => depth += 1,
                    "}" if depth == 0 => break,
                    "}" => depth -= 1,
                    "," if depth == 0 => starts = true,
                    segment if starts => {
                        segments.push(segment);
                        starts = false;
                    }
                    _ => (),
                }
            }
            segments
        }
        [colons, segment, ..] if colons == "::" => vec![segment],
        _ => Vec::new(),
    }
}

/// The words of a source text, `::`, and every other character on its own; without comments and literals.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            block_comment(rest)
        } else if let Some(length) = quoted(rest) {
            length
        } else if is_word(&rest[..first.len_utf8()]) {
            let length = rest
                .find(|c: char| !(c.is_alphanumeric() || c == '_'))
                .unwrap_or(rest.len());
            tokens.push(rest[..length].to_owned());
            length
        } else {
            let length = if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            if !first.is_whitespace() {
                tokens.push(rest[..length].to_owned());
            }
            length
        };
        rest = &rest[length..];
    }
    tokens
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Length in bytes of the block comment that `text` starts with; comments nest.
fn block_comment(text: &str) -> usize {
    let mut depth = 0;
    let mut at = 0;
    while at < text.len() {
        match text.as_bytes().get(at..at + 2) {
            Some(b"/*") => (depth, at) = (depth + 1, at + 2),
            Some(b"*/") if depth == 1 => return at + 2,
            Some(b"*/") => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
    }
    text.len()
}

/// Length in bytes of the string or character literal that `text` starts with, if any.
fn quoted(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let prefix = usize::from(bytes.starts_with(b"b"));
    if bytes[prefix..].starts_with(b"r\"") || bytes[prefix..].starts_with(b"r#") {
        let hashes = bytes[prefix + 1..]
            .iter()
            .take_while(|b| **b == b'#')
            .count();
        let start = prefix + 1 + hashes + 1;
        if bytes.get(start - 1) != Some(&b'"') {
            return None; // A raw identifier.
        }
        let end = format!("\"{}", "#".repeat(hashes));
        return Some(
            text[start..]
                .find(&end)
                .map_or(text.len(), |at| start + at + end.len()),
        );
    }
    match bytes.get(prefix) {
        Some(b'"') => Some(closed_by(b'"', bytes, prefix + 1)),
        // A character literal, unless it is a lifetime, which has no closing quote.
        Some(b'\'') if bytes.get(prefix + 1) == Some(&b'\\') => {
            Some(closed_by(b'\'', bytes, prefix + 1))
        }
        Some(b'\'') => {
            let character = text[prefix + 1..].chars().next()?;
            let end = prefix + 1 + character.len_utf8();
            (bytes.get(end) == Some(&b'\'')).then_some(end + 1)
        }
        _ => None,
    }
}

/// The position after the next `quote` without a backslash before it.
fn closed_by(quote: u8, bytes: &[u8], mut at: usize) -> usize {
    while at < bytes.len() && bytes[at] != quote {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(bytes.len())
}

/// The room of a file, from its path below `src`.
fn room_of(path: &Path) -> &str {
    let first = path.iter().next().and_then(|first| first.to_str());
    first.expect("a path below src").trim_end_matches(".rs")
}

/// The path below `src` and the text of every file of every room.
fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut directories = vec![root.clone()];
    let mut sources = Vec::new();
    while let Some(directory) = directories.pop() {
        for entry in fs::read_dir(&directory).expect("the directory is there") {
            let path = entry.expect("it can be listed").path();
            let below = path
                .strip_prefix(&root)
                .expect("it is below src")
                .to_owned();
            if path.is_dir() {
                directories.push(path);
            } else if below.extension().is_some_and(|extension| extension == "rs")
                && below != Path::new("lib.rs")
                && below != Path::new("main.rs")
            {
                sources.push((below, fs::read_to_string(&path).expect("it is text")));
            }
        }
    }
    sources
}
