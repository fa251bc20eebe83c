//! The whole document: its sections, and the checks between them.

use crate::geometry::{Point3, Rect};
use crate::scenario::{AltitudeBand, Scenario};
use crate::terrain::Terrain;
use crate::threat::Threat;

use super::Rules;
use super::chart::Chart;
use super::dataset::{Named, Site};
use super::ends;
use super::fault::Faults;
use super::fields::Fields;
use super::path::Path;
use super::planner::planner;
use super::sketch::MIN_PADDING_M;
use super::terrain;
use super::threats::threats;
use super::tree::Node;
use super::value::{At, figure, metres, name};
use super::vehicle;

const FIELDS: &[&str] = &[
    "name",
    "frame",
    "altitude_datum",
    "start",
    "target",
    "area",
    "threats",
    "terrain",
    "altitude",
    "vehicle",
    "weights",
    "planner",
];

/// An area may extend beyond the terrain grid by this much, for rounding, metres; it is then trimmed.
const OVERHANG_M: f64 = 1e-6;

/// Read the document; `None` has added at least one fault.
pub(super) fn document(
    node: &Node,
    rules: &Rules,
    drawn_seed: u64,
    faults: &mut Faults,
) -> Option<Scenario> {
    let fields = At {
        node,
        path: &Path::Root,
    }
    .fields(FIELDS, faults)?;
    let name = fields.or("name", None, faults, name);
    let dataset = Named::of(&fields, &*rules.datasets);
    let chart = Chart::of(&fields, dataset.as_ref(), faults);
    let altitude = fields.required("altitude", faults, vehicle::altitude);
    let draft = fields.or("vehicle", vehicle::DEFAULT, faults, vehicle::vehicle);
    let weights = fields.or(
        "weights",
        vehicle::DEFAULT_WEIGHTS,
        faults,
        vehicle::weights,
    );
    let planner = section(&fields, "planner", &Node::Object(Box::default()), |at| {
        planner(at, &chart, rules, drawn_seed, faults)
    });
    let ends = ["start", "target"].map(|name| {
        let end = fields.required(name, faults, |at, faults| chart.point3(at, faults));
        (name, end)
    });
    let flight = Flight {
        ends,
        altitude,
        max_climb_deg: draft.map(|draft| draft.max_climb_deg),
    };
    let layout = layout(&fields, flight, dataset.as_ref(), &chart, rules, faults);
    let ([(_, start), (_, target)], mut planner) = (ends, planner?);
    let distance = (target? - start?).norm();
    let limit = rules.limits.path_samples;
    if names_spacing(&fields) {
        check_samples(distance, planner.smoothing.spacing, limit, faults);
    } else if samples(distance, planner.smoothing.spacing) > limit as f64 {
        // A default spacing must not lead to a refusal: widen it so that the straight line takes half of the limit.
        planner.smoothing.spacing = 2.0 * distance / limit as f64;
    }
    let layout = layout?;
    Some(Scenario {
        name: name?,
        frame: chart.finish()?,
        start: layout.start,
        target: layout.target,
        area: layout.area,
        threats: layout.threats,
        terrain: layout.terrain,
        altitude: altitude?,
        vehicle: draft?.finish(distance, planner.waypoints),
        weights: weights?,
        planner,
    })
}

/// A section for which absent means the same as `empty`.
fn section<T>(
    fields: &Fields<'_>,
    name: &str,
    empty: &Node,
    read: impl FnOnce(At<'_>) -> Option<T>,
) -> Option<T> {
    let path = Path::Key(fields.path, name);
    read(At {
        node: fields.find(name).unwrap_or(empty),
        path: &path,
    })
}

/// From where to where, and how: what an area that is not given depends on.
#[derive(Clone, Copy)]
struct Flight {
    /// Start and target, with their names.
    ends: [(&'static str, Option<Point3>); 2],
    altitude: Option<AltitudeBand>,
    max_climb_deg: Option<f64>,
}

/// Everything that has coordinates.
struct Layout {
    start: Point3,
    target: Point3,
    area: Rect,
    threats: Vec<Threat>,
    terrain: Terrain,
}

fn layout(
    fields: &Fields<'_>,
    flight: Flight,
    dataset: Option<&Named<'_>>,
    chart: &Chart,
    rules: &Rules,
    faults: &mut Faults,
) -> Option<Layout> {
    let Flight { ends, altitude, .. } = flight;
    let [(_, start), (_, target)] = ends;
    let given_area = chart.area(fields, [start, target], faults);
    let threats = fields.or("threats", Vec::new(), faults, |at, faults| {
        threats(at, chart, &rules.limits, faults)
    });
    let site = Site {
        named: dataset,
        datasets: &*rules.datasets,
        chart,
        limits: &rules.limits,
        area: given_area.flatten(),
        area_is_given: fields.has("area"),
        ends,
    };
    let ground = fields.or("terrain", (terrain::DEFAULT, None), faults, |at, faults| {
        terrain::terrain(at, &site, faults)
    });
    let (ground, cut_area) = ground.unzip();
    let given_area = match cut_area.flatten() {
        Some(area) => Some(Some(area)),
        None => given_area,
    };
    if let (Some(start), Some(target)) = (start, target) {
        ends::check_apart(start, target, faults);
    }
    for (name, end) in ends {
        let Some(end) = end else { continue };
        let in_area = given_area
            .flatten()
            .is_none_or(|area| ends::check_area(name, end, area, chart, faults));
        // Ground with an end may be unknown outside the area, which is the same fault once more.
        if let Some(terrain) = &ground
            && (in_area || terrain.extent().is_none())
        {
            ends::check_ground(name, end, terrain, chart, faults);
        }
        if let Some(threats) = &threats {
            ends::check_threats(name, end, threats, faults);
        }
    }
    let given_area = match (given_area, &ground) {
        (Some(Some(area)), Some(terrain)) => covered(area, terrain, chart, faults).map(Some),
        (given_area, _) => given_area,
    };
    let (start, target, terrain) = (start?, target?, ground?);
    let threats: Vec<Threat> = threats?.into_iter().collect::<Option<_>>()?;
    let area = given_area?.unwrap_or_else(|| {
        default_area(
            [start, target],
            altitude,
            flight.max_climb_deg,
            &threats,
            &terrain,
        )
    });
    Some(Layout {
        start,
        target,
        area,
        threats,
        terrain,
    })
}

/// The given area, which a terrain grid must cover.
fn covered(area: Rect, terrain: &Terrain, chart: &Chart, faults: &mut Faults) -> Option<Rect> {
    let ground = match terrain {
        Terrain::Grid(grid) => grid.extent(),
        // The area was trimmed to a dataset when that was found.
        Terrain::Flat(_) | Terrain::Peaks(_) | Terrain::Dem(_) => return Some(area),
    };
    if ground.excess(area.min).max(ground.excess(area.max)) > OVERHANG_M {
        faults.add(
            &Path::Key(&Path::Root, "area"),
            "area-outside-terrain",
            || {
                format!(
                    "area runs from {} to {}, must lie in the terrain grid, from {} to {}",
                    chart.say(area.min),
                    chart.say(area.max),
                    chart.say(ground.min),
                    chart.say(ground.max)
                )
            },
        );
        return None;
    }
    Some(Rect {
        min: area.min.sup(&ground.min),
        max: area.max.inf(&ground.max),
    })
}

/// The area of a document that gives none: a terrain grid's extent, else the box around the start, the target and
/// every threat with its soft zone. The box is padded on every side by the greatest of a quarter of its diagonal, 10
/// m, and the room to climb to the middle of the band.
fn default_area(
    [start, target]: [Point3; 2],
    altitude: Option<AltitudeBand>,
    max_climb_deg: Option<f64>,
    threats: &[Threat],
    terrain: &Terrain,
) -> Rect {
    if let Some(extent) = terrain.extent() {
        return extent;
    }
    let area = threats
        .iter()
        .map(Threat::extent)
        .flat_map(|extent| [extent.min, extent.max])
        .chain([start.xy(), target.xy()]);
    let area = Rect::around(area).expect("start and target are there");
    let distance = (target.xy() - start.xy()).norm();
    let middle = |end: Point3| {
        altitude.map_or(end.z, |band| {
            terrain.elevation(end.xy()) + f64::midpoint(band.min, band.max)
        })
    };
    let climb = vehicle::climb_through([start.z, target.z], [middle(start), middle(target)]);
    let room = vehicle::climbing_room(climb, distance, max_climb_deg);
    let padding = (area.diagonal() / 4.0).max(MIN_PADDING_M).max(room);
    area.grown(padding)
}

fn names_spacing(fields: &Fields<'_>) -> bool {
    let smoothing = fields
        .find("planner")
        .and_then(|planner| planner.get("smoothing"));
    smoothing.is_some_and(|smoothing| smoothing.get("spacing").is_some())
}

/// Samples on the straight line from start to target.
fn samples(distance: f64, spacing: f64) -> f64 {
    (distance / spacing).ceil() + 1.0
}

/// The straight line from start to target must not exceed the server's limit of samples.
fn check_samples(distance: f64, spacing: f64, limit: usize, faults: &mut Faults) {
    let samples = samples(distance, spacing);
    if samples > limit as f64 {
        let planner = Path::Key(&Path::Root, "planner");
        let smoothing = Path::Key(&planner, "smoothing");
        faults.add(&Path::Key(&smoothing, "spacing"), "too-many", || {
            format!(
                "spacing is {} over {} m from start to target, which makes {samples} samples, \
                 must make at most {limit} (limit path_samples)",
                figure(spacing),
                metres(distance)
            )
        });
    }
}
