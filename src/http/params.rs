//! Query parameters and plan ids, read strictly: an unknown, duplicate or unreadable parameter is refused, because
//! ignoring it would give another answer than the one asked for.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use axum::extract::rejection::QueryRejection;
use axum::extract::{FromRequestParts, Path, Query};
use axum::http::Uri;
use axum::http::request::Parts;
use uuid::Uuid;

use super::auth::holds_a_key;
use super::problem::Problem;
use super::shown::Shown;
use crate::job::PlanId;
use crate::telemetry::spans;

/// The parameters of one request.
pub(super) struct Params(Vec<(String, String)>);

impl Params {
    /// The parameters of `uri`, which may have those in `known`.
    pub(super) fn read(uri: &Uri, known: &[&str]) -> Result<Self, Problem> {
        let pairs = pairs_of(uri).map_err(|error| invalid("query", &error.to_string()))?;
        for (position, (name, _)) in pairs.iter().enumerate() {
            if !known.contains(&name.as_str()) {
                let name = Shown::of(name);
                return Err(invalid(name.as_str(), &unknown(name.as_str(), known)));
            }
            if pairs[..position].iter().any(|(earlier, _)| earlier == name) {
                return Err(repeated(name));
            }
        }
        Ok(Self(pairs))
    }

    /// The parameters as they were sent.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0
            .iter()
            .map(|(name, value)| (name.as_str(), value.as_str()))
    }

    /// The value as it was sent.
    pub(super) fn text(&self, name: &str) -> Option<&str> {
        let (_, value) = self.0.iter().find(|(given, _)| given == name)?;
        Some(value)
    }

    /// The parsed value; `allowed` is for a refusal.
    pub(super) fn parse<T: FromStr>(
        &self,
        name: &str,
        allowed: &str,
    ) -> Result<Option<T>, Problem> {
        self.text(name)
            .map(|value| value.parse().map_err(|_| refused(name, value, allowed)))
            .transpose()
    }

    /// The parsed value, which must lie in `range`; `unit` is what it is a number of, for a refusal.
    pub(super) fn within<T: FromStr + PartialOrd + Display>(
        &self,
        name: &str,
        range: &RangeInclusive<T>,
        unit: &str,
    ) -> Result<Option<T>, Problem> {
        let allowed = || format!("{unit} from {} to {}", range.start(), range.end());
        let read = |text: &str| {
            let value = text.parse().ok().filter(|value| range.contains(value));
            value.ok_or_else(|| refused(name, text, &allowed()))
        };
        self.text(name).map(read).transpose()
    }
}

/// The parameters in the query.
fn pairs_of(uri: &Uri) -> Result<Vec<(String, String)>, QueryRejection> {
    // Most addresses have none, and each is examined more than once.
    if uri.query().is_none() {
        return Ok(Vec::new());
    }
    Query::try_from_uri(uri).map(|Query(pairs)| pairs)
}

/// `value` is not allowed for `name`.
pub(super) fn refused(name: &str, value: &str, allowed: &str) -> Problem {
    let value = Shown::of(value);
    invalid(
        name,
        &format!("{name} is {:?}, must be {allowed}", value.as_str()),
    )
}

/// `name` is given more than once.
pub(super) fn repeated(name: &str) -> Problem {
    invalid(name, &format!("{name} is given twice"))
}

/// `name` is needed beside the others.
pub(super) fn missing(name: &str, allowed: &str) -> Problem {
    invalid(name, &format!("{name} is missing, must be {allowed}"))
}

fn invalid(name: &str, detail: &str) -> Problem {
    Problem::InvalidParameter {
        name: name.to_owned(),
        detail: detail.to_owned(),
    }
}

fn unknown(name: &str, known: &[&str]) -> String {
    if known.is_empty() {
        format!("{name} is unknown, there are no parameters here")
    } else {
        format!("{name} is unknown, must be one of {}", known.join(", "))
    }
}

/// Parameter names that are used for credentials elsewhere.
const CREDENTIALS: [&str; 7] = [
    "access_token",
    "api-key",
    "api_key",
    "apikey",
    "authorization",
    "key",
    "token",
];

/// Whether the address contains a key, or what is meant to be one.
pub(super) fn brings_a_key(uri: &Uri) -> bool {
    let in_query = pairs_of(uri).is_ok_and(|pairs| {
        pairs.iter().any(|(name, value)| {
            CREDENTIALS.contains(&name.to_ascii_lowercase().as_str())
                || holds_a_key(name)
                || holds_a_key(value)
        })
    });
    in_query || holds_a_key(uri.path()) || uri.query().is_some_and(holds_a_key)
}

/// The ticket in the query, and the plan in the path, which is that of `/plans/{id}/events`.
pub(super) fn ticket_of(uri: &Uri) -> Option<(String, Option<PlanId>)> {
    let mut pairs = pairs_of(uri).ok()?.into_iter();
    let (_, ticket) = pairs.find(|(name, _)| name == "ticket")?;
    let id = uri.path().split('/').nth(2)?;
    Some((ticket, Uuid::try_parse(id).ok()))
}

/// Extracts nothing, and refuses any parameters.
pub(super) struct NoParams;

impl<S: Send + Sync> FromRequestParts<S> for NoParams {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        Params::read(&parts.uri, &[]).map(|_| Self)
    }
}

/// The `{id}` of the path. A malformed id names no plan.
pub(super) struct Id(pub(super) PlanId);

impl<S: Send + Sync> FromRequestParts<S> for Id {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let Ok(Path(text)) = Path::<String>::from_request_parts(parts, state).await else {
            return Err(Problem::no_such_resource(&parts.uri));
        };
        let Some(id) = plan_id(&text) else {
            return Err(Problem::NoSuchPlan(Shown::of(&text)));
        };
        spans::name_plan(id);
        Ok(Self(id))
    }
}

/// The id of a plan. Only the canonical spelling is accepted: each plan has one address.
pub(super) fn plan_id(text: &str) -> Option<PlanId> {
    let id = Uuid::try_parse(text).ok();
    id.filter(|id| id.to_string() == text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(query: &'static str) -> Option<String> {
        let uri = Uri::from_static(query);
        match Params::read(&uri, &["limit", "status"])
            .and_then(|params| params.parse::<u32>("limit", "a number"))
        {
            Ok(_) => None,
            Err(Problem::InvalidParameter { detail, .. }) => Some(detail),
            Err(other) => Some(format!("{other:?}")),
        }
    }

    #[test]
    fn known_parameters_are_read_and_others_refused() {
        for (query, expected) in [
            ("/", None),
            ("/?limit=3&status=running", None),
            ("/?limit=x", Some("limit is \"x\", must be a number")),
            ("/?limit=", Some("limit is \"\", must be a number")),
            (
                "/?limt=3",
                Some("limt is unknown, must be one of limit, status"),
            ),
            ("/?limit=3&limit=4", Some("limit is given twice")),
        ] {
            assert_eq!(fault(query).as_deref(), expected, "{query}");
        }
    }

    #[test]
    fn a_number_is_within_its_range() {
        #[track_caller]
        fn check(query: &'static str, expected: Result<Option<f64>, &str>) {
            let params = Params::read(&Uri::from_static(query), &["north"]).expect("known");
            let read = params.within("north", &(-90.0..=90.0), "degrees");
            let read = read.map_err(|problem| match problem {
                Problem::InvalidParameter { detail, .. } => detail,
                other => format!("{other:?}"),
            });
            assert_eq!(read, expected.map_err(ToOwned::to_owned), "{query}");
        }
        check("/", Ok(None));
        check("/?north=-90", Ok(Some(-90.0)));
        check("/?north=90", Ok(Some(90.0)));
        for (query, shown) in [
            ("/?north=90.5", "90.5"),
            ("/?north=NaN", "NaN"),
            ("/?north=up", "up"),
            ("/?north=", ""),
        ] {
            let refused = format!("north is {shown:?}, must be degrees from -90 to 90");
            check(query, Err(&refused));
        }
    }
}
