//! Which answers are compressed, and what is around that.

use axum::body::{Body, HttpBody as _};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use tower_http::compression::CompressionBody;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};

use super::answers::{Answers, PIECE, is_constant};
use super::header_list;

/// Streams are not compressed: each event must be sent at once.
pub(super) fn worth_compressing() -> impl Predicate {
    let plain = NotForContentType::const_new;
    SizeAbove::new(1024)
        .and(plain("text/event-stream"))
        .and(plain("application/x-ndjson"))
}

/// Codings of a caller up to this length, bytes, are left as they are.
const FEW: usize = 1024;

/// A request with no more codings than are looked at: `CompressionLayer` would weigh all of them.
pub(super) fn shorten_codings<B>(mut request: http::Request<B>) -> http::Request<B> {
    let lines = request.headers().get_all(header::ACCEPT_ENCODING);
    if lines.iter().map(HeaderValue::len).sum::<usize>() > FEW {
        let codings: Vec<&str> = header_list::entries(lines).collect();
        let codings = HeaderValue::from_bytes(codings.join(",").as_bytes());
        let codings = codings.expect("parts of header lines are one");
        let headers = request.headers_mut();
        headers.insert(header::ACCEPT_ENCODING, codings);
    }
    request
}

/// An answer before compression.
#[derive(Clone, Copy)]
struct Plain {
    status: StatusCode,
    length: Option<u64>,
    /// Whether it has a coding already.
    coded: bool,
}

fn is_coded<B>(answer: &http::Response<B>) -> bool {
    answer.headers().contains_key(header::CONTENT_ENCODING)
}

/// Keeps what an answer is in a place where compression leaves it alone.
pub(super) fn note_plain(mut answer: Response) -> Response {
    let plain = Plain {
        status: answer.status(),
        length: answer.body().size_hint().exact(),
        coded: is_coded(&answer),
    };
    answer.extensions_mut().insert(plain);
    answer
}

/// The answer as it is sent: out of the room for answers if it occupies much of it, a refusal if there is none left.
///
/// Only compressed ones keep a compressor, else every open stream would hold one; where there is no room for that, or
/// enough other long answers are being compressed, the answer is plain. `CompressionLayer` answers 406 after the work
/// is done if no coding is acceptable; we send the plain answer instead.
pub(super) fn send(
    mut answer: http::Response<CompressionBody<Body>>,
    answers: &Answers,
) -> Response {
    let coded = is_coded(&answer);
    let plain = answer.extensions_mut().remove::<Plain>();
    if let Some(plain) = plain {
        *answer.status_mut() = plain.status;
    }
    let length = plain.and_then(|plain| plain.length).unwrap_or(0);
    let own = if is_constant(&answer) { 0 } else { length };
    if coded && plain.is_none_or(|plain| !plain.coded) {
        if let Some(place) = answers.room_to_compress(length, own) {
            return answer.map(|body| place.hold(body));
        }
        answer.headers_mut().remove(header::CONTENT_ENCODING);
    }
    let answer = answer.map(CompressionBody::into_inner);
    if own <= PIECE as u64 {
        return answer;
    }
    match answers.room(own) {
        Ok(place) => answer.map(|body| place.hold(body)),
        Err(busy) => busy.into_response(),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::Router;
    use axum::extract::Request;
    use axum::routing::get;
    use http_body_util::BodyExt as _;
    use tower::ServiceBuilder;
    use tower::ServiceExt as _;
    use tower::util::MapResponseLayer;
    use tower_http::compression::CompressionLayer;

    use super::*;

    /// What `length` letters are sent as to a caller that takes gzip.
    async fn sent(answers: &Answers, length: usize) -> Response {
        let answers = answers.clone();
        let layers = ServiceBuilder::new()
            .layer(MapResponseLayer::new(move |answer| send(answer, &answers)))
            .layer(CompressionLayer::new().compress_when(worth_compressing()))
            .layer(MapResponseLayer::new(note_plain));
        let router = Router::new().route("/", get(async move || "a".repeat(length)));
        let request = Request::get("/").header(header::ACCEPT_ENCODING, "gzip");
        let request = request.body(Body::empty()).expect("a request");
        let answered = router.layer(layers).oneshot(request).await;
        answered.expect("infallible")
    }

    #[tokio::test]
    async fn without_room_for_a_compressor_answers_are_plain_and_long_ones_refused() {
        let answers = Answers::new(1 << 20, Duration::from_secs(60));
        let compressed = sent(&answers, 900_000).await;
        assert!(is_coded(&compressed));

        let plain = sent(&answers, 2000).await;
        assert_eq!((plain.status(), is_coded(&plain)), (StatusCode::OK, false));
        let body = plain.into_body().collect().await.expect("a body");
        assert_eq!(body.to_bytes(), "a".repeat(2000));
        let refused = sent(&answers, 200_000).await;
        assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);

        let read = compressed.into_body().collect().await.expect("a body");
        assert!(read.to_bytes().len() < 10_000);
        assert!(is_coded(&sent(&answers, 200_000).await));
    }

    #[tokio::test]
    async fn few_long_answers_are_compressed_at_once() {
        const LONG: usize = 100_000;
        let answers = Answers::new(1 << 24, Duration::from_secs(60));
        let mut compressed = Vec::new();
        let plain = loop {
            let answer = sent(&answers, LONG).await;
            if !is_coded(&answer) {
                break answer;
            }
            compressed.push(answer);
            assert!(compressed.len() < 100);
        };
        let body = plain.into_body().collect().await.expect("a body");
        assert_eq!(body.to_bytes(), "a".repeat(LONG));
        assert!(is_coded(&sent(&answers, 2000).await));

        let read = compressed.pop().expect("some").into_body().collect().await;
        assert!(read.expect("a body").to_bytes().len() < 10_000);
        assert!(is_coded(&sent(&answers, LONG).await));
    }

    #[tokio::test(start_paused = true)]
    async fn callers_who_take_nothing_do_not_keep_others_answers_plain() {
        let patience = Duration::from_secs(60);
        let answers = Answers::new(1 << 24, patience);
        let mut unread = Vec::new();
        while let answer = sent(&answers, 100_000).await
            && is_coded(&answer)
        {
            unread.push(answer);
            assert!(unread.len() < 100);
        }
        tokio::time::sleep(patience + Duration::from_secs(1)).await;
        assert!(is_coded(&sent(&answers, 100_000).await));
        assert!(unread.remove(0).into_body().collect().await.is_err());
    }

    #[test]
    fn of_codings_without_end_the_first_are_kept() {
        let shortened = |lines: &[&str]| {
            let mut request = Request::new(());
            for line in lines {
                let line = HeaderValue::from_bytes(line.as_bytes()).expect("a value");
                request.headers_mut().append(header::ACCEPT_ENCODING, line);
            }
            let request = shorten_codings(request);
            let lines = request.headers().get_all(header::ACCEPT_ENCODING);
            let lines = lines.iter().map(HeaderValue::as_bytes);
            lines.map(<[u8]>::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(
            shortened(&["gzip, br", "zstd"]),
            [&b"gzip, br"[..], b"zstd"]
        );
        let lines = ["\u{e9};q=0.5,".repeat(60), "gzip,\t".repeat(1000)];
        let kept = shortened(&lines.each_ref().map(String::as_str));
        let expected = [vec!["\u{e9};q=0.5"; 60], vec![""], vec!["gzip"; 39]].concat();
        assert_eq!(kept, [expected.join(",").into_bytes()]);
    }
}
