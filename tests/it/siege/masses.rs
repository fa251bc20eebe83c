//! Very many plans and documents: memory use stays bounded, surplus plans are removed, nothing breaks.

use std::time::{Duration, Instant};

use futures_util::stream::{self, StreamExt as _};
use noctule::planner;
use noctule::scenario::json;
use noctule::scenario::limits::Limits;
use serde_json::Value;

use super::Dice;
use crate::support::api::Api;
use crate::support::patience::in_time;
use crate::support::process::Service;
use crate::support::scenario;
use crate::support::size::size;

/// Ended plans that are retained.
const KEPT: usize = 200;

#[tokio::test(flavor = "multi_thread")]
async fn thousands_of_plans_stay_within_memory_and_retention() {
    let n_plans = size(600, 100_000);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let kept = KEPT.to_string();
    let service = Service::start(
        directory.path(),
        &["--workers", "2", "--retention-plans", &kept],
    );
    let mut tiny = scenario();
    tiny["planner"]["population"] = 2.into();
    tiny["planner"]["iterations"] = 1.into();
    tiny["planner"]["waypoints"] = 2.into();
    let run_half = async || {
        let runs = stream::iter(0..n_plans / 2).map(async |_| {
            let address = service.submit(&tiny).await;
            let request = service.get(&address).header("prefer", "wait=30");
            let status = request.send().await.expect("an answer").status();
            // Retention may have removed it already.
            assert!(status == 200 || status == 410, "{status}");
            let asked = Instant::now();
            service.get(&address).send().await.expect("an answer");
            asked.elapsed()
        });
        let mut waits: Vec<Duration> = runs.buffer_unordered(16).collect().await;
        waits.sort_unstable();
        println!("GET of a plan: p99 {:.1?}", waits[waits.len() * 99 / 100]);
        service.rss_kib()
    };
    let first = run_half().await;
    let second = run_half().await;
    println!(
        "{first} KiB after {} plans, {second} KiB after {n_plans}",
        n_plans / 2
    );
    // With few plans, allocator noise is larger.
    assert!(
        second as f64 <= size(1.2, 1.1) * first as f64,
        "{first} KiB, then {second} KiB"
    );

    let settled = async {
        loop {
            let listed: Value =
                serde_json::from_slice(&service.bytes("/plans?limit=1000").await).expect("JSON");
            if listed["plans"].as_array().expect("a list").len() <= KEPT {
                return;
            }
        }
    };
    in_time(settled).await;
}

/// Valid documents to damage.
const CORPUS: [&str; 5] = [
    crate::scenario::IN_DEGREES,
    include_str!("../../../scenarios/paper-1.json"),
    include_str!("../../../scenarios/paper-4.json"),
    crate::scenario::FULL,
    r#"{"start":{"x":0,"y":0,"z":0},"target":{"x":300,"y":400,"z":0},"altitude":{"min":0,"max":200}}"#,
];

/// Words that break JSON readers and scenario readers.
const WORDS: [&str; 24] = [
    "NaN",
    "-0",
    "-0.0",
    "1e999",
    "-1e999",
    "1e-400",
    "9007199254740993",
    "18446744073709551616",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"\\ud800\"",
    "\"\\udc00\\ud800\"",
    "\u{feff}",
    "\\u0000",
    "[[[[[[[[",
    "{\"x\":",
    ",",
    "}",
    "//",
    "\"kind\":\"polygon\"",
    "0.1e-7",
];

/// A document damaged in one to four places.
fn spoilt(dice: &mut Dice) -> Vec<u8> {
    let mut bytes = CORPUS[dice.below(CORPUS.len())].as_bytes().to_vec();
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len().max(1));
        let end = (at + dice.below(40)).min(bytes.len());
        match dice.below(6) {
            0 if !bytes.is_empty() => bytes[at] = u8::try_from(dice.below(256)).expect("below"),
            1 => drop(bytes.drain(at..end)),
            2 => drop(bytes.splice(at..end, WORDS[dice.below(WORDS.len())].bytes())),
            3 => {
                let copy = bytes[at..end].to_vec();
                let to = dice.below(bytes.len() + 1);
                drop(bytes.splice(to..to, copy));
            }
            4 => bytes.truncate(end),
            // Replaces a number, so that most documents stay valid JSON.
            _ => {
                if let Some(digit) = bytes[at..].iter().position(u8::is_ascii_digit) {
                    let at = at + digit;
                    let word = WORDS[dice.below(10)];
                    drop(bytes.splice(at..=at, word.bytes()));
                }
            }
        }
    }
    bytes
}

#[test]
fn damaged_documents_are_read_or_refused() {
    let rules = planner::rules(Limits::default());
    let mut dice = Dice::new(3);
    let mut read = 0_usize;
    for _ in 0..size(20_000, 1_000_000) {
        let document = spoilt(&mut dice);
        if let Ok(scenario) = json::read(&document, &rules, 1) {
            read += 1;
            let text = json::write(&scenario);
            let again =
                json::read(text.as_bytes(), &rules, 2).expect("what is written is accepted");
            assert_eq!(again, scenario, "{text}");
        }
    }
    assert!(read > 100, "only {read} were accepted");
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_bodies_never_cause_a_server_error() {
    let api = Api::new();
    let mut dice = Dice::new(4);
    for _ in 0..size(1_000, 20_000) {
        let document = spoilt(&mut dice);
        let headers = [("content-type", "application/json")];
        let path = "/plans?validate_only=true";
        let answer = api
            .send(reqwest::Method::POST, path, &headers, document.clone())
            .await;
        let text = String::from_utf8_lossy(&document);
        assert!(
            [200, 400, 413, 422].contains(&answer.status.as_u16()),
            "{answer:?}\n{text}"
        );
    }
}
