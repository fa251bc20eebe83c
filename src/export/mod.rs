//! A delivered plan in the formats that people take away. Adding one is one file and one row.

pub mod document;
mod sha256;
mod svg;

pub use sha256::sha256_hex;

/// A format of a result.
pub struct Format {
    /// As in `?format=` and `--format`; also the usual extension of a file's name.
    pub name: &'static str,
    /// As in `Accept` and `Content-Type`.
    pub media_type: &'static str,
    /// From the stored documents; `None` is the stored result, byte for byte as it was finished.
    pub write: Option<fn(&ResultInput) -> String>,
}

/// What a format is written from.
#[derive(Debug, Clone, Copy)]
pub struct ResultInput<'a> {
    /// The stored result document.
    pub result: &'a str,
    /// The accepted scenario document.
    pub scenario: &'a str,
}

/// Every format; the first is served to who names none.
pub const ALL: &[Format] = &[
    Format {
        name: "json",
        media_type: "application/json",
        write: None,
    },
    Format {
        name: "svg",
        media_type: "image/svg+xml",
        write: Some(svg::write),
    },
];
