//! Our own layers around a handler.
//!
//! axum's function layers box the next service and the whole request, and put all that for each layer into a future of
//! a kilobyte or two, to be filled and moved. Here a layer looks at the request, passes it on at once, and holds only
//! what it needs for the answer.

use std::convert::Infallible;
use std::task::{Context, Poll};

use axum::extract::Request;
use axum::response::{IntoResponse, Response};
use futures_util::FutureExt as _;
use futures_util::future::BoxFuture;
use tower::{Layer, Service};

/// A pending answer.
pub(super) type Answering = BoxFuture<'static, Result<Response, Infallible>>;

/// A layer in front of a handler, or of other layers.
pub(super) trait Around: Clone {
    /// Answer `request`, or let `next` do so.
    fn answer<S: Next>(&self, request: Request, next: &mut S) -> Answering;
}

/// What comes after a layer.
pub(super) trait Next {
    /// Its answer.
    fn run(&mut self, request: Request) -> impl Future<Output = Response> + Send + 'static;
}

impl<S> Next for S
where
    S: Service<Request, Error = Infallible>,
    S::Response: IntoResponse,
    S::Future: Send + 'static,
{
    fn run(&mut self, request: Request) -> impl Future<Output = Response> + Send + 'static {
        self.call(request).map(|answer| {
            let Ok(answer) = answer;
            answer.into_response()
        })
    }
}

/// Puts an [`Around`] before a service.
#[derive(Clone)]
pub(super) struct Layered<A>(pub(super) A);

impl<A: Around, S> Layer<S> for Layered<A> {
    type Service = Wrapped<A, S>;

    fn layer(&self, next: S) -> Wrapped<A, S> {
        Wrapped {
            around: self.0.clone(),
            next,
        }
    }
}

/// A service with a layer in front of it.
#[derive(Clone)]
pub(super) struct Wrapped<A, S> {
    around: A,
    next: S,
}

impl<A, S> Service<Request> for Wrapped<A, S>
where
    A: Around,
    S: Service<Request, Error = Infallible> + Next,
{
    type Response = Response;
    type Error = Infallible;
    type Future = Answering;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.next.poll_ready(context)
    }

    fn call(&mut self, request: Request) -> Answering {
        self.around.answer(request, &mut self.next)
    }
}
