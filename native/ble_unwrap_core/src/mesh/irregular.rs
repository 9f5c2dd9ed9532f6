//! Counts of what is irregular about a conditioned mesh.

use rayon::slice::ParallelSliceMut;

use super::defects::Defects;
use super::index::VertexId;
use super::input::Polygons;
use super::tri_mesh::TriMesh;
use crate::random::word;

/// Vertices that are one with an earlier one.
pub(super) fn count_welded(representative: &[u32], defects: &mut Defects) {
    for v in (0..representative.len() as u32).filter(|&v| representative[v as usize] != v) {
        defects.welded_vertices.found(v);
    }
}

/// Vertices at which an edge was cut or at which a polygon meets itself: several fans are no bow-tie
/// there. Counts the polygons that meet themselves.
pub(super) fn severed_vertices(
    polygons: &Polygons<'_>,
    mapped: &[bool],
    representative: &[u32],
    severed: &[u32],
    defects: &mut Defects,
) -> Vec<bool> {
    let mut marked = vec![false; representative.len()];
    for &side in severed {
        for v in polygons.side(side as usize) {
            marked[v] = true;
        }
    }
    let mut own = Vec::new();
    for p in (0..polygons.len()).filter(|&p| mapped[p]) {
        own.clear();
        own.extend(polygons.corners(p).map(|c| polygons.vertex(c)).map(|v| (representative[v], v)));
        own.sort_unstable();
        let mut meets_itself = false;
        for pair in own.windows(2).filter(|w| w[0].0 == w[1].0) {
            meets_itself = true;
            pair.iter().for_each(|&(_, v)| marked[v] = true);
        }
        if meets_itself {
            defects.repeated_vertices.found(p as u32);
        }
    }
    marked
}

/// Vertices whose corners form several fans although no edge was cut there.
pub(super) fn count_bow_ties(
    polygons: &Polygons<'_>,
    mesh: &TriMesh,
    corner: &[u32],
    severed: &[bool],
    defects: &mut Defects,
) {
    let mut fan = vec![VertexId::NONE; severed.len()];
    let mut is_bow_tie = vec![false; severed.len()];
    for (&c, &v) in corner.iter().zip(mesh.triangles().iter().flatten()) {
        let vertex = polygons.vertex(c as usize);
        is_bow_tie[vertex] |= !fan[vertex].is_none() && fan[vertex] != v && !severed[vertex];
        fan[vertex] = v;
    }
    for v in (0..is_bow_tie.len()).filter(|&v| is_bow_tie[v]) {
        defects.bow_tie_vertices.found(v as u32);
    }
}

/// Polygons with the same vertices, in any order, as an earlier one.
pub(super) fn count_duplicates(polygons: &Polygons<'_>, mapped: &[bool], defects: &mut Defects) {
    let vertices = |p: usize| polygons.corners(p).map(|c| polygons.vertex(c) as u32);
    // A sum is the same in any order; scattered, few different sets share one.
    let mut keyed: Vec<(u64, u32)> = (0..polygons.len())
        .filter(|&p| mapped[p])
        .map(|p| (vertices(p).fold(0u64, |sum, v| sum.wrapping_add(word(0, u64::from(v)))), p as u32))
        .collect();
    keyed.par_sort_unstable();
    let sorted = |p: u32| {
        let mut own: Vec<u32> = vertices(p as usize).collect();
        own.sort_unstable();
        own
    };
    let mut duplicates = Vec::new();
    for group in keyed.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
        let mut sets: Vec<(Vec<u32>, u32)> = group.iter().map(|&(_, p)| (sorted(p), p)).collect();
        sets.sort_unstable();
        duplicates.extend(sets.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1));
    }
    duplicates.sort_unstable();
    duplicates.iter().for_each(|&p| defects.duplicate_faces.found(p));
}
