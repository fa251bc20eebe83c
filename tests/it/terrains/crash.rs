//! kill -9 during an upload.

use serde_json::Value;
use tokio::io::AsyncWriteExt as _;
use tokio::net::TcpStream;

use super::{hill, jacksboro, kept};
use crate::support::patience::eventually;
use crate::support::process::Service;

#[tokio::test]
async fn a_crash_during_an_upload_leaves_the_earlier_datasets_and_nothing_else() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let uploads = directory.path().join("terrains");
    let service = Service::start(directory.path(), &[]);
    let first = service
        .request(reqwest::Method::PUT, "/terrains/hill")
        .body(hill(9.0));
    assert_eq!(first.send().await.expect("an answer").status(), 201);
    let before = service.bytes("/terrains").await;

    let file = jacksboro();
    let mut stream = TcpStream::connect(service.address())
        .await
        .expect("connected");
    let head = format!(
        "PUT /terrains/hill HTTP/1.1\r\nhost: localhost\r\ncontent-length: {}\r\n\r\n",
        file.len()
    );
    stream.write_all(head.as_bytes()).await.expect("sent");
    stream
        .write_all(&file[..file.len() / 2])
        .await
        .expect("sent");
    let arrived = async || {
        let mut incoming = std::fs::read_dir(uploads.join("incoming")).expect("it is there");
        incoming.any(|entry| {
            entry
                .and_then(|entry| entry.metadata())
                .is_ok_and(|file| file.len() > 1000)
        })
    };
    eventually(arrived).await;
    service.kill();
    // Including the dataset that ships with the program.
    assert_eq!(kept(&uploads), [4, 2, 1]);

    let service = Service::start(directory.path(), &[]);
    let after: Value = serde_json::from_slice(&service.bytes("/terrains").await).expect("JSON");
    assert_eq!(
        after,
        serde_json::from_slice::<Value>(&before).expect("JSON")
    );
    assert_eq!(kept(&uploads), [4, 2, 0]);
}
