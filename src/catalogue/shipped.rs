//! The dataset shipped with the program. A new catalogue starts with it, so that the shipped scenario over real
//! ground can be planned at once. After that it is a dataset like any other.

use std::io::Write as _;

use super::{Catalogue, CatalogueError, Claim, Declaration, Expected, Kept, Naming, Room};

/// A ridge in Tennessee; scenarios/terrain/README.md gives its source.
const NAME: &str = "jacksboro";
const FILE: &[u8] = include_bytes!("../../scenarios/terrain/jacksboro.tif");

/// Add it to `catalogue` if its name is free; `now_ms` is milliseconds since 1970.
///
/// # Errors
/// [`CatalogueError::Unavailable`].
pub fn lay_down(catalogue: &dyn Catalogue, now_ms: i64) -> Result<(), CatalogueError> {
    let naming = Naming {
        name: NAME.to_owned(),
        by: Claim::default(),
        now_ms,
        expected: Expected::Nothing,
    };
    match lay(catalogue, &naming) {
        Ok(_) | Err(CatalogueError::Mounted { .. } | CatalogueError::Exists { .. }) => Ok(()),
        Err(error) => Err(error),
    }
}

fn lay(catalogue: &dyn Catalogue, naming: &Naming) -> Result<Kept, CatalogueError> {
    catalogue.permit(naming, Room::ENDLESS)?;
    let mut staged = catalogue.stage(FILE.len() as u64)?;
    if staged.write_all(FILE).is_err() {
        let failure = staged.failure();
        return Err(failure.expect("a write that fails says why"));
    }
    let checked = staged.check(None, Declaration::default())?;
    let (kept, _) = catalogue.keep(checked, naming, Room::ENDLESS)?;
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::Directories;

    #[test]
    fn a_new_catalogue_has_it_and_one_that_has_the_name_keeps_its_own() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let catalogue = Directories::new(directory.path().join("terrains"), None);
        lay_down(&catalogue, 7).expect("a place that can be written to");
        let entry = catalogue.entry(NAME).expect("it is there");
        assert_eq!(
            (entry.uploaded_ms, entry.bytes),
            (Some(7), FILE.len() as u64)
        );
        lay_down(&catalogue, 8).expect("nothing to do");
        assert_eq!(catalogue.entry(NAME).expect("it is there"), entry);
    }
}
