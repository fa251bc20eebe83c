//! Markdown to HTML: for descriptions, and the problem pages.

use pulldown_cmark::{Options, Parser, html};

/// With tables; HTML within the text is trusted, being the program's own.
pub(super) fn html(text: &str) -> String {
    let mut page = String::new();
    html::push_html(&mut page, Parser::new_ext(text, Options::ENABLE_TABLES));
    page
}
