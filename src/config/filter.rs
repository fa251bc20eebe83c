//! The log filter, and how lines are matched.

use tracing::Subscriber;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::{FilterExt as _, Targets};
use tracing_subscriber::layer;
use tracing_subscriber::registry::LookupSpan;

use super::value::{Given, Value, quoted};

/// The log filter, in the syntax of tracing's `EnvFilter`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd)]
pub struct Filter(String);

impl Filter {
    /// The filter for log lines.
    ///
    /// An `EnvFilter` is called whenever a span begins, is entered or ends, which happens in every request. For a
    /// setting with only targets and levels, this returns a filter that decides once per call site.
    #[must_use]
    pub fn of_lines<S>(&self) -> Box<dyn layer::Filter<S> + Send + Sync>
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        match self.targets() {
            Some(targets) => targets.boxed(),
            None => EnvFilter::new(&self.0).boxed(),
        }
    }

    /// `None` if a directive has more than that, or omits a part for which the kinds of filter have other defaults.
    fn targets(&self) -> Option<Targets> {
        let is_plain = |directive: &str| {
            let is_whole = !directive.is_empty() && !directive.ends_with('=');
            is_whole && !directive.contains(|symbol: char| symbol == '[' || symbol.is_whitespace())
        };
        self.0
            .split(',')
            .all(is_plain)
            .then(|| self.0.parse().ok())?
    }
}

impl Default for Filter {
    fn default() -> Self {
        Self("info".to_owned())
    }
}

impl Value for Filter {
    const ALLOWED: &'static str = "directives such as info or warn,noctule=debug";

    fn read(given: &Given) -> Option<Self> {
        let text = given.text()?;
        EnvFilter::try_new(text).ok()?;
        Some(Self(text.to_owned()))
    }

    fn to_toml(&self) -> Option<String> {
        Some(quoted(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use std::io::{self, Write};
    use std::sync::Arc;

    use parking_lot::Mutex;
    use tracing_subscriber::layer::SubscriberExt as _;
    use tracing_subscriber::{Layer as _, Registry, fmt};

    use super::*;

    /// Collects the lines written.
    #[derive(Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// The lines that `filter` passes, from one of each level from this crate, from another, and in a span.
    fn lines(filter: Box<dyn layer::Filter<Registry> + Send + Sync>) -> String {
        macro_rules! of_all_levels {
            ($target:expr) => {
                tracing::error!(target: $target, "e");
                tracing::warn!(target: $target, "w");
                tracing::info!(target: $target, "i");
                tracing::debug!(target: $target, "d");
                tracing::trace!(target: $target, "t");
            };
        }
        let lines = Lines::default();
        let writer = lines.clone();
        let layer = fmt::layer()
            .without_time()
            .with_ansi(false)
            .with_writer(move || writer.clone());
        let subscriber = tracing_subscriber::registry().with(layer.with_filter(filter));
        tracing::subscriber::with_default(subscriber, || {
            of_all_levels!("noctule::http");
            of_all_levels!("noctule::http::plans");
            of_all_levels!("hyper");
            let span = tracing::info_span!(target: "noctule::http", "request", key = 1);
            span.in_scope(|| tracing::info!(target: "noctule::store", "within"));
        });
        let bytes = lines.0.lock().clone();
        String::from_utf8(bytes).expect("text")
    }

    #[test]
    fn lets_through_what_an_env_filter_does() {
        for (text, is_plain) in [
            ("info", true),
            ("off", true),
            ("WARN", true),
            ("4", true),
            ("noctule", true),
            ("noctule::http=debug", true),
            ("info,noctule::http=debug", true),
            (
                "trace,noctule::http=warn,noctule::http::plans=off,hyper=error",
                true,
            ),
            ("", false),
            ("info,", false),
            ("noctule=", false),
            (" info", false),
            ("info, hyper=debug", false),
            ("warn,[request]=info", false),
            ("warn,noctule::http[request{key=1}]=info", false),
        ] {
            let filter = Filter(text.to_owned());
            assert_eq!(filter.targets().is_some(), is_plain, "{text:?}");
            let expected = lines(Box::new(EnvFilter::new(text)));
            assert_eq!(lines(filter.of_lines()), expected, "{text:?}");
        }
    }

    #[test]
    fn is_read_and_written_as_text() {
        let read = |text: &str| Filter::read(&Given::Word(text.to_owned()));
        assert_eq!(read("info"), Some(Filter::default()));
        assert_eq!(read("info,noctule=loud"), None);
        assert_eq!(Filter::default().to_toml().as_deref(), Some("\"info\""));
    }
}
