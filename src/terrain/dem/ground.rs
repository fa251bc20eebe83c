//! A raster mapped onto a local plane.
//!
//! The ground is the bilinear surface between the samples in their own reference system, as other software samples
//! it. A leg that is straight on the plane is slightly curved there, so it is cut into chords whose heights are
//! within a quarter of a millimetre; along a chord the least and greatest heights are exact. Planes over blocks of
//! cells rule out most of a leg first.

use super::coverage::{self, Gap};
use super::fit::Fit;
use super::slabs::Slabs;
use super::way::{Way, greater, lesser};
use super::{DemError, Raster};
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::geometry::geoid::Geoid;
use crate::geometry::{Point2, Point3, Rect, Segment};
use crate::terrain::HeightRange;
use crate::terrain::cells::{Cells, Place, straight_parts};

/// Largest height error of a chord, metres.
const CHORD_M: f64 = 2.5e-4;

/// While blocks are searched, a line counts as straight if it bends by at most this many cells.
const BEND_CELLS: f64 = 0.02;

/// Fractions of the margin tried on each side.
const MARGINS: [f64; 3] = [1.0, 0.5, 0.25];

/// The ground of a scenario, from an elevation file.
#[derive(Clone, PartialEq)]
pub struct Dem {
    name: String,
    sha256: String,
    raster: Raster,
    fit: Fit,
    /// Every point of it has an elevation.
    extent: Rect,
    slabs: Slabs,
    /// Of `fit`, cells per square metre.
    bend: f64,
    /// Greatest rise over one cell along a row plus the greatest along a column, metres.
    steepest: f64,
    /// Longest chord, metres.
    chord_m: f64,
}

impl Dem {
    /// The ground under `area` (metres on `plane`), and within `margin` metres around it where `raster` has data.
    ///
    /// # Errors
    /// [`DemError::Outside`] or [`DemError::NoData`] when not every point of `area` has an elevation,
    /// [`DemError::UnusableCrs`] when no polynomial fits the reference system over it.
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
        let slabs = Slabs::of(&raster);
        // Over a deviation of d cells the ground rises by at most d times this.
        let steepest = steepest(&raster);
        let chord_m = chord_m(bend, steepest);
        Ok(Self {
            name: String::new(),
            sha256: String::new(),
            raster,
            fit,
            extent,
            slabs,
            bend,
            steepest,
            chord_m,
        })
    }

    /// The same, labelled with the name and checksum of its dataset.
    #[must_use]
    pub fn named(self, name: impl Into<String>, sha256: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            sha256: sha256.into(),
            ..self
        }
    }

    /// The same ground with elevations above the ellipsoid, where they were above mean sea level. `near` stands for
    /// places that its reference system does not have.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "rounding to single precision is what is wanted"
    )]
    pub fn above_ellipsoid(mut self, near: LatLon) -> Self {
        let raster = &mut self.raster;
        let lattice = &raster.lattice;
        let geoid = Geoid::under_samples([lattice.columns, lattice.rows], |cells| {
            lattice.geodetic(cells).unwrap_or(near)
        });
        let columns = lattice.columns;
        for (index, elevation) in raster.elevations.iter_mut().enumerate() {
            let cells = [(index % columns) as f64, (index / columns) as f64];
            *elevation = (f64::from(*elevation) + geoid.height_m(cells)) as f32;
        }
        self.slabs = Slabs::of(&self.raster);
        self.steepest = steepest(&self.raster);
        // Chords are as long as the steepest rise allows.
        self.chord_m = chord_m(self.bend, self.steepest);
        self
    }

    /// The dataset's name; empty unless set by [`Dem::named`].
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The dataset's checksum; empty unless set by [`Dem::named`].
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The rectangle that has an elevation everywhere; beyond it, the elevation at the edge applies.
    #[must_use]
    pub fn extent(&self) -> Rect {
        self.extent
    }

    /// The samples that define the ground.
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

    /// As `height_range`, but exact only where it exceeds `band`.
    pub(in crate::terrain) fn height_range_beyond(
        &self,
        leg: &Segment,
        window: (f64, f64),
        band: HeightRange,
    ) -> HeightRange {
        let mut range = HeightRange::EMPTY;
        let mut widen = |(from, to)| self.widen(leg.at(from), leg.at(to), band, &mut range);
        let track = [leg.a.xy(), leg.b.xy()];
        if track.iter().all(|end| self.extent.contains(*end)) {
            widen(window);
        } else {
            for part in straight_parts(track, self.extent, window) {
                widen(part);
            }
        }
        range
    }

    /// Widen `range` by the heights on the straight line `from` .. `to` that exceed `band`.
    fn widen(&self, from: Point3, to: Point3, band: HeightRange, range: &mut HeightRange) {
        let ends = [from, to].map(|point| {
            let nearest = self.extent.nearest(point.xy());
            Point3::new(nearest.x, nearest.y, point.z)
        });
        let places = ends.map(|point| self.place(point));
        if band == HeightRange::EMPTY {
            // Start from the heights at the ends, so that `range` is not empty.
            for [column, row, height] in places {
                let height = height - self.cells().elevation([column, row]);
                *range = range.join(HeightRange::of(height));
            }
        }
        self.search(ends, places, band, range);
    }

    /// Halve the line until it is nearly straight over the cells, then search blocks.
    fn search(
        &self,
        ends: [Point3; 2],
        places: [Place; 2],
        band: HeightRange,
        range: &mut HeightRange,
    ) {
        let bend = self.bend * (ends[1].xy() - ends[0].xy()).norm_squared() / 8.0;
        let [from, to] = places;
        let cells = (from[0] - to[0]).abs().max((from[1] - to[1]).abs());
        if bend > BEND_CELLS && cells > 1.0 {
            let middle = nalgebra::center(&ends[0], &ends[1]);
            let place = self.place(middle);
            self.search([ends[0], middle], [from, place], band, range);
            self.search([middle, ends[1]], [place, to], band, range);
            return;
        }
        let way = Way {
            ends,
            places,
            // The rise over the deviation, once for the ground and once for a block's plane.
            slack: 2.0 * bend * self.steepest,
        };
        self.descend(&way, self.slabs.level(cells), [0.0, 1.0], band, range);
    }

    /// Search the blocks of a level under the part `[s0, s1]` of `way`. Descend into those that may widen `range`
    /// beyond `band`, the one with the largest bound first, as that may rule out the others.
    fn descend(
        &self,
        way: &Way,
        level_idx: usize,
        [s0, s1]: [f64; 2],
        band: HeightRange,
        range: &mut HeightRange,
    ) {
        let level = &self.slabs.levels[level_idx];
        let beyond = |range: &HeightRange, heights: HeightRange| {
            let dip = lesser(range.min, band.min) - heights.min;
            let rise = heights.max - greater(range.max, band.max);
            greater(dip, rise)
        };
        let closer = |[u0, u1]: [f64; 2], range: &mut HeightRange| {
            let part = [u0, u1].map(|u| s0 + (s1 - s0) * u);
            if level_idx == 0 {
                if beyond(range, self.roughly(way, part)) > 0.0 {
                    *range = range.join(self.exactly(way, part));
                }
            } else {
                self.descend(way, level_idx - 1, part, band, range);
            }
        };
        let (mut most, mut worst, mut open) = (0.0, None, 0);
        way.blocks(level, [s0, s1], |part, heights| {
            let amount = beyond(range, heights);
            if amount > 0.0 {
                open += 1;
            }
            if amount > most {
                (most, worst) = (amount, Some(part));
            }
        });
        let Some(worst) = worst else {
            return;
        };
        closer(worst, range);
        if open == 1 {
            return;
        }
        way.blocks(level, [s0, s1], |part, heights| {
            if beyond(range, heights) > 0.0 && part[0].to_bits() != worst[0].to_bits() {
                closer(part, range);
            }
        });
    }

    /// Bounds of the heights over the part `[s0, s1]` of `way`, from the cells under the straight line between its
    /// places.
    fn roughly(&self, way: &Way, [s0, s1]: [f64; 2]) -> HeightRange {
        let HeightRange { min, max } = self.cells().height_range(way.at(s0), way.at(s1));
        HeightRange {
            min: min - way.slack,
            max: max + way.slack,
        }
    }

    /// Least and greatest height over the part `[s0, s1]` of `way`, computed along chords.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a way over four cells at most has few chords"
    )]
    fn exactly(&self, way: &Way, [s0, s1]: [f64; 2]) -> HeightRange {
        let [a, b] = way.ends;
        let length = (b.xy() - a.xy()).norm() * (s1 - s0);
        let chords = (length / self.chord_m).ceil().clamp(1.0, 1e4) as usize;
        let place = |idx: usize| {
            let share = s0 + (s1 - s0) * (idx as f64 / chords as f64);
            self.place(a + (b - a) * share)
        };
        let mut from = place(0);
        let mut range = HeightRange::EMPTY;
        for idx in 1..=chords {
            let to = place(idx);
            range = range.join(self.cells().height_range(from, to));
            from = to;
        }
        range
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

/// `area` grown on each side by as much of `margin` as is `known` everywhere.
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

/// Longest chord over which the ground deviates by at most [`CHORD_M`], metres.
fn chord_m(bend: f64, steepest: f64) -> f64 {
    (8.0 * CHORD_M / (bend * steepest).max(1e-30)).sqrt()
}

/// Greatest rise over one cell along a row plus the greatest along a column, metres.
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

/// Omits the samples.
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
