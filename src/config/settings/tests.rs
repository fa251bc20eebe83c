//! The table is sound, and the manual has it.

use std::collections::BTreeSet;

use super::*;
use crate::config::Config;
use crate::config::value::Given;

#[test]
fn each_has_names_of_its_own_and_those_of_a_table_stand_together() {
    let settings = all();
    let mut seen = BTreeSet::new();
    let mut tables = Vec::new();
    for setting in &settings {
        assert!(seen.insert(setting.flag()), "--{} twice", setting.flag());
        let (table, _) = setting.path();
        if tables.last() != Some(&table) {
            assert!(!tables.contains(&table), "{table} in two parts");
            tables.push(table);
        }
    }
    assert_eq!(
        tables.first(),
        Some(&""),
        "those without a table come first"
    );
}

/// A default that its own row refuses could not be printed and read back.
#[test]
fn each_takes_its_default() {
    let defaults = Config::default();
    for setting in all() {
        let Some(shown) = setting.shown(&defaults) else {
            continue;
        };
        let word = Given::Word(shown.trim_matches('"').to_owned());
        let mut config = defaults.clone();
        assert_eq!(setting.set(&mut config, &word), Ok(()), "{}", setting.key);
        assert_eq!(config, defaults, "{}", setting.key);
    }
}

#[test]
fn each_is_in_the_manual() {
    let manual = include_str!("../../../docs/OPERATIONS.md");
    let flagged = |line: &&str| {
        let flag = line.split(" | ").nth(1);
        flag.is_some_and(|flag| flag.starts_with("`--"))
    };
    let rows = manual.lines().filter(flagged);
    let rows: Vec<&str> = rows.collect();
    let settings = all();
    assert_eq!(rows.len(), settings.len());
    for (row, setting) in rows.iter().zip(settings) {
        let (key, flag, variable) = (setting.key, setting.flag(), setting.variable());
        let expected = format!("| `{key}` | `--{flag}` | `{variable}` ");
        assert!(row.starts_with(&expected), "{row} is not {expected}");
    }
}

#[test]
fn a_refusal_says_what_is_allowed() {
    let check = |key: &str, word: &str, expected: Result<(), &str>| {
        let settings = all();
        let setting = settings.iter().find(|setting| setting.key == key);
        let given = Given::Word(word.to_owned());
        let set = setting.expect(key).set(&mut Config::default(), &given);
        assert_eq!(set, expected.map_err(str::to_owned), "{key} = {word}");
    };
    check("workers", "4096", Ok(()));
    check("workers", "0", Err("a whole number from 1 to 4096"));
    check("workers", "2.5", Err("a whole number from 1 to 4096"));
    check("limits.population", "-1", Err("a whole number from 2"));
    check("http.head_timeout", "1m", Ok(()));
    check(
        "http.head_timeout",
        "2h",
        Err(
            "seconds, or a number with a unit such as 250ms, 30s, 15m, 12h or 30d, from 0.1 to 3600",
        ),
    );
    check("log_format", "xml", Err("text or json"));
    check("cors_origins", "https://a.example, http://b", Ok(()));
    check(
        "cors_origins",
        "https://a.example, *",
        Err("a list of exact origins such as https://plans.example or http://localhost:5173"),
    );
    check("role", "boss", Err("all, api or worker"));
    check("store_replicas", "2", Err("1, 3 or 5"));
    check(
        "store_lease",
        "0.5",
        Err("seconds, or a number with a unit such as 250ms, 30s, 15m, 12h or 30d, from 1 to 3600"),
    );
    check(
        "listen",
        "here",
        Err("an address and a port such as 127.0.0.1:8080"),
    );
}
