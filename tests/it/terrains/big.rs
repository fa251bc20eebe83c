//! A large file: uploaded in little memory, and planned over.

use std::io::{BufWriter, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use reqwest::Method;
use serde_json::{Value, json};

use crate::support::elevations::write_tiff;
use crate::support::process::Service;
use crate::support::size::size;

/// The most that the service may take above its idle memory, KiB.
const ROOM_KIB: u64 = 64 * 1024;

#[tokio::test(flavor = "multi_thread")]
async fn a_large_file_takes_little_memory_and_is_planned_over() {
    // At 20 m per cell, 100 MB of 16-bit samples are 142 km by 142 km.
    let side = size(3_000, 7_100);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("large.tif");
    let cell = 0.000_18;
    let mut out = BufWriter::new(std::fs::File::create(&file).expect("a file"));
    write_tiff(&mut out, [side, side], [10.0, 46.0], cell, |column, row| {
        let wave = |i: u32, period: u32| i16::try_from(i % period).expect("small");
        800 + (wave(column, 200) - 100).abs() / 2 + (wave(row, 260) - 130).abs() / 2
    })
    .expect("written");
    out.flush().expect("written");
    drop(out);
    let service = Service::start(&directory.path().join("data"), &["--workers", "1"]);
    service.bytes("/terrains").await;
    let idle = service.rss_kib();

    let length = file.metadata().expect("a file").len();
    let done = Arc::new(AtomicBool::new(false));
    let most = async {
        let mut most = 0;
        while !done.load(Ordering::SeqCst) {
            most = most.max(service.rss_kib());
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
        }
        most
    };
    let upload = async {
        let bytes = tokio::fs::read(&file).await;
        let chunks = futures_util::stream::iter(
            bytes
                .expect("a file")
                .chunks(1 << 16)
                .map(|chunk| Ok::<_, std::io::Error>(chunk.to_vec()))
                .collect::<Vec<_>>(),
        );
        let request = service.request(Method::PUT, "/terrains/large");
        let answer = request
            .body(reqwest::Body::wrap_stream(chunks))
            .send()
            .await;
        done.store(true, Ordering::SeqCst);
        answer.expect("an answer")
    };
    let (most, answer) = tokio::join!(most, upload);
    assert_eq!(answer.status(), 201);
    println!("{length} bytes: {idle} KiB when idle, {most} KiB at most");
    assert!(most <= idle + ROOM_KIB, "{idle} KiB, then {most} KiB");

    // 20 km across one corner.
    let document = json!({
        "frame": "wgs84",
        "start": {"lat": 45.85, "lon": 10.10, "alt": 1000},
        "target": {"lat": 45.72, "lon": 10.28, "alt": 1000},
        "terrain": {"kind": "dataset", "name": "large"},
        "altitude": {"min": 50, "max": 500},
        "planner": {"population": 50, "iterations": 20, "seed": 1, "smoothing": {"spacing": 50}},
    });
    let address = service.submit(&document).await;
    let status: Value = service.ended(&address).await;
    assert_eq!(
        (&status["status"], &status["feasible"]),
        (&"succeeded".into(), &true.into()),
        "{status}"
    );
}
