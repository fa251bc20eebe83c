//! Trace export: OTLP as JSON over HTTP, sent in batches from a thread of its own.
//!
//! When the collector cannot keep up, spans are dropped; no request waits for it.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use async_trait::async_trait;
use opentelemetry::trace::TracerProvider as _;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{Protocol, SpanExporter, WithExportConfig as _, WithHttpConfig as _};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SdkTracer, SdkTracerProvider};

use crate::config::{Endpoint, Headers};

/// Timeout for the connection, and for each read and write.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Time for sending the remaining spans at the end.
const LAST_SPANS: Duration = Duration::from_secs(1);

/// Sends spans until it is closed.
pub(super) struct Exporter(SdkTracerProvider);

impl Exporter {
    /// An exporter to the collector at `endpoint`, with `headers`.
    pub(super) fn to(endpoint: &Endpoint, headers: Headers) -> Self {
        let exporter = SpanExporter::builder()
            .with_http()
            .with_http_client(Client {
                headers,
                failing: AtomicBool::new(false),
            })
            .with_endpoint(endpoint.traces())
            .with_protocol(Protocol::HttpJson)
            .with_timeout(TIMEOUT)
            .build()
            .expect("the endpoint was read as a URI, and nothing else can be wrong");
        let resource = Resource::builder();
        // The resource already contains what OpenTelemetry's own variables say.
        let resource = if is_named_by_environment() {
            resource
        } else {
            resource.with_service_name(env!("CARGO_PKG_NAME"))
        };
        Self(
            SdkTracerProvider::builder()
                .with_batch_exporter(exporter)
                .with_resource(resource.build())
                .build(),
        )
    }

    /// Creates spans that are exported.
    pub(super) fn tracer(&self) -> SdkTracer {
        self.0.tracer(env!("CARGO_PKG_NAME"))
    }

    /// Send the remaining spans, if that does not take long.
    pub(super) fn close(self) {
        // Failures have been logged.
        let _ = self.0.shutdown_with_timeout(LAST_SPANS);
    }
}

fn is_named_by_environment() -> bool {
    let says = |variable: &str, part: &str| {
        std::env::var(variable).is_ok_and(|value| !value.is_empty() && value.contains(part))
    };
    says("OTEL_SERVICE_NAME", "") || says("OTEL_RESOURCE_ATTRIBUTES", "service.name=")
}

/// Blocks, which is fine on a thread of its own.
#[derive(Debug)]
struct Client {
    /// These override headers of the same name from the library.
    headers: Headers,
    /// Whether the last batch was refused or lost.
    failing: AtomicBool,
}

#[async_trait]
impl HttpClient for Client {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let answer = post(&request, &self.headers);
        let failure = match &answer {
            Ok(200..=299) => None,
            Ok(status) => Some(format!("it answers {status}")),
            Err(error) => Some(error.to_string()),
        };
        self.tell(request.uri().host().unwrap_or_default(), failure);
        Ok(Response::builder().status(answer?).body(Bytes::new())?)
    }
}

impl Client {
    /// Logs one line when sending begins to fail, and one when it works again.
    fn tell(&self, collector: &str, failure: Option<String>) {
        let failed = self.failing.swap(failure.is_some(), Ordering::Relaxed);
        match failure {
            Some(error) if !failed => {
                tracing::warn!(
                    collector,
                    error,
                    "traces cannot be exported; they are dropped"
                );
            }
            None if failed => tracing::info!(collector, "traces are exported again"),
            _ => {}
        }
    }
}

/// Returns the status of the answer.
fn post(request: &Request<Bytes>, own: &Headers) -> io::Result<u16> {
    let uri = request.uri();
    let invalid = || io::Error::from(io::ErrorKind::InvalidInput);
    let authority = uri.authority().ok_or_else(invalid)?;
    let host = authority.host().trim_matches(['[', ']']);
    let mut stream = connect((host, authority.port_u16().unwrap_or(80)))?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.set_write_timeout(Some(TIMEOUT))?;

    let mut head = format!("POST {} HTTP/1.1\r\nhost: {authority}\r\n", uri.path()).into_bytes();
    for (name, value) in own.iter() {
        write!(head, "{name}: {value}\r\n")?;
    }
    for (name, value) in request.headers() {
        if own.iter().any(|(known, _)| known == name.as_str()) {
            continue;
        }
        head.extend_from_slice(name.as_str().as_bytes());
        head.extend_from_slice(b": ");
        head.extend_from_slice(value.as_bytes());
        head.extend_from_slice(b"\r\n");
    }
    let length = request.body().len();
    write!(
        head,
        "content-length: {length}\r\nconnection: close\r\n\r\n"
    )?;
    stream.write_all(&head)?;
    stream.write_all(request.body())?;

    // The status line; the rest is not needed.
    let mut line = [0; 12];
    stream.read_exact(&mut line)?;
    let status = std::str::from_utf8(&line[9..]).ok();
    status
        .filter(|_| line.starts_with(b"HTTP/1."))
        .and_then(|status| status.parse().ok())
        .ok_or_else(|| io::Error::from(io::ErrorKind::InvalidData))
}

fn connect(address: (&str, u16)) -> io::Result<TcpStream> {
    let mut last = io::Error::from(io::ErrorKind::NotFound);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, TIMEOUT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}
