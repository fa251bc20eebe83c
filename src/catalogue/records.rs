//! The stored records of names and contents, and the rules for following and changing a name.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::content::{Checked, Declaration};
use super::{CatalogueError, Entry, Expected, Kept, Naming, Room};
use crate::terrain::DatasetError;
use crate::terrain::dem::{Metadata, Survey};

/// The stored record of a name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Name {
    pub(super) sha256: String,
    pub(super) uploaded_ms: i64,
    pub(super) owner: Option<String>,
}

impl Name {
    /// Whether a name that refers to `before` may be assigned to other content or removed.
    fn permit(before: Option<&Self>, naming: &Naming) -> Result<(), CatalogueError> {
        let name = naming.name.clone();
        match (&naming.expected, before) {
            (Expected::Nothing, Some(_)) => return Err(CatalogueError::Exists { name }),
            (Expected::OneOf(_), None) => return Err(CatalogueError::Absent { name }),
            (Expected::OneOf(sums), Some(before))
                if !sums.iter().any(|sum| *sum == before.sha256 || sum == "*") =>
            {
                return Err(CatalogueError::Changed { name });
            }
            (Expected::NoneOf(sums), Some(before)) if sums.contains(&before.sha256) => {
                return Err(CatalogueError::Changed { name });
            }
            _ => {}
        }
        if before.is_some_and(|before| !naming.by.covers(before.owner.as_ref())) {
            return Err(CatalogueError::Owned { name });
        }
        Ok(())
    }

    /// What a name refers to that may be assigned to content, where there may be no more names than `room` has.
    pub(super) fn assignable<'n>(
        names: &'n BTreeMap<String, Self>,
        naming: &Naming,
        room: Room,
    ) -> Result<Option<&'n Self>, CatalogueError> {
        let before = names.get(&naming.name);
        Self::permit(before, naming)?;
        if before.is_none() {
            room.admit_name(names.len())?;
        }
        Ok(before)
    }

    /// The checksum of the requested content: `sha256` where it is given, otherwise that of the name's content.
    pub(super) fn wanted<'a>(
        names: &'a BTreeMap<String, Self>,
        name: &str,
        sha256: Option<&'a str>,
    ) -> Result<&'a str, DatasetError> {
        let named = || names.get(name).map(|name| &*name.sha256);
        sha256.or_else(named).ok_or_else(|| Self::unknown(names))
    }

    /// Why there is no record of the content `wanted` under `name`. While it may be one of the records that cannot be
    /// read (`may_be_unread`), nobody knows whether it has gone.
    pub(super) fn missing(
        names: &BTreeMap<String, Self>,
        name: &str,
        wanted: &str,
        may_be_unread: bool,
    ) -> DatasetError {
        match names.get(name) {
            Some(Self { sha256, .. }) if sha256 == wanted || may_be_unread => {
                DatasetError::Unavailable(format!("nothing is known of the content {wanted}"))
            }
            Some(Self { sha256, .. }) => DatasetError::Replaced {
                sha256: sha256.clone(),
            },
            None => Self::unknown(names),
        }
    }

    fn unknown(names: &BTreeMap<String, Self>) -> DatasetError {
        DatasetError::Unknown {
            names: names.keys().cloned().collect(),
        }
    }

    /// The result of assigning a name that refers to `before` to `file`, and its record then.
    pub(super) fn assigned(before: Option<&Self>, file: &Checked, naming: &Naming) -> (Kept, Self) {
        let record = Self {
            sha256: file.sha256.clone(),
            uploaded_ms: naming.now_ms,
            owner: naming.by.owner.clone(),
        };
        match before {
            None => (Kept::Created, record),
            Some(before) if before.sha256 == file.sha256 => (Kept::Unchanged, before.clone()),
            Some(_) => (Kept::Replaced, record),
        }
    }

    /// What is known about the dataset of this `name`, whose content has so many `bytes`.
    pub(super) fn entry(self, name: &str, bytes: u64, metadata: Metadata, survey: Survey) -> Entry {
        Entry {
            name: name.to_owned(),
            sha256: Some(self.sha256),
            bytes,
            metadata,
            survey: Some(survey),
            uploaded_ms: Some(self.uploaded_ms),
            owner: self.owner,
        }
    }

    /// The checksum of the content of a name, if the name may be removed.
    pub(super) fn removable<'a>(
        before: Option<&'a Self>,
        naming: &Naming,
    ) -> Result<&'a str, CatalogueError> {
        let Some(record) = before else {
            let name = naming.name.clone();
            return Err(CatalogueError::Unknown { name });
        };
        Self::permit(before, naming)?;
        Ok(&record.sha256)
    }
}

/// The stored record of a content.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Content {
    pub(super) bytes: u64,
    #[serde(default)]
    pub(super) declared: Declaration,
    /// `None` when no sample has data.
    min: Option<f64>,
    max: Option<f64>,
    no_data_share: f64,
}

impl Content {
    pub(super) fn of(file: &Checked) -> Self {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        Self {
            bytes: file.staged.bytes(),
            declared: file.declaration.clone(),
            min: finite(file.survey.min),
            max: finite(file.survey.max),
            no_data_share: file.survey.no_data_share,
        }
    }

    pub(super) fn survey(&self) -> Survey {
        Survey {
            min: self.min.unwrap_or(f64::INFINITY),
            max: self.max.unwrap_or(f64::NEG_INFINITY),
            no_data_share: self.no_data_share,
        }
    }
}
