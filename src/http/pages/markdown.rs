//! Markdown to HTML: for descriptions, the problem pages and the guides.

use pulldown_cmark::{CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd, html};

use super::guides;

/// A whole document: its headings can be linked to.
pub(super) struct Document {
    pub(super) html: String,
    /// Its sections below the title, in their order.
    pub(super) sections: Vec<Section>,
}

/// What the contents of a document say of a section.
pub(super) struct Section {
    pub(super) id: String,
    pub(super) title: String,
}

/// With tables; HTML within the text is trusted, being the program's own.
pub(super) fn html(text: &str) -> String {
    written(events(text))
}

/// `text` with an id for each heading, the one that links between Markdown documents mean.
pub(super) fn document(text: &str) -> Document {
    let mut events: Vec<Event> = events(text).collect();
    let mut sections: Vec<Section> = Vec::new();
    for start in 0..events.len() {
        let title = match &events[start] {
            Event::Start(Tag::Heading { .. }) => words(&events[start + 1..]),
            _ => continue,
        };
        let section = anchor(&title);
        let Event::Start(Tag::Heading { level, id, .. }) = &mut events[start] else {
            continue;
        };
        *id = Some(CowStr::from(section.clone()));
        if *level == HeadingLevel::H2 {
            sections.push(Section { id: section, title });
        }
    }
    Document {
        html: written(events.into_iter()),
        sections,
    }
}

/// Parts of `text`; links to documents beside it lead to their pages, and are text where there is none.
fn events(text: &str) -> impl Iterator<Item = Event<'_>> {
    let mut linked = true;
    Parser::new_ext(text, Options::ENABLE_TABLES).filter_map(move |event| match event {
        Event::Start(Tag::Link {
            link_type,
            dest_url,
            title,
            id,
        }) => {
            let dest_url = if dest_url.contains(".md") && !dest_url.contains(':') {
                guides::served(&dest_url).map(CowStr::from)
            } else {
                Some(dest_url)
            };
            linked = dest_url.is_some();
            dest_url.map(|dest_url| {
                Event::Start(Tag::Link {
                    link_type,
                    dest_url,
                    title,
                    id,
                })
            })
        }
        Event::End(TagEnd::Link) => linked.then_some(event),
        other => Some(other),
    })
}

fn written<'a>(events: impl Iterator<Item = Event<'a>>) -> String {
    let mut page = String::new();
    html::push_html(&mut page, events);
    page
}

/// The text of a heading whose parts these begin with.
fn words(parts: &[Event]) -> String {
    let within = parts
        .iter()
        .take_while(|part| !matches!(part, Event::End(TagEnd::Heading(_))));
    within
        .filter_map(|part| match part {
            Event::Text(text) | Event::Code(text) => Some(text.as_ref()),
            _ => None,
        })
        .collect()
}

/// As the common hosts of Markdown form it: small letters, no punctuation, hyphens for spaces.
fn anchor(title: &str) -> String {
    let kept = |letter: &char| letter.is_alphanumeric() || matches!(letter, ' ' | '-' | '_');
    title
        .to_lowercase()
        .chars()
        .filter(kept)
        .map(|letter| if letter == ' ' { '-' } else { letter })
        .collect()
}
