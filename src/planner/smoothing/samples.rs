//! A spline, or the legs it goes back to, as a series of points.

use crate::geometry::bspline::BSpline;
use crate::geometry::{LEVEL, Point3};

/// Samples lie no farther than this from the curve's own bulge, metres.
const SAGITTA: f64 = 0.02;

/// The fine polyline that stands for the curve keeps this near to it, metres.
const DEVIATION: f64 = 5e-4;

/// Samples nearer than this count as one, metres.
const SHORTEST_CHORD: f64 = 1e-6;

/// A sample of the curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) point: Point3,
    u: f64,
    /// First control point of the polynomial piece that ends here.
    pub(super) piece: usize,
}

/// Samples of the curve, no farther apart than `spacing`, every knot among them.
pub(super) fn sample(spline: &BSpline, spacing: f64) -> Vec<Sample> {
    let mut samples = vec![Sample {
        point: spline.control_points[0],
        u: 0.0,
        piece: 0,
    }];
    for (piece, u0, u1) in spline.spans() {
        let end = Sample {
            point: spline.at(piece, u1),
            u: u1,
            piece,
        };
        let start = Sample {
            point: spline.at(piece, u0),
            u: u0,
            piece,
        };
        bisect(spline, spacing, start, end, &mut samples);
    }
    // Where control points coincide, a piece has no extent.
    samples.dedup_by(|next, before| {
        let same = (next.point - before.point).norm() < SHORTEST_CHORD;
        if same {
            before.u = next.u;
        }
        same
    });
    let last = samples.len() - 1;
    samples[0].point = spline.control_points[0];
    samples[last].point = spline.control_points[spline.control_points.len() - 1];
    samples
}

/// Samples of the legs themselves, every waypoint among them.
pub(super) fn corners_alone(route: &[Point3], spacing: f64) -> Vec<Sample> {
    let at = |point| Sample {
        point,
        u: 0.0,
        piece: 0,
    };
    let mut samples = vec![at(route[0])];
    for ends in route.windows(2) {
        let way = ends[1] - ends[0];
        let is_level = way.z.abs() < LEVEL;
        let parts = (way.norm() / spacing).ceil();
        let mut part = 1.0;
        while part < parts {
            let mut point = ends[0] + way * (part / parts);
            if is_level {
                // A leg just below a threat's base must not be rounded up to it.
                point.z = ends[0].z.min(ends[1].z);
            }
            samples.push(at(point));
            part += 1.0;
        }
        samples.push(at(ends[1]));
    }
    samples
}

fn bisect(spline: &BSpline, spacing: f64, start: Sample, end: Sample, samples: &mut Vec<Sample>) {
    let u = 0.5 * (start.u + end.u);
    let middle = Sample {
        point: spline.at(start.piece, u),
        u,
        piece: start.piece,
    };
    let chord = end.point - start.point;
    let length = chord.norm();
    let bulge = if length < SHORTEST_CHORD {
        (middle.point - start.point).norm()
    } else {
        (middle.point - start.point).cross(&chord).norm() / length
    };
    if length > spacing || bulge > SAGITTA {
        bisect(spline, spacing, start, middle, samples);
        bisect(spline, spacing, middle, end, samples);
    } else {
        samples.push(end);
    }
}

/// A polyline within [`DEVIATION`] of the curve, and the piece that each of its points belongs to.
pub(super) fn fine_polyline(spline: &BSpline, samples: &[Sample]) -> (Vec<Point3>, Vec<usize>) {
    let mut points = vec![samples[0].point];
    let mut pieces = vec![samples[0].piece];
    for ends in samples.windows(2) {
        let (from, to) = (ends[0].u, ends[1].u);
        // A curve keeps within |C''| width^2 / 8 of its chord.
        let bulge = spline.second_derivative_bound(ends[1].piece) * (to - from) * (to - from) / 8.0;
        let steps = (bulge / DEVIATION).sqrt().ceil().max(1.0);
        let mut step = 1.0;
        while step < steps {
            points.push(spline.at(ends[1].piece, from + (to - from) * step / steps));
            pieces.push(ends[1].piece);
            step += 1.0;
        }
        points.push(ends[1].point);
        pieces.push(ends[1].piece);
    }
    (points, pieces)
}
