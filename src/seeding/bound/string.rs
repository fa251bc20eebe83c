//! The taut string round widened walls, computed for a bound.

use super::departure::{Departure, Place};
use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::Point2;
use crate::seeding::obstacles::Obstacles;
use crate::seeding::outline::Outline;
use crate::seeding::taut::{Limits, TautStrings, taut_strings_within};

/// Maximum number of ways examined for one string: beyond a few hundred walls, the search ends with what it has proven
/// so far.
const MOST_WAYS: usize = 60_000;

/// Without widening anything: for cases with too many gaps to examine.
pub(super) fn plain(
    walls: &[Wall],
    radii: &[Option<f64>],
    prices: &Prices,
    stop: &dyn Fn() -> bool,
) -> f64 {
    let (cost, _) = cost((walls, radii), prices, &[], (f64::INFINITY, stop));
    prices.climbing_at(cost)
}

/// Radii of the cores alone.
pub(super) fn cores(walls: &[Wall]) -> Vec<Option<f64>> {
    let radius = |wall: &Wall| wall.toll.is_none().then_some(wall.core);
    walls.iter().map(radius).collect()
}

/// A lower bound, seen from above, for routes round `walls` widened to `radii` (`None` leaves one out): the string,
/// less what routes may save by cutting corners, but not below 0, plus the ways out of soft zones that are not `spent`;
/// infinite where there is no string. Once `enough` is proven, or `stop` asks for it, what is proven so far. Also
/// returns the ways examined.
pub(super) fn cost(
    (walls, radii): (&[Wall], &[Option<f64>]),
    prices: &Prices,
    spent: &[usize],
    limits: (f64, &dyn Fn() -> bool),
) -> (f64, usize) {
    let ends = departures((walls, radii), prices, spent);
    between(ends, (walls, radii), prices, limits)
}

/// As `cost`, from one of these `ends` to the other.
pub(super) fn between(
    ends: [Departure; 2],
    (walls, radii): (&[Wall], &[Option<f64>]),
    prices: &Prices,
    (enough, stop): (f64, &dyn Fn() -> bool),
) -> (f64, usize) {
    let slack = slack(walls, radii, prices);
    let tolls = ends[0].toll + ends[1].toll;
    let enough = (enough - tolls).max(0.0) / prices.fuel + slack;
    let (shortest, ways) = shortest(
        &scene((walls, radii), ends.map(|end| end.at)),
        (enough, stop),
    );
    // Where fuel is cheap and soft zones are expensive, cutting corners may save more than the way costs.
    ((prices.fuel * (shortest - slack) + tolls).max(0.0), ways)
}

/// A gap between two cores.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    middle: Point2,
    /// Distance from there to each core, metres.
    half: f64,
}

impl Gap {
    /// Between shapes that are nearest to each other at two points, which are surrounded by their `cores`.
    pub(super) fn new([p, q]: [Point2; 2], cores: [f64; 2]) -> Self {
        let apart = (q - p).norm();
        // Shapes that touch have no way of their own between them: the gap is a point.
        let along = (q - p).try_normalize(0.0).unwrap_or_default();
        Self {
            middle: p + along * (0.5 * (apart + cores[0] - cores[1])),
            half: 0.5 * (apart - cores[0] - cores[1]).max(0.0),
        }
    }
}

/// As `cost`, for routes through `gap`; the soft zones of the walls on both sides are `spent`.
pub(super) fn through(
    (walls, radii): (&[Wall], &[Option<f64>]),
    prices: &Prices,
    spent: &[usize],
    gap: Gap,
    stop: &dyn Fn() -> bool,
) -> f64 {
    // The way may use the middle of the gap for free.
    let radii = narrowed((walls, radii), gap.middle, gap.half);
    let ends = departures((walls, &radii), prices, spent);
    let halves: f64 = ends
        .iter()
        .map(|end| {
            let scene = scene((walls, &radii), [end.at, gap.middle]);
            shortest(&scene, (f64::INFINITY, stop)).0 - gap.half
        })
        .sum();
    let slack = slack(walls, &radii, prices);
    (prices.fuel * (halves - slack) + ends[0].toll + ends[1].toll).max(0.0)
}

/// Radii at which no wall comes nearer to a point than `spread` metres; `None` for those whose shapes do.
pub(super) fn narrowed(
    (walls, radii): (&[Wall], &[Option<f64>]),
    at: Point2,
    spread: f64,
) -> Vec<Option<f64>> {
    let narrowed = |(wall, radius): (&Wall, &Option<f64>)| {
        let most = wall.distance(at) - spread;
        radius.map(|radius| radius.min(most)).filter(|_| most > 0.0)
    };
    walls.iter().zip(radii).map(narrowed).collect()
}

/// Both ends as seen by a string.
pub(super) fn departures(
    field: (&[Wall], &[Option<f64>]),
    prices: &Prices,
    spent: &[usize],
) -> [Departure; 2] {
    let [start, target] = [0, 1].map(|end| Place {
        at: prices.ends[end].xy(),
        spread: 0.0,
        end: Some(end),
    });
    [[start, target], [target, start]].map(|ends| Departure::of(field, prices, ends, spent))
}

/// Walls, none of which is wider than it may be at either end. Strings pass where two of them overlap by what routes
/// may enter both.
pub(super) fn scene((walls, radii): (&[Wall], &[Option<f64>]), ends: [Point2; 2]) -> Obstacles {
    let outlines = walls.iter().zip(radii).map(|(wall, radius)| {
        let outline = wall.outline((*radius)?);
        Some(Outline {
            core: outline.core.min(outline.radius),
            ..outline
        })
    });
    let tolerance = walls.iter().map(|wall| wall.tolerance).fold(0.0, f64::max);
    Obstacles::new(outlines, ends, None).forgiving(2.0 * tolerance)
}

/// Metres by which the string may be shorter because routes may cut corners, or pay to do so.
pub(super) fn slack(walls: &[Wall], radii: &[Option<f64>], prices: &Prices) -> f64 {
    let kept = walls
        .iter()
        .zip(radii)
        .filter(|(_, radius)| radius.is_some());
    let length: f64 = kept.map(|(wall, _)| wall.slack()).sum();
    // A way round a corner instead of across it may lie in every soft zone.
    let dearest: f64 = walls.iter().map(|wall| wall.influence).sum();
    length * (1.0 + prices.exposure * dearest / prices.fuel)
}

/// The length that no string in `scene` undercuts, up to `enough`, and the ways examined.
pub(super) fn shortest(
    scene: &Obstacles,
    (enough, stop): (f64, &dyn Fn() -> bool),
) -> (f64, usize) {
    let found = pulled(scene, (enough, stop));
    let first = found.strings.first().map(|string| string.length);
    (first.unwrap_or(f64::INFINITY).min(found.beyond), found.ways)
}

pub(super) fn pulled(scene: &Obstacles, (enough, stop): (f64, &dyn Fn() -> bool)) -> TautStrings {
    let limits = Limits {
        most_ways: MOST_WAYS,
        enough,
        stop,
    };
    taut_strings_within(scene, 1, limits)
}
