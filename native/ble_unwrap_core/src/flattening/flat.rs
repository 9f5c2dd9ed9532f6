//! A patch in the plane, and whether its stretch is within a limit.

use nalgebra::Point2;

use crate::charts::{Chart, Patch};
use crate::distortion::{self, RestTriangle};
use crate::mesh::{FaceId, TriMesh};
use crate::stretch;

/// A chart is refused if one hundredth of its area is stretched by more than this: it would blur
/// visibly there although its L2, an average, is fine.
const MOST_P99_STRETCH: f64 = 4.0;

/// Height (the whole surface has area 1) up to which a face's lengths are rounding.
pub(crate) const NEGLIGIBLE: f64 = 1e-8;

/// A position in the plane for each vertex.
pub(crate) type Positions = Vec<Point2<f64>>;

/// A patch flattened without flips and without overlap.
pub(crate) struct Flat {
    pub(crate) uv: Positions,
    pub(crate) l2: f64,
}

impl Flat {
    pub(crate) fn into_chart(self, patch: Patch) -> Chart {
        Chart { patch, uv: self.uv, l2: self.l2 }
    }
}

/// L2 stretch of the surface as it is; of the thickened rest triangles where it has no area.
pub(crate) fn l2(patch: &Patch, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
    let true_l2 = stretch::l2_of_positions(&patch.mesh, uv, NEGLIGIBLE);
    if true_l2.is_nan() { stretch::l2_stretch(&patch.mesh, rest, uv) } else { true_l2 }
}

/// A chart of a map; the map again where it is over the limit.
pub(super) fn judge(
    patch: &Patch,
    rest: &[RestTriangle],
    uv: Positions,
    limit: Option<f64>,
) -> Result<Flat, Positions> {
    let l2 = l2(patch, rest, &uv);
    let good = limit.is_none_or(|limit| l2 <= limit && is_sharp(&patch.mesh, rest, &uv));
    if good { Ok(Flat { uv, l2 }) } else { Err(uv) }
}

/// Whether so little of a map is stretched so much that nobody sees it blurred.
fn is_sharp(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> bool {
    p99_stretch(mesh, rest, uv) <= MOST_P99_STRETCH
}

/// The stretch that 99 % of the area stays under, with the chart at the area of its surface.
fn p99_stretch(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
    let squared = |f: FaceId| {
        let corners = mesh.triangle(f).map(|v| uv[v.index()]);
        distortion::squared_stretch(&rest[f.index()].jacobian(corners))
    };
    let mut faces: Vec<(f64, f64)> = mesh.faces().map(|f| (squared(f), rest[f.index()].area())).collect();
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = faces.iter().map(|f| f.1).sum();
    let mut below = 0.0;
    let p99 = faces.iter().find(|f| {
        below += f.1;
        below >= 0.99 * total
    });
    p99.map_or(1.0, |f| (f.0 * stretch::plane_area(mesh, uv) / total).sqrt())
}
