//! The whole way from a mesh to an atlas; alone knows every stage.
//!
//! 1. Condition the input into an oriented manifold surface ([`condition`](crate::mesh::condition())).
//! 2. Cut it into charts under the stretch limit, and join charts that were cut needlessly.
//! 3. Pack the charts and round to single precision.
//! 4. Verify the rounded result exactly and measure it.

mod analysis;
mod budget;
mod carry;
mod charting;
mod component;
mod darts;
mod finish;
mod flatten;
mod memo;
mod merge;
mod needs;
mod polygon;
mod prolong;
mod recut;
mod relief;
mod ribbons;
mod rigid;
mod rungs;
mod sew;
mod steps;
mod tally;

use std::time::Instant;

use crate::error::UnwrapError;
use crate::mesh::MeshInput;
use crate::progress::{Progress, Stage};
use crate::report::Report;
use crate::settings::Settings;

pub use analysis::Analysis;
use analysis::Prepared;
use memo::Run;
pub use rungs::{Rung, Rungs};
pub(crate) use steps::Steps;

/// A UV for every corner of the input, and what is known about it.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// One UV a corner, in [0, 1]²; (0, 0) for the corners of unmapped faces.
    pub uv: Vec<[f32; 2]>,
    /// Chart of each input face, from 0; −1 for unmapped faces.
    pub chart: Vec<i32>,
    /// Measures of the result.
    pub report: Report,
}

/// Unwraps a mesh: cuts it into charts, flattens them under the stretch limit, packs them.
///
/// Guaranteed for every result, and checked exactly on the final single-precision values: each face
/// whose vertices are finite lies in exactly one chart; no triangle is flipped or without area; no
/// chart overlaps itself or another; charts keep the margin. Every chart has an L2 stretch within
/// `settings.stretch_limit` or is listed in the report (a single polygon may not flatten under it); where that limit is
/// over the atlas, this holds for [`Settings::chart_limit`], and the whole is within the limit or the report warns. The
/// result is the same, bit for bit, for any number of threads.
///
/// Not guaranteed: the fewest charts or the shortest seams possible.
///
/// Near-linear in the number of faces. Runs on rayon's current thread pool.
///
/// # Errors
/// [`UnwrapError`]: invalid arrays, a setting out of range, charts that cannot keep the margin at the
/// texture size, not enough memory, or cancelled. Nothing is produced then.
pub fn unwrap(input: &MeshInput<'_>, settings: &Settings, progress: &Progress) -> Result<Atlas, UnwrapError> {
    progress.check()?;
    settings.validate()?;
    needs::require(input, 1, settings)?;
    let mut clock = Clock::new();
    progress.enter(Stage::Condition);
    let prepared = Prepared::new(input, settings.weld, progress)?;
    clock.lap("condition");
    prepared.unwrap(input, settings, clock, &Run::new(progress, None))
}

/// Seconds of each stage, for the report; nothing is decided by them.
pub(crate) struct Clock {
    last: Instant,
    laps: Vec<(&'static str, f64)>,
}

impl Clock {
    pub(crate) fn new() -> Self {
        Self { last: Instant::now(), laps: Vec::new() }
    }

    pub(crate) fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        self.laps.push((name, (now - self.last).as_secs_f64()));
        self.last = now;
    }

    pub(crate) fn into_laps(self) -> Vec<(&'static str, f64)> {
        self.laps
    }
}
