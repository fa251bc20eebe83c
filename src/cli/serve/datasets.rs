//! Opens the datasets where the configuration places them.

use std::sync::Arc;

use anyhow::Context as _;

use super::{backend, data_dir};
use crate::catalogue::{Catalogue, CatalogueError, Directories, Mounted, Sharing, lay_down};
use crate::config::Config;
use crate::store;
use crate::telemetry::Instruments;

/// The datasets of the data directory, or of the store that nodes share, and the operator's own. A new place gets the
/// dataset that comes with the program.
///
/// # Errors
/// When the configuration names no place, or the operator's directory cannot be read.
pub(super) async fn open(
    config: &Config,
    instruments: &Arc<Instruments>,
) -> anyhow::Result<Arc<dyn Catalogue>> {
    let mounted = config.terrain_dir.as_deref().map(Mounted::open);
    let mounted = mounted.transpose().context("terrain_dir")?;
    let data_dir = data_dir(config)?;
    let shelf = backend::shelf(config);
    let instruments = instruments.clone();
    let opening = move || -> Arc<dyn Catalogue> {
        let (catalogue, is_new) = if let Some(shelf) = shelf {
            let sharing = Sharing::new(shelf, data_dir.join("terrain-cache"), instruments);
            let is_new = sharing.is_new();
            (Directories::shared(sharing, mounted), is_new)
        } else {
            let uploads = data_dir.join("terrains");
            let is_new = !uploads.exists();
            (Directories::new(uploads, mounted), Ok(is_new))
        };
        if let Err(error) = begin(&catalogue, is_new) {
            tracing::warn!(%error, "the dataset that comes with the program cannot be kept");
        }
        Arc::new(catalogue)
    };
    Ok(tokio::task::spawn_blocking(opening).await?)
}

fn begin(
    catalogue: &Directories,
    is_new: Result<bool, CatalogueError>,
) -> Result<(), CatalogueError> {
    if is_new? {
        lay_down(catalogue, store::wall_clock()())?;
    }
    Ok(())
}
