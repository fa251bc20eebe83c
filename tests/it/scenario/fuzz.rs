//! Malformed scenario documents: nothing panics, and accepted ones survive a round trip.

use noctule::scenario::json;
use proptest::prelude::*;

use super::{FULL, read, rules};

/// Any JSON, rich in words of scenario documents.
fn any_json() -> impl Strategy<Value = serde_json::Value> {
    let leaf = prop_oneof![
        Just(serde_json::Value::Null),
        any::<bool>().prop_map(Into::into),
        any::<f64>().prop_map(Into::into),
        (-3_i64..12).prop_map(Into::into),
        word().prop_map(Into::into),
    ];
    leaf.prop_recursive(5, 80, 12, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..6).prop_map(Into::into),
            prop::collection::vec((word(), inner), 0..8)
                .prop_map(|entries| serde_json::Value::Object(entries.into_iter().collect())),
        ]
    })
}

/// Every word of the full document, and random ones.
fn word() -> impl Strategy<Value = String> {
    let words: Vec<String> = FULL
        .split(|c: char| !c.is_alphanumeric() && c != '_' && c != '-')
        .filter(|word| word.starts_with(char::is_alphabetic))
        .map(str::to_owned)
        .collect();
    prop_oneof![9 => prop::sample::select(words), 1 => ".*"]
}

/// All JSON pointers into a value.
fn pointers(value: &serde_json::Value, here: &str, found: &mut Vec<String>) {
    found.push(here.to_owned());
    match value {
        serde_json::Value::Object(entries) => {
            entries
                .iter()
                .for_each(|(key, value)| pointers(value, &format!("{here}/{key}"), found));
        }
        serde_json::Value::Array(items) => {
            items
                .iter()
                .enumerate()
                .for_each(|(index, value)| pointers(value, &format!("{here}/{index}"), found));
        }
        _ => {}
    }
}

/// Valid documents: numbers of every magnitude, in range, and points far enough apart.
fn scenario_document() -> impl Strategy<Value = String> {
    let threat = prop_oneof![
        (-1e4..1e4, 500.0..1e4_f64, 0.001..400.0, 0.0..100.0, prop::option::of(-50.0..50.0)).prop_map(
            |(x, y, radius, soft, base)| serde_json::json!({
                "kind": "cylinder", "center": {"x": x, "y": y}, "radius": radius, "influence": radius + soft, "base": base,
                "top": base.map(|base: f64| base + 1.5),
            })
        ),
        (-1e4..1e4, 500.0..1e4_f64, 0.001..400.0, 0.0..100.0, ".{0,9}").prop_map(|(x, y, size, margin, name)| {
            serde_json::json!({
                "kind": "polygon", "name": name, "margin": margin,
                "vertices": [{"x": x, "y": y}, {"x": x + size, "y": y}, {"x": x, "y": y + size}],
            })
        }),
    ];
    let terrain = prop_oneof![
        (-1e3..0.0).prop_map(|elevation| serde_json::json!({"kind": "flat", "elevation": elevation})),
        (-1e4..1e4, -500.0..0.0, 1.0..1e3).prop_map(|(x, height, spread)| serde_json::json!({
            "kind": "peaks",
            "peaks": [{"center": {"x": x, "y": x}, "height": height, "spread": {"x": spread, "y": 1}}],
        })),
    ];
    let settings = (
        1_usize..200,
        2_usize..300,
        0_u64..1 << 53,
        prop::option::of(1_u64..3_600_000),
        0.0..=1.0,
    );
    (
        ((-1e4..1e4), (-1e4..100.0), (0.0..1e3)),
        prop::collection::vec(threat, 0..6),
        terrain,
        (0.0..500.0, 0.001..1e5),
        settings,
    )
        .prop_map(
            |((x, y, z), threats, terrain, (min, width), (n, bats, seed, time, loudness))| {
                serde_json::json!({
                    "start": {"x": x, "y": y, "z": z}, "target": {"x": x + 3.25, "y": -1e4, "z": 0.1},
                    "threats": threats, "terrain": terrain, "altitude": {"min": min, "max": min + width},
                    "planner": {"waypoints": n, "population": bats, "seed": seed, "time_limit_ms": time,
                        "parameters": {"loudness": loudness}},
                })
                .to_string()
            },
        )
}

proptest! {
    #[test]
    fn bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = json::read(&bytes, &rules(), 0);
    }

    #[test]
    fn a_truncated_or_damaged_document_never_panics(at in 0..FULL.len(), byte: u8) {
        let _ = json::read(&FULL.as_bytes()[..at], &rules(), 0);
        let mut spoilt = FULL.as_bytes().to_vec();
        spoilt[at] = byte;
        let _ = json::read(&spoilt, &rules(), 0);
    }

    #[test]
    fn random_json_never_panics(value in any_json()) {
        let _ = read(&value.to_string());
    }

    #[test]
    fn a_document_with_one_part_replaced_never_panics(at: prop::sample::Index, value in any_json()) {
        let mut document: serde_json::Value = serde_json::from_str(FULL).expect("JSON");
        let mut found = Vec::new();
        pointers(&document, "", &mut found);
        *document.pointer_mut(at.get(&found[..]).as_str()).expect("it was found there") = value;
        if let Ok(scenario) = read(&document.to_string()) {
            let text = json::write(&scenario);
            prop_assert_eq!(&read(&text).expect("what is written is accepted"), &scenario);
        }
    }

    #[test]
    fn a_written_scenario_reads_back_unchanged(document in scenario_document()) {
        let scenario = read(&document).map_err(|refusal| TestCaseError::fail(refusal.to_string()))?;
        let text = json::write(&scenario);
        let again = read(&text).map_err(|refusal| TestCaseError::fail(refusal.to_string()))?;
        prop_assert_eq!(&again, &scenario);
        prop_assert_eq!(json::write(&again), text);
    }
}
