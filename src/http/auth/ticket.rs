//! Tickets: what a browser's `EventSource`, which can send no header, follows one plan with.
//!
//! Kept in memory only: they live for minutes, and a reader whose ticket is gone takes a new one.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use tokio::time::Instant;

use super::fresh;
use super::keys::{Digest, digest};
use crate::job::PlanId;

/// Tickets of one key, or of all who have none; a further one takes the place of the oldest.
const MOST: usize = 10_000;

/// The tickets in force, by their sums.
#[derive(Debug, Default)]
pub(super) struct Tickets(Mutex<HashMap<Digest, Ticket>>);

#[derive(Debug, Clone, Copy)]
struct Ticket {
    plan: PlanId,
    holder: Option<Digest>,
    until: Instant,
}

/// The sum of the key that a ticket was issued for; `None` where nobody had one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Holder(pub(super) Option<Digest>);

impl Tickets {
    /// A ticket for the plan's events, in the place of the key `holder`.
    pub(super) fn issue(
        &self,
        plan: PlanId,
        holder: Option<Digest>,
        now: Instant,
        life: Duration,
    ) -> Result<String, getrandom::Error> {
        let text = fresh::random_hex()?;
        let ticket = Ticket {
            plan,
            holder,
            until: now + life,
        };
        let mut tickets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        tickets.retain(|_, ticket| ticket.until > now);
        let own = tickets.iter().filter(|(_, other)| other.holder == holder);
        if own.clone().count() >= MOST {
            let oldest = own.min_by_key(|(_, other)| other.until);
            if let Some(oldest) = oldest.map(|(sum, _)| *sum) {
                tickets.remove(&oldest);
            }
        }
        tickets.insert(digest(text.as_bytes()), ticket);
        Ok(text)
    }

    /// Whose ticket for the plan `text` is, if it is one.
    pub(super) fn holder(&self, text: &str, plan: PlanId, now: Instant) -> Option<Holder> {
        let tickets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let ticket = tickets.get(&digest(text.as_bytes()))?;
        (ticket.plan == plan && ticket.until > now).then_some(Holder(ticket.holder))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::new_id;

    const LIFE: Duration = Duration::from_secs(600);

    #[test]
    fn a_ticket_is_for_one_plan_and_some_time() {
        let tickets = Tickets::default();
        let (plan, now, key) = (new_id(0), Instant::now(), Some([1; 32]));
        let ticket = tickets.issue(plan, key, now, LIFE).expect("random");
        assert_eq!(tickets.holder(&ticket, plan, now), Some(Holder(key)));
        let later = now + LIFE - Duration::from_millis(1);
        assert_eq!(
            tickets.holder(&ticket, plan, later),
            Some(Holder(key)),
            "again"
        );
        assert_eq!(tickets.holder(&ticket, new_id(0), now), None);
        assert_eq!(tickets.holder(&ticket, plan, now + LIFE), None);
        assert_eq!(tickets.holder("", plan, now), None);
    }

    #[test]
    fn a_key_has_so_many_and_no_more() {
        let tickets = Tickets::default();
        let (plan, begin) = (new_id(0), Instant::now());
        let issue = |key: u8, n: usize| {
            let now = begin + Duration::from_micros(n as u64);
            tickets
                .issue(plan, Some([key; 32]), now, LIFE)
                .expect("random")
        };
        let other = issue(2, 0);
        let first = issue(1, 1);
        let second = issue(1, 2);
        for n in 2..=MOST {
            issue(1, n + 1);
        }
        let holds = |text: &str| tickets.holder(text, plan, begin).is_some();
        assert!(holds(&other) && holds(&second) && !holds(&first));
    }
}
