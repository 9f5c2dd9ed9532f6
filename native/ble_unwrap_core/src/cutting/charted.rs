//! How much of the charting is done.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::progress::{Progress, Stage};

/// Faces charted so far, from any thread, as a share of the stage [`Stage::Charts`].
pub(crate) struct Charted<'a> {
    progress: &'a Progress,
    total: f64,
    /// In thousandths of a face, so that parts of the work on a face count and no order of sums matters.
    done: AtomicU64,
}

impl<'a> Charted<'a> {
    pub(crate) fn new(progress: &'a Progress, faces: usize) -> Self {
        Self { progress, total: 1000.0 * faces.max(1) as f64, done: AtomicU64::new(0) }
    }

    /// Adds a share (0 to 1) of the work on some faces.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a positive count")]
    pub(crate) fn add(&self, faces: f64, share: f64) {
        let more = (1000.0 * faces * share) as u64;
        let done = self.done.fetch_add(more, Ordering::Relaxed) + more;
        self.progress.advance(Stage::Charts, done as f64 / self.total);
    }
}
