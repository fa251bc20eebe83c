//! The ground seen from above: tints by height, shading by slope, contour lines.

use super::canvas::{Area, Canvas, Font, Spot, ring};
use super::contour::Field;
use super::labels::Labels;
use super::palette::{SOIL, tint};
use super::scale::{MapScale, Steps};
use crate::geometry::Point2;
use crate::terrain::Terrain;

/// Samples from west to east, finest first. A coarser lattice is used if the ground is so rough that the drawing
/// would exceed [`MOST_POINTS`].
const LATTICES: [usize; 5] = [141, 101, 71, 51, 31];
/// Most points of all rings together.
const MOST_POINTS: usize = 16_000;
/// Most contour lines.
const MOST_LEVELS: f64 = 14.0;
/// Ground with less variation is drawn level, metres.
const LEVEL_M: f64 = 1e-3;

/// The ground under a plan.
pub(super) struct Relief {
    /// Lowest and highest ground shown, metres.
    pub(super) range: (f64, f64),
    /// Interval of the contour lines.
    pub(super) interval: Steps,
    contours: Vec<Layer>,
    shades: Vec<Layer>,
}

/// One filled outline.
struct Layer {
    /// Metres; for shading, its darkness.
    level: f64,
    style: String,
    rings: Vec<Vec<Spot>>,
}

impl Relief {
    pub(super) fn of(terrain: &Terrain, map: &MapScale) -> Self {
        let mut relief = None;
        for columns in LATTICES {
            let drawn = Self::sampled(terrain, map, columns);
            let small = drawn.points() <= MOST_POINTS;
            relief = Some(drawn);
            if small {
                break;
            }
        }
        relief.expect("there is a lattice")
    }

    fn sampled(terrain: &Terrain, map: &MapScale, columns: usize) -> Self {
        let pixels = map.frame.width / (columns - 1) as f64;
        let metres = pixels / map.pixels_per_metre();
        let mut rows = 2;
        while (rows - 1) as f64 * pixels < map.frame.height - 1e-6 {
            rows += 1;
        }
        let origin = map.view.min;
        let field = Field::sample(columns, rows, |column, row| {
            terrain.elevation(Point2::new(
                origin.x + column as f64 * metres,
                origin.y + row as f64 * metres,
            ))
        });
        let (min, max) = field.range();
        let interval = Steps::of((max - min).max(LEVEL_M), MOST_LEVELS);
        let mut relief = Self {
            range: (min, max),
            interval,
            contours: Vec::new(),
            shades: Vec::new(),
        };
        if max - min < LEVEL_M {
            return relief;
        }
        let spots = |field: &Field, level: f64| {
            let rings = field.rings(level).into_iter();
            rings
                .map(|ring| {
                    let spot = |(x, y): (f64, f64)| {
                        (map.frame.left + x * pixels, map.frame.bottom() - y * pixels)
                    };
                    ring.into_iter().map(spot).collect::<Vec<_>>()
                })
                .filter(|ring: &Vec<_>| extent(ring) > 1.5)
                .collect()
        };
        for level in interval.within(min, max) {
            relief.contours.push(Layer {
                level,
                style: format!("fill=\"{}\"", relief.tint_above(level)),
                rings: spots(&field, level),
            });
        }
        let (lit, dark) = shading(&field, metres);
        let dark_style = "fill=\"#000\" fill-opacity=\"0.04\"";
        let lit_style = "fill=\"#fff\" fill-opacity=\"0.13\"";
        let shades = [0.06, 0.12, 0.18, 0.25, 0.33]
            .map(|level| (&dark, level, dark_style))
            .into_iter()
            .chain([0.06, 0.12, 0.18].map(|level| (&lit, level, lit_style)));
        for (field, level, style) in shades {
            relief.shades.push(Layer {
                level,
                style: style.to_owned(),
                rings: spots(field, level),
            });
        }
        relief
    }

    /// Tint of the ground from the contour line at `level` up to the next.
    pub(super) fn tint_above(&self, level: f64) -> String {
        let (min, max) = self.range;
        tint((level + 0.5 * self.interval.step - min) / (max - min).max(LEVEL_M))
    }

    /// The contour lines, from the lowest.
    pub(super) fn levels(&self) -> impl Iterator<Item = f64> + '_ {
        self.contours.iter().map(|contour| contour.level)
    }

    fn points(&self) -> usize {
        let layers = self.contours.iter().chain(&self.shades);
        layers.flat_map(|layer| &layer.rings).map(Vec::len).sum()
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, frame: &Area) {
        let lowest = tint(0.0);
        canvas.rect(frame, &format!("fill=\"{lowest}\""));
        let lines = format!("stroke=\"{SOIL}\" stroke-opacity=\"0.55\" stroke-width=\"0.7\"");
        canvas.group("g", &lines, |canvas| draw(canvas, &self.contours));
        canvas.group("g", "", |canvas| draw(canvas, &self.shades));
    }

    /// Label each contour line, or every other one if there are many, where there is room.
    pub(super) fn label(&self, canvas: &mut Canvas, labels: &mut Labels) {
        let font = Font::new(9.0, "#6b583c").anchor("middle").halo();
        let many = self.contours.len() > 8;
        let step = self.interval.step * if many { 2.0 } else { 1.0 };
        let labelled = |contour: &&Layer| {
            let count = contour.level / step;
            (count - count.round()).abs() < 1e-6
        };
        for contour in self.contours.iter().filter(labelled) {
            let words = self.interval.label(contour.level);
            let size = font.measure(&words);
            let longest = contour.rings.iter().max_by_key(|ring| ring.len());
            let mut places = longest.map_or_else(Vec::new, |ring| straight_places(ring, size.0));
            places.sort_by(|a, b| b.straightness.total_cmp(&a.straightness));
            let free = places.into_iter().find(|place| {
                let (cos, sin) = (place.direction.0.abs(), place.direction.1.abs());
                let turned = (size.0 * cos + size.1 * sin, size.0 * sin + size.1 * cos);
                labels.place([Area::about(place.at, turned)]).is_some()
            });
            if let Some(place) = free {
                let degrees = libm::atan2(place.direction.1, place.direction.0).to_degrees();
                let (x, y) = place.at;
                let drop = 0.35 * font.size;
                let baseline = (x - drop * place.direction.1, y + drop * place.direction.0);
                canvas.turned_text(baseline, degrees, &font, &words);
            }
        }
    }
}

fn draw(canvas: &mut Canvas, layers: &[Layer]) {
    for layer in layers.iter().filter(|layer| !layer.rings.is_empty()) {
        let data: String = layer.rings.iter().map(|spots| ring(spots)).collect();
        canvas.path(&data, &format!("{} fill-rule=\"evenodd\"", layer.style));
    }
}

/// Half the perimeter of the box around a ring, pixels.
fn extent(ring: &[Spot]) -> f64 {
    let span = |of: fn(&Spot) -> f64| {
        let (min, max) = ring
            .iter()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| {
                (min.min(value), max.max(value))
            });
        max - min
    };
    span(|spot| spot.0) + span(|spot| spot.1)
}

/// How much brighter and how much darker than level ground each node is, with light from the north-west at 45
/// degrees. Slopes are scaled to a common steepness, so that hills and mountain ranges look alike.
fn shading(field: &Field, metres: f64) -> (Field, Field) {
    const STEEPNESS: f64 = 0.5;
    const LIGHT: [f64; 3] = [-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2];
    let (columns, rows) = field.size();
    let slope = |column: usize, row: usize| {
        let (west, east) = (column.saturating_sub(1), (column + 1).min(columns - 1));
        let (south, north) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let east_up = field.at(east, row) - field.at(west, row);
        let north_up = field.at(column, north) - field.at(column, south);
        (
            east_up / ((east - west) as f64 * metres),
            north_up / ((north - south) as f64 * metres),
        )
    };
    let mut squares = 0.0;
    for row in 0..rows {
        for column in 0..columns {
            let (east, north) = slope(column, row);
            squares += east * east + north * north;
        }
    }
    let common = (squares / (columns * rows) as f64).sqrt();
    let exaggeration = (STEEPNESS / common.max(1e-12)).min(10.0);
    let brightness = |column, row| {
        let (east, north) = slope(column, row);
        let (east, north) = (exaggeration * east, exaggeration * north);
        let towards = LIGHT[2] - east * LIGHT[0] - north * LIGHT[1];
        towards / (1.0 + east * east + north * north).sqrt() - LIGHT[2]
    };
    (
        Field::sample(columns, rows, brightness),
        Field::sample(columns, rows, |column, row| -brightness(column, row)),
    )
}

/// A position on a contour line for its label.
struct Place {
    at: Spot,
    /// Unit vector along the line, from left to right.
    direction: (f64, f64),
    /// 1 where the line is straight.
    straightness: f64,
}

/// Positions along `ring` that leave `width` pixels for text.
fn straight_places(ring: &[Spot], width: f64) -> Vec<Place> {
    let mut places = Vec::new();
    for middle in (0..ring.len()).step_by(4) {
        let walk = |step: &dyn Fn(usize) -> usize| {
            let (mut idx, mut walked) = (middle, 0.0);
            while walked < 0.6 * width {
                let next = step(idx);
                walked += distance(ring[idx], ring[next]);
                idx = next;
                if idx == middle {
                    break;
                }
            }
            (ring[idx], walked)
        };
        let (before, back) = walk(&|idx| (idx + ring.len() - 1) % ring.len());
        let (after, forth) = walk(&|idx| (idx + 1) % ring.len());
        let (dx, dy) = (after.0 - before.0, after.1 - before.1);
        let chord = distance(before, after);
        if chord < 0.8 * width {
            continue;
        }
        let upright = if dx < 0.0 { -chord } else { chord };
        places.push(Place {
            at: ring[middle],
            direction: (dx / upright, dy / upright),
            straightness: chord / (back + forth),
        });
    }
    places
}

fn distance(a: Spot, b: Spot) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;
    use crate::terrain::{Flat, Grid};

    fn map() -> MapScale {
        MapScale {
            view: Rect {
                min: Point2::new(0.0, 0.0),
                max: Point2::new(199.0, 199.0),
            },
            frame: Area::about((300.0, 300.0), (600.0, 600.0)),
        }
    }

    fn drawn(terrain: &Terrain) -> String {
        let mut canvas = Canvas::new(600.0, 600.0);
        let relief = Relief::of(terrain, &map());
        relief.draw(&mut canvas, &map().frame);
        relief.label(&mut canvas, &mut Labels::within(map().frame));
        canvas.finish()
    }

    #[test]
    fn level_ground_has_one_tint() {
        let text = drawn(&Terrain::Flat(Flat { elevation: 12.0 }));
        assert!(!text.contains("<path") && !text.contains("<text"), "{text}");
    }

    #[test]
    fn the_roughest_ground_stays_small() {
        let mut state = 1_u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 16)
        };
        let text = drawn(&Terrain::Grid(Grid {
            origin: Point2::new(0.0, 0.0),
            cell: 1.0,
            columns: 200,
            rows: 200,
            elevations: (0..40_000).map(|_| noise()).collect(),
        }));
        assert!(text.contains("<path"));
        assert!(text.len() < 250_000, "{} bytes", text.len());
    }
}
