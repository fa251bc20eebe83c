//! Removes expired plans, and datasets that nothing refers to any more.

use std::collections::BTreeSet;
use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use tokio::task::JoinHandle;

use crate::catalogue::Catalogue;
use crate::store::{Clock, SWEEP, Store};

/// Pause between two sweeps.
const PERIOD: Duration = Duration::from_secs(5);

/// Sweeps until dropped.
pub struct Sweeper(JoinHandle<()>);

impl Sweeper {
    /// Start sweeping.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    #[must_use]
    pub fn start(store: Arc<dyn Store>, catalogue: Arc<dyn Catalogue>, clock: Clock) -> Self {
        Self(tokio::spawn(sweep(store, catalogue, clock)))
    }
}

impl Drop for Sweeper {
    fn drop(&mut self) {
        self.0.abort();
    }
}

async fn sweep(store: Arc<dyn Store>, catalogue: Arc<dyn Catalogue>, clock: Clock) {
    let mut sound = true;
    loop {
        tokio::time::sleep(PERIOD).await;
        loop {
            match store.sweep(clock()).await {
                Ok(SWEEP) => continue,
                Ok(_) => sound = true,
                Err(error) if sound => {
                    tracing::warn!(%error, "plans past their time could not be removed; trying again");
                    sound = false;
                }
                Err(_) => {}
            }
            break;
        }
        if let Err(error) = sweep_datasets(&*store, &catalogue).await {
            tracing::debug!(%error, "datasets were not swept; trying again");
        }
    }
}

/// Remove the content that no name refers to and no plan was planned over, unless it was used lately.
///
/// # Errors
/// When the store or the catalogue cannot be reached.
pub async fn sweep_datasets(
    store: &dyn Store,
    catalogue: &Arc<dyn Catalogue>,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    let asked = catalogue.clone();
    if !tokio::task::spawn_blocking(move || asked.has_unnamed()).await? {
        return Ok(());
    }
    let uses = store.datasets_in_use().await?;
    let used: BTreeSet<String> = uses.into_iter().map(|used| used.sha256).collect();
    let asked = catalogue.clone();
    tokio::task::spawn_blocking(move || asked.sweep(&used)).await??;
    Ok(())
}
