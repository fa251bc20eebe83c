//! Documents at the edges of JSON: each gets an exact response.

use crate::support::api::Api;

/// A valid document with one number replaced.
fn with_number(number: &str) -> Vec<u8> {
    let document = r#"{"start":{"x":0,"y":0,"z":0},"target":{"x":NUMBER,"y":400,"z":0},"altitude":{"min":0,"max":200}}"#;
    document.replace("NUMBER", number).into_bytes()
}

/// A valid document with one more member.
fn with_member(member: &str) -> Vec<u8> {
    let mut document = with_number("300");
    document.truncate(document.len() - 1);
    document.extend(format!(",{member}}}").into_bytes());
    document
}

fn nested(depth: usize) -> Vec<u8> {
    with_member(&format!(
        "\"x\":{}{}",
        "[".repeat(depth - 1),
        "]".repeat(depth - 1)
    ))
}

/// Documents, each with its name, the status and the kind of problem.
fn cases() -> Vec<(&'static str, Vec<u8>, (u16, &'static str))> {
    let good = with_number("300");
    let valid = (200, "");
    let no_json = (400, "invalid-json");
    let no_scenario = (422, "invalid-scenario");
    vec![
        ("127 levels", nested(127), no_scenario),
        ("128 levels", nested(128), no_json),
        ("4000 levels", b"[".repeat(4_000), no_json),
        ("NaN", with_number("NaN"), no_json),
        ("Infinity", with_number("-Infinity"), no_json),
        ("minus zero", with_number("-0"), valid),
        ("minus zero with a point", with_number("-0.0"), valid),
        ("an exponent", with_number("3E2"), valid),
        ("less than any number", with_number("1e-400"), valid),
        ("more than any number", with_number("1e400"), no_json),
        ("400 digits", with_number(&"9".repeat(400)), no_json),
        ("too far away", with_number("1e308"), no_scenario),
        ("a leading zero", with_number("0300"), no_json),
        ("a plus", with_number("+300"), no_json),
        ("a point without digits", with_number("300."), no_json),
        (
            "a seed that no float holds",
            with_member(r#""planner":{"seed":9007199254740993}"#),
            no_scenario,
        ),
        (
            "a seed of 64 bits and one",
            with_member(r#""planner":{"seed":18446744073709551616}"#),
            no_scenario,
        ),
        (
            "a byte order mark",
            [b"\xef\xbb\xbf", &good[..]].concat(),
            no_json,
        ),
        (
            "UTF-16",
            good.iter().flat_map(|byte| [*byte, 0]).collect(),
            no_json,
        ),
        (
            "no UTF-8",
            with_member("\"name\":\"?\"")
                .iter()
                .map(|byte| if *byte == b'?' { 0xff } else { *byte })
                .collect(),
            no_json,
        ),
        (
            "a lone surrogate",
            with_member(r#""name":"\ud800""#),
            no_json,
        ),
        (
            "the wrong half first",
            with_member(r#""name":"\udc00\ud800""#),
            no_json,
        ),
        (
            "a pair of surrogates",
            with_member(r#""name":"\ud83e\udd87""#),
            valid,
        ),
        (
            "a control character",
            with_member("\"name\":\"a\tb\""),
            no_json,
        ),
        (
            "a key twice",
            with_member(r#""frame":"local","frame":"local""#),
            no_scenario,
        ),
        ("a byte after the end", [&good[..], b"x"].concat(), no_json),
        (
            "a second document",
            [&good[..], &good[..]].concat(),
            no_json,
        ),
        ("a comment", [&good[..], b"//"].concat(), no_json),
        (
            "space after the end",
            [&good[..], b" \r\n\t"].concat(),
            valid,
        ),
        ("a comma too many", with_member("\"name\":null,"), no_json),
        ("single quotes", with_member("'name':null"), no_json),
        ("nothing", Vec::new(), no_json),
        ("null", b"null".to_vec(), no_scenario),
        ("a list", b"[]".to_vec(), no_scenario),
    ]
}

#[tokio::test]
async fn documents_at_the_edges_of_json_get_exact_responses() {
    let api = Api::new();
    for (name, document, (status, slug)) in cases() {
        let headers = [("content-type", "application/json")];
        let path = "/plans?validate_only=true";
        let answer = api
            .send(reqwest::Method::POST, path, &headers, document)
            .await;
        assert_eq!(answer.status, status, "{name}: {answer:?}");
        if !slug.is_empty() {
            answer.expect_problem(status, slug);
        }
    }
}
