//! Requests over connections that stay open.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use axum::body::Bytes;
use axum::http::{HeaderMap, Method, Request, Response};
use http_body_util::{BodyExt as _, Full};
use hyper::body::Incoming;
use hyper::client::conn::http1::{self, SendRequest};
use hyper_util::rt::TokioIo;
use tokio::net::TcpStream;

/// What is asked; built anew for each request.
#[derive(Debug, Clone)]
pub(super) struct Question {
    method: Method,
    path: String,
    body: Bytes,
    wait: bool,
}

impl Question {
    pub(super) fn get(path: impl Into<String>) -> Self {
        Self {
            method: Method::GET,
            path: path.into(),
            body: Bytes::new(),
            wait: false,
        }
    }

    pub(super) fn post(path: impl Into<String>, body: impl Into<Bytes>) -> Self {
        Self {
            method: Method::POST,
            body: body.into(),
            ..Self::get(path)
        }
    }

    /// Allow the answer to take long.
    pub(super) fn patient(self) -> Self {
        Self { wait: true, ..self }
    }

    fn request(&self) -> Request<Full<Bytes>> {
        let mut request = Request::builder()
            .method(self.method.clone())
            .uri(&self.path)
            .header("host", "localhost");
        if self.wait {
            request = request.header("prefer", "wait=30");
        }
        if self.method == Method::POST {
            request = request.header("content-type", "application/json");
        }
        let body = Full::new(self.body.clone());
        request.body(body).expect("its parts are well-formed")
    }
}

/// An answer, read to its end.
pub(super) struct Answer {
    pub(super) status: u16,
    pub(super) headers: HeaderMap,
    pub(super) body: Bytes,
}

/// A connection that stays open.
pub(super) struct Connection(SendRequest<Full<Bytes>>);

impl Connection {
    pub(super) async fn open(address: SocketAddr) -> anyhow::Result<Self> {
        let stream = TcpStream::connect(address).await?;
        stream.set_nodelay(true)?;
        let (sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
        tokio::spawn(connection);
        Ok(Self(sender))
    }

    /// Ask, and read the head of the answer.
    pub(super) async fn begin(
        &mut self,
        question: &Question,
    ) -> anyhow::Result<Response<Incoming>> {
        self.0.ready().await?;
        Ok(self.0.send_request(question.request()).await?)
    }

    /// Ask, and read the answer.
    pub(super) async fn ask(&mut self, question: &Question) -> anyhow::Result<Answer> {
        let (head, body) = self.begin(question).await?.into_parts();
        Ok(Answer {
            status: head.status.as_u16(),
            headers: head.headers,
            body: body.collect().await?.to_bytes(),
        })
    }
}

/// The results of asking the same thing again and again.
pub(super) struct Load {
    /// Answers a second, of all connections together.
    pub(super) rate: f64,
    /// Times from question to answer, milliseconds, in order.
    times_ms: Vec<f64>,
    /// How many answers had which status.
    pub(super) statuses: BTreeMap<u16, usize>,
}

impl Load {
    /// The time within which this share of the answers came, milliseconds.
    pub(super) fn within_ms(&self, share: f64) -> f64 {
        let last = self.times_ms.len() - 1;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "an index"
        )]
        let idx = (share * last as f64).round() as usize;
        self.times_ms[idx.min(last)]
    }

    /// Fails unless every answer had this status.
    pub(super) fn all(self, status: u16) -> anyhow::Result<Self> {
        let known = self.statuses.keys().eq([&status]);
        anyhow::ensure!(
            known,
            "the answers should all be {status}: {:?}",
            self.statuses
        );
        Ok(self)
    }
}

/// Ask `question` over `connections` connections, each as soon as it has the previous answer.
pub(super) async fn load(
    address: SocketAddr,
    connections: usize,
    time: Duration,
    question: Question,
) -> anyhow::Result<Load> {
    let question = Arc::new(question);
    let mut open = Vec::new();
    for _ in 0..connections {
        open.push(Connection::open(address).await?);
    }
    let begun = Instant::now();
    let asking: Vec<_> = open
        .into_iter()
        .map(|connection| tokio::spawn(keep_asking(connection, question.clone(), begun + time)))
        .collect();
    let mut times_ms = Vec::new();
    let mut statuses = BTreeMap::new();
    for asking in asking {
        for (status, ms) in asking.await.context("asking broke")?? {
            times_ms.push(ms);
            *statuses.entry(status).or_default() += 1;
        }
    }
    times_ms.sort_by(f64::total_cmp);
    Ok(Load {
        rate: times_ms.len() as f64 / begun.elapsed().as_secs_f64(),
        times_ms,
        statuses,
    })
}

/// Asks at least once.
async fn keep_asking(
    mut connection: Connection,
    question: Arc<Question>,
    until: Instant,
) -> anyhow::Result<Vec<(u16, f64)>> {
    let mut answers = Vec::new();
    loop {
        let asked = Instant::now();
        let answer = connection.ask(&question).await?;
        answers.push((answer.status, asked.elapsed().as_secs_f64() * 1e3));
        if Instant::now() >= until {
            return Ok(answers);
        }
    }
}
