//! The spherical coding decoded in lanes: as `Spherical::decode`, by polynomials within rounding.

use pulp::{Simd, WithSimd};

use super::Spherical;
use crate::cost::batch::{LANES, PointRow};
use crate::geometry::LEVEL;
use crate::geometry::lane::{Lane, parts};

/// Decodes as many positions as there are lanes, heights above ground, into `points`: a row for the
/// start, each free waypoint, and the target.
pub(super) struct Chains<'a, 's> {
    pub(super) coding: &'a Spherical<'s>,
    pub(super) positions: [&'a [f64]; LANES],
    pub(super) points: &'a mut [PointRow],
}

impl WithSimd for Chains<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            coding,
            positions,
            points,
        } = self;
        for part in 0..parts::<S>() {
            chain(simd, part, coding, &positions, points);
        }
    }
}

#[inline(always)]
fn chain<S: Simd>(
    simd: S,
    part: usize,
    coding: &Spherical,
    positions: &[&[f64]; LANES],
    points: &mut [PointRow],
) {
    let band = coding.scenario.altitude;
    let zero = Lane::splat(simd, 0.0);
    let (lowest, highest) = (zero.with(band.min), zero.with(band.max));
    let middle = zero.with(band.middle());
    let (mut x, mut y, mut heading) = (zero, zero, zero);
    let mut height = zero.with(coding.start_height);
    let last = points.len() - 1;
    for (leg_idx, point) in points[1..].iter_mut().enumerate() {
        let [amplitude, turn, polar] = vector(simd, part, positions, leg_idx);
        heading = heading + turn;
        let (sin, cos) = polar.sin_cos();
        let level = amplitude * sin;
        let (north, east) = heading.sin_cos();
        x = x + level * east;
        y = y + level * north;
        let steepest = level * coding.steepest;
        let glide = (middle - height).clamp(-steepest, steepest);
        height = (height + glide + amplitude * cos).clamp(lowest, highest);
        x.store(&mut point.x, part);
        y.store(&mut point.y, part);
        height.store(&mut point.z, part);
    }
    // Turn and stretch the chain so that its end comes to lie on the target: by the course less the
    // direction of the end, whose sine and cosine are products of those of both.
    let [along, across] = coding.toward;
    let reach = (x * x + y * y).sqrt();
    let closed = zero.with(LEVEL).le(reach);
    let scale = zero.with(coding.distance) / (reach * reach);
    let cos = closed.select((x * along + y * across) * scale, zero.with(along));
    let sin = closed.select((x * across - y * along) * scale, zero.with(across));
    let start = coding.scenario.start;
    for point in &mut points[1..last] {
        let (x, y) = (
            Lane::load(simd, &point.x, part),
            Lane::load(simd, &point.y, part),
        );
        (x * cos - y * sin + start.x).store(&mut point.x, part);
        (x * sin + y * cos + start.y).store(&mut point.y, part);
    }
}

/// The three numbers of a leg in each lane.
#[inline(always)]
fn vector<S: Simd>(
    simd: S,
    part: usize,
    positions: &[&[f64]; LANES],
    leg_idx: usize,
) -> [Lane<S>; 3] {
    let mut rows = [[0.0; LANES]; 3];
    let from = part * S::F64_LANES;
    for (lane, position) in positions[from..from + S::F64_LANES].iter().enumerate() {
        let numbers = &position[3 * leg_idx..3 * leg_idx + 3];
        for (row, number) in rows.iter_mut().zip(numbers) {
            row[lane] = *number;
        }
    }
    [
        Lane::load(simd, &rows[0], 0),
        Lane::load(simd, &rows[1], 0),
        Lane::load(simd, &rows[2], 0),
    ]
}
