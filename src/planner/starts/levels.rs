//! The heights at which a place is worth flying over: in the middle of the band, and where a threat can be passed above
//! or below, just clear of it.

use super::over::TOUCH;
use super::{direction, lifted, steepest};
use crate::geometry::{Point2, Point3};
use crate::scenario::Scenario;

/// Additional clearance from tops and bases, as a share of the band: a leg may slope by this much over a threat.
const CLEAR: f64 = 0.02;

/// Number of directions in which a climb can begin.
const DIRECTIONS: usize = 24;

/// Maximum number of heights beside the middle at one place: those nearest to it, and the farthest.
const MOST: usize = 4;

/// Heights nearer to each other than this share of the band count as one.
const ALIKE: f64 = 0.01;

/// `spot` in the middle of the band, then at the heights that clear threats within `reach` of it, those nearest to the
/// middle first.
pub(super) fn over(scenario: &Scenario, spot: Point2, reach: f64) -> Vec<Point3> {
    let middle = lifted(scenario, spot, 0.5);
    let band = scenario.altitude;
    let ground = scenario.terrain.elevation(middle.xy());
    let (lowest, highest) = (ground + band.min, ground + band.max);
    let clear = CLEAR * (band.max - band.min);
    let mut places: Vec<Point3> = scenario
        .threats
        .iter()
        .filter(|threat| threat.extent().grown(reach).contains(middle.xy()))
        .flat_map(|threat| {
            let above = threat.top.filter(|top| (middle.z..=highest).contains(top));
            let below = threat.base.filter(|base| (lowest..middle.z).contains(base));
            [
                above,
                above.map(|top| (top + clear).min(highest)),
                below.map(|base| base - TOUCH),
                below.map(|base| (base - clear).max(lowest)),
            ]
        })
        .flatten()
        .map(|z| Point3::new(middle.x, middle.y, z))
        .filter(|&point| can_be_reached(scenario, point))
        .collect();
    let away = |point: &Point3| (point.z - middle.z).abs();
    places.sort_by(|one, other| away(one).total_cmp(&away(other)));
    let alike = ALIKE * (band.max - band.min);
    places.dedup_by(|next, before| (next.z - before.z).abs() <= alike);
    if places.len() > MOST {
        places.drain(MOST - 1..places.len() - 1);
    }
    places.insert(0, middle);
    places
}

/// Places around start and target from which, or up to which, the way is in the middle of the band: those that one leg
/// reaches as steeply as the vehicle can climb, if that is farther than `least`.
pub(super) fn about_ends(scenario: &Scenario, least: f64) -> Vec<Point3> {
    let middle = scenario.altitude.middle();
    let mut places = Vec::new();
    for end in [scenario.start, scenario.target] {
        let ground = scenario.terrain.elevation(end.xy());
        let reach = (ground + middle - end.z).abs() / steepest(scenario) * (1.0 + 1e-9);
        if !scenario.terrain.is_flat() || reach < least {
            continue;
        }
        places.extend(
            (0..DIRECTIONS)
                .map(|idx| {
                    let heading = std::f64::consts::TAU * idx as f64 / DIRECTIONS as f64;
                    let way = direction(heading) * reach;
                    end.xy() + way
                })
                .filter(|spot| scenario.area.contains(*spot))
                .map(|spot| lifted(scenario, spot, 0.5)),
        );
    }
    places
}

/// Whether the vehicle can climb to `point` from the start, and from it to the target.
fn can_be_reached(scenario: &Scenario, point: Point3) -> bool {
    [scenario.start, scenario.target].iter().all(|end| {
        let way = (point.xy() - end.xy()).norm();
        (point.z - end.z).abs() <= way * steepest(scenario)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Segment;
    use crate::planner::tests::{radar, scenario};

    /// One threat up to `top` and, elsewhere, one from `base`; the middle of the band is at 100 m.
    fn passable(top: f64, base: f64) -> Scenario {
        let mut scenario = scenario();
        scenario.threats = vec![radar(350.0, 250.0, 60.0), radar(680.0, 620.0, 60.0)];
        scenario.threats[0].top = Some(top);
        scenario.threats[1].base = Some(base);
        scenario
    }

    fn heights(scenario: &Scenario, x: f64, y: f64) -> Vec<f64> {
        let places = over(scenario, Point2::new(x, y), 40.0);
        places.iter().map(|place| place.z).collect()
    }

    #[test]
    fn places_around_a_threat_have_the_heights_that_clear_it() {
        let scenario = passable(130.0, 70.0);
        assert_eq!(heights(&scenario, 350.0, 370.0), [100.0, 130.0, 134.0]);
        assert_eq!(heights(&scenario, 680.0, 500.0), [100.0, 69.999, 66.0]);
        assert_eq!(heights(&scenario, 500.0, 430.0), [100.0]);
    }

    #[test]
    fn threats_cleared_at_the_middle_of_the_band_add_no_heights() {
        let scenario = passable(99.0, 101.0);
        for (x, y) in [(350.0, 250.0), (680.0, 620.0)] {
            assert_eq!(heights(&scenario, x, y), [100.0]);
        }
    }

    #[test]
    fn heights_outside_the_band_or_beyond_the_climb_are_left_out() {
        let scenario = passable(199.0, 201.0);
        assert_eq!(heights(&scenario, 350.0, 370.0), [100.0, 199.0]);
        // From the start, which is at 0 m, 145 m away.
        let heights = heights(&scenario, 280.0, 220.0);
        assert_eq!(heights, [100.0]);
    }

    #[test]
    fn of_many_heights_the_nearest_and_the_one_that_clears_all_are_kept() {
        let mut scenario = passable(130.0, 0.0);
        for top in [140.0, 150.0, 160.0, 170.0] {
            let mut threat = scenario.threats[0].clone();
            threat.top = Some(top);
            scenario.threats.push(threat);
        }
        let expected = [100.0, 130.0, 134.0, 140.0, 174.0];
        assert_eq!(heights(&scenario, 350.0, 370.0), expected);
    }

    #[test]
    fn a_climb_from_an_end_takes_at_most_one_leg() {
        let mut scenario = scenario();
        (scenario.start.x, scenario.start.y) = (300.0, 300.0);
        // The target is 50 m above the middle, which a leg reaches before its end.
        let places = about_ends(&scenario, 60.0);
        assert_eq!(places.len(), DIRECTIONS);
        for b in places {
            let a = scenario.start;
            assert!((b.z - 100.0).abs() < 1e-9);
            assert!((Segment { a, b }.climb().to_degrees() - 45.0).abs() < 1e-6);
        }
        assert!(about_ends(&scenario, 200.0).is_empty());
    }
}
