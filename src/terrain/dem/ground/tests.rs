use proptest::prelude::*;

use super::*;
use crate::geometry::geodesy::{LatLon, undulation_m};
use crate::terrain::dem::{Crs, Lattice};

/// A raster of 80 x 60 nodes about 100 m apart, and the plane at its centre.
fn hills(epsg: u16, lat: f64) -> (Raster, TangentPlane) {
    let crs = Crs::epsg(epsg).expect("it is known");
    let middle = LatLon { lat, lon: -84.3 };
    let [x, y] = crs.east_north(middle).expect("it reaches there");
    let step = if crs.is_geographic() {
        [
            100.0 / 111_000.0 / libm::cos(lat.to_radians()),
            -100.0 / 111_000.0,
        ]
    } else {
        [100.0, -100.0]
    };
    let lattice = Lattice {
        crs,
        columns: 80,
        rows: 60,
        first: [x - 39.5 * step[0], y - 29.5 * step[1]],
        step,
    };
    let elevations = (0..80 * 60).map(|idx: u16| f32::from(idx.wrapping_mul(idx) % 97) * 1.5);
    let raster = Raster {
        lattice,
        offset: [7, 5],
        elevations: elevations.collect(),
    };
    (raster, TangentPlane::at(middle, 300.0))
}

fn area() -> Rect {
    Rect {
        min: Point2::new(-2500.0, -2000.0),
        max: Point2::new(2500.0, 2000.0),
    }
}

/// Textbook bilinear interpolation at the exact place below `point`.
fn expected(raster: &Raster, plane: &TangentPlane, point: Point2) -> f64 {
    let cells = raster
        .lattice
        .below(plane, point)
        .expect("it reaches there");
    let ([column, row], [x, y]) = raster.lattice.cell(cells).expect("it lies inside");
    let at = |column, row| f64::from(raster.elevations[row * raster.lattice.columns + column]);
    (at(column, row) * (1.0 - x) + at(column + 1, row) * x) * (1.0 - y)
        + (at(column, row + 1) * (1.0 - x) + at(column + 1, row + 1) * x) * y
}

#[test]
fn elevations_are_those_of_the_file() {
    for (epsg, lat) in [
        (4326, 36.6),
        (4326, 0.0),
        (4326, -78.0),
        (32616, 36.6),
        (5070, 41.0),
        (3857, 60.0),
    ] {
        let (raster, plane) = hills(epsg, lat);
        // A metre of web Mercator is half a metre at 60 degrees.
        let scale = if epsg == 3857 { 0.4 } else { 1.0 };
        let area = Rect {
            min: area().min * scale,
            max: area().max * scale,
        };
        let dem = Dem::new(raster.clone(), &plane, area, 300.0).expect("the raster is wider");
        assert!(
            dem.extent().contains(area.min) && dem.extent().max.x > area.max.x,
            "{epsg}"
        );
        let size = area.max - area.min;
        for i in 0..40 {
            for j in 0..40 {
                let share = nalgebra::Vector2::new(
                    size.x * f64::from(i) / 39.0,
                    size.y * f64::from(j) / 39.0,
                );
                let point = area.min + share;
                let off = dem.elevation(point) - expected(&raster, &plane, point);
                // One or two millionths of a cell, with 300 m of relief.
                assert!(
                    off.abs() < 1e-3,
                    "EPSG:{epsg} at {lat}: {off} m off at {point}"
                );
            }
        }
    }
}

#[test]
fn an_area_that_sticks_out_is_refused_where_it_does() {
    let (raster, plane) = hills(4326, 36.6);
    let mut wide = area();
    wide.max.x = 4500.0;
    let Err(DemError::Outside { at, north_east, .. }) = Dem::new(raster, &plane, wide, 0.0) else {
        panic!("it sticks out");
    };
    assert!(
        at.lon > north_east.lon && (at.lon + 84.25).abs() < 0.02,
        "{at:?}"
    );
}

#[test]
fn a_hole_is_refused_under_the_area_and_avoided_beside_it() {
    let (mut raster, plane) = hills(32616, 36.6);
    let whole = raster.clone();
    // 950 m west and 450 m north of the centre.
    raster.elevations[25 * 80 + 30] = f32::NAN;
    let Err(DemError::NoData { at, row, column }) = Dem::new(raster, &plane, area(), 0.0) else {
        panic!("there is a hole");
    };
    assert_eq!([row, column], [32, 35]);
    let away = plane.local(at) - Point2::new(-950.0, 450.0);
    assert!(away.norm() < 40.0, "{away}");
    // On the west side, 2850 m from the centre: the margin must stop short of it.
    let mut raster = whole;
    raster.elevations[25 * 80 + 11] = f32::NAN;
    let dem = Dem::new(raster, &plane, area(), 600.0).expect("the hole is outside");
    assert!(
        dem.extent().min.x >= -2800.0 && dem.extent().min.x < -2600.0,
        "{:?}",
        dem.extent()
    );
    assert!((dem.extent().max.x - 3100.0).abs() < 1e-9);
    let leg = Segment {
        a: Point3::new(-4000.0, 450.0, 100.0),
        b: Point3::new(-2000.0, 450.0, 100.0),
    };
    let range = dem.height_range(&leg, (0.0, 1.0));
    assert!(range.min.is_finite() && range.max.is_finite());
    let edge = dem.elevation(Point2::new(dem.extent().min.x, 450.0));
    assert!((dem.elevation(leg.a.xy()) - edge).abs() < 1e-12);
}

/// Nodes of the geoid 20 km apart would be two million here, and take half an hour.
#[test]
fn a_raster_of_the_whole_earth_is_raised_at_its_samples() {
    let lattice = Lattice {
        crs: Crs::wgs84(),
        columns: 37,
        rows: 19,
        first: [-180.0, 90.0],
        step: [10.0, -10.0],
    };
    let raster = Raster {
        offset: [0, 0],
        elevations: vec![100.0; lattice.columns * lattice.rows],
        lattice,
    };
    let plane = TangentPlane::at(
        LatLon {
            lat: 46.0,
            lon: 7.0,
        },
        0.0,
    );
    let dem = Dem::new(raster, &plane, area(), 0.0).expect("the raster is wider");
    let dem = dem.above_ellipsoid(plane.origin());
    for [column, row] in [[18, 4], [19, 4], [3, 11], [36, 18]] {
        let place = LatLon {
            lat: 90.0 - 10.0 * row as f64,
            lon: -180.0 + 10.0 * column as f64,
        };
        let raised = f64::from(dem.raster().elevations[row * 37 + column]);
        let off = raised - 100.0 - undulation_m(place);
        assert!(off.abs() < 1e-4, "{place:?}: {off}");
    }
}

#[test]
fn a_vertical_leg_has_a_range() {
    let (raster, plane) = hills(4326, 36.6);
    let dem = Dem::new(raster, &plane, area(), 0.0).expect("the raster is wider");
    let leg = Segment {
        a: Point3::new(10.0, 20.0, 250.0),
        b: Point3::new(10.0, 20.0, 280.0),
    };
    let ground = dem.elevation(Point2::new(10.0, 20.0));
    let range = dem.height_range(&leg, (0.0, 1.0));
    assert!(
        (range.min - (250.0 - ground)).abs() < 1e-9 && (range.max - (280.0 - ground)).abs() < 1e-9
    );
}

proptest! {
    #[test]
    fn the_range_holds_every_sample_and_is_reached(
        geographic: bool, lat in -75.0..75.0f64,
        x0 in -3500.0..3500.0f64, y0 in -2600.0..2600.0f64, x1 in -3500.0..3500.0f64, y1 in -2600.0..2600.0f64,
        z0 in 0.0..200.0f64, z1 in 0.0..200.0f64, t0 in 0.0..0.5f64, t1 in 0.5..1.0f64,
    ) {
        let (raster, plane) = if geographic { hills(4326, lat) } else { hills(32616, lat.abs()) };
        let dem = Dem::new(raster, &plane, area(), 200.0).expect("the raster is wider");
        let leg = Segment { a: Point3::new(x0, y0, z0), b: Point3::new(x1, y1, z1) };
        let range = dem.height_range(&leg, (t0, t1));
        let mut seen = HeightRange::EMPTY;
        for i in 0..=8000 {
            let point = leg.at(t0 + (t1 - t0) * f64::from(i) / 8000.0);
            seen = seen.join(HeightRange::of(point.z - dem.elevation(point.xy())));
        }
        prop_assert!(range.min <= seen.min + CHORD_M && range.max >= seen.max - CHORD_M, "{range:?} {seen:?}");
        // Samples are about a metre apart, and the height changes by at most 3 m between them.
        prop_assert!(seen.min - range.min < 3.0 && range.max - seen.max < 3.0, "{range:?} {seen:?}");
        // Beyond a band the result is the same as without one.
        let band = HeightRange { min: 10.0, max: 60.0 };
        let beyond = dem.height_range_beyond(&leg, (t0, t1), band);
        let below = (band.min - beyond.min).max(0.0) - (band.min - range.min).max(0.0);
        let above = (beyond.max - band.max).max(0.0) - (range.max - band.max).max(0.0);
        prop_assert!(below.abs() < 1e-9 && above.abs() < 1e-9, "{range:?} {beyond:?}");
    }
}
