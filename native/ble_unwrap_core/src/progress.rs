//! One shared object by which another thread watches a computation and asks it to stop.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::memory::{self, OutOfMemory};

/// The computation was stopped before its end, and nothing was produced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Cancelled {
    /// The caller asked it to stop, by [`Progress::cancel`].
    #[error("cancelled")]
    OnRequest,
    /// There was not enough memory to go on.
    #[error(transparent)]
    OutOfMemory(OutOfMemory),
}

impl Cancelled {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::OnRequest => ErrorKind::Cancelled,
            Self::OutOfMemory(_) => ErrorKind::OutOfMemory,
        }
    }
}

/// What the computation is doing. The stages are listed in the order in which they happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
#[repr(u8)]
pub enum Stage {
    /// Not started.
    Waiting = 0,
    /// Checking the input and building the manifold mesh.
    Condition,
    /// Cutting the surface into charts and flattening them. This stage takes by far the longest.
    Charts,
    /// Placing the charts in the unit square.
    Pack,
    /// Checking the result exactly and making the report.
    Verify,
    /// Finished.
    Done,
}

impl Stage {
    const ALL: [Self; 6] = [Self::Waiting, Self::Condition, Self::Charts, Self::Pack, Self::Verify, Self::Done];

    /// A word for a status line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Condition => "reading mesh",
            Self::Charts => "making charts",
            Self::Pack => "packing",
            Self::Verify => "checking",
            Self::Done => "done",
        }
    }

    /// Share of the whole done when the stage begins; measured on meshes of 10,000 to 100,000 faces.
    fn begin(self) -> f64 {
        match self {
            Self::Waiting | Self::Condition => 0.0,
            Self::Charts => 0.02,
            Self::Pack => 0.85,
            Self::Verify => 0.97,
            Self::Done => 1.0,
        }
    }
}

/// The cancel flag and the progress of one computation. Share it by reference or in an `Arc`; every method may be called
/// from any thread at any time.
///
/// [`Progress::fraction`] never falls. Cancelling is cooperative: each thread of the computation looks at the flag at least
/// once in every few milliseconds of work.
#[derive(Debug)]
pub struct Progress {
    cancelled: AtomicBool,
    /// Whether the computation has seen that it is to stop.
    stopping: AtomicBool,
    /// Refused allocations in this process when it began: one more ends it.
    refusals: AtomicU64,
    stage: AtomicU8,
    /// The fraction as the bits of a non-negative f64, whose order is that of the integers.
    fraction: AtomicU64,
}

impl Default for Progress {
    fn default() -> Self {
        Self {
            cancelled: AtomicBool::new(false),
            stopping: AtomicBool::new(false),
            refusals: AtomicU64::new(memory::refusals()),
            stage: AtomicU8::new(Stage::Waiting as u8),
            fraction: AtomicU64::new(0.0f64.to_bits()),
        }
    }
}

impl Progress {
    /// A computation that has not started.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Says that the computation starts now, so that allocations that were refused to other computations before do not end
    /// it.
    pub fn begin(&self) {
        self.refusals.store(memory::refusals(), Ordering::Relaxed);
    }

    /// Asks the computation to stop. It returns [`Cancelled`] soon after.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether [`Progress::cancel`] was called.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Fails once the computation has been cancelled. The stages call `progress.check()?` in their loops.
    ///
    /// # Errors
    /// [`Cancelled::OnRequest`] after [`Progress::cancel`], [`Cancelled::OutOfMemory`] after
    /// [`note_refusal`](memory::note_refusal).
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() {
            self.stopping.store(true, Ordering::Relaxed);
            return Err(Cancelled::OnRequest);
        }
        memory::none_since(self.refusals.load(Ordering::Relaxed)).map_err(Cancelled::OutOfMemory)
    }

    /// Whether a check has failed because of [`Progress::cancel`]. From then on the computation can only end with
    /// [`Cancelled`]. It does so once it has freed its memory, which takes a while where that is millions of small arrays.
    #[must_use]
    pub fn is_stopping(&self) -> bool {
        self.stopping.load(Ordering::Relaxed)
    }

    /// The current stage.
    #[must_use]
    pub fn stage(&self) -> Stage {
        Stage::ALL[usize::from(self.stage.load(Ordering::Relaxed)).min(Stage::ALL.len() - 1)]
    }

    /// Share of the work done, from 0 to 1; never falls.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        f64::from_bits(self.fraction.load(Ordering::Relaxed))
    }

    /// Says that a stage begins. The computation calls this for its own stages; a host may call it to report
    /// [`Stage::Done`].
    pub fn enter(&self, stage: Stage) {
        self.stage.store(stage as u8, Ordering::Relaxed);
        self.raise(stage.begin());
    }

    /// Reports that `share` (0 to 1) of `stage` is done. For the stages.
    pub(crate) fn advance(&self, stage: Stage, share: f64) {
        let end = Stage::ALL[(stage as usize + 1).min(Stage::ALL.len() - 1)].begin();
        self.raise(stage.begin() + (end - stage.begin()) * share.clamp(0.0, 1.0));
    }

    fn raise(&self, fraction: f64) {
        self.fraction.fetch_max(fraction.to_bits(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fraction_rises_from_zero_to_one() {
        let p = Progress::new();
        let mut last = p.fraction();
        assert_eq!(last, 0.0);
        for stage in Stage::ALL {
            p.enter(stage);
            for share in [0.0, 0.7, 0.3, 1.0] {
                p.advance(stage, share);
                assert!(p.fraction() >= last);
                last = p.fraction();
            }
        }
        assert_eq!(last, 1.0);
        assert_eq!(p.stage(), Stage::Done);
    }

    #[test]
    fn check_fails_after_cancel() {
        let p = Progress::new();
        assert_eq!(p.check(), Ok(()));
        p.cancel();
        assert!(!p.is_stopping(), "nobody has looked yet");
        assert_eq!(p.check(), Err(Cancelled::OnRequest));
        assert!(p.is_stopping());
    }
}
