//! The whole way from a mesh to an atlas; alone knows every stage.
//!
//! 1. Condition the input into an oriented manifold surface ([`condition`](crate::mesh::condition())).
//! 2. Cut it into charts under the stretch limit, with as few and as short seams as can be found ([`cutting`](crate::cutting)).
//! 3. Lay the charts out: pack them, round to single precision, verify the rounded result exactly, mend what the check finds,
//!    and measure ([`layout`](crate::layout)).

mod analysis;
mod needs;
mod prepared;

use crate::atlas::Atlas;
use crate::cache::Run;
use crate::clock::Clock;
use crate::error::UnwrapError;
use crate::mesh::MeshInput;
use crate::progress::{Progress, Stage};
use crate::settings::Settings;

pub use analysis::Analysis;
use prepared::Prepared;

/// Unwraps a mesh: cuts it into charts, flattens them under the stretch limit, and packs them into the unit square, or several
/// [tiles](crate::settings::PackSettings::tiles) of that size, each chart into one.
///
/// Guaranteed for every result, checked exactly on the final single-precision values, and proven by its
/// [`Certificate`](crate::Certificate): each face whose vertices are all finite lies in exactly one chart; no triangle
/// is flipped or without area; no chart overlaps itself or another; charts keep the margin. With [`Settings::stack`]
/// charts of like parts lie on each other instead, exactly, and the triangles of a mirrored one are all turned over
/// there. Where this cannot be proven, the call fails.
///
/// Every chart has an L2 stretch within `settings.stretch_limit`, or is listed in the report (a single polygon, which is
/// never cut, may have more). Where [`Settings::limit_over`] is the atlas, a chart is held to [`Settings::chart_limit`]
/// instead, and the whole layout is within `settings.stretch_limit`, or a warning in the report says that it is not. The
/// result is the same, bit for bit, for any number of threads.
///
/// Not guaranteed: the fewest charts or the shortest seams possible.
///
/// The time is nearly proportional to the number of faces. The work is done on rayon's current thread pool.
///
/// # Errors
/// [`UnwrapError`]: the arrays are invalid, a setting is out of range, the charts cannot keep the margin at the size of the
/// texture, there is not enough memory, no layout could be proven, or the caller cancelled. Nothing is produced then.
pub fn unwrap(input: &MeshInput<'_>, settings: &Settings, progress: &Progress) -> Result<Atlas, UnwrapError> {
    progress.check()?;
    settings.validate()?;
    needs::require(input, 1, settings)?;
    let mut clock = Clock::new();
    progress.enter(Stage::Condition);
    let prepared = Prepared::new(input, &settings.conditioning(), progress)?;
    clock.lap("condition");
    prepared.unwrap(input, settings, clock, &Run::new(progress, None))
}
