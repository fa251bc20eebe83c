//! The gate before a route: who is admitted.

use std::future::ready;
use std::sync::Arc;

use axum::extract::Request;
use axum::http::{HeaderMap, Uri, header};
use axum::response::IntoResponse as _;
use futures_util::FutureExt as _;
use futures_util::future::Either;
use tokio::time::Instant;

use super::rate::Taken;
use super::{Access, Needs, Scope, Unauthorized, ticket};
use crate::http::caller::Caller;
use crate::http::layer::{Answering, Around, Next};
use crate::http::params::ticket_of;
use crate::http::problem::Problem;
use crate::telemetry::spans;

/// The layer in front of one route.
#[derive(Clone)]
pub(in crate::http) struct Gate(Arc<(Access, Needs)>);

impl Gate {
    pub(in crate::http) fn new(access: Access, needs: Needs) -> Self {
        Self(Arc::new((access, needs)))
    }
}

impl Around for Gate {
    fn answer<S: Next>(&self, mut request: Request, next: &mut S) -> Answering {
        let (access, needs) = &*self.0;
        let (refused, taken) = match access.admit(*needs, request.uri(), request.headers()) {
            Ok(Admitted { caller, taken }) => {
                if let Some(caller) = caller {
                    request.extensions_mut().insert(caller);
                }
                (None, taken)
            }
            Err(Refused { problem, taken }) => (Some(problem), taken),
        };
        let answering = match refused {
            Some(problem) => Either::Left(ready(problem.into_response())),
            None => Either::Right(next.run(request)),
        };
        Box::pin(answering.map(move |mut answer| {
            if let Some(taken) = taken {
                taken.allowance().write(answer.headers_mut());
            }
            Ok(answer)
        }))
    }
}

impl Access {
    /// The caller, and what is left of their rate; admits everybody where there are no keys.
    fn admit(&self, needs: Needs, uri: &Uri, headers: &HeaderMap) -> Result<Admitted, Refused> {
        let asked = match needs {
            Needs::Nothing => return Ok(Admitted::default()),
            Needs::Scope(scope) => scope,
            Needs::Ticket => Scope::Read,
        };
        let ticket = match needs {
            Needs::Ticket if !headers.contains_key(header::AUTHORIZATION) => ticket_of(uri),
            _ => None,
        };
        let keys = self.0.keys.borrow().clone();
        let now = self.now();
        let key = match (ticket, keys.as_deref()) {
            (Some((ticket, plan)), keys) => {
                let plan = plan.ok_or(Unauthorized::NoTicket)?;
                ticket::holder(&ticket, plan, keys, now.as_millisecond())?
            }
            (None, Some(keys)) => Some(keys.find(secret(headers)?).ok_or(Unauthorized::NoKey)?),
            (None, None) => None,
        };
        let Some(key) = key else {
            return Ok(Admitted::default());
        };
        if key.has_expired(now) {
            return Err(Unauthorized::Expired.into());
        }
        spans::name_key(&key.name);
        let taken = key
            .rate
            .map(|rate| self.0.buckets.take(&key.name, rate, Instant::now()));
        if let Some(taken) = taken.filter(|taken| !taken.granted) {
            let retry_after_s = taken.retry_after_s();
            return Err(Refused {
                problem: Problem::RateLimited { retry_after_s },
                taken: Some(taken),
            });
        }
        if !key.may(asked) {
            return Err(Refused {
                problem: Problem::Forbidden(asked),
                taken,
            });
        }
        Ok(Admitted {
            caller: Some(Caller::of(key)),
            taken,
        })
    }
}

/// A request that may proceed.
#[derive(Default)]
struct Admitted {
    /// `None` where the caller's identity does not matter.
    caller: Option<Caller>,
    taken: Option<Taken>,
}

/// A request that is refused.
struct Refused {
    problem: Problem,
    taken: Option<Taken>,
}

impl From<Unauthorized> for Refused {
    fn from(why: Unauthorized) -> Self {
        Self {
            problem: Problem::Unauthorized(why),
            taken: None,
        }
    }
}

/// What follows `Bearer` in the only such header.
fn secret(headers: &HeaderMap) -> Result<&[u8], Unauthorized> {
    const SCHEME: &[u8] = b"bearer ";
    let mut values = headers.get_all(header::AUTHORIZATION).iter();
    let Some(value) = values.next() else {
        return Err(Unauthorized::Nothing);
    };
    let value = value.as_bytes();
    let (scheme, secret) = value.split_at(value.len().min(SCHEME.len()));
    if values.next().is_none() && scheme.eq_ignore_ascii_case(SCHEME) {
        Ok(secret.trim_ascii())
    } else {
        Err(Unauthorized::NoKey)
    }
}
