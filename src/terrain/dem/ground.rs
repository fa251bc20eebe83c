//! A raster seen from a local plane.
//!
//! The ground is the bilinear surface between the samples in their own reference system, which is what
//! everybody else samples, too. A straight leg is not quite straight there: it is cut into pieces so short that
//! each is within a tenth of a millimetre of height of its chord, and along chords least and greatest heights
//! are exact.

use super::coverage::{self, Gap};
use super::fit::Fit;
use super::{DemError, Raster};
use crate::geometry::geodesy::TangentPlane;
use crate::geometry::{Point2, Point3, Rect, Segment};
use crate::terrain::HeightRange;
use crate::terrain::blocks::Blocks;
use crate::terrain::cells::{Cells, Place};

/// What a chord may add to or take from a height, metres.
const CHORD_M: f64 = 1e-4;

/// A chord over more cells than this is cut, so that what is clear of the ground need not be walked.
const MOST_CELLS: f64 = 8.0;

/// Shares of the margin that are tried on each side.
const MARGINS: [f64; 3] = [1.0, 0.5, 0.25];

/// A hair on either side, cells, for rounding.
const HAIR: f64 = 1e-6;

/// The ground of a scenario, out of a file of elevations.
#[derive(Clone, PartialEq)]
pub struct Dem {
    name: String,
    sha256: String,
    raster: Raster,
    fit: Fit,
    /// Elevations are known all over it.
    extent: Rect,
    blocks: Blocks<f32>,
    /// Of the fit, cells a square metre.
    bend: f64,
    /// Longest chord, metres.
    chord_m: f64,
}

/// A part of a way over the ground.
#[derive(Clone, Copy)]
struct Part {
    from: Place,
    to: Place,
    /// As points of the plane, while it is longer than one chord, and how often it will be halved.
    halves: Option<([Point3; 2], u32)>,
}

impl Dem {
    /// The ground under `area` (metres on `plane`), and `margin` metres round it where `raster` reaches.
    ///
    /// # Errors
    /// [`DemError::Outside`] or [`DemError::NoData`] when not every point of `area` has an elevation,
    /// [`DemError::UnusableCrs`] when a polynomial does not follow the reference system over it.
    pub fn new(
        raster: Raster,
        plane: &TangentPlane,
        area: Rect,
        margin: f64,
    ) -> Result<Self, DemError> {
        let exact = |point: Point2| raster.lattice.below(plane, point);
        let grown = Fit::of(area.grown(margin), exact);
        let margin = if grown.is_some() { margin } else { 0.0 };
        let Some(fit) = grown.or_else(|| Fit::of(area, exact)) else {
            return Err(DemError::UnusableCrs {
                crs: raster.lattice.crs.to_string(),
                reason: "it maps the area too unevenly".into(),
            });
        };
        let bend = fit.bend();
        match coverage::gap(&raster, &fit, bend, area) {
            Some(Gap::Outside(point)) => return Err(raster.lattice.outside(plane.geodetic(point))),
            Some(Gap::NoData([column, row])) => {
                let cells = [column as f64, row as f64];
                return Err(DemError::NoData {
                    at: raster.lattice.geodetic(cells).unwrap_or(plane.origin()),
                    row: raster.offset[0] + row,
                    column: raster.offset[1] + column,
                });
            }
            None => {}
        }
        let extent = widened(area, margin, |rect| {
            coverage::gap(&raster, &fit, bend, rect).is_none()
        });
        let nodes = [raster.lattice.columns, raster.lattice.rows];
        let blocks = Blocks::of(nodes, &raster.elevations, 1);
        // Over d cells of deviation the ground rises by no more than this times d.
        let steepest = steepest(&raster);
        let chord_m = (8.0 * CHORD_M / (bend * steepest).max(1e-30)).sqrt();
        Ok(Self {
            name: String::new(),
            sha256: String::new(),
            raster,
            fit,
            extent,
            blocks,
            bend,
            chord_m,
        })
    }

    /// The same, out of the dataset called `name`, which `sha256` stands for whatever it is called.
    #[must_use]
    pub fn named(self, name: impl Into<String>, sha256: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            sha256: sha256.into(),
            ..self
        }
    }

    /// The same, higher by so many metres: above another datum.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "rounding to single precision is what is wanted"
    )]
    pub fn lifted(mut self, metres: f64) -> Self {
        if metres != 0.0 {
            for elevation in &mut self.raster.elevations {
                *elevation = (f64::from(*elevation) + metres) as f32;
            }
            let nodes = [self.raster.lattice.columns, self.raster.lattice.rows];
            self.blocks = Blocks::of(nodes, &self.raster.elevations, 1);
        }
        self
    }

    /// What the dataset is called; empty unless it was [`Dem::named`].
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What stands for the dataset; empty likewise.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The rectangle that has an elevation everywhere; beyond it, that of its edge goes on.
    #[must_use]
    pub fn extent(&self) -> Rect {
        self.extent
    }

    /// The samples that the ground lies between.
    #[must_use]
    pub fn raster(&self) -> &Raster {
        &self.raster
    }

    /// Lowest and highest elevation of the samples, metres.
    #[must_use]
    pub fn elevations(&self) -> [f64; 2] {
        let known = self
            .raster
            .elevations
            .iter()
            .filter(|sample| !sample.is_nan());
        let reach = known.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], sample| {
            [low.min(*sample), high.max(*sample)]
        });
        reach.map(f64::from)
    }

    pub(in crate::terrain) fn elevation(&self, point: Point2) -> f64 {
        self.cells()
            .elevation(self.fit.at(self.extent.nearest(point)))
    }

    pub(in crate::terrain) fn height_range(
        &self,
        leg: &Segment,
        window: (f64, f64),
    ) -> HeightRange {
        self.height_range_beyond(leg, window, HeightRange::EMPTY)
    }

    /// As `height_range`, but only where it reaches beyond `band`.
    pub(in crate::terrain) fn height_range_beyond(
        &self,
        leg: &Segment,
        (t0, t1): (f64, f64),
        band: HeightRange,
    ) -> HeightRange {
        let mut range = HeightRange::EMPTY;
        let Rect { min, max } = self.extent;
        if self.extent.contains(leg.a.xy()) && self.extent.contains(leg.b.xy()) {
            self.widen(leg.at(t0), leg.at(t1), band, &mut range);
            return range;
        }
        // Beyond the extent its edge goes on, so that the way over the ground bends there.
        let (a, b) = (leg.a, leg.b);
        let mut bends = [
            share_of_way(a.x, b.x, min.x),
            share_of_way(a.x, b.x, max.x),
            share_of_way(a.y, b.y, min.y),
            share_of_way(a.y, b.y, max.y),
            t1,
        ];
        bends.sort_by(f64::total_cmp);
        let mut from = t0;
        for to in bends.map(|bend| bend.clamp(t0, t1)) {
            if to > from || (to >= t1 && range == HeightRange::EMPTY) {
                self.widen(leg.at(from), leg.at(to), band, &mut range);
                from = to;
            }
        }
        range
    }

    /// Widen `range` by the heights on the straight way `from` .. `to`, as far as they are beyond `band`.
    fn widen(&self, from: Point3, to: Point3, band: HeightRange, range: &mut HeightRange) {
        let ends = [from, to].map(|point| {
            let nearest = self.extent.nearest(point.xy());
            Point3::new(nearest.x, nearest.y, point.z)
        });
        let places = ends.map(|point| self.place(point));
        for [column, row, height] in places {
            let height = height - self.cells().elevation([column, row]);
            *range = range.join(HeightRange::of(height));
        }
        let length = (ends[1].xy() - ends[0].xy()).norm();
        let whole = Part {
            from: places[0],
            to: places[1],
            halves: self.halvings(length).map(|count| (ends, count)),
        };
        self.search(whole, band, range);
    }

    /// How often a way of so many metres is halved until each part is a chord; `None` when it is one.
    fn halvings(&self, length: f64) -> Option<u32> {
        let mut count = 0;
        let mut reach = self.chord_m;
        while reach < length && count < 40 {
            reach *= 2.0;
            count += 1;
        }
        (count > 0).then_some(count)
    }

    /// Branch and bound, from the least and greatest elevations of blocks down to single cells.
    fn search(&self, part: Part, band: HeightRange, range: &mut HeightRange) {
        let Part { from, to, halves } = part;
        let bulge = halves.map_or(0.0, |([a, b], _)| {
            // Twice what it can be: chords of it are cut elsewhere than the way itself.
            self.bend * (b.xy() - a.xy()).norm_squared() / 4.0
        });
        let ground = self
            .blocks
            .below([from[0], from[1]], [to[0], to[1]], bulge + HAIR);
        let may_dip = from[2].min(to[2]) - ground.max < range.min.min(band.min);
        let may_rise = from[2].max(to[2]) - ground.min > range.max.max(band.max);
        if !may_dip && !may_rise {
            return;
        }
        let cells = (from[0] - to[0]).abs().max((from[1] - to[1]).abs());
        let (middle, rest) = match halves {
            Some(([a, b], count)) => {
                let middle = nalgebra::center(&a, &b);
                let rest = (count > 1).then_some(count - 1);
                (
                    self.place(middle),
                    [[a, middle], [middle, b]].map(|ends| Some((ends, rest?))),
                )
            }
            None if cells > MOST_CELLS => (
                std::array::from_fn(|axis| 0.5 * (from[axis] + to[axis])),
                [None; 2],
            ),
            None => {
                *range = range.join(self.cells().height_range(from, to));
                return;
            }
        };
        self.search(
            Part {
                from,
                to: middle,
                halves: rest[0],
            },
            band,
            range,
        );
        self.search(
            Part {
                from: middle,
                to,
                halves: rest[1],
            },
            band,
            range,
        );
    }

    fn place(&self, point: Point3) -> Place {
        let [column, row] = self.fit.at(point.xy());
        [column, row, point.z]
    }

    fn cells(&self) -> Cells<'_, f32> {
        Cells {
            columns: self.raster.lattice.columns,
            rows: self.raster.lattice.rows,
            elevations: &self.raster.elevations,
        }
    }
}

/// `area` with as much of `margin` on each side as is `known` all over.
fn widened(area: Rect, margin: f64, known: impl Fn(Rect) -> bool) -> Rect {
    let mut rect = area;
    for side in 0..4 {
        for share in MARGINS {
            let mut wider = rect;
            match side {
                0 => wider.min.x -= share * margin,
                1 => wider.max.x += share * margin,
                2 => wider.min.y -= share * margin,
                _ => wider.max.y += share * margin,
            }
            if known(wider) {
                rect = wider;
                break;
            }
        }
    }
    rect
}

/// Most that the ground rises over one cell along a row, and along a column, together, metres.
fn steepest(raster: &Raster) -> f64 {
    let columns = raster.lattice.columns;
    let mut most = [0.0_f32; 2];
    for (idx, sample) in raster.elevations.iter().enumerate() {
        if (idx + 1) % columns != 0 {
            most[0] = most[0].max((raster.elevations[idx + 1] - sample).abs());
        }
        if let Some(below) = raster.elevations.get(idx + columns) {
            most[1] = most[1].max((below - sample).abs());
        }
    }
    f64::from(most[0]) + f64::from(most[1])
}

/// The `t` at which `a + (b - a) t` is `value`; infinite when nowhere.
fn share_of_way(a: f64, b: f64, value: f64) -> f64 {
    let t = (value - a) / (b - a);
    if t.is_nan() { f64::INFINITY } else { t }
}

/// Without its samples.
impl std::fmt::Debug for Dem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Dem")
            .field("name", &self.name)
            .field("lattice", &self.raster.lattice)
            .field("extent", &self.extent)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
