//! `planner.warm_start.plan_id`: replaced by that stored plan's waypoints, so that the result depends on the accepted
//! document alone.

use serde::Deserialize;

use super::AppState;
use super::caller::Caller;
use super::off_thread;
use super::params::plan_id;
use super::problem::Problem;
use crate::export::document::{FrameDocument, Position};
use crate::geometry::Point3;
use crate::geometry::geodesy::LatLon;
use crate::job::PlanId;
use crate::scenario::frame::{Datum, Frame};
use crate::scenario::json::{Fault, MOST_M};
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

/// Whether [`resolve`] has anything to do.
pub(super) fn names_a_plan(scenario: &Scenario) -> bool {
    matches!(scenario.planner.warm_start, Some(WarmStart::Plan(_)))
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
    let unknown = |why| Problem::InvalidScenario(vec![Fault::unknown_plan(id, why)]);
    let plan = plan_id(id)
        .ok_or_else(|| unknown("must be the id of a plan, a UUID in lower case with hyphens"))?;
    let result = match result_of(state, caller, plan).await {
        Ok(result) => result.ok_or_else(|| unknown("that plan has no route yet"))?,
        Err(Problem::NoSuchPlan(_) | Problem::Gone(_)) => {
            return Err(unknown("no plan has this id"));
        }
        Err(problem) => return Err(problem),
    };
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
