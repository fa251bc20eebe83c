//! An OpenTelemetry collector that keeps the traces it receives.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};

use serde_json::Value;

/// A document that was posted to it.
pub(crate) struct Taken {
    pub(crate) path: String,
    /// Lines `name: value`.
    pub(crate) headers: Vec<String>,
    pub(crate) document: Value,
}

/// Listens until the process ends.
pub(crate) struct Collector {
    pub(crate) address: SocketAddr,
    taken: Receiver<Taken>,
}

impl Collector {
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("bound");
        let (take, taken) = channel();
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if take.send(read(stream.expect("a connection"))).is_err() {
                    return;
                }
            }
        });
        Self { address, taken }
    }

    /// Everything posted so far.
    pub(crate) fn taken(&self) -> Vec<Taken> {
        self.taken.try_iter().collect()
    }
}

fn read(stream: TcpStream) -> Taken {
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    reader.read_line(&mut line).expect("a line");
    let path = line.split(' ').nth(1).expect("a path").to_owned();
    let mut length = 0;
    let mut headers = Vec::new();
    loop {
        line.clear();
        reader.read_line(&mut line).expect("a line");
        let Some((name, value)) = line.trim_end().split_once(": ") else {
            break;
        };
        headers.push(line.trim_end().to_owned());
        if name == "content-length" {
            length = value.parse().expect("a number");
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).expect("a whole body");
    let answer = b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\n{}";
    reader.get_mut().write_all(answer).expect("answered");
    Taken {
        path,
        headers,
        document: serde_json::from_slice(&body).expect("JSON"),
    }
}
