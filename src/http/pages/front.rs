//! The page at `/` and its files: all built into the program, laid out as in `src/page`.
//!
//! Vendored files were compressed with brotli ahead of time; everything is also kept as gzip, made on the first request
//! for it. A browser asks again each time and is told that nothing has changed.

use std::io::Write as _;
use std::sync::LazyLock;

use axum::extract::Path;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;

use crate::digest::sha256_hex;
use crate::http::accept::takes;
use crate::http::answers::constant;
use crate::http::entity_tags::EntityTags;
use crate::http::params::NoParams;
use crate::http::problem::Problem;

/// Its own scripts and styles, requests to its own origin, images that it creates itself.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
     img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// It may be cached, and is revalidated each time.
const CACHING: HeaderValue = HeaderValue::from_static("no-cache");

/// A file of the page.
struct File {
    /// Its path below `src/page`.
    name: &'static str,
    bytes: &'static [u8],
    brotli: Option<&'static [u8]>,
    gzip: LazyLock<Vec<u8>>,
    /// Hash of the plain bytes.
    hash: LazyLock<String>,
}

/// The content coding of the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coding {
    Plain,
    Gzip,
    Brotli,
}

macro_rules! file {
    ($name:literal) => {
        file!($name, None)
    };
    ($name:literal, compressed) => {
        file!(
            $name,
            Some(include_bytes!(concat!("../../page/", $name, ".br")).as_slice())
        )
    };
    ($name:literal, $brotli:expr) => {
        File {
            name: $name,
            bytes: include_bytes!(concat!("../../page/", $name)),
            brotli: $brotli,
            gzip: LazyLock::new(|| gzip(include_bytes!(concat!("../../page/", $name)))),
            hash: LazyLock::new(|| hash(include_bytes!(concat!("../../page/", $name)))),
        }
    };
}

/// Every file there is.
static FILES: [File; 58] = [
    file!("index.html"),
    file!("page.css"),
    file!("mark.svg"),
    file!("again.js"),
    file!("api.js"),
    file!("backdrop.js"),
    file!("beneath.js"),
    file!("camera.js"),
    file!("chart.js"),
    file!("check.js"),
    file!("datasets.js"),
    file!("describe.js"),
    file!("dom.js"),
    file!("draft.js"),
    file!("dropped.js"),
    file!("editor.js"),
    file!("figures.js"),
    file!("followed.js"),
    file!("form.js"),
    file!("format.js"),
    file!("frame.js"),
    file!("graphics.js"),
    file!("ground.js"),
    file!("import.js"),
    file!("key.js"),
    file!("labels.js"),
    file!("main.js"),
    file!("narrow.js"),
    file!("new.js"),
    file!("notice.js"),
    file!("palette.js"),
    file!("passes.js"),
    file!("plans.js"),
    file!("print.js"),
    file!("relief.js"),
    file!("result.js"),
    file!("routes.js"),
    file!("save.js"),
    file!("scene.js"),
    file!("silence.js"),
    file!("sizes.js"),
    file!("stage.js"),
    file!("steps.js"),
    file!("stream.js"),
    file!("strip.js"),
    file!("sure.js"),
    file!("tabs.js"),
    file!("tools.js"),
    file!("turns.js"),
    file!("undo.js"),
    file!("unsaved.js"),
    file!("upload.js"),
    file!("volumes.js"),
    file!("way.js"),
    file!("words.js"),
    file!("vendor/three.js", compressed),
    file!("vendor/uplot.js", compressed),
    file!("vendor/uplot.css", compressed),
];

fn hash(bytes: &[u8]) -> String {
    let mut digest = sha256_hex(bytes);
    digest.truncate(24);
    digest
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder
        .write_all(bytes)
        .and_then(|()| encoder.finish())
        .expect("writing to memory cannot fail")
}

/// `GET /`.
pub(in crate::http) async fn front(
    uri: Uri,
    _: NoParams,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    serve("index.html", &uri, &headers)
}

/// `GET /page/{file}`.
pub(in crate::http) async fn file(
    uri: Uri,
    name: Option<Path<String>>,
    _: NoParams,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    serve(
        &name.map(|Path(name)| name).unwrap_or_default(),
        &uri,
        &headers,
    )
}

/// `GET /page/vendor/{file}`.
pub(in crate::http) async fn vendored(
    uri: Uri,
    name: Option<Path<String>>,
    _: NoParams,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let name = name.map(|Path(name)| name).unwrap_or_default();
    serve(&format!("vendor/{name}"), &uri, &headers)
}

fn serve(name: &str, uri: &Uri, headers: &HeaderMap) -> Result<Response, Problem> {
    let Some(file) = FILES.iter().find(|file| file.name == name) else {
        return Err(Problem::no_such_resource(uri));
    };
    let (coding, bytes) = file.coded(headers);
    let tag = coding.tag(&file.hash);
    let common = [
        (header::ETAG, tag.clone()),
        (header::CACHE_CONTROL, CACHING),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::VARY, HeaderValue::from_static("accept-encoding")),
    ];
    if EntityTags::known(headers).is_some_and(|known| known.contain(&tag)) {
        return Ok((StatusCode::NOT_MODIFIED, common).into_response());
    }
    let mut response = constant((common, bytes));
    let answered = response.headers_mut();
    answered.insert(header::CONTENT_TYPE, file.media_type());
    if let Some(name) = coding.name() {
        answered.insert(header::CONTENT_ENCODING, HeaderValue::from_static(name));
    }
    Ok(response)
}

impl File {
    /// The shortest coding that the caller accepts.
    fn coded(&'static self, headers: &HeaderMap) -> (Coding, &'static [u8]) {
        if let Some(brotli) = self.brotli
            && takes(headers, "br")
        {
            return (Coding::Brotli, brotli);
        }
        if takes(headers, "gzip") {
            return (Coding::Gzip, &self.gzip);
        }
        (Coding::Plain, self.bytes)
    }

    fn media_type(&self) -> HeaderValue {
        let extension = self.name.rsplit('.').next().unwrap_or_default();
        HeaderValue::from_static(match extension {
            "html" => "text/html; charset=utf-8",
            "css" => "text/css; charset=utf-8",
            "js" => "text/javascript; charset=utf-8",
            "svg" => "image/svg+xml",
            _ => unreachable!("a file of the page is one of these, as its test says"),
        })
    }
}

impl Coding {
    /// The name in `Content-Encoding`.
    fn name(self) -> Option<&'static str> {
        match self {
            Self::Plain => None,
            Self::Gzip => Some("gzip"),
            Self::Brotli => Some("br"),
        }
    }

    /// The entity tag of content with this hash, in this coding.
    fn tag(self, hash: &str) -> HeaderValue {
        let tag = match self.name() {
            None => format!("\"{hash}\""),
            Some(name) => format!("\"{hash}-{name}\""),
        };
        HeaderValue::from_str(&tag).expect("visible ASCII")
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};
    use std::fs;
    use std::path::Path;

    use super::*;

    fn directory() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("src/page")
    }

    #[test]
    fn the_table_lists_exactly_the_existing_files() {
        let mut there = BTreeSet::new();
        for (below, prefix) in [("", ""), ("vendor", "vendor/")] {
            for entry in fs::read_dir(directory().join(below)).expect("it is there") {
                let name = entry.expect("listed").file_name();
                let name = name.to_str().expect("ASCII");
                let served = [".html", ".css", ".js", ".svg"]
                    .iter()
                    .any(|end| name.ends_with(end));
                if served {
                    there.insert(format!("{prefix}{name}"));
                }
            }
        }
        let listed = FILES.iter().map(|file| file.name.to_owned()).collect();
        assert_eq!(there, listed);
    }

    /// The served files are exactly those that were bundled.
    #[test]
    fn vendored_files_match_their_recorded_hashes() {
        let sums = fs::read_to_string(directory().join("vendor/SHA256SUMS")).expect("it is there");
        let sums: BTreeMap<&str, &str> = sums
            .lines()
            .map(|line| line.split_once("  ").expect("a hash and a name"))
            .map(|(sum, name)| (name, sum))
            .collect();
        let mut checked = 0;
        for file in FILES.iter().filter(|file| file.name.starts_with("vendor/")) {
            let name = file.name.trim_start_matches("vendor/");
            let brotli = file.brotli.expect("compressed ahead of time");
            for (name, bytes) in [
                (name.to_owned(), file.bytes),
                (format!("{name}.br"), brotli),
            ] {
                assert_eq!(sums[name.as_str()], sha256_hex(bytes), "{name}");
                checked += 1;
            }
        }
        assert_eq!(checked, sums.len());
        for library in ["three", "uplot"] {
            let licence = directory().join(format!("vendor/{library}.LICENSE"));
            let licence = fs::read_to_string(licence).expect("it is there");
            assert!(licence.contains("MIT"), "{library}");
        }
    }

    #[test]
    fn the_page_is_small_on_the_wire() {
        let wire = |file: &File| file.brotli.map_or_else(|| file.gzip.len(), <[u8]>::len);
        let whole: usize = FILES.iter().map(wire).sum();
        assert!(whole <= 250_000, "{whole} bytes");
    }

    /// The document loads `main.js`, and that the others.
    #[test]
    fn exactly_the_imported_scripts_are_served() {
        let mut imported = BTreeSet::from(["main.js"]);
        for file in FILES
            .iter()
            .filter(|file| !file.name.starts_with("vendor/"))
        {
            let text = std::str::from_utf8(file.bytes).expect("text");
            for (_, name) in text.lines().filter_map(|line| line.split_once(" from './")) {
                imported.insert(name.trim_end_matches(['\'', ';']));
            }
        }
        let is_script = |name: &&str| name.rsplit_once('.').is_some_and(|(_, end)| end == "js");
        let names = FILES.iter().map(|file| file.name);
        let served: BTreeSet<&str> = names.filter(is_script).collect();
        assert_eq!(imported, served);
    }
}
