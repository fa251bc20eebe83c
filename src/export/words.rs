//! Text from callers in exported files.

/// `words` without the characters that XML 1.0 cannot represent, even escaped.
pub(super) fn for_xml(words: &str) -> String {
    let allowed = |letter: &char| !matches!(letter, '\u{0}'..='\u{8}' | '\u{b}' | '\u{c}' | '\u{e}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}');
    words.chars().filter(allowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_what_xml_can_hold() {
        assert_eq!(for_xml("a\u{0}b\u{b}\tç <&> \u{fffe}🦇"), "ab\tç <&> 🦇");
    }
}
