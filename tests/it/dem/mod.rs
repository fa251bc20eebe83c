//! Elevation files: valid, malformed and malicious ones.

mod fuzz;
mod hostile;
mod masks;
mod right;
mod sparse;
mod tiff;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use noctule::terrain::dem::{self, Dataset, Declared, DemError};

/// A file named `name` with these bytes, in a temporary directory.
fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    (directory, path)
}

fn open(path: &Path) -> Result<Dataset, DemError> {
    dem::open(path, Declared::default())
}

/// What a zlib encoder makes of these bytes.
fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

/// An SRTM tile with the same value everywhere.
fn tile(side: usize, sample: i16) -> Vec<u8> {
    sample.to_be_bytes().repeat(side * side)
}

/// The small test files, by name.
fn corpus() -> &'static [(String, Vec<u8>)] {
    static FILES: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(|| {
        let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/dem/corpus");
        let entries = std::fs::read_dir(directory).expect("it is there");
        let paths = entries.map(|entry| entry.expect("it can be listed").path());
        let mut files: Vec<(String, Vec<u8>)> = paths
            .map(|path| {
                let name = path.file_name().expect("a name").to_str();
                let bytes = std::fs::read(&path).expect("it can be read");
                (name.expect("UTF-8").to_owned(), bytes)
            })
            .collect();
        files.sort();
        assert!(files.len() >= 7);
        files
    });
    &FILES
}
