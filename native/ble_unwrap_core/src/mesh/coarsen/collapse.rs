//! A mesh under collapse: connectivity that shrinks, and which collapse comes next.

use nalgebra::{Point3, Vector3};

use super::quadric::{Quadric, initial_quadrics};
use super::queue::VertexQueue;
use crate::mesh::measure::area_vector;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Cost of moving a unit of area by a unit of length, squared, in flat places. An edge of length l on
/// a surface of curvature κ errs by about κ²l⁴/4, so that this weighs as much where the surface bends
/// by 2√0.001 radians, 3.6°, along an edge: flatter places are coarsened evenly, whatever their noise.
const LENGTH_WEIGHT: f64 = 1e-3;

/// Area, in squared edge lengths, that a vertex has at least in the length term, so that slivers
/// without any area still lose their short edges first.
const LEAST_AREA: f64 = 1e-3;

/// Cosine of the angle by which a collapse may turn a face: 60°.
const LEAST_TURN_COSINE: f64 = 0.5;

/// Shape (1 for an equilateral triangle, 0 for a degenerate one) below which a collapse must not
/// bring a triangle, unless one of the triangles it replaces was worse.
const LEAST_SHAPE: f64 = 0.1;

/// Shape below which the normal of a triangle is not to be trusted.
const NO_SHAPE: f64 = 1e-6;

/// Neighbours of a vertex at most, for it to take part in a collapse, before and after. Bounds the
/// work of one collapse. The hub of a fan stays while its rim is thinned.
pub(super) const MOST_NEIGHBOURS: u32 = 32;

/// Vertices tried between two looks at the cancel flag.
const CHECK_EVERY: usize = 512;

/// A collapse of one vertex into a neighbour.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    cost: f64,
    /// The half-edge towards the kept vertex; on a boundary, the one that has a face.
    edge: HalfedgeId,
    kept: VertexId,
}

/// A face at the vertex to be removed.
#[derive(Clone, Copy, Debug)]
struct FanFace {
    /// The other two corners, counter-clockwise.
    ends: [VertexId; 2],
    area_vector: Vector3<f64>,
    shape: f64,
}

/// All there is at a vertex, in two cache lines: collapses hop over the mesh, and what they wait for
/// is memory.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Vertex {
    /// The position in a box around the origin of half extent 1: quadrics keep their digits.
    point: Point3<f64>,
    quadric: Quadric,
    outgoing: HalfedgeId,
    neighbour_count: u32,
    /// Equal to `mark_value` for the neighbours of the vertex at hand.
    mark: u32,
    /// The vertex whose collapse cost is the key in the queue. `NONE` if the vertex is not in the
    /// queue or its key is above its least cost, since that collapse is illegal for now.
    cheapest: VertexId,
}

/// The corners of a face and the far sides of its half-edges.
#[derive(Clone, Debug)]
struct Face {
    corner: [VertexId; 3],
    twin: [HalfedgeId; 3],
}

/// The connectivity of [`TriMesh`] in the same terms, with faces and vertices removed.
#[derive(Debug)]
pub(super) struct Collapsing {
    vertices: Vec<Vertex>,
    faces: Vec<Face>,
    queue: VertexQueue,
    /// The vertex a removed vertex went into; itself while it lives.
    kept: Vec<VertexId>,
    /// Whether a face still lives.
    alive: Vec<bool>,
    /// Removed vertices in order.
    removed: Vec<VertexId>,
    // Of the vertex at hand: faces, neighbours, candidates, and the mark on the neighbours.
    fan: Vec<FanFace>,
    ring: Vec<VertexId>,
    candidates: Vec<Candidate>,
    mark_value: u32,
}

impl Collapsing {
    /// O(n).
    pub(super) fn new(mesh: &TriMesh, progress: &Progress) -> Result<Self, Cancelled> {
        let points = normalised(mesh.positions());
        let quadrics = initial_quadrics(mesh, &points, progress)?;
        let vertex = |((v, point), quadric): ((VertexId, Point3<f64>), Quadric)| Vertex {
            point,
            quadric,
            outgoing: mesh.outgoing(v).next().unwrap_or(HalfedgeId::NONE),
            neighbour_count: mesh.neighbours(v).count() as u32,
            mark: 0,
            cheapest: VertexId::NONE,
        };
        let face = |f: FaceId| Face { corner: mesh.triangle(f), twin: f.halfedges().map(|h| mesh.twin(h)) };
        let mut collapsing = Self {
            vertices: mesh.vertices().zip(points).zip(quadrics).map(vertex).collect(),
            faces: mesh.faces().map(face).collect(),
            queue: VertexQueue::new(std::iter::empty()),
            kept: mesh.vertices().collect(),
            alive: vec![true; mesh.face_count()],
            removed: Vec::new(),
            fan: Vec::new(),
            ring: Vec::new(),
            candidates: Vec::new(),
            mark_value: 0,
        };
        progress.check()?;
        let keys: Vec<Option<f64>> = mesh.vertices().map(|v| collapsing.key(v)).collect();
        collapsing.queue = VertexQueue::new(keys.into_iter());
        Ok(collapsing)
    }

    /// Collapses the cheapest legal vertex again and again, until `target` vertices are left or no
    /// collapse is legal.
    pub(super) fn run(&mut self, target: usize, progress: &Progress) -> Result<(), Cancelled> {
        let mut tried = 0usize;
        while self.vertex_count() > target {
            if tried.is_multiple_of(CHECK_EVERY) {
                progress.check()?;
            }
            tried += 1;
            let Some(v) = self.queue.pop() else { break };
            // The key was a lower bound: neighbours may have grown dearer, the cheapest may be illegal.
            // If no collapse is legal, the vertex waits outside until its surroundings change.
            let (found, is_cheapest) = self.cheapest_legal(v);
            self.at_mut(v).cheapest = VertexId::NONE;
            let Some(candidate) = found else { continue };
            if self.queue.precedes(v, candidate.cost) {
                self.collapse(v, candidate);
            } else {
                self.queue.set(v, Some(candidate.cost));
                if is_cheapest {
                    self.at_mut(v).cheapest = candidate.kept;
                }
            }
        }
        Ok(())
    }

    /// Vertices that live.
    pub(super) fn vertex_count(&self) -> usize {
        self.kept.len() - self.removed.len()
    }

    /// The removed vertices in the order of their removal.
    pub(super) fn removed(&self) -> &[VertexId] {
        &self.removed
    }

    /// For each vertex the living one it ended in.
    pub(super) fn roots(&self) -> Vec<VertexId> {
        let mut root = self.kept.clone();
        for &v in self.removed.iter().rev() {
            root[v.index()] = root[root[v.index()].index()];
        }
        root
    }

    /// The living part as a mesh, and the vertex of `fine` that each of its vertices is.
    pub(super) fn mesh(&self, fine: &TriMesh) -> (TriMesh, Vec<VertexId>) {
        let living: Vec<FaceId> = fine.faces().filter(|f| self.alive[f.index()]).collect();
        let mut place = vec![0usize; fine.face_count()];
        for (i, f) in living.iter().enumerate() {
            place[f.index()] = i;
        }
        let halfedges = || living.iter().flat_map(|f| f.halfedges());
        let corner: Vec<u32> = halfedges().map(|h| self.from(h).index() as u32).collect();
        let twin = halfedges()
            .map(|h| self.twin(h))
            .map(|t| if t.is_none() { t } else { FaceId::new(place[t.face().index()]).halfedge(t.slot()) })
            .collect();
        let (mesh, source) = TriMesh::from_glued(&corner, twin, |s| fine.position(VertexId::new(s as usize)));
        (mesh, source.into_iter().map(|s| VertexId::new(s as usize)).collect())
    }

    fn from(&self, h: HalfedgeId) -> VertexId {
        self.faces[h.face().index()].corner[h.slot()]
    }

    fn to(&self, h: HalfedgeId) -> VertexId {
        let slot = h.slot();
        self.faces[h.face().index()].corner[if slot == 2 { 0 } else { slot + 1 }]
    }

    fn twin(&self, h: HalfedgeId) -> HalfedgeId {
        self.faces[h.face().index()].twin[h.slot()]
    }

    fn at(&self, v: VertexId) -> &Vertex {
        &self.vertices[v.index()]
    }

    fn at_mut(&mut self, v: VertexId) -> &mut Vertex {
        &mut self.vertices[v.index()]
    }

    fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.twin(self.at(v).outgoing).is_none()
    }

    /// Calls `visit` with every half-edge that leaves `v`, counter-clockwise from the boundary.
    fn turn(&self, v: VertexId, mut visit: impl FnMut(HalfedgeId)) {
        let first = self.at(v).outgoing;
        let mut h = first;
        loop {
            visit(h);
            h = self.twin(h.prev());
            if h.is_none() || h == first {
                break;
            }
        }
    }

    fn cost(&self, v: VertexId, kept: VertexId) -> f64 {
        let (gone, kept) = (self.at(v), self.at(kept));
        let squared = (kept.point - gone.point).norm_squared();
        let area = gone.quadric.area.max(LEAST_AREA * squared);
        gone.quadric.at(&kept.point) + kept.quadric.at(&kept.point) + LENGTH_WEIGHT * squared * area
    }

    /// Calls `visit` with every collapse of `v` that is not ruled out by `v` alone: a boundary vertex
    /// goes along its boundary only.
    fn each_candidate(&self, v: VertexId, mut visit: impl FnMut(Candidate)) {
        if self.at(v).neighbour_count > MOST_NEIGHBOURS {
            return;
        }
        let candidate = |edge, kept| Candidate { cost: self.cost(v, kept), edge, kept };
        if self.is_boundary_vertex(v) {
            let ahead = self.at(v).outgoing;
            visit(candidate(ahead, self.to(ahead)));
            let mut last = ahead;
            self.turn(v, |h| last = h);
            visit(candidate(last.prev(), self.from(last.prev())));
        } else {
            self.turn(v, |h| visit(candidate(h, self.to(h))));
        }
    }

    /// The least cost of removing `v`, legal or not, after noting whose it is.
    fn key(&mut self, v: VertexId) -> Option<f64> {
        let mut least: Option<Candidate> = None;
        self.each_candidate(v, |c| least = Some(least.filter(|l| l.cost <= c.cost).unwrap_or(c)));
        self.at_mut(v).cheapest = least.map_or(VertexId::NONE, |l| l.kept);
        least.map(|l| l.cost)
    }

    /// Brings the key of `v` up to date after its neighbour `gone` went into `kept`.
    fn update(&mut self, v: VertexId, gone: VertexId, kept: VertexId) {
        let cheapest = self.at(v).cheapest;
        if v == kept || [VertexId::NONE, gone, kept].contains(&cheapest) || self.is_boundary_vertex(v) {
            let key = self.key(v);
            self.queue.set(v, key);
        } else if self.queue.lower(v, self.cost(v, kept)) {
            // The costs of the other collapses are what they were.
            self.at_mut(v).cheapest = kept;
        }
    }

    /// The cheapest legal collapse of `v`, and whether none that is illegal is cheaper. Leaves the
    /// neighbours of `v` in `ring`.
    fn cheapest_legal(&mut self, v: VertexId) -> (Option<Candidate>, bool) {
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        self.each_candidate(v, |c| candidates.push(c));
        candidates.sort_unstable_by(|a, b| a.cost.total_cmp(&b.cost).then(a.kept.cmp(&b.kept)));
        self.gather(v);
        let found = candidates.iter().position(|c| self.keeps_topology(v, c) && self.keeps_shape(v, c.kept));
        let legal = found.map(|i| candidates[i]);
        self.candidates = candidates;
        (legal, found == Some(0))
    }

    /// Lists the faces and neighbours of `v` and marks the latter.
    fn gather(&mut self, v: VertexId) {
        let (mut fan, mut ring) = (std::mem::take(&mut self.fan), std::mem::take(&mut self.ring));
        fan.clear();
        ring.clear();
        self.turn(v, |h| {
            let ends = [self.to(h), self.from(h.prev())];
            let p = [v, ends[0], ends[1]].map(|w| self.at(w).point);
            let area_vector = area_vector(p);
            fan.push(FanFace { ends, area_vector, shape: shape(p, area_vector.norm()) });
            ring.push(ends[0]);
            if self.twin(h.prev()).is_none() {
                ring.push(ends[1]);
            }
        });
        self.mark_value += 1;
        for w in &ring {
            self.vertices[w.index()].mark = self.mark_value;
        }
        (self.fan, self.ring) = (fan, ring);
    }

    /// The link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999) and what it leaves open.
    fn keeps_topology(&self, v: VertexId, candidate: &Candidate) -> bool {
        let Candidate { edge, kept, .. } = *candidate;
        let across = self.twin(edge);
        let faces = if across.is_none() { 1 } else { 2 };
        let count = |w: VertexId| self.at(w).neighbour_count;
        if v == kept || count(kept) > MOST_NEIGHBOURS || count(v) + count(kept) > MOST_NEIGHBOURS + faces + 2 {
            return false;
        }
        // An edge doubled, or from the vertex to itself: nothing the conditions below would cover.
        if self.ring.contains(&v) || self.ring.iter().filter(|&&w| w == kept).count() != 1 {
            return false;
        }
        if across.is_none() {
            // A loop of three edges is as short as loops get.
            let second = self.at(self.to(edge)).outgoing;
            let third = self.at(self.to(second)).outgoing;
            if second == edge || third == edge || self.at(self.to(third)).outgoing == edge {
                return false;
            }
        } else {
            let apex = [edge, across].map(|h| self.from(h.prev()));
            let tetrahedron = count(v) == 3 && count(kept) == 3;
            if apex[0] == apex[1] || tetrahedron {
                return false;
            }
        }
        let mut shared = 0;
        let mut tally = |w: VertexId| shared += u32::from(self.at(w).mark == self.mark_value);
        self.turn(kept, |h| {
            tally(self.to(h));
            if self.twin(h.prev()).is_none() {
                tally(self.from(h.prev()));
            }
        });
        shared == faces
    }

    /// Whether the faces of `v` keep their sides and a decent shape when `v` moves to `kept`.
    fn keeps_shape(&self, v: VertexId, kept: VertexId) -> bool {
        debug_assert!(!self.fan.is_empty(), "{v} has faces");
        let worst = self.fan.iter().map(|f| f.shape).fold(LEAST_SHAPE, f64::min);
        let whole: Vector3<f64> = self.fan.iter().map(|f| f.area_vector).sum();
        let to = self.at(kept).point;
        self.fan.iter().filter(|f| !f.ends.contains(&kept)).all(|face| {
            let p = [to, self.at(face.ends[0]).point, self.at(face.ends[1]).point];
            let moved = area_vector(p);
            let before = if face.shape > NO_SHAPE { face.area_vector } else { whole };
            let length = moved.norm();
            moved.dot(&before) >= LEAST_TURN_COSINE * length * before.norm() && shape(p, length) >= worst
        })
    }

    /// Carries out a legal collapse of `v`, whose neighbours are in `ring`.
    fn collapse(&mut self, v: VertexId, candidate: Candidate) {
        let Candidate { edge, kept, .. } = candidate;
        // The half-edge from v to the kept vertex and the one back, as far as they have faces.
        let (there, back) = if self.from(edge) == v { (edge, self.twin(edge)) } else { (HalfedgeId::NONE, edge) };
        let mut outgoing = self.at(kept).outgoing;
        if !there.is_none() && !back.is_none() {
            if outgoing == there.next() || outgoing == back {
                outgoing = self.twin(there.prev());
            }
        } else if back.is_none() {
            if outgoing == there.next() {
                outgoing = self.twin(there.prev());
            }
        } else {
            // The kept vertex was the start of this boundary edge and takes over that of v.
            let ahead = self.at(v).outgoing;
            outgoing = if ahead == back.next() { self.twin(back.prev()) } else { ahead };
        }
        let mut h = self.at(v).outgoing;
        for _ in 0..self.fan.len() {
            self.faces[h.face().index()].corner[h.slot()] = kept;
            h = self.twin(h.prev());
        }
        if !there.is_none() {
            self.remove_face(there.prev(), there.next(), there.prev());
        }
        if !back.is_none() {
            self.remove_face(back.next(), back.prev(), back.prev());
        }
        self.at_mut(kept).outgoing = outgoing;

        let faces = 2 - u32::from(there.is_none()) - u32::from(back.is_none());
        let Vertex { quadric, neighbour_count, .. } = *self.at(v);
        let heir = self.at_mut(kept);
        heir.quadric += quadric;
        heir.neighbour_count = heir.neighbour_count + neighbour_count - faces - 2;
        self.kept[v.index()] = kept;
        self.removed.push(v);
        for i in 0..self.ring.len() {
            self.update(self.ring[i], v, kept);
        }
    }

    /// Removes a face at the collapsed edge by glueing what lies beyond its `moved` side, that of the
    /// removed vertex, to what lies beyond its `still` side. `leaving` leaves the apex.
    fn remove_face(&mut self, moved: HalfedgeId, still: HalfedgeId, leaving: HalfedgeId) {
        let apex = self.from(leaving);
        let (a, b) = (self.twin(moved), self.twin(still));
        if !a.is_none() {
            self.faces[a.face().index()].twin[a.slot()] = b;
        }
        if !b.is_none() {
            self.faces[b.face().index()].twin[b.slot()] = a;
        }
        if self.at(apex).outgoing == leaving {
            // Of the two sides, the one whose far side runs from the apex.
            self.at_mut(apex).outgoing = if leaving == moved { b } else { a };
        }
        self.at_mut(apex).neighbour_count -= 1;
        self.alive[moved.face().index()] = false;
    }
}

/// Shape of a triangle from its corners and twice its area: 1 if equilateral, 0 if degenerate.
fn shape(p: [Point3<f64>; 3], double_area: f64) -> f64 {
    let squares = (p[1] - p[0]).norm_squared() + (p[2] - p[1]).norm_squared() + (p[0] - p[2]).norm_squared();
    if squares > 0.0 { 12f64.sqrt() * double_area / squares } else { 0.0 }
}

/// The points moved and scaled into a box of half extent 1 around the origin.
fn normalised(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let Some(first) = points.first() else { return Vec::new() };
    let (low, high) = points.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
    let half = (0.5 * high.coords - 0.5 * low.coords).max();
    let half = if half > 0.0 { half } else { 1.0 };
    let centre = 0.5 * low.coords + 0.5 * high.coords;
    points.iter().map(|p| Point3::from((p.coords - centre) / half)).collect()
}
