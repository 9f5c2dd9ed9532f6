//! The quads of a layout that are to stay convex.

use crate::charts::Chart;
use crate::distortion;
use crate::mesh::{Quad, VertexId};

/// The halves that the quads of a chart have by their other diagonal, of those that are convex on the surface and in the
/// plane: rounding is to keep them.
pub(super) fn convex_halves(chart: &Chart) -> Vec<[VertexId; 3]> {
    let mesh = &chart.patch.mesh;
    let is_positive = |t: &[VertexId; 3]| distortion::signed_double_area(t.map(|v| chart.uv[v.index()])) > 0.0;
    Quad::all(mesh, &chart.patch.polygon)
        .map(|quad| (quad, quad.other_halves(mesh)))
        .filter(|(quad, halves)| halves.iter().all(is_positive) && quad.is_convex(mesh))
        .flat_map(|(_, halves)| halves)
        .collect()
}

/// What the user is told of quads that are left bent.
pub(super) fn warning(count: usize) -> String {
    let (quads, are) = if count == 1 { ("quad", "is") } else { ("quads", "are") };
    format!(
        "{count} {quads} that {are} convex on the surface {are} bent in UV: by the other diagonal, which a game engine or a \
         subdivision may take, a triangle there is flipped; triangulate such faces before"
    )
}
