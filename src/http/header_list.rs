//! Lists in headers, RFC 9110 section 5.6.

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
