//! `planner.warm_start.plan_id`: replaced by that stored plan's waypoints, so that the result depends on the accepted
//! document alone.

use bytes::Bytes;
use serde::Deserialize;

use super::AppState;
use super::caller::Caller;
use super::named::{PLAN, may_name};
use super::off_thread;
use super::params::plan_id;
use super::problem::Problem;
use crate::export::document::{FrameDocument, Position};
use crate::geometry::Point3;
use crate::geometry::geodesy::LatLon;
use crate::job::PlanId;
use crate::scenario::frame::{Datum, Frame};
use crate::scenario::json::{Fault, MAX_LISTED, MOST_M};
use crate::scenario::{Scenario, WarmStart};

/// The part of a result document that is needed here.
#[derive(Deserialize)]
struct Route {
    frame: Option<FrameDocument>,
    waypoints: Vec<Position>,
}

impl Route {
    /// Its waypoints in the local plane of `frame`, or why they cannot lie there.
    fn within(&self, frame: &Frame) -> Result<Vec<Point3>, &'static str> {
        const ANOTHER: &str = "that plan's route is in another frame";
        let points = self.waypoints.iter();
        let points: Option<Vec<_>> = points.map(|position| position.within(frame)).collect();
        let points = points.ok_or(ANOTHER)?;
        let Some(wgs84) = frame.wgs84() else {
            return Ok(points);
        };
        let reached = |position: &Position| match *position {
            Position::Geodetic { lat, lon, .. } => wgs84.reaches(LatLon { lat, lon }),
            Position::Local { .. } => true,
        };
        if !self.waypoints.iter().all(reached) {
            return Err("that plan's route is too far from this scenario's area");
        }
        let datum = &self.frame.as_ref().ok_or(ANOTHER)?.altitude_datum;
        let up = match (datum.as_str(), wgs84.datum) {
            ("msl", Datum::Ellipsoid) => 1.0,
            ("ellipsoid", Datum::Msl) => -1.0,
            _ => return Ok(points),
        };
        let geoid = wgs84.geoid();
        let lifted = |point: Point3| {
            let undulation_m = geoid.height_m([point.x, point.y]);
            Point3::new(point.x, point.y, point.z + up * undulation_m)
        };
        Ok(points.into_iter().map(lifted).collect())
    }
}

/// Where a document names the plan that it starts from.
#[derive(Deserialize)]
struct Document {
    planner: Planner,
}

#[derive(Deserialize)]
struct Planner {
    warm_start: Start,
}

#[derive(Deserialize)]
struct Start {
    plan_id: String,
}

/// The `refusal` of a document, with what is wrong with the plan that it starts from, which only the store knows.
pub(super) async fn refused_too(
    state: &AppState,
    caller: &Caller,
    document: Bytes,
    refusal: Problem,
) -> Problem {
    let Problem::InvalidScenario(mut faults) = refusal else {
        return refusal;
    };
    if faults.len() < MAX_LISTED && may_name(&document, PLAN) {
        let named = move || serde_json::from_slice::<Document>(&document);
        if let Ok(Ok(document)) = off_thread::run(caller, named).await
            && let Err(Problem::InvalidScenario(more)) =
                result_named(state, caller, &document.planner.warm_start.plan_id).await
        {
            faults.extend(more);
        }
    }
    Problem::InvalidScenario(faults)
}

/// The result of another plan of the caller, if it has one. The plan may be deleted at any moment.
async fn result_of(
    state: &AppState,
    caller: &Caller,
    plan: PlanId,
) -> Result<Option<String>, Problem> {
    caller.plan(&*state.store, plan).await?;
    Ok(state.store.result(plan).await?)
}

/// The plan with this id, and its result.
///
/// # Errors
/// An invalid scenario when it does not exist or has no route yet.
async fn result_named(
    state: &AppState,
    caller: &Caller,
    id: &str,
) -> Result<(PlanId, String), Problem> {
    let unknown = |why| unknown(id, why);
    let plan = plan_id(id)
        .ok_or_else(|| unknown("must be the id of a plan, a UUID in lower case with hyphens"))?;
    match result_of(state, caller, plan).await {
        Ok(Some(result)) => Ok((plan, result)),
        Ok(None) => Err(unknown("that plan has no route yet")),
        Err(Problem::NoSuchPlan(_) | Problem::Gone(_)) => Err(unknown("no plan has this id")),
        Err(problem) => Err(problem),
    }
}

fn unknown(id: &str, why: &str) -> Problem {
    Problem::InvalidScenario(vec![Fault::unknown_plan(id, why)])
}

/// Insert the waypoints of the plan that `scenario` starts from.
///
/// # Errors
/// An invalid scenario when that plan does not exist or has no route yet.
pub(super) async fn resolve(
    state: &AppState,
    caller: &Caller,
    scenario: &mut Scenario,
) -> Result<(), Problem> {
    let Some(WarmStart::Plan(id)) = &scenario.planner.warm_start else {
        return Ok(());
    };
    let unknown = |why| unknown(id, why);
    let (plan, result) = result_named(state, caller, id).await?;
    let room = state.answers.room_to_make_one(result.len())?;
    let frame = scenario.frame.clone();
    // A result may be long, and another datum needs the geoid, which takes its time.
    let read = move || {
        let _room = room;
        serde_json::from_str(&result).map(|route: Route| route.within(&frame))
    };
    let points = off_thread::run(caller, read).await?.map_err(|error| {
        tracing::error!(warm_start_plan_id = %plan, %error, "a stored result cannot be read");
        Problem::Internal
    })?;
    let points = points.map_err(unknown)?;
    // Routes may lead further than the points of a document.
    let within = |point: &Point3| point.iter().all(|metres| metres.abs() <= MOST_M);
    if !points.iter().all(within) {
        return Err(unknown(
            "that plan's route has coordinates of more than 10,000 km",
        ));
    }
    scenario.planner.warm_start = Some(WarmStart::Waypoints(points));
    Ok(())
}
