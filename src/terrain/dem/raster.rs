//! Samples in memory: a window of a file.

use std::collections::BTreeSet;
use std::ops::Range;

use super::{DemError, Lattice};

/// Lowest and highest elevation accepted, metres; the deepest sea and the highest land are within.
const BELIEVED: [f64; 2] = [-12_000.0, 12_000.0];

/// Within them, but written where nothing is known far oftener than it is the depth of a trench.
const UNKNOWN: f32 = -9999.0;

/// Rows and columns of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) rows: Range<usize>,
    pub(super) columns: Range<usize>,
}

/// Which samples of a span are wanted: files of blocks leave out those that hold none of them.
#[derive(Debug, Clone, Copy)]
pub(super) enum Wanted<'a> {
    All,
    /// By row and column.
    Some(&'a BTreeSet<[usize; 2]>),
}

impl Wanted<'_> {
    /// The first of `rows` of which anything is wanted.
    pub(super) fn first_row(self, rows: Range<usize>) -> Option<usize> {
        match self {
            Self::All => (!rows.is_empty()).then_some(rows.start),
            Self::Some(nodes) => nodes
                .range([rows.start, 0]..[rows.end, 0])
                .next()
                .map(|[row, _]| *row),
        }
    }

    /// The blocks `width` columns wide that hold anything wanted of `rows` and `columns`, in order.
    pub(super) fn blocks(
        self,
        rows: Range<usize>,
        columns: &Range<usize>,
        width: usize,
    ) -> BTreeSet<usize> {
        match self {
            Self::All => (columns.start / width..columns.end.div_ceil(width)).collect(),
            Self::Some(nodes) => nodes
                .range([rows.start, 0]..[rows.end, 0])
                .filter(|[_, column]| columns.contains(column))
                .map(|[_, column]| column / width)
                .collect(),
        }
    }
}

/// Receives samples as `(row, column of the first, samples)`; NaN means no data. Samples outside the requested span
/// may be included, in any order.
pub(super) type Visit<'a> = dyn FnMut(usize, usize, &[f32]) -> Result<(), DemError> + 'a;

/// The samples of some rows and columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Where they lie.
    pub lattice: Lattice,
    /// Row and column of the first sample in the file.
    pub offset: [usize; 2],
    /// Metres, row by row; NaN means no data.
    pub elevations: Vec<f32>,
}

impl Raster {
    /// An empty raster for `span` of `whole`.
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

    /// Keep the part of `samples` that lies in this raster; they begin at `(row, column)` of the file.
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

/// Value of a sample without data.
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

    /// The elevation of a sample; NaN if it has none. A value equal to the no-data value in single precision also
    /// counts as none.
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

/// Round to the nearest single-precision value, infinite beyond the range.
#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding is what is wanted"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// Refuse impossible elevations.
pub(super) fn check_elevations(row: usize, column: usize, samples: &[f32]) -> Result<(), DemError> {
    let is_believed = |value: f32| {
        (BELIEVED[0]..=BELIEVED[1]).contains(&f64::from(value)) && value.total_cmp(&UNKNOWN).is_ne()
    };
    let doubtful = |value: f32| !(value.is_nan() || is_believed(value));
    match samples.iter().position(|value| doubtful(*value)) {
        Some(at) => Err(DemError::Elevation {
            row,
            column: column + at,
            value: samples[at].into(),
        }),
        None => Ok(()),
    }
}
