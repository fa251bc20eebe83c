//! Origins of web pages.

use ::http::Uri;

use super::value::{Given, Value};

/// An origin as a browser writes it, such as `https://plans.example:8443`: in lower case, without a path, without the
/// scheme's default port.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd)]
pub struct Origin(String);

impl Origin {
    /// `None` when it is no origin.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        is_origin(text).then(|| Self(text.to_owned()))
    }

    /// As a browser sends it; visible ASCII.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

fn is_origin(text: &str) -> bool {
    let Ok(uri) = text.parse::<Uri>() else {
        return false;
    };
    let (Some(scheme), Some(authority)) = (uri.scheme_str(), uri.authority()) else {
        return false;
    };
    let own_port = matches!(
        (scheme, authority.port_u16()),
        ("http", Some(80)) | ("https", Some(443))
    );
    matches!(scheme, "http" | "https")
        && !own_port
        && !authority.as_str().contains(['@', '*'])
        && text
            .bytes()
            .all(|byte| byte.is_ascii_graphic() && !byte.is_ascii_uppercase())
        && text == format!("{scheme}://{authority}")
}

/// Separated by commas in a flag or variable.
impl Value for Vec<Origin> {
    const ALLOWED: &'static str =
        "a list of exact origins such as https://plans.example or http://localhost:5173";

    fn read(given: &Given) -> Option<Self> {
        let texts = Vec::<String>::read(given)?;
        texts.iter().map(|text| Origin::read(text)).collect()
    }

    fn to_toml(&self) -> Option<String> {
        let texts: Vec<String> = self.iter().map(|origin| origin.0.clone()).collect();
        texts.to_toml()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_exact_origins_are_accepted() {
        for (text, taken) in [
            ("https://plans.example", true),
            ("http://localhost:5173", true),
            ("http://[::1]:3000", true),
            ("*", false),
            ("null", false),
            ("https://*.example", false),
            ("https://plans.example/", false),
            ("https://plans.example/app", false),
            ("https://Plans.example", false),
            ("https://plans.example:443", false),
            ("https://user@plans.example", false),
            ("plans.example", false),
            ("ftp://plans.example", false),
            ("", false),
        ] {
            assert_eq!(Origin::read(text).is_some(), taken, "{text}");
        }
    }
}
