//! The guides: the documents of `docs/` that people who use or run a service need, as pages beside the reference.

use std::fmt::Write as _;
use std::sync::LazyLock;

use axum::extract::Path;
use axum::http::Uri;
use axum::response::Response;

use super::super::answers::constant;
use super::super::params::NoParams;
use super::super::problem::Problem;
use super::{escape, html, markdown, page};

/// A document, and what stands in its address.
struct Guide {
    name: &'static str,
    text: &'static str,
}

/// A row of the table: its address, and its file in `docs/`.
macro_rules! guides {
    ($($name:literal: $file:literal,)*) => {
        [$(Guide { name: $name, text: include_str!(concat!("../../../docs/", $file)) },)*]
    };
}

/// In the order in which the reference lists them.
static GUIDES: [Guide; 9] = guides! {
    "formats": "FORMATS.md",
    "terrain": "TERRAIN.md",
    "coordinates": "COORDINATES.md",
    "problems": "PROBLEMS.md",
    "operations": "OPERATIONS.md",
    "reliability": "RELIABILITY.md",
    "equations": "EQUATIONS.md",
    "bound": "BOUND.md",
    "benchmarks": "BENCHMARKS.md",
};

/// The page of each guide, in their order.
static PAGES: LazyLock<Vec<String>> = LazyLock::new(|| GUIDES.iter().map(whole).collect());

impl Guide {
    fn title(&self) -> &'static str {
        let heading = self.text.lines().next().unwrap_or_default();
        heading.trim_start_matches("# ")
    }
}

/// `GET /docs/{guide}`.
pub(in crate::http) async fn guide(
    uri: Uri,
    name: Option<Path<String>>,
    _: NoParams,
) -> Result<Response, Problem> {
    let found = name.and_then(|Path(name)| GUIDES.iter().position(|guide| guide.name == name));
    match found {
        Some(number) => Ok(constant(html(PAGES[number].as_str()))),
        None => Err(Problem::no_such_resource(&uri)),
    }
}

/// Links to all guides, as the items of a list.
pub(super) fn links() -> String {
    GUIDES.iter().fold(String::new(), |mut items, guide| {
        let title = escape(guide.title());
        let _ = writeln!(
            items,
            "<li><a href=\"/docs/{}\">{title}</a></li>",
            guide.name
        );
        items
    })
}

/// Where a link of a document in `docs/` to another one leads here; `None` when that one is not served.
pub(super) fn served(link: &str) -> Option<String> {
    let (file, place) = link
        .split_once('#')
        .map_or((link, None), |(file, place)| (file, Some(place)));
    let name = file.strip_suffix(".md")?.to_lowercase();
    GUIDES.iter().find(|guide| guide.name == name)?;
    let place = place.map(|place| format!("#{place}")).unwrap_or_default();
    Some(format!("/docs/{name}{place}"))
}

/// The guide with links to its sections.
fn whole(guide: &Guide) -> String {
    let document = markdown::document(guide.text);
    let mut contents = String::new();
    for section in &document.sections {
        let _ = writeln!(
            contents,
            "<li><a href=\"#{}\">{}</a></li>",
            section.id,
            escape(&section.title)
        );
    }
    let body = format!(
        "<p><a href=\"/docs\">Reference</a></p>\n<nav aria-label=\"Contents\"><ul>\n{contents}</ul></nav>\n<main>{}</main>",
        document.html
    );
    page(&format!("Noctule: {}", guide.title()), &body)
}
