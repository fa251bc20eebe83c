//! Notifies those who follow a plan of its changes.

use std::collections::HashMap;

use parking_lot::Mutex;
use tokio::sync::watch;

use crate::job::PlanId;

/// A watch channel for each plan that somebody follows.
#[derive(Default)]
pub(super) struct Changes(Mutex<Watches>);

#[derive(Default)]
struct Watches {
    ticks: HashMap<PlanId, watch::Sender<u64>>,
    /// Sweep when there are more watches than this.
    sweep_at: usize,
}

impl Changes {
    pub(super) fn subscribe(&self, id: PlanId) -> watch::Receiver<u64> {
        let mut watches = self.0.lock();
        if watches.ticks.len() > watches.sweep_at {
            watches.ticks.retain(|_, ticks| ticks.receiver_count() > 0);
            // Doubling keeps the sweeps' share of the work constant.
            watches.sweep_at = 2 * watches.ticks.len() + 64;
        }
        watches.ticks.entry(id).or_default().subscribe()
    }

    pub(super) fn tick(&self, id: PlanId) {
        let mut watches = self.0.lock();
        if let Some(ticks) = watches.ticks.get(&id) {
            if ticks.receiver_count() == 0 {
                watches.ticks.remove(&id);
            } else {
                ticks.send_modify(|ticks| *ticks += 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropped_followers_are_forgotten() {
        let changes = Changes::default();
        let kept = changes.subscribe(PlanId::from_u128(0));
        for id in 1..10_000 {
            drop(changes.subscribe(PlanId::from_u128(id)));
        }
        let watches = changes.0.lock();
        assert!(watches.ticks.len() < 200, "{} watches", watches.ticks.len());
        drop(watches);
        changes.tick(PlanId::from_u128(0));
        assert!(kept.has_changed().expect("its sender is kept"));
    }
}
