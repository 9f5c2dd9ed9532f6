//! The oriented manifold triangle mesh that every stage works on.

use nalgebra::Point3;

use super::groups::Groups;
use super::index::{FaceId, HalfedgeId, VertexId};

/// An oriented triangle mesh, manifold by construction, in three flat arrays.
///
/// The corner *is* the half-edge: half-edge `3·f + k` leaves corner `k` of face `f` towards
/// corner `k + 1`. `twin` holds the opposite half-edge, or [`HalfedgeId::NONE`] on a boundary.
///
/// Guaranteed (`check_invariants` tests it): twins are mutual and opposed; the corners of a
/// vertex form one fan, so there is no bow-tie; every vertex is used by a face.
///
/// Not guaranteed: being connected, having a boundary, positive areas, distinct positions.
///
/// Edges may be marked as guides, which the borders of charts should follow, vertices have weights for the seams there, and faces may be in parts
/// that keep their shape; parts of the mesh keep all this.
#[derive(Clone, Debug, Default)]
pub(crate) struct TriMesh {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[VertexId; 3]>,
    twin: Vec<HalfedgeId>,
    /// An outgoing half-edge of each vertex; on the boundary the one without a twin.
    outgoing: Vec<HalfedgeId>,
    /// Whether a half-edge lies on a guide; empty where none does.
    guide: Vec<bool>,
    /// What a border at each vertex counts for its length; empty where that is 1 everywhere.
    seam_weight: Vec<f32>,
    /// The part between hard edges that each face is in, from 1 on, and 0 for none; empty where all are in none.
    part: Vec<u32>,
}

/// What a border along a guide counts for its length: a little less than along the edge of a box. It may take a way so
/// much longer to follow the guide.
const GUIDE_COST: f64 = 0.1;

/// A part of at least one in so many faces is extracted by a table of all faces, a smaller one by looking its faces up.
const LARGE_PART: usize = 16;

/// Counts of the cells of a mesh, and what follows from them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Topology {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of edges, an edge and its twin counted once.
    pub edges: usize,
    /// Number of faces.
    pub faces: usize,
    /// Number of boundary loops.
    pub loops: usize,
    /// Number of edge-connected components.
    pub components: usize,
}

impl Topology {
    /// Euler characteristic V − E + F.
    #[must_use]
    pub(crate) fn euler(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.faces as i64
    }

    /// Genus summed over the components: (2C − L − χ) / 2.
    #[must_use]
    pub(crate) fn genus(&self) -> usize {
        let twice = 2 * self.components as i64 - self.loops as i64 - self.euler();
        debug_assert!(twice >= 0 && twice % 2 == 0, "not an oriented manifold: {self:?}");
        usize::try_from(twice / 2).unwrap_or(0)
    }

    /// Whether the mesh can be a chart: connected, genus 0, with a boundary.
    #[must_use]
    pub(crate) fn is_chart(&self) -> bool {
        self.components == 1 && self.loops >= 1 && self.genus() == 0
    }

    /// Whether the mesh is a topological disk.
    #[must_use]
    pub(crate) fn is_disk(&self) -> bool {
        self.is_chart() && self.loops == 1
    }
}

impl TriMesh {
    /// Builds a mesh from glued triangles; the vertices are the fans of corners that gluing makes.
    ///
    /// `corner_source[h]` names the point a corner lies at, `position(source)` gives its
    /// coordinates, `twin[h]` the opposite half-edge or [`HalfedgeId::NONE`]. Returns the mesh and
    /// the source of each vertex. Two fans at one source become two vertices: this is how
    /// bow-ties, cuts and sub-meshes with pinched vertices come out manifold. O(n).
    ///
    /// # Panics
    /// If the arrays differ in length or the length is no multiple of three.
    #[must_use]
    pub(crate) fn from_glued(
        corner_source: &[u32],
        twin: Vec<HalfedgeId>,
        position: impl Fn(u32) -> Point3<f64>,
    ) -> (Self, Vec<u32>) {
        assert_eq!(corner_source.len(), twin.len(), "one twin a corner");
        assert_eq!(twin.len() % 3, 0, "three corners a triangle");
        let mut corner_vertex = vec![VertexId::NONE; twin.len()];
        let mut source = Vec::new();
        let mut outgoing = Vec::new();
        for seed in 0..twin.len() {
            if !corner_vertex[seed].is_none() {
                continue;
            }
            // Turn clockwise to the first corner of the fan (or once around a closed fan).
            let seed = HalfedgeId::new(seed);
            let mut first = seed;
            loop {
                let across = twin[first.index()];
                if across.is_none() {
                    break;
                }
                first = across.next();
                if first == seed {
                    break;
                }
            }
            let vertex = VertexId::new(source.len());
            source.push(corner_source[seed.index()]);
            outgoing.push(first);
            let mut h = first;
            loop {
                corner_vertex[h.index()] = vertex;
                let across = twin[h.prev().index()];
                if across.is_none() || across == first {
                    break;
                }
                h = across;
            }
        }
        let positions = source.iter().map(|&s| position(s)).collect();
        let triangles = corner_vertex.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        (
            Self { positions, triangles, twin, outgoing, guide: Vec::new(), seam_weight: Vec::new(), part: Vec::new() },
            source,
        )
    }

    /// Builds a mesh from vertex indices, gluing every pair of opposed half-edges.
    ///
    /// Half-edges that occur twice in the same direction, and edges with more than two faces, stay
    /// unglued. Unused positions vanish and bow-ties split, so vertex numbers may differ from the
    /// input; the second value gives the source of each vertex. Meant for clean meshes and tests;
    /// [`condition`](super::condition()) accepts anything.
    #[cfg(test)]
    #[must_use]
    pub(crate) fn from_triangles(positions: &[Point3<f64>], triangles: &[[u32; 3]]) -> (Self, Vec<u32>) {
        let corners: Vec<u32> = triangles.iter().flatten().copied().collect();
        let end = |h: usize| corners[HalfedgeId::new(h).next().index()];
        let mut keys: Vec<(u32, u32, usize)> =
            (0..corners.len()).map(|h| (corners[h].min(end(h)), corners[h].max(end(h)), h)).collect();
        keys.sort_unstable();
        let mut twin = vec![HalfedgeId::NONE; corners.len()];
        for group in keys.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if let [(_, _, a), (_, _, b)] = *group
                && corners[a] == end(b)
                && corners[b] == end(a)
            {
                twin[a] = HalfedgeId::new(b);
                twin[b] = HalfedgeId::new(a);
            }
        }
        Self::from_glued(&corners, twin, |s| positions[s as usize])
    }

    /// The part of the mesh made of `faces` (in this order), cut along every edge for which
    /// `is_cut` holds (asked once a side). Returns it with the source of each vertex; face `i` of
    /// the part is `faces[i]`. O(m log m) in the number m of faces of the part, O(n) at most.
    #[must_use]
    pub(crate) fn submesh(&self, faces: &[FaceId], is_cut: impl Fn(HalfedgeId) -> bool) -> (Self, Vec<VertexId>) {
        if faces.len() >= self.face_count() / LARGE_PART {
            let mut place = vec![FaceId::NONE; self.face_count()];
            for (i, f) in faces.iter().enumerate() {
                place[f.index()] = FaceId::new(i);
            }
            let find = |f: FaceId| (!place[f.index()].is_none()).then(|| place[f.index()].index());
            return self.glue_part(faces, |h, t| if is_cut(h) || is_cut(t) { None } else { find(t.face()) });
        }
        let mut place: Vec<(FaceId, FaceId)> = faces.iter().enumerate().map(|(i, &f)| (f, FaceId::new(i))).collect();
        place.sort_unstable();
        let find = |f: FaceId| place.binary_search_by_key(&f, |e| e.0).ok().map(|at| place[at].1.index());
        self.glue_part(faces, |h, t| if is_cut(h) || is_cut(t) { None } else { find(t.face()) })
    }

    /// The parts of the mesh made of the faces of each group, cut apart from each other. As
    /// [`TriMesh::submesh`] of each group, but all together O(n).
    ///
    /// # Panics
    /// If the groups hold a face twice.
    #[must_use]
    pub(crate) fn partition(&self, groups: &Groups<FaceId>) -> Vec<(Self, Vec<VertexId>)> {
        let mut place = vec![(u32::MAX, 0usize); self.face_count()];
        for (g, faces) in groups.iter().enumerate() {
            for (i, f) in faces.iter().enumerate() {
                assert_eq!(place[f.index()].0, u32::MAX, "{f} is in two groups");
                place[f.index()] = (FaceId::new(g).index() as u32, i);
            }
        }
        let part = |(g, faces): (usize, &[FaceId])| {
            self.glue_part(faces, |_, t| {
                let (group, local) = place[t.face().index()];
                (group as usize == g).then_some(local)
            })
        };
        groups.iter().enumerate().map(part).collect()
    }

    /// `across(h, twin)` gives the local index of the face beyond `h`, if it is glued there.
    fn glue_part(
        &self,
        faces: &[FaceId],
        across: impl Fn(HalfedgeId, HalfedgeId) -> Option<usize>,
    ) -> (Self, Vec<VertexId>) {
        let mut corner_source = Vec::with_capacity(3 * faces.len());
        let mut twin = Vec::with_capacity(3 * faces.len());
        let mut guide = Vec::with_capacity(if self.guide.is_empty() { 0 } else { 3 * faces.len() });
        for &f in faces {
            for h in f.halfedges() {
                if !self.guide.is_empty() {
                    guide.push(self.is_guide(h));
                }
                corner_source.push(self.from(h).index() as u32);
                let t = self.twin(h);
                let local = if t.is_none() { None } else { across(h, t) };
                twin.push(local.map_or(HalfedgeId::NONE, |f| FaceId::new(f).halfedge(t.slot())));
            }
        }
        let (mesh, source) = Self::from_glued(&corner_source, twin, |s| self.positions[s as usize]);
        let source: Vec<VertexId> = source.into_iter().map(|s| VertexId::new(s as usize)).collect();
        let seam_weight = self.seam_weights_of(&source);
        let part = if self.part.is_empty() { Vec::new() } else { faces.iter().map(|&f| self.part(f)).collect() };
        (mesh.with_guides(guide).with_seam_weights(seam_weight).with_parts(part), source)
    }

    /// Number of vertices.
    #[inline]
    #[must_use]
    pub(crate) fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of triangles.
    #[inline]
    #[must_use]
    pub(crate) fn face_count(&self) -> usize {
        self.triangles.len()
    }

    /// Number of half-edges: three a triangle.
    #[inline]
    #[must_use]
    pub(crate) fn halfedge_count(&self) -> usize {
        self.twin.len()
    }

    /// All vertices in order.
    pub(crate) fn vertices(&self) -> impl ExactSizeIterator<Item = VertexId> + Clone + use<> {
        (0..self.vertex_count()).map(VertexId::new)
    }

    /// All faces in order.
    pub(crate) fn faces(&self) -> impl ExactSizeIterator<Item = FaceId> + Clone + use<> {
        (0..self.face_count()).map(FaceId::new)
    }

    /// All half-edges in order.
    pub(crate) fn halfedges(&self) -> impl ExactSizeIterator<Item = HalfedgeId> + Clone + use<> {
        (0..self.halfedge_count()).map(HalfedgeId::new)
    }

    /// Each edge once: boundary half-edges, and of a twin pair the one of lower index.
    pub(crate) fn edges(&self) -> impl Iterator<Item = HalfedgeId> + '_ {
        self.halfedges().filter(|&h| self.twin(h).is_none() || h < self.twin(h))
    }

    /// Coordinates of a vertex.
    #[inline]
    #[must_use]
    pub(crate) fn position(&self, v: VertexId) -> Point3<f64> {
        self.positions[v.index()]
    }

    /// Coordinates of all vertices.
    #[inline]
    #[must_use]
    pub(crate) fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// The corners of all triangles.
    #[inline]
    #[must_use]
    pub(crate) fn triangles(&self) -> &[[VertexId; 3]] {
        &self.triangles
    }

    /// The corners of a triangle.
    #[inline]
    #[must_use]
    pub(crate) fn triangle(&self, f: FaceId) -> [VertexId; 3] {
        self.triangles[f.index()]
    }

    /// The corner positions of a triangle.
    #[inline]
    #[must_use]
    pub(crate) fn triangle_positions(&self, f: FaceId) -> [Point3<f64>; 3] {
        self.triangle(f).map(|v| self.position(v))
    }

    /// The vertex a half-edge leaves.
    #[inline]
    #[must_use]
    pub(crate) fn from(&self, h: HalfedgeId) -> VertexId {
        self.triangles[h.face().index()][h.slot()]
    }

    /// The vertex a half-edge points to.
    #[inline]
    #[must_use]
    pub(crate) fn to(&self, h: HalfedgeId) -> VertexId {
        self.from(h.next())
    }

    /// The opposite half-edge, or [`HalfedgeId::NONE`] on a boundary.
    #[inline]
    #[must_use]
    pub(crate) fn twin(&self, h: HalfedgeId) -> HalfedgeId {
        self.twin[h.index()]
    }

    /// Whether no face lies on the other side.
    #[inline]
    #[must_use]
    pub(crate) fn is_boundary(&self, h: HalfedgeId) -> bool {
        self.twin(h).is_none()
    }

    /// Whether a vertex lies on a boundary loop.
    #[inline]
    #[must_use]
    pub(crate) fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.is_boundary(self.outgoing[v.index()])
    }

    /// Length of an edge.
    #[inline]
    #[must_use]
    pub(crate) fn edge_length(&self, h: HalfedgeId) -> f64 {
        (self.position(self.to(h)) - self.position(self.from(h))).norm()
    }

    /// Length of all boundary loops together, summed in the order of half-edges.
    #[must_use]
    pub(crate) fn boundary_length(&self) -> f64 {
        self.halfedges().filter(|&h| self.is_boundary(h)).map(|h| self.edge_length(h)).sum()
    }

    /// The same mesh with other guides: for each half-edge whether it lies on one, the same for both sides of an edge.
    ///
    /// # Panics
    /// If there is neither a mark for each half-edge nor none at all.
    #[must_use]
    pub(crate) fn with_guides(self, guide: Vec<bool>) -> Self {
        assert!(guide.is_empty() || guide.len() == self.twin.len(), "one mark a half-edge");
        Self { guide: if guide.contains(&true) { guide } else { Vec::new() }, ..self }
    }

    /// Whether any edge is a guide.
    #[inline]
    #[must_use]
    pub(crate) fn has_guides(&self) -> bool {
        !self.guide.is_empty()
    }

    /// Whether the borders of charts should follow an edge.
    #[inline]
    #[must_use]
    pub(crate) fn is_guide(&self, h: HalfedgeId) -> bool {
        self.guide.get(h.index()).is_some_and(|guide| *guide)
    }

    /// The same mesh with what a border at each vertex counts for its length, or nothing where that is 1 everywhere.
    ///
    /// # Panics
    /// If there is neither a number for each vertex nor none at all.
    #[must_use]
    pub(crate) fn with_seam_weights(self, seam_weight: Vec<f32>) -> Self {
        assert!(seam_weight.is_empty() || seam_weight.len() == self.positions.len(), "one number a vertex");
        Self { seam_weight, ..self }
    }

    /// What a border counts for its length at a vertex.
    #[inline]
    #[must_use]
    pub(crate) fn seam_weight(&self, v: VertexId) -> f32 {
        self.seam_weight.get(v.index()).copied().unwrap_or(1.0)
    }

    /// What a border counts for its length at some vertices, for a mesh made of them.
    pub(crate) fn seam_weights_of(&self, vertices: &[VertexId]) -> Vec<f32> {
        if self.seam_weight.is_empty() {
            Vec::new()
        } else {
            vertices.iter().map(|v| self.seam_weight[v.index()]).collect()
        }
    }

    /// The same mesh with the part between hard edges that each face is in, or nothing where there are none.
    ///
    /// # Panics
    /// If there is neither a number for each face nor none at all.
    #[must_use]
    pub(crate) fn with_parts(self, part: Vec<u32>) -> Self {
        assert!(part.is_empty() || part.len() == self.triangles.len(), "one number a face");
        Self { part: if part.iter().any(|p| *p != 0) { part } else { Vec::new() }, ..self }
    }

    /// The part between hard edges that a face is in, which unrolls and is not to be bent; 0 for none.
    #[inline]
    #[must_use]
    pub(crate) fn part(&self, f: FaceId) -> u32 {
        self.part.get(f.index()).copied().unwrap_or(0)
    }

    /// Whether every face is in a part between hard edges.
    #[must_use]
    pub(crate) fn is_all_parts(&self) -> bool {
        !self.part.is_empty() && self.part.iter().all(|part| *part != 0)
    }

    /// What a border along an edge costs beside one of the same length at a place of the usual kind: less on a guide, and less where
    /// seams weigh less.
    #[inline]
    #[must_use]
    pub(crate) fn border_cost(&self, h: HalfedgeId) -> f64 {
        let guide = if self.is_guide(h) { GUIDE_COST } else { 1.0 };
        let at = |v: VertexId| f64::from(self.seam_weight(v));
        guide * 0.5 * (at(self.from(h)) + at(self.to(h)))
    }

    /// One of the half-edges that leave `v`.
    #[inline]
    #[must_use]
    pub(crate) fn an_outgoing(&self, v: VertexId) -> HalfedgeId {
        self.outgoing[v.index()]
    }

    /// The half-edges that leave `v`, counter-clockwise; on a boundary from the half-edge without a
    /// twin. The neighbours of `v` are their ends and, on a boundary, the start of the last one's
    /// [`prev`](HalfedgeId::prev).
    pub(crate) fn outgoing(&self, v: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let first = self.outgoing[v.index()];
        let mut current = first;
        std::iter::from_fn(move || {
            if current.is_none() {
                return None;
            }
            let h = current;
            current = self.twin(h.prev());
            if current == first {
                current = HalfedgeId::NONE;
            }
            Some(h)
        })
    }

    /// The vertices joined to `v` by an edge, counter-clockwise.
    pub(crate) fn neighbours(&self, v: VertexId) -> impl Iterator<Item = VertexId> + '_ {
        self.outgoing(v).flat_map(move |h| {
            let last = self.is_boundary(h.prev()).then(|| self.from(h.prev()));
            std::iter::once(self.to(h)).chain(last)
        })
    }

    /// The boundary half-edge that follows boundary half-edge `h` along its loop.
    #[inline]
    #[must_use]
    pub(crate) fn next_boundary(&self, h: HalfedgeId) -> HalfedgeId {
        self.outgoing[self.to(h).index()]
    }

    /// The boundary loops, each as half-edges in order with the surface on their left; sorted by
    /// lowest half-edge.
    #[must_use]
    pub(crate) fn boundary_loops(&self) -> Groups<HalfedgeId> {
        let mut seen = vec![false; self.halfedge_count()];
        let mut loops = Groups::new();
        for first in self.halfedges() {
            if !self.is_boundary(first) || seen[first.index()] {
                continue;
            }
            let mut h = first;
            while !seen[h.index()] {
                seen[h.index()] = true;
                loops.push(h);
                h = self.next_boundary(h);
            }
            loops.close();
        }
        loops
    }

    /// A component label for each face, and the number of components; faces are joined over edges.
    /// Labels ascend with the lowest face.
    #[must_use]
    pub(crate) fn components(&self) -> (Vec<u32>, usize) {
        let mut label = vec![u32::MAX; self.face_count()];
        let mut count = 0;
        let mut stack = Vec::new();
        for seed in self.faces() {
            if label[seed.index()] != u32::MAX {
                continue;
            }
            label[seed.index()] = count;
            stack.push(seed);
            while let Some(f) = stack.pop() {
                for h in f.halfedges() {
                    let t = self.twin(h);
                    if !t.is_none() && label[t.face().index()] == u32::MAX {
                        label[t.face().index()] = count;
                        stack.push(t.face());
                    }
                }
            }
            count += 1;
        }
        (label, count as usize)
    }

    /// Cell counts, boundary loops and components.
    #[must_use]
    pub(crate) fn topology(&self) -> Topology {
        let boundary = self.twin.iter().filter(|t| t.is_none()).count();
        Topology {
            vertices: self.vertex_count(),
            edges: (self.halfedge_count() + boundary) / 2,
            faces: self.face_count(),
            loops: self.boundary_loops().len(),
            components: self.components().1,
        }
    }

    /// Checks every promise of the type and names the first one broken. For tests; O(n).
    ///
    /// # Errors
    /// A sentence that names the offending element.
    #[cfg(test)]
    pub(crate) fn check_invariants(&self) -> Result<(), String> {
        if self.twin.len() != 3 * self.triangles.len() || self.outgoing.len() != self.positions.len() {
            return Err("array lengths disagree".into());
        }
        for h in self.halfedges() {
            let t = self.twin(h);
            if t.is_none() {
                continue;
            }
            if t.index() >= self.halfedge_count() || self.twin(t) != h || t == h {
                return Err(format!("{h} and {t} are not each other's twin"));
            }
            if self.from(h) != self.to(t) || self.to(h) != self.from(t) {
                return Err(format!("twins {h} and {t} do not run against each other"));
            }
        }
        let mut used = vec![0usize; self.vertex_count()];
        for v in self.triangles.iter().flatten() {
            if v.index() >= used.len() {
                return Err(format!("a triangle names {v}, which is not there"));
            }
            used[v.index()] += 1;
        }
        for v in self.vertices() {
            let fan = self.outgoing(v).take(used[v.index()] + 1).filter(|&h| self.from(h) == v).count();
            if fan != used[v.index()] || fan == 0 {
                return Err(format!("{v} has {} corners, its fan {fan}", used[v.index()]));
            }
        }
        Ok(())
    }
}
