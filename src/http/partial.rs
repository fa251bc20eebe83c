//! `GET /plans/{id}/result?partial=true` before the end: the best route so far, measured like a result, as if the plan
//! were cancelled now.

use std::collections::VecDeque;

use super::AppState;
use super::caller::Caller;
use super::problem::Problem;
use crate::export::document::{Convergence, Incumbent, Origin, ResultDocument};
use crate::job::{Event, Plan};
use crate::planner;
use crate::scenario::Scenario;
use crate::scenario::json::{self, Rules};

/// Maximum number of points of the curve in it, the newest.
const CURVE: usize = 10_000;

/// Events read at once.
const PAGE: usize = 1_000;

/// The document, or `None` when the run has not reported a route yet.
pub(super) async fn result(
    state: &AppState,
    caller: &Caller,
    plan: &Plan,
) -> Result<Option<String>, Problem> {
    let Some(best) = state.store.incumbent(plan.id).await? else {
        return Ok(None);
    };
    let points = CURVE.min(usize::try_from(plan.iterations).unwrap_or(CURVE));
    let curve_room = points * size_of::<Convergence>();
    let curve_room = state.answers.room_to_make_one(curve_room)?;
    let curve = curve(state, plan).await?;
    let scenario = state.store.scenario(plan.id).await?;
    let scenario_room = state.answers.room_to_make_one(scenario.len())?;
    let run_ms = plan
        .started_ms
        .map_or(0, |began| state.clock.now_ms() - began);
    let (rules, bounds, plan) = (state.rules.clone(), state.bounds.clone(), plan.clone());
    let measure = move |scenario: &String| {
        let _rooms = (&curve_room, &scenario_room);
        let lower = |scenario: &Scenario| bounds.of_plan(plan.id, scenario);
        let origin = plan.origin(scenario, run_ms.max(0) as f64);
        measure(scenario, &rules, best, lower, curve, origin).map(Some)
    };
    state.terrains.over(caller, scenario, measure).await?
}

/// The curve of the present run, excluding an earlier one that was cut off.
async fn curve(state: &AppState, plan: &Plan) -> Result<Vec<Convergence>, Problem> {
    let mut curve = VecDeque::new();
    let mut after = 0;
    loop {
        let page = state.store.events(plan.id, after, PAGE).await?;
        let Some(last) = page.events.last() else {
            return Ok(curve.into());
        };
        after = last.id;
        for numbered in page.events {
            match numbered.event {
                Event::Convergence(point) => curve.push_back(point),
                Event::Status(plan) if plan.started_ms.is_none() => curve.clear(),
                _ => {}
            }
        }
        let excess = curve.len().saturating_sub(CURVE);
        curve.drain(..excess);
    }
}

fn measure(
    scenario: &str,
    rules: &Rules,
    best: Incumbent,
    lower: impl FnOnce(&Scenario) -> f64,
    curve: Vec<Convergence>,
    origin: Origin,
) -> Result<String, Problem> {
    let scenario = json::read_accepted(scenario, rules)?;
    let route = best.waypoints.into_iter();
    let route = route.map(|position| position.within(&scenario.frame));
    let route = route
        .collect::<Option<_>>()
        .expect("an incumbent is told in the frame of its scenario");
    let lower = lower(&scenario);
    let outcome = planner::so_far(&scenario, route, lower);
    let document = ResultDocument {
        stop_reason: None,
        is_final: Some(false),
        evaluations: curve.last().map_or(0, |last| last.evaluations),
        convergence: curve,
        ..ResultDocument::new(&outcome, origin)
    };
    Ok(document.to_json())
}
