//! Isomap, for comparison: classical scaling of geodesic distances.
//!
//! Tenenbaum, de Silva, Langford: A global geometric framework for nonlinear dimensionality reduction, Science
//! 290, 2000; with landmarks as in de Silva and Tenenbaum, Stanford technical report, 2004.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::geodesics::LandmarkDistances;
use crate::linalg::Mds;
use crate::mesh::VertexId;
use crate::progress::Cancelled;
use crate::progress::Progress;

/// Places every vertex in the plane of the first two coordinates of its landmarks' scaling, in units of
/// distance. Deterministic, O(kn).
pub(super) fn place_all(
    mds: &Mds,
    distances: &LandmarkDistances,
    progress: &Progress,
) -> Result<Vec<Point2<f64>>, Cancelled> {
    (0..distances.vertex_count())
        .into_par_iter()
        .map_init(
            || vec![0.0; distances.len()],
            |squared, v| {
                progress.check()?;
                for (l, d) in squared.iter_mut().enumerate() {
                    *d = distances.get(l, VertexId::new(v)).powi(2);
                }
                let mut place = [0.0; 2];
                mds.place(squared, &mut place);
                Ok(Point2::from(place))
            },
        )
        .collect()
}
