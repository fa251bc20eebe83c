//! Samples in memory: the window of a file that somebody needs.

use std::ops::Range;

use super::{DemError, Lattice};

/// Lowest and highest elevation that is believed, metres: the sea's and the land's greatest are within.
const BELIEVED: [f64; 2] = [-12_000.0, 12_000.0];

/// Rows and columns of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) rows: Range<usize>,
    pub(super) columns: Range<usize>,
}

/// What is done with samples: `(row, column of the first, samples)`; not a number is no data. Samples
/// outside the span asked for may come, too, and no order is promised.
pub(super) type Visit<'a> = dyn FnMut(usize, usize, &[f32]) -> Result<(), DemError> + 'a;

/// The samples of some rows and columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Where they stand.
    pub lattice: Lattice,
    /// Row and column of the first in the file.
    pub offset: [usize; 2],
    /// Metres, row by row; not a number where nothing is known.
    pub elevations: Vec<f32>,
}

impl Raster {
    /// Room for `span` of `whole`.
    pub(super) fn new(whole: &Lattice, span: &Span) -> Self {
        let first = [span.columns.start, span.rows.start];
        Self {
            lattice: Lattice {
                crs: whole.crs.clone(),
                columns: span.columns.len(),
                rows: span.rows.len(),
                first: [0, 1].map(|axis| whole.first[axis] + first[axis] as f64 * whole.step[axis]),
                step: whole.step,
            },
            offset: [span.rows.start, span.columns.start],
            elevations: vec![f32::NAN; span.rows.len() * span.columns.len()],
        }
    }

    /// Keep what belongs here of `samples`, which begin at `(row, column)` of the file.
    pub(super) fn keep(&mut self, row: usize, column: usize, samples: &[f32]) {
        let Lattice { columns, rows, .. } = self.lattice;
        let Some(row) = row.checked_sub(self.offset[0]).filter(|row| *row < rows) else {
            return;
        };
        let from = column.max(self.offset[1]);
        let to = (column + samples.len()).min(self.offset[1] + columns);
        if from < to {
            let start = row * columns + from - self.offset[1];
            self.elevations[start..start + to - from]
                .copy_from_slice(&samples[from - column..to - column]);
        }
    }
}

/// What a sample holds where nothing is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct NoData {
    value: f64,
    single: f32,
}

impl NoData {
    pub(super) fn new(value: Option<f64>) -> Self {
        let value = value.unwrap_or(f64::NAN);
        Self {
            value,
            single: narrow(value),
        }
    }

    /// The elevation that a sample holds; not a number where it holds none. A value that single precision
    /// cannot tell from that of no data is none, either.
    #[expect(clippy::float_cmp, reason = "no data is that very value")]
    pub(super) fn elevation(self, sample: f64) -> f32 {
        let single = narrow(sample);
        if sample == self.value || single == self.single {
            f32::NAN
        } else {
            single
        }
    }
}

/// To the nearest of single precision, infinite beyond.
#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding is what is wanted"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// Refuse what no ground is at.
pub(super) fn check_elevations(row: usize, column: usize, samples: &[f32]) -> Result<(), DemError> {
    let doubtful =
        |value: f32| !(value.is_nan() || (BELIEVED[0]..=BELIEVED[1]).contains(&f64::from(value)));
    match samples.iter().position(|value| doubtful(*value)) {
        Some(at) => Err(DemError::Elevation {
            row,
            column: column + at,
            value: samples[at].into(),
        }),
        None => Ok(()),
    }
}
