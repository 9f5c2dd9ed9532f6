//! Spectral analysis: how many dimensions the geodesic distances of a patch need.

use crate::geodesics::LandmarkDistances;
use crate::linalg::{EigenError, classical_mds};
use crate::progress::Cancelled;

/// Leading eigenvalues kept; iso-charts finds no use for more than ten.
const KEPT: usize = 10;

/// Classical scaling of the landmark distances of a patch (iso-charts, section 3.1).
#[derive(Clone, Debug)]
pub(crate) struct SpectralAnalysis {
    /// Leading eigenvalues of the centred matrix −½ J D² J, descending, at most ten, positive.
    pub eigenvalues: Vec<f64>,
    /// Number of dimensions the patch needs, at least 2 where there are two eigenvalues.
    pub dimension: usize,
    /// (λ₁ + λ₂) / Σ λ⁺, from 0 to 1: the share of the plane. Predicts how well the patch flattens: 1
    /// for a developable patch, 0.95 for a spherical cap of 70°, 0.79 for one of 100°.
    pub planarity: f64,
    coordinates: Vec<f64>,
}

impl SpectralAnalysis {
    /// Analyses the distances between the landmarks. Distances that are not finite (a patch is
    /// connected, so none should be) give no dimension and planarity 0. O(k³) for k landmarks.
    ///
    /// # Errors
    /// [`Cancelled::OutOfMemory`].
    pub(crate) fn new(distances: &LandmarkDistances) -> Result<Self, Cancelled> {
        let squared: Vec<f64> = distances.between_landmarks().into_iter().map(|d| d * d).collect();
        let mds = match classical_mds(&squared, distances.len(), KEPT) {
            Ok(mds) => mds,
            Err(EigenError::Cancelled(c)) => return Err(c),
            Err(_) => {
                return Ok(Self { eigenvalues: Vec::new(), dimension: 0, planarity: 0.0, coordinates: Vec::new() });
            }
        };
        let total = mds.eigenvalues.iter().filter(|l| **l > 0.0).sum();
        let eigenvalues = mds.eigenvalues[..mds.dimensions].to_vec();
        let dimension = dimension(&eigenvalues, total);
        Ok(Self { dimension, planarity: mds.energy_share(2), eigenvalues, coordinates: mds.coordinates })
    }

    /// Coordinate `d` of landmark number `l`.
    #[must_use]
    pub(crate) fn coordinate(&self, l: usize, d: usize) -> f64 {
        self.coordinates[l * self.eigenvalues.len() + d]
    }
}

/// The largest gap √λᵢ − √λᵢ₊₁ between 90 % and 99 % of the energy.
fn dimension(eigenvalues: &[f64], total: f64) -> usize {
    let enough = |share: f64| {
        let mut sum = 0.0;
        eigenvalues.iter().position(|l| {
            sum += l;
            sum >= share * total
        })
    };
    let last = eigenvalues.len();
    let (a, b) = (enough(0.90).map_or(last, |i| i + 1), enough(0.99).map_or(last, |i| i + 1));
    let root = |i: usize| eigenvalues.get(i).map_or(0.0, |l| l.sqrt());
    let mut best = (a, f64::NEG_INFINITY);
    for i in a.max(1)..b.max(a + 1) {
        let gap = root(i - 1) - root(i);
        if gap > best.1 {
            best = (i, gap);
        }
    }
    best.0.max(2).min(last)
}
