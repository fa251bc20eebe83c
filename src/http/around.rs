//! Layers of our own round a handler.
//!
//! What axum makes of a function puts the next service and the whole request into a box of its own, and all of that
//! for each layer into a future of a kilobyte or two, to be filled and moved. Here a layer looks at the
//! request, hands it on at once, and holds no more than what it wants of the answer.

use std::convert::Infallible;
use std::task::{Context, Poll};

use axum::extract::Request;
use axum::response::{IntoResponse, Response};
use futures_util::FutureExt as _;
use futures_util::future::BoxFuture;
use tower::{Layer, Service};

/// An answer on its way.
pub(super) type Answering = BoxFuture<'static, Result<Response, Infallible>>;

/// What stands before a handler, and before other layers.
pub(super) trait Around: Clone {
    /// Answer `request`, or let `next` do so.
    fn answer<S: Next>(&self, request: Request, next: &mut S) -> Answering;
}

/// What is behind a layer.
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

/// A service with what stands before it.
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
