//! Opens the datasets where the configuration places them.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use tokio::time::timeout;

use super::backend;
use crate::catalogue::{Catalogue, CatalogueError, Directories, Mounted, Sharing, lay_down};
use crate::cli::config::data_dir;
use crate::config::Config;
use crate::store;
use crate::telemetry::Instruments;

/// How long the start waits for servers that keep the datasets.
const PATIENCE: Duration = Duration::from_secs(5);

/// Whether the place of the datasets is new, as it was before anything was put there. May block.
type IsNew = Box<dyn FnOnce() -> Result<bool, CatalogueError> + Send>;

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
    let opening = move || -> (Directories, IsNew) {
        if let Some(shelf) = shelf {
            let sharing = Sharing::new(shelf, data_dir.join("terrain-cache"), instruments);
            let catalogue = Directories::shared(sharing.clone(), mounted);
            (catalogue, Box::new(move || sharing.is_new()))
        } else {
            let uploads = data_dir.join("terrains");
            let is_new = !uploads.exists();
            let catalogue = Directories::new(uploads, mounted);
            (catalogue, Box::new(move || Ok(is_new)))
        }
    };
    let (catalogue, is_new) = tokio::task::spawn_blocking(opening).await?;
    let catalogue = Arc::new(catalogue);
    let beginning = tokio::task::spawn_blocking({
        let catalogue = catalogue.clone();
        move || {
            let is_new = is_new();
            catalogue.reach();
            if let Err(error) = begin(&catalogue, is_new) {
                tracing::warn!(%error, "the dataset that comes with the program cannot be kept");
            }
        }
    });
    if let Ok(begun) = timeout(PATIENCE, beginning).await {
        begun?;
    } else {
        tracing::warn!("reaching the datasets takes long; the service begins without them");
    }
    Ok(catalogue)
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
