//! The targets of the load, each in a process of its own: the service, or a handler that does nothing.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::Context as _;
use axum::Router;
use axum::body::Bytes;
use axum::routing::get;
use clap::Args;

use crate::cli::serve;
use crate::config::Config;

/// How this process is told to be one, and which; for `noctule bench serve` itself.
#[derive(Args)]
pub(super) struct Role {
    /// Be the service, over this directory
    #[arg(long, hide = true)]
    data_dir: Option<PathBuf>,
    /// Be a handler that does nothing
    #[arg(long, hide = true)]
    bare: bool,
    /// Of the service; without any, plans only wait
    #[arg(long, hide = true, default_value_t = 0)]
    workers: usize,
    /// Of the service
    #[arg(long, hide = true, default_value_t = 1_000)]
    queue: usize,
}

impl Role {
    /// Play it until somebody ends the process; `false` when there is none to play.
    pub(super) fn play(&self) -> anyhow::Result<bool> {
        let listen = SocketAddr::from(([127, 0, 0, 1], 0));
        if self.bare {
            tokio::runtime::Builder::new_multi_thread()
                .enable_all()
                .build()?
                .block_on(bare(listen))?;
        } else if let Some(data_dir) = &self.data_dir {
            serve::start(&Config {
                listen,
                data_dir: Some(data_dir.clone()),
                workers: self.workers,
                queue: self.queue,
                ..Config::default()
            })?;
        } else {
            return Ok(false);
        }
        Ok(true)
    }
}

/// The least that such a server can do: a short answer to `GET`, and reading the whole body of a `POST`.
async fn bare(listen: SocketAddr) -> anyhow::Result<()> {
    let answer = ([("content-type", "application/json")], r#"{"status":"ok"}"#);
    let router = Router::new().route(
        "/",
        get(async move || answer).post(async move |body: Bytes| {
            drop(body);
            answer
        }),
    );
    let listener = tokio::net::TcpListener::bind(listen).await?;
    println!("listening on http://{}", listener.local_addr()?);
    std::io::stdout().flush()?;
    axum::serve(listener, router).await?;
    Ok(())
}

/// A running target; stopped when dropped, and its data removed.
pub(super) struct Stage {
    child: Child,
    /// Where it listens.
    pub(super) address: SocketAddr,
    data_dir: Option<PathBuf>,
}

impl Stage {
    /// A handler that does nothing.
    pub(super) fn bare() -> anyhow::Result<Self> {
        Self::start(&["--bare".to_owned()], None)
    }

    /// The service over a new directory.
    pub(super) fn service(workers: usize, queue: usize) -> anyhow::Result<Self> {
        let name = format!("noctule-bench-{}", uuid::Uuid::now_v7());
        let data_dir = std::env::temp_dir().join(name);
        let arguments = [
            "--data-dir".to_owned(),
            data_dir.to_string_lossy().into_owned(),
            format!("--workers={workers}"),
            format!("--queue={queue}"),
        ];
        Self::start(&arguments, Some(&data_dir))
    }

    fn start(arguments: &[String], data_dir: Option<&Path>) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("this program is not found")?;
        let child = Command::new(program)
            .args(["bench", "serve"])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let mut stage = Self {
            child,
            address: SocketAddr::from(([127, 0, 0, 1], 0)),
            data_dir: data_dir.map(ToOwned::to_owned),
        };
        let stdout = stage.child.stdout.take().expect("it is piped");
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line)?;
        let address = line.trim().strip_prefix("listening on http://");
        stage.address = address
            .and_then(|address| address.parse().ok())
            .context("the process to be measured does not listen")?;
        Ok(stage)
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        // Both fail when it has already ended, the last when it never started.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(data_dir) = &self.data_dir {
            let _ = std::fs::remove_dir_all(data_dir);
        }
    }
}
