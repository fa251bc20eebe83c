//! Threats as a file gives them, and how many of them a scenario may have.

use serde_json::{Value, json};

use super::Most;
use super::facts::Facts;
use super::place::Place;

/// A threat of the document.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Threat {
    name: Option<String>,
    pub(super) shape: Shape,
    /// Metres in the document's datum, as is `top`.
    base: Option<f64>,
    top: Option<f64>,
}

/// A threat, and what of the file it is made without, because that makes no sense.
pub(super) type Made = (Threat, Vec<String>);

/// Lengths in metres.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    Cylinder {
        center: Place,
        radius: f64,
        influence: f64,
    },
    Polygon {
        vertices: Vec<Place>,
        margin: f64,
    },
}

/// All threats of a file. Those past the limits are counted, and not kept.
#[derive(Debug)]
pub(super) struct Threats {
    most: Most,
    kept: Vec<Threat>,
    n_found: usize,
    /// Of all polygons together.
    n_vertices: usize,
}

impl Threats {
    pub(super) fn up_to(most: Most) -> Self {
        Self {
            most,
            kept: Vec::new(),
            n_found: 0,
            n_vertices: 0,
        }
    }

    pub(super) fn add(&mut self, threat: Threat) {
        self.n_found += 1;
        if let Shape::Polygon { vertices, .. } = &threat.shape {
            self.n_vertices += vertices.len();
        }
        if self.excess().is_none() {
            self.kept.push(threat);
        }
    }

    /// Which limit they exceed, and by how much.
    pub(super) fn excess(&self) -> Option<String> {
        let (n_found, n_vertices, most) = (self.n_found, self.n_vertices, self.most);
        if n_found > most.threats {
            Some(format!(
                "the file has {n_found} threats, must have at most {} (limit threats)",
                most.threats
            ))
        } else if n_vertices > most.polygon_vertices {
            Some(format!(
                "the polygons of the file have {n_vertices} vertices together, must have at most {} (limit polygon_vertices)",
                most.polygon_vertices
            ))
        } else {
            None
        }
    }

    /// As in the document.
    pub(super) fn json(self) -> Value {
        self.kept.into_iter().map(Threat::json).collect()
    }
}

impl Shape {
    /// Without a soft zone.
    pub(super) fn circle(center: Place, radius: f64) -> Result<Self, String> {
        let allowed = radius.is_finite() && radius > 0.0;
        let influence = radius;
        allowed
            .then_some(Self::Cylinder {
                center,
                radius,
                influence,
            })
            .ok_or_else(|| format!("radius is {radius}, must be > 0"))
    }

    /// Without a soft zone.
    pub(super) fn polygon(vertices: Vec<Place>) -> Self {
        let margin = 0.0;
        Self::Polygon { vertices, margin }
    }
}

impl Threat {
    /// Between two heights, a base and a top, or one, or none. Where they make no sense it has none: to
    /// leave the threat out would let a route through.
    pub(super) fn new(
        name: Option<String>,
        shape: Shape,
        heights: Result<[Option<f64>; 2], String>,
    ) -> Made {
        let heights = heights.and_then(|heights| match heights {
            [Some(base), Some(top)] if base >= top => {
                Err(format!("base is {base}, must be < the top, {top}"))
            }
            heights => Ok(heights),
        });
        let (heights, amiss) = match heights {
            Ok(heights) => (heights, Vec::new()),
            Err(reason) => (
                [None, None],
                vec![format!("{reason}: it is kept clear of at any height")],
            ),
        };
        let [base, top] = heights;
        let threat = Self {
            name,
            shape,
            base,
            top,
        };
        (threat, amiss)
    }

    fn json(self) -> Value {
        let Self {
            name, base, top, ..
        } = self;
        match self.shape {
            Shape::Cylinder {
                center,
                radius,
                influence,
            } => json!({
                "kind": "cylinder",
                "name": name,
                "center": center.json(),
                "radius": radius,
                "influence": influence,
                "base": base,
                "top": top,
            }),
            Shape::Polygon { vertices, margin } => json!({
                "kind": "polygon",
                "name": name,
                "vertices": vertices.into_iter().map(Place::json).collect::<Value>(),
                "margin": margin,
                "base": base,
                "top": top,
            }),
        }
    }
}

/// A circle with the radius in its facts.
pub(super) fn circle(facts: &Facts, center: Place) -> Result<Made, String> {
    let radius = facts.number("radius")?.unwrap_or_default();
    let shape = Shape::circle(center, radius)?;
    let soft = at_least("influence", radius, facts);
    Ok(with_facts(shape, soft, facts))
}

/// The outer ring of a polygon, closed or not.
#[expect(
    clippy::float_cmp,
    reason = "a ring is closed by its very first corner"
)]
pub(super) fn polygon(facts: &Facts, ring: &[[f64; 2]]) -> Result<Made, String> {
    let open = match ring {
        [first, between @ .., last] if first == last => &ring[..=between.len()],
        _ => ring,
    };
    if open.len() < 3 {
        let count = open.len();
        return Err(format!(
            "a polygon of {count} corners, must have three or more"
        ));
    }
    let corners = open.iter().map(|[lon, lat]| Place::new(*lon, *lat));
    let vertices: Result<Vec<Place>, String> = corners.collect();
    let soft = at_least("margin", 0.0, facts);
    Ok(with_facts(Shape::polygon(vertices?), soft, facts))
}

/// The number of this name, if there is one.
fn at_least(name: &str, least: f64, facts: &Facts) -> Result<Option<f64>, String> {
    match facts.number(name)? {
        Some(given) if given < least => Err(format!("{name} is {given}, must be >= {least}")),
        given => Ok(given),
    }
}

/// The shape with its soft zone, between the heights of its facts.
fn with_facts(mut shape: Shape, soft: Result<Option<f64>, String>, facts: &Facts) -> Made {
    let soft = soft.map_err(|reason| format!("{reason}: it has no soft zone"));
    if let Ok(Some(given)) = soft {
        match &mut shape {
            Shape::Cylinder { influence, .. } => *influence = given,
            Shape::Polygon { margin, .. } => *margin = given,
        }
    }
    let number = |name| facts.number(name);
    let heights = number("base").and_then(|base| Ok([base, number("top")?]));
    let (threat, mut amiss) = Threat::new(facts.name().map(str::to_owned), shape, heights);
    amiss.extend(soft.err());
    (threat, amiss)
}
