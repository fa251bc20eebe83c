//! `noctule healthcheck`: one request to a running service, for images that have no curl.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use anyhow::{Context, bail};
use axum::http::Uri;
use axum::http::uri::PathAndQuery;
use clap::Args;

/// Timeout for the connection, and for each read and write.
const TIMEOUT: Duration = Duration::from_secs(3);

#[derive(Args)]
pub(super) struct Arguments {
    /// Address to ask; /readyz there, unless it names another path
    #[arg(
        long,
        env = "NOCTULE_HEALTHCHECK_URL",
        default_value = "http://127.0.0.1:8080/readyz"
    )]
    url: Uri,
}

/// Succeeds when the answer is 200.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let url = &arguments.url;
    if url.scheme_str() != Some("http") {
        bail!("{url} must begin with http://");
    }
    let authority = url.authority().context("the URL names no host")?;
    let port = match authority.as_str().rsplit_once(authority.host()) {
        Some((_, "" | ":")) => 80,
        _ => authority
            .port_u16()
            .filter(|port| *port > 0)
            .with_context(|| format!("{url}: the port must be a whole number from 1 to 65535"))?,
    };
    let address = (authority.host().trim_matches(['[', ']']), port);
    let path = url.path_and_query().map(PathAndQuery::as_str);
    // The page at the root is there whether or not the service is ready.
    let path = path.filter(|path| *path != "/").unwrap_or("/readyz");
    let head =
        ask(address, authority.as_str(), path).with_context(|| format!("no answer from {url}"))?;
    match head.split(' ').nth(1) {
        Some("200") => Ok(()),
        Some(status) => bail!("http://{authority}{path} answers {status}"),
        None => bail!("{url} does not speak HTTP"),
    }
}

/// The beginning of the answer.
fn ask(address: (&str, u16), host: &str, path: &str) -> anyhow::Result<String> {
    let mut stream = connect(address)?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    write!(
        stream,
        "GET {path} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n"
    )?;
    let mut head = [0; 32];
    let mut filled = 0;
    while filled < head.len() {
        match stream.read(&mut head[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                bail!("nothing was sent within {} s", TIMEOUT.as_secs())
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(String::from_utf8_lossy(&head[..filled]).into_owned())
}

fn connect(address: (&str, u16)) -> anyhow::Result<TcpStream> {
    let mut last = None;
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, TIMEOUT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = Some(error),
        }
    }
    Err(last.map_or_else(|| anyhow::anyhow!("the host has no address"), Into::into))
}
