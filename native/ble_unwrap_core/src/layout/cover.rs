//! How much of a texture charts will cover.

use crate::charts::Chart;
use crate::packing::{self, PackError, PackSettings};
use crate::progress::{Cancelled, Progress};
use crate::settings::Settings;

use super::placed::{items, triangles};
use super::scale;

/// Texels along the longer side of the texture, and the margin, at which it is found out: whatever those of the settings are, a mesh is to have the
/// same seams.
const SIZE: u32 = 512;
const MARGIN: f64 = 1.0;

/// The share of a texture of the proportions of `settings` that charts cover once they are packed, about; `None` where they cannot be packed. Costs a
/// fraction of what packing does.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn cover(charts: &[&Chart], settings: &Settings, progress: &Progress) -> Result<Option<f64>, Cancelled> {
    let mut scaled: Vec<Chart> = charts.iter().copied().cloned().collect();
    scale::scale(&mut scaled, settings);
    let PackSettings { width, height, rotation, .. } = settings.packing;
    let longer = u64::from(width.max(height));
    // No more than the size itself.
    let side = |length: u32| u32::try_from(u64::from(length) * u64::from(SIZE) / longer).unwrap_or(SIZE).max(1);
    let packing = PackSettings {
        width: side(width),
        height: side(height),
        margin_texels: MARGIN,
        rotation,
        ..PackSettings::default()
    };
    let scaled: Vec<&Chart> = scaled.iter().collect();
    match packing::rough_cover(&items(&scaled, &triangles(&scaled)), &packing, progress) {
        Ok(share) => Ok((share > 0.0).then_some(share)),
        Err(PackError::Cancelled(cancelled)) => Err(cancelled),
        Err(_) => Ok(None),
    }
}
