//! How each step in a plan's life changes its record. Every step is checked against the transition table.

use super::state::{Refused, Status};
use super::{Event, Failure, Plan, Submission};
use crate::digest::sha256_hex;
use crate::export::document::{Convergence, Origin, Timing};

impl Plan {
    /// The record of a plan that has just been accepted at `queue_position`.
    #[must_use]
    pub fn accepted(submission: &Submission, queue_position: u64) -> Self {
        Self {
            id: submission.id,
            owner: submission.owner.clone(),
            name: submission.name.clone(),
            status: Status::Queued,
            stop_reason: None,
            feasible: None,
            best_cost: None,
            progress: 0.0,
            iteration: 0,
            iterations: submission.iterations,
            evaluations: 0,
            queue_position: Some(queue_position),
            algorithm: submission.algorithm.clone(),
            seed: submission.seed,
            created_ms: submission.created_ms,
            started_ms: None,
            finished_ms: None,
            expires_ms: None,
            cancel_requested: false,
            error: None,
            revision: 1,
        }
    }

    /// This record as it was on acceptance at `queue_position`.
    #[must_use]
    pub fn as_accepted(self, queue_position: u64) -> Self {
        Self {
            status: Status::Queued,
            stop_reason: None,
            feasible: None,
            best_cost: None,
            progress: 0.0,
            iteration: 0,
            evaluations: 0,
            queue_position: Some(queue_position),
            started_ms: None,
            finished_ms: None,
            expires_ms: None,
            cancel_requested: false,
            error: None,
            revision: 1,
            ..self
        }
    }

    /// A worker starts on it: queued -> running.
    ///
    /// # Errors
    /// [`Refused`] from any other status.
    pub fn start(&mut self, now_ms: i64) -> Result<(), Refused> {
        self.become_status(Status::Running)?;
        self.started_ms = Some(now_ms);
        self.queue_position = None;
        Ok(())
    }

    /// Its worker is gone: running -> queued. The next run begins again from the seed, so nothing of this one remains.
    ///
    /// # Errors
    /// [`Refused`] from any other status.
    pub fn requeue(&mut self) -> Result<(), Refused> {
        self.become_status(Status::Queued)?;
        self.started_ms = None;
        self.feasible = None;
        self.best_cost = None;
        self.progress = 0.0;
        self.iteration = 0;
        self.evaluations = 0;
        Ok(())
    }

    /// Its end has been requested, and a worker will carry it out.
    pub fn request_cancel(&mut self) {
        self.cancel_requested = true;
        self.revision += 1;
    }

    /// It ends on request without a result: no worker has it, or the worker that had it is gone.
    ///
    /// # Errors
    /// [`Refused`] when it had already ended.
    pub fn cancel(&mut self, now_ms: i64) -> Result<(), Refused> {
        self.end(Status::Cancelled, now_ms)?;
        self.cancel_requested = true;
        Ok(())
    }

    /// Its run failed.
    ///
    /// # Errors
    /// [`Refused`] when it was not running.
    pub fn fail(&mut self, failure: Failure, now_ms: i64) -> Result<(), Refused> {
        self.end(Status::Failed, now_ms)?;
        self.error = Some(failure);
        Ok(())
    }

    /// It ends as `status`, which must be final.
    ///
    /// # Errors
    /// [`Refused`] when the table does not allow it, or when `status` is not final.
    pub fn end(&mut self, status: Status, now_ms: i64) -> Result<(), Refused> {
        if !status.is_final() {
            return Err(Refused {
                from: self.status,
                to: status,
            });
        }
        self.become_status(status)?;
        self.finished_ms = Some(now_ms);
        self.queue_position = None;
        Ok(())
    }

    /// Its run has reported these events: progress moves to the last convergence point among them, if any.
    pub fn advance(&mut self, told: &[Event]) {
        let point = told.iter().rev().find_map(|event| match event {
            Event::Convergence(point) => Some(point),
            _ => None,
        });
        if let Some(point) = point {
            self.reach(point);
        }
    }

    fn reach(&mut self, point: &Convergence) {
        self.iteration = point.iteration as u64;
        self.evaluations = point.evaluations;
        self.best_cost = point.best_cost;
        self.feasible = Some(point.best_cost.is_some());
        self.progress = if self.iterations == 0 {
            1.0
        } else {
            (self.iteration as f64 / self.iterations as f64).min(1.0)
        };
        self.revision += 1;
    }

    /// The origin recorded in the result of its run; `scenario` is the accepted document.
    #[must_use]
    pub fn origin(&self, scenario: &str, run_ms: f64) -> Origin {
        let started_ms = self.started_ms.unwrap_or(self.created_ms);
        Origin {
            plan_id: Some(self.id),
            algorithm: self.algorithm.clone(),
            seed: self.seed,
            scenario_sha256: sha256_hex(scenario.as_bytes()),
            timing: Timing {
                // The wall clock may have been set back between the two.
                queued_ms: (started_ms - self.created_ms).max(0) as f64,
                run_ms,
            },
        }
    }

    fn become_status(&mut self, next: Status) -> Result<(), Refused> {
        if !self.status.may_become(next) {
            return Err(Refused {
                from: self.status,
                to: next,
            });
        }
        self.status = next;
        self.revision += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accepted() -> Plan {
        Plan::accepted(&Submission::example(), 3)
    }

    fn point(iteration: usize, best_cost: Option<f64>) -> Event {
        Event::Convergence(Convergence {
            iteration,
            evaluations: 40,
            elapsed_ms: 1.0,
            best_cost,
            best_violation: 0.0,
            mean_cost: 9.0,
            feasible_fraction: 0.5,
        })
    }

    #[test]
    fn a_requeued_plan_is_as_it_was_accepted_but_for_its_revision() {
        let mut plan = accepted();
        plan.start(2_000).expect("queued may run");
        plan.advance(&[
            point(20, None),
            point(50, Some(470.0)),
            Event::End(Status::Failed),
        ]);
        assert_eq!((plan.feasible, plan.best_cost), (Some(true), Some(470.0)));
        assert!((plan.progress - 0.25).abs() < 1e-12);
        plan.requeue().expect("running may be queued");
        let fresh = accepted();
        let again = Plan {
            revision: fresh.revision,
            queue_position: fresh.queue_position,
            ..plan.clone()
        };
        assert_eq!(again, fresh);
        assert_eq!(plan.revision, 4);
    }

    #[test]
    fn whatever_happened_it_is_known_how_a_plan_was_accepted() {
        let mut plan = accepted();
        plan.start(2_000).expect("queued may run");
        plan.advance(&[point(50, Some(470.0))]);
        plan.request_cancel();
        plan.end(Status::Cancelled, 3_000)
            .expect("running may be cancelled");
        plan.stop_reason = Some("cancelled".to_owned());
        plan.expires_ms = Some(4_000);
        assert_eq!(plan.as_accepted(3), accepted());
        let mut failed = accepted();
        failed.start(2_000).expect("queued may run");
        let failure = Failure {
            kind: "worker-lost".to_owned(),
            detail: String::new(),
        };
        failed.fail(failure, 3_000).expect("running may fail");
        assert_eq!(failed.as_accepted(3), accepted());
    }

    #[test]
    fn progress_of_a_plan_without_iterations_is_whole() {
        let mut plan = Plan {
            iterations: 0,
            ..accepted()
        };
        plan.start(2_000).expect("queued may run");
        plan.advance(&[point(0, None)]);
        assert!((plan.progress - 1.0).abs() < 1e-12);
        assert_eq!(plan.feasible, Some(false));
    }

    #[test]
    fn a_refused_step_changes_nothing() {
        let mut plan = accepted();
        assert_eq!(
            plan.end(Status::Succeeded, 5),
            Err(Refused {
                from: Status::Queued,
                to: Status::Succeeded
            })
        );
        plan.start(2_000).expect("queued may run");
        let before = plan.clone();
        assert!(plan.start(3_000).is_err());
        assert!(plan.end(Status::Queued, 3_000).is_err());
        assert_eq!(plan, before);
        plan.cancel(4_000).expect("running may be cancelled");
        let ended = plan.clone();
        assert!(plan.cancel(5_000).is_err());
        assert!(plan.requeue().is_err());
        assert_eq!(plan, ended);
        assert!(plan.cancel_requested && plan.finished_ms == Some(4_000));
    }
}
