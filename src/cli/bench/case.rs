//! The scenarios that are benchmarked.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::Value;

use crate::planner;
use crate::scenario::Scenario;
use crate::scenario::json::{self, Refusal, Rules};
use crate::scenario::limits::Limits;

/// A scenario document whose `planner` is ours to fill in.
pub(super) struct Case {
    /// A name such as `paper-1`.
    pub(super) name: String,
    /// Least cost found by anybody with [`BEST_KNOWN_WAYPOINTS`] waypoints.
    pub(super) best_known: Option<f64>,
    file: PathBuf,
    document: Value,
}

/// A document that the reader refuses.
#[derive(Debug, thiserror::Error)]
#[error("{} is refused: {refusal}", file.display())]
pub(super) struct Refused {
    pub(super) file: PathBuf,
    pub(super) refusal: Refusal,
}

/// N of the best known routes.
pub(super) const BEST_KNOWN_WAYPOINTS: usize = 10;

/// The shipped scenarios, and the cost of the best route known for each: the least that long runs of several searches
/// and polishing reached, so an upper bound of the optimum.
const SHIPPED: [(&str, &str, f64); 4] = [
    (
        "paper-1",
        include_str!("../../../scenarios/paper-1.json"),
        489.4413,
    ),
    (
        "paper-2",
        include_str!("../../../scenarios/paper-2.json"),
        505.1495,
    ),
    (
        "paper-3",
        include_str!("../../../scenarios/paper-3.json"),
        519.4687,
    ),
    (
        "paper-4",
        include_str!("../../../scenarios/paper-4.json"),
        525.6264,
    ),
];

/// The cases that `files` name, the shipped ones when there are none.
///
/// # Errors
/// When a file cannot be read, is not JSON, or is [`Refused`].
pub(super) fn cases(files: &[PathBuf]) -> anyhow::Result<Vec<Case>> {
    if files.is_empty() {
        return SHIPPED.iter().map(shipped).collect();
    }
    files
        .iter()
        .map(|file| {
            let named = |row: &&(&str, &str, f64)| Path::new(row.0) == file;
            SHIPPED
                .iter()
                .find(named)
                .map_or_else(|| from_file(file), shipped)
        })
        .collect()
}

fn shipped(row: &(&str, &str, f64)) -> anyhow::Result<Case> {
    let &(name, text, best_known) = row;
    Ok(Case {
        name: name.to_owned(),
        best_known: Some(best_known),
        file: name.into(),
        document: serde_json::from_str(text)?,
    })
}

fn from_file(file: &Path) -> anyhow::Result<Case> {
    let text = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    let refused = |refusal| Refused {
        file: file.to_owned(),
        refusal,
    };
    // Check the document's own faults first, before its planner is replaced.
    json::read(&text, &rules(), 1).map_err(refused)?;
    Ok(Case {
        name: file
            .file_stem()
            .unwrap_or(file.as_os_str())
            .to_string_lossy()
            .into_owned(),
        best_known: None,
        file: file.to_owned(),
        document: serde_json::from_slice(&text)?,
    })
}

fn rules() -> Rules {
    planner::rules(Limits::default())
}

impl Case {
    /// A generated document, under its own name.
    pub(super) fn drawn(document: Value) -> Self {
        let name = document["name"].as_str().unwrap_or_default();
        Self {
            name: name.to_owned(),
            best_known: None,
            file: name.into(),
            document,
        }
    }

    /// The scenario with its own planner.
    ///
    /// # Errors
    /// [`Refused`]; a document from a file was read before and is not.
    pub(super) fn as_it_is(&self) -> anyhow::Result<Scenario> {
        self.read(&self.document)
    }

    /// The scenario with `planner` in place of its own.
    ///
    /// # Errors
    /// [`Refused`], when it is not a valid planner for the scenario.
    pub(super) fn with(&self, planner: &Value) -> anyhow::Result<Scenario> {
        let mut document = self.document.clone();
        document["planner"] = planner.clone();
        self.read(&document)
    }

    /// The same, with `threats` beside the scenario's own.
    ///
    /// # Errors
    /// As for [`Case::with`].
    pub(super) fn with_threats(
        &self,
        planner: &Value,
        threats: Vec<Value>,
    ) -> anyhow::Result<Scenario> {
        let mut document = self.document.clone();
        document["planner"] = planner.clone();
        match &mut document["threats"] {
            Value::Array(own) => own.extend(threats),
            none => *none = threats.into(),
        }
        self.read(&document)
    }

    fn read(&self, document: &Value) -> anyhow::Result<Scenario> {
        let text = document.to_string();
        let read = json::read(text.as_bytes(), &rules(), 1).map_err(|refusal| Refused {
            file: self.file.clone(),
            refusal,
        });
        Ok(read?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_case_can_override_planner_settings_and_add_threats() {
        let cases = cases(&[PathBuf::from("paper-2")]).expect("a shipped one");
        assert_eq!(cases.len(), 1);
        let scenario = cases[0]
            .with(&json!({"algorithm": "abc", "waypoints": 4, "seed": 9}))
            .expect("no fault");
        assert_eq!(scenario.planner.algorithm, "abc");
        assert_eq!(scenario.planner.waypoints, 4);
        let refused = cases[0]
            .with(&json!({"waypoints": 0}))
            .expect_err("none is too few");
        assert!(refused.downcast_ref::<Refused>().is_some());
        let more = vec![json!({"kind": "cylinder", "center": {"x": 5, "y": 5}, "radius": 1})];
        let scenario = cases[0].with_threats(&json!({}), more).expect("no fault");
        assert_eq!(scenario.threats.len(), 7);
    }
}
