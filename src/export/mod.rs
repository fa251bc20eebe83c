//! A delivered plan in the formats that people take away. Adding one is one file and one row.

pub mod document;

/// A format of a result.
pub struct Format {
    /// As in `?format=`.
    pub name: &'static str,
    /// As in `Accept` and `Content-Type`.
    pub media_type: &'static str,
    /// From the stored result document.
    pub write: fn(String) -> String,
}

/// Every format; the first is served to who names none.
pub const ALL: &[Format] = &[Format {
    name: "json",
    media_type: "application/json",
    // Byte for byte as it was finished.
    write: |stored| stored,
}];
