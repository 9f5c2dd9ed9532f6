//! A coarse mesh of the same surface, by quadric half-edge collapse.

mod collapse;
mod guides;
mod nearest;
mod quadric;
mod queue;
#[cfg(test)]
mod tests;

use super::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};
use collapse::Collapsing;

/// A coarse mesh and how the fine one, from which it was made, lies on it.
///
/// Guaranteed: the coarse mesh has the components, boundary loops and genus of the fine one; its
/// vertices are vertices of the fine mesh at the same positions, those of its boundary on the same
/// boundary loop; no two of its edges have the same ends unless that was so in the fine mesh. The image of a chain of
/// guides is a chain of guides.
///
/// Not guaranteed: that no two of its faces intersect; that a coarse face has any fine face; that
/// the fine faces of a connected set of coarse faces are connected (nearly always they are).
#[derive(Clone, Debug, Default)]
pub(crate) struct Coarse {
    /// The coarse mesh.
    pub mesh: TriMesh,
    /// For each fine vertex the coarse vertex it collapsed into.
    pub vertex: Vec<VertexId>,
    /// For each coarse vertex the fine vertex it is.
    pub source: Vec<VertexId>,
    /// For each fine face the coarse face it lies on: the one nearest to its centroid among those at
    /// the coarse vertices its corners collapsed into.
    pub face: Vec<FaceId>,
}

/// Coarsens a mesh to `target_vertices`, or to as few as can be if that is more.
///
/// Vertices collapse into neighbours in the order of the quadric error this makes (Garland and
/// Heckbert, "Surface simplification using quadric error metrics", 1997, section 4, with its
/// boundary planes of section 6, which guides have too), with area weights and a small term for length that coarsens flat
/// places evenly. A boundary vertex moves along its boundary only. A collapse is not made where it
/// would change the topology, turn a face by more than 60° or make a needle of it. Any manifold mesh
/// will do: closed, of any genus, of several components, with degenerate faces; some of these stop
/// above the target.
///
/// O(n log n), one thread but for [`Coarse::face`]: 3 to 8 µs a fine vertex, growing with the
/// caches missed. Deterministic.
///
/// # Errors
/// [`Cancelled`] soon after a cancel: at most a few passes over the arrays run unwatched.
pub(crate) fn coarsen(mesh: &TriMesh, target_vertices: usize, progress: &Progress) -> Result<Coarse, Cancelled> {
    let mut collapsing = Collapsing::new(mesh, progress)?;
    collapsing.run(target_vertices, progress)?;
    let (coarse, source) = collapsing.mesh(mesh);
    let mut number = vec![VertexId::NONE; mesh.vertex_count()];
    for (i, v) in source.iter().enumerate() {
        number[v.index()] = VertexId::new(i);
    }
    let vertex: Vec<VertexId> = collapsing.roots().iter().map(|root| number[root.index()]).collect();
    let coarse = guides::carried_over(mesh, coarse, &vertex).with_seam_weights(mesh.seam_weights_of(&source));
    let face = nearest_or_same(mesh, &coarse, &vertex, collapsing.removed().is_empty(), progress)?;
    Ok(Coarse { mesh: coarse, vertex, source, face })
}

/// The coarse face of each fine face; nothing to search where nothing was removed.
fn nearest_or_same(
    fine: &TriMesh,
    coarse: &TriMesh,
    vertex: &[VertexId],
    same: bool,
    progress: &Progress,
) -> Result<Vec<FaceId>, Cancelled> {
    if same { Ok(fine.faces().collect()) } else { nearest::nearest_faces(fine, coarse, vertex, progress) }
}
