//! `terrain`: flat, peaks, grid and dataset.

use crate::geometry::Rect;
use crate::scenario::limits::Limits;
use crate::terrain::{Flat, Grid, Peak, Peaks, Terrain};

use super::chart::Chart;
use super::dataset::{self, Site};
use super::fault::Faults;
use super::fields::Fields;
use super::path::Path;
use super::point::pair;
use super::ranges::{CELL, COORDINATE, MIN_NODES, SPREAD};
use super::value::At;

const FLAT: &[&str] = &["kind", "elevation"];
const PEAKS: &[&str] = &["kind", "base", "peaks"];
const GRID: &[&str] = &["kind", "origin", "cell", "columns", "rows", "elevations"];

/// The terrain of a document that gives none.
pub(super) const DEFAULT: Terrain = Terrain::Flat(Flat { elevation: 0.0 });

/// Terrain of any kind, and the area, trimmed to a dataset.
pub(super) fn terrain(
    at: At<'_>,
    site: &Site<'_>,
    faults: &mut Faults,
) -> Option<(Terrain, Option<Rect>)> {
    let kinds = [
        ("flat", FLAT),
        ("peaks", PEAKS),
        ("grid", GRID),
        ("dataset", dataset::FIELDS),
    ];
    let (chart, limits) = (site.chart, site.limits);
    let terrain = match at.variant(&kinds, faults)? {
        ("flat", fields) => {
            let elevation = fields.number_or("elevation", 0.0, COORDINATE, faults)?;
            Terrain::Flat(Flat { elevation })
        }
        ("peaks", fields) => Terrain::Peaks(peaks(&fields, chart, limits, faults)?),
        ("grid", fields) => Terrain::Grid(grid(&fields, chart, limits, faults)?),
        ("dataset", fields) => {
            let (terrain, area) = dataset::ground(&fields, site, faults)?;
            return Some((terrain, Some(area)));
        }
        _ => unreachable!("a kind that the table above lacks"),
    };
    Some((terrain, None))
}

fn peaks(
    fields: &Fields<'_>,
    chart: &Chart,
    limits: &Limits,
    faults: &mut Faults,
) -> Option<Peaks> {
    let base = fields.number_or("base", 0.0, COORDINATE, faults);
    let peaks = fields.required("peaks", faults, |at, faults| {
        let len = at.len(faults)?;
        if len > limits.peaks {
            faults.add(at.path, "too-many", || {
                format!(
                    "peaks has {len} items, must have at most {} (limit peaks)",
                    limits.peaks
                )
            });
            return None;
        }
        at.items(faults, |at, faults| peak(at, chart, faults))
            .into_iter()
            .collect::<Option<Vec<_>>>()
    });
    Some(Peaks {
        base: base?,
        peaks: peaks?,
    })
}

fn peak(at: At<'_>, chart: &Chart, faults: &mut Faults) -> Option<Peak> {
    let fields = at.fields(&["center", "height", "spread"], faults)?;
    let center = fields.required("center", faults, |at, faults| chart.point2(at, faults));
    let height = fields.number("height", COORDINATE, faults);
    let spread = fields.required("spread", faults, |at, faults| pair(at, SPREAD, faults));
    Some(Peak {
        center: center?,
        height: height?,
        spread: spread?,
    })
}

fn grid(fields: &Fields<'_>, chart: &Chart, limits: &Limits, faults: &mut Faults) -> Option<Grid> {
    let nodes = ("terrain_nodes", limits.terrain_nodes);
    let origin = fields.required("origin", faults, |at, faults| chart.point2(at, faults));
    let cell = fields.number("cell", CELL, faults);
    let columns = fields.required("columns", faults, |at, faults| {
        at.count(MIN_NODES, nodes, faults)
    });
    let rows = fields.required("rows", faults, |at, faults| {
        at.count(MIN_NODES, nodes, faults)
    });
    let expected = columns
        .zip(rows)
        .map(|(columns, rows)| columns.saturating_mul(rows));
    let elevations = fields.required("elevations", faults, |at, faults| {
        elevations(at, expected, limits, faults)
    });
    let grid = Grid {
        origin: origin?,
        cell: cell?,
        columns: columns?,
        rows: rows?,
        elevations: elevations?.into(),
    };
    let far = grid.extent().max;
    for (axis, end) in [("x", far.x), ("y", far.y)] {
        if !COORDINATE.contains(end) {
            faults.add(&Path::Key(fields.path, "cell"), "out-of-range", || {
                format!(
                    "the grid ends at {axis} = {end}, must end at {}",
                    COORDINATE.advice(end)
                )
            });
            return None;
        }
    }
    Some(grid)
}

/// Elevations: as many as the grid has nodes, within the server's limit.
fn elevations(
    at: At<'_>,
    expected: Option<usize>,
    limits: &Limits,
    faults: &mut Faults,
) -> Option<Vec<f64>> {
    let len = at.len(faults)?;
    let nodes = expected.unwrap_or(len).max(len);
    if nodes > limits.terrain_nodes {
        faults.add(at.path, "too-many", || {
            format!(
                "the grid has {nodes} nodes, must have at most {} (limit terrain_nodes)",
                limits.terrain_nodes
            )
        });
        return None;
    }
    let elevations = at.numbers(COORDINATE, faults);
    if let Some(expected) = expected
        && len != expected
    {
        faults.add(at.path, "wrong-length", || {
            format!("elevations has {len} items, must have columns * rows = {expected}")
        });
        return None;
    }
    elevations
}
