//! The operator's limits, with the defaults that `GET /limits` shows.
//!
//! A refusal names the limit by its field here and the value that exceeds it. Ranges that do not depend on the
//! operator (such as a turn of at most 180 degrees) are in `json`.

/// Upper limits on a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Size of a request body, bytes; checked before the body is read.
    pub body_bytes: usize,
    /// Threats in a scenario.
    pub threats: usize,
    /// Vertices of all polygons together.
    pub polygon_vertices: usize,
    /// Nodes of a terrain grid, or of a dataset under an area.
    pub terrain_nodes: usize,
    /// Size of an uploaded dataset, bytes; checked while it is received.
    pub terrain_bytes: u64,
    /// Size of all uploaded datasets together, bytes; checked when one more is to be kept.
    pub terrains_bytes: u64,
    /// Uploaded datasets, by their names.
    pub terrains: usize,
    /// Peaks of an analytic terrain.
    pub peaks: usize,
    /// Free waypoints, N.
    pub waypoints: usize,
    /// Population: number of bats.
    pub population: usize,
    /// Iterations.
    pub iterations: usize,
    /// population * iterations * waypoints; bounds the time of one plan.
    pub work: u64,
    /// Samples of the delivered path: a document is refused if the straight line from start to target already exceeds
    /// this at its `smoothing.spacing`.
    pub path_samples: usize,
}

impl Limits {
    /// For a document that was accepted before: present limits do not invalidate it.
    pub const NONE: Self = Self {
        body_bytes: usize::MAX,
        threats: usize::MAX,
        polygon_vertices: usize::MAX,
        terrain_nodes: usize::MAX,
        terrain_bytes: u64::MAX,
        terrains_bytes: u64::MAX,
        terrains: usize::MAX,
        peaks: usize::MAX,
        waypoints: usize::MAX,
        population: usize::MAX,
        iterations: usize::MAX,
        work: u64::MAX,
        path_samples: usize::MAX,
    };
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            body_bytes: 8 * 1024 * 1024,
            threats: 10_000,
            polygon_vertices: 20_000,
            terrain_nodes: 4_000_000,
            terrain_bytes: 1 << 30,
            terrains_bytes: 1 << 34,
            terrains: 10_000,
            peaks: 1_000,
            waypoints: 200,
            population: 10_000,
            iterations: 100_000,
            work: 4_000_000_000,
            path_samples: 50_000,
        }
    }
}
