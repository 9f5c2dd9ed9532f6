//! The dual graph of a patch over whole polygons: what is cut is never inside a polygon.

use crate::mesh::{FaceId, Groups, HalfedgeId, TriMesh, measure};

/// A side shared by two polygons, seen from one of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// The polygon beyond.
    pub(super) to: u32,
    /// The half-edge on the near side.
    pub(super) halfedge: HalfedgeId,
    /// Length of the side.
    pub(super) length: f64,
}

/// Polygons (numbered from 0 by first face) and the sides between them.
#[derive(Debug)]
pub(super) struct PolygonGraph {
    /// Polygon of each face.
    pub(super) of_face: Vec<u32>,
    /// Faces of each polygon.
    pub(super) faces: Groups<FaceId>,
    /// Area of each polygon.
    pub(super) area: Vec<f64>,
    /// Sides of each polygon.
    pub(super) links: Groups<Link>,
}

impl PolygonGraph {
    /// O(n log n). `polygon` holds any name for the polygon of each face.
    pub(super) fn new(mesh: &TriMesh, polygon: &[u32]) -> Self {
        let mut names: Vec<(u32, usize)> = polygon.iter().enumerate().map(|(f, &p)| (p, f)).collect();
        names.sort_unstable();
        let mut first: Vec<(usize, u32)> = names.chunk_by(|a, b| a.0 == b.0).map(|g| (g[0].1, g[0].0)).collect();
        first.sort_unstable();
        let mut number: Vec<(u32, u32)> =
            first.iter().enumerate().map(|(i, &(_, name))| (name, FaceId::new(i).index() as u32)).collect();
        number.sort_unstable();
        let of_face: Vec<u32> = polygon
            .iter()
            .map(|p| number.binary_search_by_key(p, |e| e.0).map_or(u32::MAX, |at| number[at].1))
            .collect();
        let faces = Groups::by_label(&of_face, first.len(), FaceId::new);
        let mut area = Vec::with_capacity(first.len());
        let mut links = Groups::new();
        for (p, group) in faces.iter().enumerate() {
            area.push(group.iter().map(|&f| measure::triangle_area(mesh.triangle_positions(f))).sum());
            for h in group.iter().flat_map(|f| f.halfedges()) {
                let t = mesh.twin(h);
                if t.is_none() || of_face[t.face().index()] as usize == p {
                    continue;
                }
                links.push(Link { to: of_face[t.face().index()], halfedge: h, length: mesh.edge_length(h) });
            }
            links.close();
        }
        Self { of_face, faces, area, links }
    }

    /// Number of polygons.
    pub(super) fn len(&self) -> usize {
        self.faces.len()
    }

    /// For each polygon the label of most of its area; ties go to the lower label.
    pub(super) fn majority(&self, mesh: &TriMesh, face_label: &[u32]) -> Vec<u32> {
        let of = |faces: &[FaceId]| {
            let mut share: Vec<(u32, f64)> = faces
                .iter()
                .map(|&f| (face_label[f.index()], measure::triangle_area(mesh.triangle_positions(f))))
                .collect();
            share.sort_by_key(|s| s.0);
            let mut best = (share[0].0, f64::NEG_INFINITY);
            for same in share.chunk_by(|a, b| a.0 == b.0) {
                let area = same.iter().map(|s| s.1).sum();
                if area > best.1 {
                    best = (same[0].0, area);
                }
            }
            best.0
        };
        self.faces.iter().map(of).collect()
    }

    /// Mean over the corners of a polygon of a value given at vertices.
    pub(super) fn mean_at(&self, mesh: &TriMesh, polygon: usize, value: impl Fn(usize) -> f64) -> f64 {
        let faces = self.faces.group(polygon);
        let sum: f64 = faces.iter().flat_map(|&f| mesh.triangle(f)).map(|v| value(v.index())).sum();
        sum / (3 * faces.len()) as f64
    }

    /// Relabels so that every label is one connected set of polygons, numbered by first polygon.
    /// Returns the number of labels.
    pub(super) fn split_components(&self, label: &mut [u32]) -> usize {
        let mut fresh = vec![u32::MAX; self.len()];
        let mut count = 0;
        let mut stack = Vec::new();
        for seed in 0..self.len() {
            if fresh[seed] != u32::MAX {
                continue;
            }
            fresh[seed] = count;
            stack.push(seed);
            while let Some(p) = stack.pop() {
                for link in self.links.group(p) {
                    let q = link.to as usize;
                    if fresh[q] == u32::MAX && label[q] == label[seed] {
                        fresh[q] = count;
                        stack.push(q);
                    }
                }
            }
            count += 1;
        }
        label.copy_from_slice(&fresh);
        count as usize
    }
}
