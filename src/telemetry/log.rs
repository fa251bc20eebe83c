//! Log lines on stderr, with the ids of the request and the plan in fields.
//!
//! The setting `log` says what is logged, in the syntax of tracing's `EnvFilter`.

use std::io::IsTerminal as _;
use std::panic::PanicHookInfo;
use std::sync::OnceLock;
use std::time::Duration;

use tracing::{Level, Metadata};
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{Layer as _, fmt};

use super::Metrics;
use super::lines::Lines;
use super::otlp::Exporter;
use crate::config::{Config, LogFormat};

/// Time for writing the remaining lines at the end; a reader that takes longer is not waited for.
const LAST_LINES: Duration = Duration::from_secs(1);

static LINES: OnceLock<Lines> = OnceLock::new();

/// What must be closed at the end of the program.
#[must_use = "what is left is sent when it is closed"]
pub struct Log(Option<Exporter>);

impl Log {
    /// Send what is left, and close.
    pub fn close(self) {
        if let Some(exporter) = self.0 {
            exporter.close();
        }
        flush();
    }
}

/// Write the lines that still wait, if that does not take long. What ends the process otherwise than by closing the
/// log calls this first.
pub fn flush() {
    if let Some(lines) = LINES.get() {
        lines.flush(LAST_LINES);
    }
}

/// Start writing log lines, and exporting traces if there is a collector. Panics are logged too.
///
/// # Errors
/// When there can be no thread that writes.
///
/// # Panics
/// When called twice.
pub fn init(config: &Config, metrics: &Metrics) -> std::io::Result<Log> {
    let lines = Lines::to(std::io::stderr(), metrics.lines_dropped())?;
    let lines = LINES.get_or_init(|| lines);
    let lines = fmt::layer().with_writer(move || lines.clone());
    let lines = match config.log_format {
        LogFormat::Text => lines.with_ansi(std::io::stderr().is_terminal()).boxed(),
        LogFormat::Json => lines
            .json()
            .flatten_event(true)
            .with_span_list(false)
            .boxed(),
    };
    let exporter = config
        .otlp_endpoint
        .as_ref()
        .map(|endpoint| Exporter::to(endpoint, config.otlp_headers.clone()));
    let traces = exporter.as_ref().map(|exporter| {
        tracing_opentelemetry::layer()
            .with_tracer(exporter.tracer())
            .with_location(false)
            .with_threads(false)
            .with_filter(filter_fn(is_exported))
    });
    tracing_subscriber::registry()
        .with(lines.with_filter(config.log.of_lines()))
        .with(traces)
        .init();
    std::panic::set_hook(Box::new(log_panic));
    Ok(Log(exporter))
}

/// The program's own spans and their usual lines, whatever the log filter says.
fn is_exported(metadata: &Metadata) -> bool {
    metadata.target().starts_with(env!("CARGO_PKG_NAME")) && *metadata.level() <= Level::INFO
}

/// The one line of a panic; the spans round it name the request or the plan.
fn log_panic(panic: &PanicHookInfo) {
    let payload = panic.payload();
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let message = text
        .or_else(|| payload.downcast_ref().copied())
        .unwrap_or("no message");
    let place = panic.location().map(ToString::to_string);
    let thread = std::thread::current().name().map(ToOwned::to_owned);
    let is_the_last = thread.as_deref() == Some("main");
    tracing::error!(message, place, thread, "panicked");
    if is_the_last {
        // The process ends without closing the log.
        flush();
    }
}
