//! All settings: one row each.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::setting::{Setting, row};

/// Every setting, in the order in which they are shown.
pub(super) fn all() -> Vec<Setting> {
    [
        service(),
        store(),
        edges(),
        http(),
        webhook(),
        retention(),
        limits(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Settings without a table come first: the service itself.
fn service() -> Vec<Setting> {
    vec![
        row(
            "listen",
            "ADDRESS",
            "Address and port to listen on; port 0 takes a free one",
            ..,
            |c| &mut c.listen,
        ),
        row(
            "data_dir",
            "DIR",
            "Directory for the plans, created if it does not exist",
            ..,
            |c| &mut c.data_dir,
        ),
        row(
            "terrain_dir",
            "DIR",
            "Directory of datasets that scenarios may name; it is only read",
            ..,
            |c| &mut c.terrain_dir,
        ),
        row(
            "workers",
            "N",
            "Plans to run at the same time",
            1..=4096,
            |c| &mut c.workers,
        ),
        row(
            "queue",
            "N",
            "Plans that may wait; more are refused with 503 queue-full",
            1..=100_000_000,
            |c| &mut c.queue,
        ),
        row(
            "grace",
            "SECONDS",
            "Time from a signal to the exit; runs that do not finish in it go back to the queue",
            Duration::ZERO..=Duration::from_secs(3600),
            |c| &mut c.grace,
        ),
    ]
}

/// Where plans are kept, and how that is shared.
fn store() -> Vec<Setting> {
    vec![
        row(
            "store",
            "PLACE",
            "Where plans are kept: sqlite, or NATS servers that nodes share, nats://HOST:PORT[,HOST:PORT...][/NAMESPACE]",
            ..,
            |c| &mut c.store,
        ),
        row(
            "store_credentials",
            "FILE",
            "Credentials for the NATS servers, as nsc writes them",
            ..,
            |c| &mut c.store_credentials,
        ),
        row(
            "store_replicas",
            "N",
            "Copies that the NATS servers keep of everything: 1, 3 or 5",
            ..,
            |c| &mut c.store_replicas,
        ),
        row(
            "store_lease",
            "SECONDS",
            "Silence after which other nodes of the NATS store take over the plans that a node runs",
            Duration::from_secs(1)..=Duration::from_secs(3600),
            |c| &mut c.store_lease,
        ),
        row(
            "role",
            "ROLE",
            "What this node does for those that share its store: all, api (runs no plans) or worker (only runs plans)",
            ..,
            |c| &mut c.role,
        ),
    ]
}

/// Who may use the service, and what it reports to others.
fn edges() -> Vec<Setting> {
    vec![
        row(
            "keys_file",
            "FILE",
            "File with the keys of those who may use the service, see noctule key new; NOCTULE_KEYS may hold them instead",
            ..,
            |c| &mut c.keys_file,
        ),
        row(
            "allow_anonymous",
            "BOOL",
            "Let other machines reach the service although it has no keys",
            ..,
            |c| &mut c.allow_anonymous,
        ),
        row(
            "cors_origins",
            "ORIGINS",
            "Origins of other web pages that may use the service, such as https://plans.example",
            ..,
            |c| &mut c.cors_origins,
        ),
        row(
            "log",
            "FILTER",
            "What is logged, in the syntax of tracing's EnvFilter",
            ..,
            |c| &mut c.log,
        ),
        row(
            "log_format",
            "FORMAT",
            "Format of the log on stderr: text, or json with one object a line",
            ..,
            |c| &mut c.log_format,
        ),
        row(
            "otlp_endpoint",
            "URL",
            "Send traces to this OpenTelemetry collector, by OTLP over HTTP",
            ..,
            |c| &mut c.otlp_endpoint,
        )
        .or_variable("OTEL_EXPORTER_OTLP_ENDPOINT"),
        row(
            "otlp_headers",
            "HEADERS",
            "Send these headers with traces: name=value, separated by commas",
            ..,
            |c| &mut c.otlp_headers,
        )
        .or_variable("OTEL_EXPORTER_OTLP_HEADERS"),
    ]
}

fn http() -> Vec<Setting> {
    const TIMEOUT: RangeInclusive<Duration> =
        Duration::from_millis(100)..=Duration::from_secs(3600);
    vec![
        row(
            "http.head_timeout",
            "SECONDS",
            "Time limit for a request's head; also how long a connection may be idle",
            TIMEOUT,
            |c| &mut c.http.head_timeout,
        ),
        row(
            "http.body_timeout",
            "SECONDS",
            "Time limit for a request's body; added to http.head_timeout, also how long an answer may be left unread",
            TIMEOUT,
            |c| &mut c.http.body_timeout,
        ),
        row(
            "http.bodies_bytes",
            "BYTES",
            "Memory for the bodies of all requests that are being received or read; more are refused with 503 busy",
            1 << 20..,
            |c| &mut c.http.bodies_bytes,
        ),
        row(
            "http.answers_bytes",
            "BYTES",
            "Memory for long answers that have not been sent yet, and for stored documents that wait until one is made of them; more are refused with 503 busy",
            1 << 20..,
            |c| &mut c.http.answers_bytes,
        ),
        row(
            "http.max_connections",
            "N",
            "Connections open at once; more wait in the listener's backlog",
            1..=1_000_000,
            |c| &mut c.http.max_connections,
        ),
        row(
            "http.streams",
            "N",
            "Event streams open at once; more are refused with 429 too-many-streams",
            1..=1_000_000,
            |c| &mut c.http.streams,
        ),
        row(
            "http.streams_per_key",
            "N",
            "Event streams open at once for the owner of a key",
            1..=1_000_000,
            |c| &mut c.http.streams_per_key,
        ),
    ]
}

fn webhook() -> Vec<Setting> {
    vec![
        row(
            "webhook.secret_file",
            "FILE",
            "File with the secret, whsec_..., that signs webhooks; without one, none are sent",
            ..,
            |c| &mut c.webhook.secret_file,
        ),
        row(
            "webhook.allow_private",
            "BOOL",
            "Also allow webhooks to private addresses, and without TLS",
            ..,
            |c| &mut c.webhook.allow_private,
        ),
    ]
}

fn retention() -> Vec<Setting> {
    vec![
        row(
            "retention.age",
            "SECONDS",
            "How long ended plans are kept; 0 for ever",
            Duration::ZERO..=Duration::from_secs(100 * 365 * 24 * 60 * 60),
            |c| &mut c.retention.age,
        ),
        row(
            "retention.plans",
            "N",
            "Ended plans to keep; those that ended first are removed first; 0 for any number",
            ..,
            |c| &mut c.retention.plans,
        ),
        row(
            "retention.bytes",
            "BYTES",
            "Bytes of ended plans' documents and events to keep; 0 for any number",
            ..,
            |c| &mut c.retention.bytes,
        ),
        row(
            "retention.events",
            "N",
            "Newest events to keep of each plan",
            100..,
            |c| &mut c.retention.events,
        ),
    ]
}

fn limits() -> Vec<Setting> {
    vec![
        row(
            "limits.body_bytes",
            "BYTES",
            "Length of a request's body",
            1..,
            |c| &mut c.limits.body_bytes,
        ),
        row("limits.threats", "N", "Threats of a scenario", 1.., |c| {
            &mut c.limits.threats
        }),
        row(
            "limits.polygon_vertices",
            "N",
            "Vertices of all polygons of a scenario together",
            3..,
            |c| &mut c.limits.polygon_vertices,
        ),
        row(
            "limits.terrain_nodes",
            "N",
            "Nodes of a terrain grid, or of a dataset under an area",
            4..,
            |c| &mut c.limits.terrain_nodes,
        ),
        row(
            "limits.terrain_bytes",
            "BYTES",
            "Length of an uploaded dataset",
            1..,
            |c| &mut c.limits.terrain_bytes,
        ),
        row(
            "limits.terrains_bytes",
            "BYTES",
            "Length of all uploaded datasets together",
            1..,
            |c| &mut c.limits.terrains_bytes,
        ),
        row(
            "limits.terrains",
            "N",
            "Names of uploaded datasets",
            1..,
            |c| &mut c.limits.terrains,
        ),
        row(
            "limits.peaks",
            "N",
            "Peaks of an analytic terrain",
            1..,
            |c| &mut c.limits.peaks,
        ),
        row(
            "limits.waypoints",
            "N",
            "Free waypoints of a route",
            1..,
            |c| &mut c.limits.waypoints,
        ),
        row(
            "limits.population",
            "N",
            "Members of a population",
            2..,
            |c| &mut c.limits.population,
        ),
        row(
            "limits.iterations",
            "N",
            "Iterations of a search",
            1..,
            |c| &mut c.limits.iterations,
        ),
        row(
            "limits.work",
            "N",
            "population * iterations * waypoints, which bounds the time of one plan",
            1..,
            |c| &mut c.limits.work,
        ),
        row(
            "limits.path_samples",
            "N",
            "Samples of a straight path from start to target; a detour takes more",
            2..,
            |c| &mut c.limits.path_samples,
        ),
    ]
}

#[cfg(test)]
mod tests;
