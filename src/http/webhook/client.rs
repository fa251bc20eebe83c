//! One request to a receiver: to an address that was checked, without redirects, within a time limit.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, HeaderValue, Method, Request, StatusCode, header};
use bytes::Bytes;
use http_body_util::Full;
use hyper::client::conn::http1;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::pki_types::ServerName;
use tokio_rustls::rustls::{ClientConfig, RootCertStore, crypto::ring};

use super::address::{Target, is_public};

/// Time limit for all of it: name lookup, connection, request and the head of the answer.
const TIMEOUT: Duration = Duration::from_secs(15);

/// Sends webhooks.
#[derive(Clone)]
pub(super) struct Client {
    tls: TlsConnector,
    private: bool,
}

impl Client {
    /// A client with the machine's trusted certificates; `private` allows receivers outside the public internet.
    pub(super) fn new(private: bool) -> Self {
        let mut roots = RootCertStore::empty();
        let found = rustls_native_certs::load_native_certs();
        for error in &found.errors {
            tracing::warn!(%error, "a certificate authority of this machine cannot be read");
        }
        let (added, _) = roots.add_parsable_certificates(found.certs);
        if added == 0 {
            tracing::warn!("this machine trusts no certificate authority: no webhook gets through");
        }
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .expect("ring has the default versions")
            .with_root_certificates(roots)
            .with_no_client_auth();
        Self {
            tls: Arc::new(config).into(),
            private,
        }
    }

    /// Send `body`; returns the status of the answer.
    pub(super) async fn post(
        &self,
        target: &Target,
        headers: HeaderMap,
        body: String,
    ) -> io::Result<StatusCode> {
        let sent = tokio::time::timeout(TIMEOUT, self.exchange(target, headers, body)).await;
        sent.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
    }

    async fn exchange(
        &self,
        target: &Target,
        headers: HeaderMap,
        body: String,
    ) -> io::Result<StatusCode> {
        let request = request(target, headers, body)?;
        let stream = self.connect(target).await?;
        if !target.tls {
            return send(stream, request).await;
        }
        let name = ServerName::try_from(target.host.clone()).map_err(io::Error::other)?;
        send(self.tls.connect(name, stream).await?, request).await
    }

    /// Connects to the very address that was checked, so a name that resolves differently the next time achieves
    /// nothing.
    async fn connect(&self, target: &Target) -> io::Result<TcpStream> {
        let found = tokio::net::lookup_host((target.host.as_str(), target.port)).await?;
        let allowed: Vec<SocketAddr> = found
            .filter(|address| self.private || is_public(address.ip()))
            .collect();
        if allowed.is_empty() {
            return Err(io::Error::other("the host has no public address"));
        }
        let stream = TcpStream::connect(&allowed[..]).await?;
        stream.set_nodelay(true)?;
        Ok(stream)
    }
}

fn request(
    target: &Target,
    mut headers: HeaderMap,
    body: String,
) -> io::Result<Request<Full<Bytes>>> {
    let authority = target
        .uri
        .authority()
        .map_or("", |authority| authority.as_str());
    let host = HeaderValue::from_str(authority).map_err(io::Error::other)?;
    headers.insert(header::HOST, host);
    headers.insert(
        header::USER_AGENT,
        HeaderValue::from_static(concat!("noctule/", env!("CARGO_PKG_VERSION"))),
    );
    let path = target.uri.path_and_query();
    let path = path.map_or("", |path| path.as_str());
    // A query may follow the host directly, without a path.
    let slash = if path.starts_with('/') { "" } else { "/" };
    let mut request = Request::new(Full::new(Bytes::from(body)));
    *request.method_mut() = Method::POST;
    *request.uri_mut() = format!("{slash}{path}").parse().map_err(io::Error::other)?;
    *request.headers_mut() = headers;
    Ok(request)
}

/// Send it, and hang up once the head of the answer has come.
async fn send(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    request: Request<Full<Bytes>>,
) -> io::Result<StatusCode> {
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream))
        .await
        .map_err(io::Error::other)?;
    let answer = sender.send_request(request);
    tokio::pin!(connection, answer);
    let answer = tokio::select! {
        biased;
        answer = &mut answer => answer,
        // However the connection ended: an answer that came before is available now, and a delivered webhook must not
        // be sent again. Where there is no answer, its error says why.
        _ = &mut connection => answer.await,
    };
    answer
        .map(|answer| answer.status())
        .map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    use tokio::io::ReadBuf;

    use super::*;

    /// Breaks the connection right after its answer to what was written, or instead of an answer.
    struct Breaking {
        answer: &'static [u8],
        heard: bool,
        reader: Option<Waker>,
    }

    impl AsyncRead for Breaking {
        fn poll_read(
            mut self: Pin<&mut Self>,
            context: &mut Context<'_>,
            buffer: &mut ReadBuf<'_>,
        ) -> Poll<io::Result<()>> {
            if !self.heard {
                self.reader = Some(context.waker().clone());
                return Poll::Pending;
            }
            match std::mem::take(&mut self.answer) {
                [] => Poll::Ready(Err(io::ErrorKind::ConnectionReset.into())),
                answer => {
                    buffer.put_slice(answer);
                    Poll::Ready(Ok(()))
                }
            }
        }
    }

    impl AsyncWrite for Breaking {
        fn poll_write(
            mut self: Pin<&mut Self>,
            _: &mut Context<'_>,
            bytes: &[u8],
        ) -> Poll<io::Result<usize>> {
            self.heard = true;
            self.reader.take().into_iter().for_each(Waker::wake);
            Poll::Ready(Ok(bytes.len()))
        }

        fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }

        fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }
    }

    async fn sent(answer: &'static [u8]) -> io::Result<StatusCode> {
        let stream = Breaking {
            answer,
            heard: false,
            reader: None,
        };
        send(stream, Request::new(Full::default())).await
    }

    #[tokio::test]
    async fn a_complete_answer_counts_even_if_the_connection_then_breaks() {
        let answer = sent(b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n").await;
        assert_eq!(answer.expect("it came"), StatusCode::OK);
        for cut_off in ["", "HTTP/1.1 200 OK\r\ncontent-le"] {
            assert!(sent(cut_off.as_bytes()).await.is_err(), "{cut_off}");
        }
    }
}
