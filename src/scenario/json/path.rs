//! The path from the root of a document to the value being read, kept on the stack of the readers.

use std::fmt::{self, Display};

/// A place in the document; displayed as a JSON pointer (RFC 6901).
#[derive(Debug, Clone, Copy)]
pub(super) enum Path<'a> {
    /// The whole document.
    Root,
    /// A field of the given object.
    Key(&'a Path<'a>, &'a str),
    /// An item of the given array.
    Index(&'a Path<'a>, usize),
}

impl Path<'_> {
    /// The value's name in a fault's detail: `radius`, `vertices[2]`, `the document`.
    pub(super) fn label(&self) -> String {
        match self {
            Path::Root => "the document".to_owned(),
            Path::Key(_, key) => (*key).to_owned(),
            Path::Index(parent, index) => format!("{}[{index}]", parent.label()),
        }
    }
}

impl Display for Path<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Path::Root => Ok(()),
            Path::Key(parent, key) => write!(out, "{parent}/{}", escape(key)),
            Path::Index(parent, index) => write!(out, "{parent}/{index}"),
        }
    }
}

/// Escape a reference token (RFC 6901).
pub(super) fn escape(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

#[cfg(test)]
mod tests {
    use super::Path;

    #[test]
    fn a_path_is_a_json_pointer() {
        let threats = Path::Key(&Path::Root, "threats");
        let third = Path::Index(&threats, 2);
        let odd = Path::Key(&third, "a/b~c");
        assert_eq!(odd.to_string(), "/threats/2/a~1b~0c");
        assert_eq!(third.label(), "threats[2]");
        assert_eq!(Path::Root.to_string(), "");
    }
}
