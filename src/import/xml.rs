//! What is refused before XML is parsed. The parser compares each attribute of an element with the others, and each
//! namespace in force with the others wherever one is declared, so that without these limits its time grows with the
//! square or the cube of a file's size.
//!
//! One pass over the bytes, which need not be well-formed: what the parser would not read counts too. Deliberately
//! absent: a check of anything else.

use std::collections::BTreeSet;

/// Most attributes of one element, declarations of namespaces among them; those of KML have at most three.
const MOST_ATTRIBUTES: usize = 64;

/// Most prefixes that a file declares, with the empty one; files in use have about four.
const MOST_PREFIXES: usize = 16;

/// Longest declaration of a namespace, from its prefix to its name, bytes.
const LONGEST_DECLARATION: usize = 256;

/// One attribute, as it is written.
struct Attribute<'t> {
    name: &'t [u8],
    value: &'t [u8],
}

/// Refuse what would take the parser long.
///
/// # Errors
/// What there is too much of, and how much is allowed.
pub(super) fn check(text: &str) -> Result<(), String> {
    let mut prefixes = BTreeSet::new();
    let mut rest = text.as_bytes();
    while let Some(markup) = next_markup(rest) {
        rest = if let Some(past) = past_text_of_its_own(markup) {
            past
        } else {
            tag(markup, &mut prefixes)?
        };
    }
    Ok(())
}

/// From the next `<`, without it.
fn next_markup(text: &[u8]) -> Option<&[u8]> {
    let begin = text.iter().position(|byte| *byte == b'<')?;
    Some(&text[begin + 1..])
}

/// What follows a comment, literal text or an instruction, within which `<` and quotes mean nothing.
fn past_text_of_its_own(markup: &[u8]) -> Option<&[u8]> {
    const KINDS: [(&[u8], &[u8]); 3] = [(b"!--", b"-->"), (b"![CDATA[", b"]]>"), (b"?", b"?>")];
    let (inner, end) = KINDS
        .iter()
        .find_map(|(begin, end)| Some((markup.strip_prefix(*begin)?, *end)))?;
    let len = inner.windows(end.len()).position(|bytes| bytes == end);
    Some(len.map_or(&[], |len| &inner[len + end.len()..]))
}

/// Read a tag up to its end; what follows.
fn tag<'t>(markup: &'t [u8], prefixes: &mut BTreeSet<&'t [u8]>) -> Result<&'t [u8], String> {
    let mut rest = markup;
    let mut n_attributes = 0;
    while let Some((attribute, after)) = next_attribute(rest) {
        rest = after;
        n_attributes += 1;
        if n_attributes > MOST_ATTRIBUTES {
            return Err(format!(
                "an element has more than {MOST_ATTRIBUTES} attributes, must have at most {MOST_ATTRIBUTES}"
            ));
        }
        if let Some(prefix) = declared_prefix(attribute.name) {
            declaration(prefix, attribute.value, prefixes)?;
        }
    }
    Ok(rest)
}

/// The next attribute of a tag and what follows it; `None` at the tag's end.
fn next_attribute(tag: &[u8]) -> Option<(Attribute<'_>, &[u8])> {
    let begin = tag
        .iter()
        .position(|byte| matches!(byte, b'"' | b'\'' | b'<' | b'>'))?;
    let quote = tag[begin];
    if matches!(quote, b'<' | b'>') {
        return None;
    }
    let quoted = &tag[begin + 1..];
    let len = quoted.iter().position(|byte| *byte == quote)?;
    let attribute = Attribute {
        name: name_before(&tag[..begin]),
        value: &quoted[..len],
    };
    Some((attribute, &quoted[len + 1..]))
}

/// The last name in front of `=`.
fn name_before(text: &[u8]) -> &[u8] {
    let text = text.trim_ascii_end();
    let name = text.strip_suffix(b"=").unwrap_or(text).trim_ascii_end();
    let begin = name.iter().rposition(u8::is_ascii_whitespace);
    begin.map_or(name, |begin| &name[begin + 1..])
}

/// The prefix that an attribute of this name declares, if it does. The parser also takes `a:xmlns` for `xmlns`.
fn declared_prefix(name: &[u8]) -> Option<&[u8]> {
    if let Some(prefix) = name.strip_prefix(b"xmlns:") {
        return Some(prefix);
    }
    let is_default = name == b"xmlns" || name.ends_with(b":xmlns");
    is_default.then_some(b"")
}

fn declaration<'t>(
    prefix: &'t [u8],
    namespace: &[u8],
    prefixes: &mut BTreeSet<&'t [u8]>,
) -> Result<(), String> {
    let len = prefix.len() + namespace.len();
    if len > LONGEST_DECLARATION {
        return Err(format!(
            "prefix and name of a namespace are {len} bytes long, must be at most {LONGEST_DECLARATION}"
        ));
    }
    prefixes.insert(prefix);
    if prefixes.len() > MOST_PREFIXES {
        return Err(format!(
            "the file declares more than {MOST_PREFIXES} prefixes of namespaces, must be at most {MOST_PREFIXES}"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn read(text: &str, expected: Result<(), &str>) {
        assert_eq!(check(text), expected.map_err(str::to_owned));
    }

    /// Attributes of one element, each written as `one` does.
    fn element(many: usize, one: impl Fn(usize) -> String) -> String {
        let attributes: String = (0..many).map(one).collect();
        format!("<kml><a{attributes}/></kml>")
    }

    #[test]
    fn attributes_of_one_element_are_counted() {
        let refusal = Err("an element has more than 64 attributes, must have at most 64");
        let plain = |many| element(many, |n| format!(" a{n}='>'"));
        read(&plain(64), Ok(()));
        read(&plain(65), refusal);
        read(&plain(64).repeat(100), Ok(()));
        read(&element(65, |n| format!("\na{n} = \"'\"")), refusal);
    }

    #[test]
    fn prefixes_are_counted_wherever_they_are_declared() {
        let refusal =
            Err("the file declares more than 16 prefixes of namespaces, must be at most 16");
        for one in [
            |n| format!(" xmlns:a{n}='u'"),
            |n| format!("\txmlns:a{n}\n=\n\"u\""),
            |n| format!("><a xmlns:a{n}='u'"),
        ] {
            read(&element(16, one), Ok(()));
            read(&element(17, one), refusal);
        }
        let again = |n| format!("><a xmlns='{n}' xmlns:gx='u'");
        read(&element(1000, again), Ok(()));
        let last = " xmlns='u'";
        let with_default = |n| {
            if n < 16 {
                format!(" xmlns:a{n}='u'")
            } else {
                last.to_owned()
            }
        };
        read(&element(17, with_default), refusal);
    }

    #[test]
    fn declarations_are_short() {
        let long = |len: usize| "x".repeat(len);
        read(&format!("<kml xmlns:a='{}'/>", long(255)), Ok(()));
        read(&format!("<kml a='{}'/>", long(10_000)), Ok(()));
        let refusal = "prefix and name of a namespace are 257 bytes long, must be at most 256";
        for text in [
            format!("<kml xmlns:a='{}'/>", long(256)),
            format!("<kml xmlns:{}=''/>", long(257)),
            format!("<kml xmlns='{}'/>", long(257)),
            format!("<kml a:xmlns='{}'/>", long(257)),
        ] {
            read(&text, Err(refusal));
        }
    }

    #[test]
    fn what_is_no_markup_does_not_count() {
        let many = element(100, |n| format!(" xmlns:a{n}='u'"));
        for (before, after) in [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?a ", "?>")] {
            read(&format!("<kml>{before}{many}{after}</kml>"), Ok(()));
            read(&format!("<kml>{before}{many}"), Ok(()));
            let refusal = format!("<kml>{before}'{after}{many}");
            assert!(check(&refusal).is_err(), "{refusal}");
        }
        read("<", Ok(()));
        read("<a b='", Ok(()));
    }
}
