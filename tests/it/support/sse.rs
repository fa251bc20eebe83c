//! A strict reader of server-sent events.

use reqwest::{RequestBuilder, Response};
use serde_json::{Value, json};

use super::description::check_schema;

/// A block of a stream.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Block {
    Retry(u64),
    Comment(String),
    Event { id: u64, name: String, data: Value },
}

impl Block {
    /// The status that a `status` event carries.
    pub(crate) fn status(&self) -> Option<String> {
        match self {
            Self::Event { name, data, .. } if name == "status" => {
                Some(data["status"].as_str()?.to_owned())
            }
            _ => None,
        }
    }
}

/// An open stream.
pub(crate) struct Stream {
    response: Response,
    text: String,
}

impl Stream {
    /// Sends the request and checks the head of the response.
    pub(crate) async fn open(request: RequestBuilder) -> Self {
        let response = request.send().await.expect("an answer");
        assert_eq!(response.status(), 200);
        let header = |name: &str| {
            response.headers()[name]
                .to_str()
                .expect("visible ASCII")
                .to_owned()
        };
        assert_eq!(header("content-type"), "text/event-stream");
        assert_eq!(header("cache-control"), "no-cache, no-transform");
        assert_eq!(header("x-accel-buffering"), "no");
        let mut stream = Self {
            response,
            text: String::new(),
        };
        assert_eq!(stream.next().await, Some(Block::Retry(2000)));
        stream
    }

    /// The next block; `None` when the server has closed the stream.
    pub(crate) async fn next(&mut self) -> Option<Block> {
        loop {
            if let Some(end) = self.text.find("\n\n") {
                let block = read(&self.text[..end]);
                self.text.drain(..end + 2);
                return Some(block);
            }
            let Some(chunk) = self.response.chunk().await.expect("an unbroken stream") else {
                assert_eq!(self.text, "", "the last block is whole");
                return None;
            };
            self.text
                .push_str(std::str::from_utf8(&chunk).expect("UTF-8"));
        }
    }

    /// Everything up to the close.
    pub(crate) async fn rest(mut self) -> Vec<Block> {
        let mut blocks = Vec::new();
        while let Some(block) = self.next().await {
            blocks.push(block);
        }
        blocks
    }
}

fn read(block: &str) -> Block {
    if let Some(comment) = block.strip_prefix(':') {
        return Block::Comment(comment.trim().to_owned());
    }
    if let Some(retry) = block.strip_prefix("retry: ") {
        return Block::Retry(retry.parse().expect("milliseconds"));
    }
    let lines: Vec<&str> = block.split('\n').collect();
    let [id, name, data] = lines[..] else {
        panic!("not an event: {block:?}")
    };
    let id = id
        .strip_prefix("id: ")
        .expect("an id")
        .parse()
        .expect("a number");
    let name = name.strip_prefix("event: ").expect("a name").to_owned();
    let data = data.strip_prefix("data: ").expect("data");
    let data = serde_json::from_str(data).expect("JSON");
    let line = json!({"id": id, "event": name, "data": data});
    check_schema(
        &json!({"$ref": "#/components/schemas/EventLine"}),
        &line,
        block,
    );
    Block::Event { id, name, data }
}

/// The ids and names of the events among `blocks`.
pub(crate) fn events(blocks: &[Block]) -> Vec<(u64, String)> {
    blocks
        .iter()
        .filter_map(|block| match block {
            Block::Event { id, name, .. } => Some((*id, name.clone())),
            _ => None,
        })
        .collect()
}
