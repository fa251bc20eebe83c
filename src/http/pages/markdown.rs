//! Markdown as HTML: descriptions, and the page of problems.

use pulldown_cmark::{Options, Parser, html};

/// With tables; HTML within the text is the program's own.
pub(super) fn html(text: &str) -> String {
    let mut page = String::new();
    html::push_html(&mut page, Parser::new_ext(text, Options::ENABLE_TABLES));
    page
}
