//! Lists in headers, RFC 9110 section 5.6.

use axum::http::HeaderValue;

/// Entries of a list after these are not looked at, as if they were not there: nobody has so many in earnest.
const MOST: usize = 100;

/// The first entries of a list, which may go on over several lines. Lines that are not UTF-8 have none.
pub(super) fn entries<'l>(
    lines: impl IntoIterator<Item = &'l HeaderValue>,
) -> impl Iterator<Item = &'l str> {
    let lines = lines.into_iter().map(HeaderValue::as_bytes);
    let lines = lines.filter_map(|line| str::from_utf8(line).ok());
    lines.flat_map(|line| split(line, ',')).take(MOST)
}

/// The parts of `text` between `separator`s; one within a quoted string does not separate.
pub(super) fn split(text: &str, separator: char) -> impl Iterator<Item = &str> {
    let (mut quoted, mut escaped) = (false, false);
    let separates = move |c: char| {
        if escaped {
            escaped = false;
        } else if c == '"' {
            quoted = !quoted;
        } else {
            escaped = quoted && c == '\\';
        }
        c == separator && !quoted
    };
    text.split(separates).map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_goes_on_over_all_readable_lines() {
        let lines = [b"a, \"b,c\"".as_slice(), b"\"\xff\"", "\u{e9}".as_bytes()];
        let lines = lines.map(|line| HeaderValue::from_bytes(line).expect("a value"));
        let found: Vec<&str> = entries(&lines).collect();
        assert_eq!(found, ["a", "\"b,c\"", "\u{e9}"]);
    }

    #[test]
    fn a_list_without_end_is_not_read_to_its_end() {
        let lines = ["a,b,c".repeat(50), "d".to_owned()];
        let lines = lines.map(|line| HeaderValue::try_from(line).expect("a value"));
        assert_eq!(entries(&lines).count(), MOST);
    }

    #[test]
    fn quoted_parts_are_not_split() {
        for (text, expected) in [
            ("a, b ,c", &["a", "b", "c"][..]),
            ("", &[""]),
            ("a,,b", &["a", "", "b"]),
            (r#"a="x, y", b"#, &[r#"a="x, y""#, "b"]),
            (r#""a\", b", c"#, &[r#""a\", b""#, "c"]),
            (r#"\"a, b", c"#, &[r#"\"a, b""#, "c"]),
            (r#""a, b"#, &[r#""a, b"#]),
        ] {
            let parts: Vec<&str> = split(text, ',').collect();
            assert_eq!(parts, expected, "{text}");
        }
    }
}
