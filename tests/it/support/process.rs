//! The real binary as a separate process that is always reaped.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::time::Duration;

use reqwest::{Client, RequestBuilder, Response};
use serde_json::Value;

use super::patience::{PATIENCE, in_time};

/// A free port on the loopback interface.
const LOOPBACK: &str = "127.0.0.1:0";

pub(crate) fn noctule() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_noctule"));
    clean(&mut command);
    command
}

/// The binary with a small disk of its own, mounted on `data_dir` in a private namespace.
fn on_a_small_disk(data_dir: &Path, options: &str) -> Command {
    const MOUNT: &str = "mount -t tmpfs -o \"$0\" tmpfs \"$1\" && shift && exec \"$@\"";
    let mut command = Command::new("unshare");
    command
        .args(["--map-root-user", "--mount", "sh", "-c", MOUNT, options])
        .arg(data_dir)
        .arg(env!("CARGO_BIN_EXE_noctule"));
    clean(&mut command);
    command
}

/// The binary limited by the shell's `ulimit` to a number of open files.
fn with_few_files(ulimit: &str) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("{ulimit} && exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_noctule"));
    clean(&mut command);
    command
}

fn clean(command: &mut Command) {
    // The environment of the tests must not change the outcome.
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("NOCTULE_") {
            command.env_remove(name);
        }
    }
}

/// Runs the binary to its end, with `input` as standard input.
pub(crate) fn run(arguments: &[&str], input: &str) -> Output {
    run_with(&[], arguments, input)
}

/// The same with environment variables.
pub(crate) fn run_with(variables: &[(&str, &str)], arguments: &[&str], input: &str) -> Output {
    let mut child = noctule()
        .envs(variables.iter().copied())
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    // A process that does not read its input closes the pipe.
    let _ = child
        .stdin
        .take()
        .expect("piped")
        .write_all(input.as_bytes());
    child.wait_with_output().expect("the binary ends")
}

/// `noctule serve`; killed when dropped.
pub(crate) struct Service {
    child: Child,
    url: String,
    client: Client,
}

impl Service {
    /// On a free port; returns once it listens.
    pub(crate) fn start(data_dir: &Path, arguments: &[&str]) -> Self {
        Self::start_with_log(data_dir, arguments, Stdio::null())
    }

    /// The same, with its log in a file.
    pub(crate) fn start_with_log(
        data_dir: &Path,
        arguments: &[&str],
        log: impl Into<Stdio>,
    ) -> Self {
        Self::start_as(noctule(), LOOPBACK, data_dir, arguments, log)
    }

    /// The same with environment variables.
    pub(crate) fn start_with(
        variables: &[(&str, &str)],
        data_dir: &Path,
        arguments: &[&str],
    ) -> Self {
        let mut command = noctule();
        command.envs(variables.iter().copied());
        Self::start_as(command, LOOPBACK, data_dir, arguments, Stdio::null())
    }

    /// The same on a given address.
    pub(crate) fn start_on(
        listen: &str,
        data_dir: &Path,
        arguments: &[&str],
        log: impl Into<Stdio>,
    ) -> Self {
        Self::start_as(noctule(), listen, data_dir, arguments, log)
    }

    /// With `data_dir` on a disk of its own, mounted with options such as `size=3m`.
    pub(crate) fn start_on_a_small_disk(data_dir: &Path, options: &str) -> Self {
        let command = on_a_small_disk(data_dir, options);
        Self::start_as(command, LOOPBACK, data_dir, &[], Stdio::null())
    }

    /// On the small disk of another one, which may end meanwhile.
    pub(crate) fn start_beside(&self, data_dir: &Path) -> Self {
        let mut command = self.within();
        command.arg(env!("CARGO_BIN_EXE_noctule"));
        clean(&mut command);
        Self::start_as(command, LOOPBACK, data_dir, &[], Stdio::null())
    }

    /// Limited in open files, for example by `ulimit -n 256`.
    pub(crate) fn start_with_few_files(
        ulimit: &str,
        data_dir: &Path,
        arguments: &[&str],
        log: impl Into<Stdio>,
    ) -> Self {
        Self::start_as(with_few_files(ulimit), LOOPBACK, data_dir, arguments, log)
    }

    fn start_as(
        command: Command,
        listen: &str,
        data_dir: &Path,
        arguments: &[&str],
        log: impl Into<Stdio>,
    ) -> Self {
        let mut service = Self::starting_as(command, listen, data_dir, arguments, log);
        let mut line = String::new();
        let stdout = service.child.stdout.take().expect("piped");
        BufReader::new(stdout).read_line(&mut line).expect("a line");
        let url = line.trim().strip_prefix("listening on ");
        service.url = url.map_or_else(|| panic!("not listening: {line:?}"), str::to_owned);
        service
    }

    /// Without waiting until it listens: it has no address yet.
    pub(crate) fn starting(data_dir: &Path, arguments: &[&str], log: impl Into<Stdio>) -> Self {
        Self::starting_as(noctule(), LOOPBACK, data_dir, arguments, log)
    }

    fn starting_as(
        mut command: Command,
        listen: &str,
        data_dir: &Path,
        arguments: &[&str],
        log: impl Into<Stdio>,
    ) -> Self {
        let child = command
            .args(["serve", "--listen", listen, "--data-dir"])
            .arg(data_dir)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .expect("the binary starts");
        Self {
            url: String::new(),
            child,
            client: Client::builder()
                .no_proxy()
                .timeout(PATIENCE)
                .build()
                .expect("a client"),
        }
    }

    pub(crate) fn url(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }

    pub(crate) fn client(&self) -> &Client {
        &self.client
    }

    /// The address that it listens on.
    pub(crate) fn address(&self) -> SocketAddr {
        let address = self
            .url
            .strip_prefix("http://")
            .expect("it is announced so");
        address.parse().expect("an address")
    }

    /// The memory that the process occupies now, KiB.
    pub(crate) fn rss_kib(&self) -> u64 {
        self.memory_kib("VmRSS:")
    }

    /// The most memory that the process has ever occupied, KiB.
    pub(crate) fn peak_rss_kib(&self) -> u64 {
        self.memory_kib("VmHWM:")
    }

    fn memory_kib(&self, name: &str) -> u64 {
        let file = format!("/proc/{}/status", self.child.id());
        let text = std::fs::read_to_string(file).expect("the process runs");
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        let number = line.and_then(|line| line.split_whitespace().next());
        number.expect("a line of it").parse().expect("a number")
    }

    pub(crate) fn get(&self, path: &str) -> RequestBuilder {
        self.client.get(self.url(path))
    }

    pub(crate) fn request(&self, method: reqwest::Method, path: &str) -> RequestBuilder {
        self.client.request(method, self.url(path))
    }

    pub(crate) async fn post(&self, document: &Value) -> Response {
        let request = self.client.post(self.url("/plans")).json(document);
        request.send().await.expect("an answer")
    }

    /// Submits a scenario; the plan's address.
    pub(crate) async fn submit(&self, document: &Value) -> String {
        address_of(&self.post(document).await)
    }

    /// Waits for the plan's end; its status document.
    pub(crate) async fn ended(&self, address: &str) -> Value {
        let ended = async {
            loop {
                let status = json_of(self.get(address).header("prefer", "wait=30")).await;
                if ["succeeded", "failed", "cancelled"]
                    .contains(&status["status"].as_str().expect("text"))
                {
                    return status;
                }
            }
        };
        in_time(ended).await
    }

    /// The body of `path`, which must exist.
    pub(crate) async fn bytes(&self, path: &str) -> bytes::Bytes {
        let answer = self.get(path).send().await.expect("an answer");
        assert_eq!(answer.status(), 200, "{path}");
        answer.bytes().await.expect("a whole body")
    }

    /// `path` as the process sees it, inside its mount namespace.
    pub(crate) fn seen(&self, path: &Path) -> std::path::PathBuf {
        let path = path.strip_prefix("/").expect("absolute");
        let process = Path::new("/proc").join(self.child.id().to_string());
        process.join("root").join(path)
    }

    /// Remounts the small disk on `data_dir` with these options.
    pub(crate) fn remount(&self, data_dir: &Path, options: &str) {
        let done = self
            .within()
            .args(["mount", "-o"])
            .arg(format!("remount,{options}"))
            .arg(data_dir)
            .status()
            .expect("nsenter runs");
        assert!(done.success());
    }

    /// A command that is run where the process is, on its small disk.
    fn within(&self) -> Command {
        let mut command = Command::new("nsenter");
        command
            .args(["--user", "--mount", "--preserve-credentials", "--target"])
            .arg(self.child.id().to_string());
        command
    }

    /// Waits until `/readyz` answers with this status; its detail.
    pub(crate) async fn until_ready(&self, status: u16) -> String {
        let answer = async {
            loop {
                let answer = self.get("/readyz").send().await.expect("an answer");
                if answer.status() == status {
                    let document: Value = answer.json().await.expect("JSON");
                    return document["detail"].as_str().unwrap_or_default().to_owned();
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        in_time(answer).await
    }

    /// Sends `SIG{name}`.
    pub(crate) fn signal(&self, name: &str) {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill")
            .args(["-s", name, &pid])
            .status()
            .expect("kill runs");
        assert!(sent.success());
    }

    /// Kills the process as a power cut would.
    pub(crate) fn kill(mut self) {
        self.child.kill().expect("killed");
        self.child.wait().expect("reaped");
    }

    /// Waits for the process to end by itself.
    pub(crate) async fn exit(mut self) -> ExitStatus {
        let ended = tokio::task::spawn_blocking(move || self.child.wait().expect("reaped"));
        in_time(ended).await.expect("no panic")
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // Both fail if it has been reaped already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The address of the plan that was accepted with this answer.
pub(crate) fn address_of(accepted: &Response) -> String {
    assert_eq!(accepted.status(), 202);
    let address = accepted.headers()["location"].to_str();
    address.expect("visible ASCII").to_owned()
}

/// The document that a request is answered with.
pub(crate) async fn json_of(request: reqwest::RequestBuilder) -> Value {
    let answer = request.send().await.expect("an answer");
    answer.json().await.expect("JSON")
}
