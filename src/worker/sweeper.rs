//! Removes expired plans, and datasets that nothing refers to any more.

use std::collections::BTreeSet;
use std::error::Error;
use std::fmt::Display;
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
    let [mut plans, mut datasets] = [Sound(true); 2];
    loop {
        tokio::time::sleep(PERIOD).await;
        let swept = loop {
            match store.sweep(clock()).await {
                Ok(SWEEP) => {}
                swept => break swept.err(),
            }
        };
        plans.note(swept.as_ref(), "plans past their time could not be removed");
        let swept = sweep_datasets(&*store, &catalogue).await.err();
        datasets.note(
            swept.as_ref(),
            "datasets that nothing refers to were not looked for",
        );
    }
}

/// Whether something worked when it was last tried.
#[derive(Clone, Copy)]
struct Sound(bool);

impl Sound {
    /// Tell of the first of several failures.
    fn note(&mut self, failure: Option<&impl Display>, what: &str) {
        if let Some(error) = failure
            && self.0
        {
            tracing::warn!(%error, "{what}; trying again");
        }
        self.0 = failure.is_none();
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
    let uses = store.all_datasets_in_use().await?;
    let used: BTreeSet<String> = uses.into_iter().map(|used| used.sha256).collect();
    let asked = catalogue.clone();
    tokio::task::spawn_blocking(move || asked.sweep(&used)).await??;
    Ok(())
}
