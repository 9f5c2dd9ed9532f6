//! Charts copied to where the surface is the same.

use nalgebra::Point2;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{self, Polished, Rung, Rungs};
use crate::mesh::{FaceId, HalfedgeId, Likeness, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::state::Cutting;

/// A copy lies just as its original if that stretches it by no more than this above; else it is minimised from there. Quads that are
/// not flat are stretched otherwise by their other diagonal.
const MOST_RISE: f64 = 1e-2;

/// A chart of a cutting on another mesh that is like its own, or on the other half of its own. `None` where that is no chart under the limit.
pub(super) fn copied(
    cutting: &Cutting<'_>,
    chart: &Chart,
    there: &Patch,
    likeness: &Likeness,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Option<Chart>, Cancelled> {
    let (mesh, polygon) = (&there.mesh, &there.polygon);
    let sides = chart.patch.faces.iter().flat_map(|f| f.halfedges()).map(|h| likeness.image(h));
    let mut polygons: Vec<u32> = sides.filter(|h| !h.is_none()).map(|h| polygon[h.face().index()]).collect();
    polygons.sort_unstable();
    polygons.dedup();
    let faces = polygons.iter().flat_map(|&p| faces_of(polygon, p)).collect();
    let is_cut = |h: HalfedgeId| !there.is_diagonal(h) && cutting.is_seam(likeness.source(h));
    let patch = Patch::cut_out(mesh, polygon, faces, is_cut);
    let mut uv = vec![Point2::origin(); patch.mesh.vertex_count()];
    for (f, corners) in patch.faces.iter().zip(patch.mesh.triangles()) {
        for (h, v) in f.halfedges().into_iter().zip(corners) {
            // A triangle whose polygon has no side from a corner of it is glued to itself, and has no likeness.
            let Some(side) = side_from(mesh, h, |h| there.is_diagonal(h)) else { return Ok(None) };
            let source = likeness.source(side);
            uv[v.index()] = if likeness.is_mirrored {
                // A side runs the other way there. Mirrored once more, the chart is not turned over.
                let p = cutting.end(source);
                Point2::new(-p.x, p.y)
            } else {
                cutting.start(source)
            };
        }
    }
    let as_good = Settings { stretch_limit: settings.chart_limit().min(chart.l2 + MOST_RISE), ..settings.clone() };
    let flat = match flattening::lying(&patch, uv.clone(), &as_good) {
        Polished::Flat(flat) => Polished::Flat(flat),
        _ => flattening::polish(&patch, &uv, Rung::Prolonged, settings, rungs, run)?,
    };
    Ok(match flat {
        Polished::Flat(flat) => Some(flat.into_chart(patch)),
        Polished::Refused | Polished::BadStart => None,
    })
}

/// The faces of a polygon, which are beside each other.
fn faces_of(polygon: &[u32], p: u32) -> impl Iterator<Item = FaceId> + use<> {
    let first = polygon.partition_point(|&q| q < p);
    let last = polygon.partition_point(|&q| q <= p);
    (first..last).map(FaceId::new)
}

/// The side of the polygon of a half-edge that begins at the same corner.
fn side_from(mesh: &TriMesh, h: HalfedgeId, is_diagonal: impl Fn(HalfedgeId) -> bool) -> Option<HalfedgeId> {
    let turn = |&h: &HalfedgeId| is_diagonal(h).then(|| mesh.twin(h).next());
    std::iter::successors(Some(h), turn).take(mesh.face_count()).find(|&h| !is_diagonal(h))
}
