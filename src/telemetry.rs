//! What the operator reads: log lines on stderr, with the ids of the request and the plan in fields.
//!
//! The setting `log` says what is logged, in the syntax of tracing's `EnvFilter`.

use std::panic::PanicHookInfo;

use crate::config::{Config, LogFormat};

/// Start to write log lines, and let panics be among them.
///
/// # Panics
/// When called twice.
pub fn init(config: &Config) {
    let lines = tracing_subscriber::fmt()
        .with_env_filter(config.log.to_env_filter())
        .with_writer(std::io::stderr);
    match config.log_format {
        LogFormat::Text => lines
            .with_ansi(std::io::IsTerminal::is_terminal(&std::io::stderr()))
            .init(),
        LogFormat::Json => lines
            .json()
            .flatten_event(true)
            .with_span_list(false)
            .init(),
    }
    std::panic::set_hook(Box::new(log_panic));
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
    tracing::error!(message, place, thread, "panicked");
}
