//! Whether a route can begin at the start and end at the target: they must be apart, on or above ground, inside the
//! area and the terrain, and outside every threat.

use crate::geometry::{Point3, Rect};
use crate::terrain::Terrain;
use crate::threat::{Shape, Threat};

use super::chart::Chart;
use super::fault::Faults;
use super::path::Path;
use super::value::{figure, metres, quote};

/// A point at most this far below ground still counts as standing on it, metres; more than rounding to one decimal
/// can cause.
const SUNK_M: f64 = 0.1 + 1e-9;
/// Start and target closer than this in 3-D are the same, metres.
const SAME_M: f64 = 1e-6;
/// Start and target horizontally closer than this give the route no direction, metres.
const ABOVE_M: f64 = 1e-3;
/// An end no deeper in a threat touches it, metres: 0.3 - 0.1 is less than 0.2 in floating point.
const HAIR_M: f64 = 1e-9;

/// Start and target must be apart, also horizontally: the route coding is relative to the line between them.
pub(super) fn check_apart(start: Point3, target: Point3, faults: &mut Faults) {
    let path = Path::Key(&Path::Root, "target");
    let (distance, horizontal) = ((target - start).norm(), (target.xy() - start.xy()).norm());
    if distance <= SAME_M {
        faults.add(&path, "target-is-start", || {
            format!(
                "target is {} m from start, must be more than {SAME_M} m away",
                metres(distance)
            )
        });
    } else if horizontal < ABOVE_M {
        faults.add(&path, "target-above-start", || {
            format!(
                "target is {} m from start seen from above, must be at least {ABOVE_M} m",
                figure(horizontal)
            )
        });
    }
}

/// Check the start or the target against the ground; `name` is its field.
pub(super) fn check_ground(
    name: &str,
    end: Point3,
    terrain: &Terrain,
    chart: &Chart,
    faults: &mut Faults,
) {
    let path = Path::Key(&Path::Root, name);
    let known = match terrain {
        Terrain::Flat(_) | Terrain::Peaks(_) => None,
        Terrain::Grid(grid) => Some(("the terrain grid", grid.extent())),
        Terrain::Dem(dem) => Some(("the dataset", dem.extent())),
    };
    if let Some((what, extent)) = known.filter(|(_, extent)| !extent.contains(end.xy())) {
        let corners = [extent.min, extent.max].map(|corner| chart.say(corner));
        return outside(&path, "outside-terrain", what, end, &corners, chart, faults);
    }
    let ground = terrain.elevation(end.xy());
    if ground - end.z > SUNK_M {
        faults.add(&path, "below-ground", || {
            format!(
                "{name} has {} {}, must be at most 0.1 m below the ground, which is at {}",
                chart.height(),
                figure(end.z),
                metres(ground)
            )
        });
    }
}

/// The start or the target must lie in the area; returns whether it does.
pub(super) fn check_area(
    name: &str,
    end: Point3,
    area: Rect,
    chart: &Chart,
    faults: &mut Faults,
) -> bool {
    let contained = chart.is_in_area(end.xy(), area);
    if !contained {
        let path = Path::Key(&Path::Root, name);
        let corners = chart.say_area(area);
        outside(
            &path,
            "outside-area",
            "the area",
            end,
            &corners,
            chart,
            faults,
        );
    }
    contained
}

/// The start or the target must be outside every threat; touching one is allowed.
pub(super) fn check_threats(
    name: &str,
    end: Point3,
    threats: &[Option<Threat>],
    faults: &mut Faults,
) {
    let mut around = threats
        .iter()
        .enumerate()
        .filter_map(|(threat_idx, threat)| {
            let threat = threat.as_ref()?;
            let is_inside = threat.reaches(end.z) && threat.distance(end.xy()) < -HAIR_M;
            is_inside.then_some((threat_idx, threat))
        });
    let Some((threat_idx, threat)) = around.next() else {
        return;
    };
    let more = around.count();
    let code = if name == "start" {
        "start-in-threat"
    } else {
        "target-in-threat"
    };
    faults.add(&Path::Key(&Path::Root, name), code, || {
        let named = threat
            .name
            .as_deref()
            .map(|name| format!(" ({})", quote(name)))
            .unwrap_or_default();
        let others = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        let place = match &threat.shape {
            Shape::Cylinder(cylinder) => format!(
                "{} m from the axis of threats/{threat_idx}{named}{others}, must be >= its radius {}",
                metres((end.xy() - cylinder.center).norm()),
                figure(cylinder.radius)
            ),
            Shape::Polygon(_) => {
                format!("inside the polygon threats/{threat_idx}{named}{others}, must be outside")
            }
        };
        format!("{name} is {place}")
    });
}

fn outside(
    path: &Path<'_>,
    code: &'static str,
    what: &str,
    end: Point3,
    [from, to]: &[String; 2],
    chart: &Chart,
    faults: &mut Faults,
) {
    faults.add(path, code, || {
        format!(
            "{} is at {}, must lie in {what}, from {from} to {to}",
            path.label(),
            chart.say(end.xy())
        )
    });
}
