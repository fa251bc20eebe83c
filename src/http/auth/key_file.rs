//! The operator's file of keys: TOML, one `[[key]]` each.
//!
//! Refusals name the entry but never repeat its sum: an operator who put the key itself there by mistake would find it
//! in the log.

use data_encoding::HEXLOWER_PERMISSIVE;
use jiff::Timestamp;
use serde::Deserialize;

use super::keys::{Digest, Key, PREFIX};
use super::rate::Rate;
use super::scope::Scope;

/// Longest name, characters.
const MAX_NAME: usize = 100;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    key: Vec<toml::Table>,
}

/// An entry as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    sha256: String,
    scopes: Vec<String>,
    owner: Option<String>,
    expires: Option<toml::Value>,
    active_plans: Option<u64>,
    requests_per_second: Option<f64>,
    burst: Option<u32>,
}

/// The valid keys of a file, and what is wrong with the others.
pub(super) fn read(text: &str) -> (Vec<Key>, Vec<String>) {
    let file: File = match toml::from_str(text) {
        Ok(file) => file,
        Err(error) => {
            let start = error.span().map_or(0, |span| span.start);
            let line = 1 + text[..start].matches('\n').count();
            return (
                Vec::new(),
                vec![format!("line {line}: {}", error.message())],
            );
        }
    };
    let (mut keys, mut faults) = (Vec::new(), Vec::new());
    for (position, table) in file.key.into_iter().enumerate() {
        let place = place(position, &table);
        match entry(table) {
            Ok(key) => keys.push(key),
            Err(fault) => faults.push(format!("{place}: {fault}")),
        }
    }
    (keys, faults)
}

/// An entry's name, or its position where it has none.
fn place(position: usize, table: &toml::Table) -> String {
    match table.get("name").and_then(toml::Value::as_str) {
        Some(name) => format!("key {name:?}"),
        None => format!("key {} of the file", position + 1),
    }
}

fn entry(table: toml::Table) -> Result<Key, String> {
    let entry: Entry = table
        .try_into()
        .map_err(|error: toml::de::Error| error.message().to_owned())?;
    check_name("name", &entry.name)?;
    let owner = entry.owner.unwrap_or_else(|| entry.name.clone());
    check_name("owner", &owner)?;
    if entry.active_plans == Some(0) {
        return Err("active_plans is 0, must be at least 1".to_owned());
    }
    Ok(Key {
        sha256: sum(&entry.sha256)?,
        scopes: scopes(&entry.scopes)?,
        expires: entry.expires.as_ref().map(expires).transpose()?,
        rate: rate(entry.requests_per_second, entry.burst)?,
        active_plans: entry.active_plans,
        name: entry.name,
        owner,
    })
}

/// Names are written to logs as they are.
fn check_name(field: &str, name: &str) -> Result<(), String> {
    let sane =
        (1..=MAX_NAME).contains(&name.chars().count()) && !name.chars().any(char::is_control);
    if sane {
        Ok(())
    } else {
        Err(format!(
            "{field} must be 1 to {MAX_NAME} characters, none of them a control character"
        ))
    }
}

fn sum(text: &str) -> Result<Digest, String> {
    if text.starts_with(PREFIX) {
        return Err("sha256 is the key itself, must be its SHA-256; make a new key, this one has been written down".to_owned());
    }
    let bytes = HEXLOWER_PERMISSIVE.decode(text.as_bytes()).ok();
    bytes
        .and_then(|bytes| bytes.try_into().ok())
        .ok_or_else(|| "sha256 must be 64 hexadecimal digits".to_owned())
}

fn scopes(names: &[String]) -> Result<Vec<Scope>, String> {
    let all = || Scope::ALL.map(Scope::name).join(", ");
    if names.is_empty() {
        return Err(format!("scopes is empty, must have some of {}", all()));
    }
    let read = |name: &String| {
        Scope::from_name(name)
            .ok_or_else(|| format!("the scope {name:?} is unknown, must be one of {}", all()))
    };
    names.iter().map(read).collect()
}

/// Given as a TOML time, or as text.
fn expires(value: &toml::Value) -> Result<Timestamp, String> {
    let text = match value {
        toml::Value::String(text) => text.clone(),
        toml::Value::Datetime(time) => time.to_string(),
        other => other.to_string(),
    };
    text.parse().map_err(|_| {
        format!("expires is {text}, must be a time of RFC 3339 such as 2027-01-31T00:00:00Z")
    })
}

fn rate(per_second: Option<f64>, burst: Option<u32>) -> Result<Option<Rate>, String> {
    let Some(per_second) = per_second else {
        return match burst {
            None => Ok(None),
            Some(_) => Err("burst is given without requests_per_second".to_owned()),
        };
    };
    if !(0.001..=1e6).contains(&per_second) {
        return Err(format!(
            "requests_per_second is {per_second}, must be from 0.001 to 1000000"
        ));
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "1 to 1000000"
    )]
    let default = per_second.ceil() as u32;
    match burst.unwrap_or(default) {
        0 => Err("burst is 0, must be at least 1".to_owned()),
        burst => Ok(Some(Rate { per_second, burst })),
    }
}

#[cfg(test)]
mod tests {
    use super::super::keys::Keys;
    use super::*;

    const SUM: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn an_entry_has_defaults() {
        let text = format!("[[key]]\nname = \"a\"\nsha256 = \"{SUM}\"\nscopes = [\"plan\"]\n");
        let (keys, faults) = read(&text);
        assert_eq!(faults, [""; 0]);
        assert_eq!(keys[0].owner, "a");
        assert_eq!(keys[0].rate, None);
        let more = "owner = \"x\"\nexpires = 2027-01-31T00:00:00Z\nrequests_per_second = 2.5\n";
        let (keys, faults) = read(&(text + more));
        assert_eq!(faults, [""; 0]);
        assert_eq!(keys[0].owner, "x");
        let rate = Rate {
            per_second: 2.5,
            burst: 3,
        };
        assert_eq!(keys[0].rate, Some(rate));
        let expires = keys[0].expires.expect("a time");
        assert_eq!(expires.to_string(), "2027-01-31T00:00:00Z");
    }

    #[test]
    fn refusals_name_the_entry_and_never_its_checksum() {
        #[track_caller]
        fn check(text: &str, expected: &str) {
            let text = text.replace("SUM", SUM);
            let fault = Keys::read(&text).expect_err("refused").to_string();
            assert!(fault.contains(expected), "{fault}");
            assert!(!fault.contains("ba7816bf"), "{fault}");
        }
        let good = "[[key]]\nname = \"a\"\nsha256 = \"SUM\"\nscopes = [\"read\"]\n";
        check("", "there is no [[key]]");
        check("[[key]]\nname =", "line 2");
        check("[[keys]]\nname = \"a\"", "unknown field `keys`");
        check(&format!("{good}{good}"), "two keys have the name \"a\"");
        check(
            &format!("{good}{}", good.replace("\"a\"", "\"b\"")),
            "key \"b\" has the sha256 of another one",
        );
        check(&good.replace("SUM", "abc"), "key \"a\": sha256 must be 64");
        check(
            &good.replace("SUM", "\u{e9}"),
            "key \"a\": sha256 must be 64",
        );
        check(
            &good.replace("SUM", "noctule_ba7816bf"),
            "key \"a\": sha256 is the key itself",
        );
        check(
            &good.replace("read", "write"),
            "key \"a\": the scope \"write\" is unknown, must be one of read, plan, metrics, admin",
        );
        check(&good.replace("\"read\"", ""), "key \"a\": scopes is empty");
        check(&good.replace("name = \"a\"\n", ""), "key 1 of the file");
        check(
            &format!("{good}colour = 1"),
            "key \"a\": unknown field `colour`",
        );
        check(
            &format!("{good}expires = \"soon\""),
            "key \"a\": expires is soon",
        );
        check(
            &format!("{good}expires = 2027-01-31"),
            "key \"a\": expires is",
        );
        check(
            &format!("{good}burst = 2"),
            "key \"a\": burst is given without",
        );
        check(
            &format!("{good}active_plans = 0"),
            "key \"a\": active_plans is 0",
        );
        check(
            &format!("{good}requests_per_second = 0.0"),
            "key \"a\": requests_per_second is 0",
        );
        check(&good.replace("\"a\"", "\"a\\n\""), "name must be 1 to 100");
    }
}
