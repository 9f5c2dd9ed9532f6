//! A form of a surface that does not depend on how its mesh is placed and numbered.
//!
//! On symmetric shapes many choices are ties: which vertex is the farthest, which of two borders is the shorter. What
//! breaks them is the last digit of a coordinate or the number of an element, and so the same ball, turned or with its
//! faces in another order, would be cut otherwise. Here each connected component gets an order of its polygons and a
//! place in space that are found from its shape alone, before any stage looks at it:
//!
//! 1. Every side of a polygon gets a colour made of quantities that no motion and no uniform scaling changes
//!    ([`colours`]).
//! 2. A side is chosen to start from, and the polygons are visited from there breadth first, each from the side by which
//!    it is reached ([`traversal`]). Where several sides look the same, a symmetry of the shape leads from one to the
//!    other, and whichever is taken gives the same form.
//! 3. A frame is spanned by one of the longest sides and the normal of one of the largest polygons, the first in that order, and
//!    coordinates in it are rounded so far that the rounding of the input does not survive ([`placement`]).
//! 4. Polygons whose triangles nobody gave are divided anew, each from the side by which it was reached.

mod colours;
mod placement;
mod polygons;
#[cfg(test)]
mod tests;
mod traversal;

use std::cmp::Reverse;
use std::sync::Arc;

use nalgebra::Point3;

use super::condition::Surface;
use super::ear_clipping::clip_ears;
use super::groups::Groups;
use super::index::{FaceId, HalfedgeId, VertexId};
use super::tri_mesh::TriMesh;
use super::triangulate::{Diagonal, halve_quad};
use crate::progress::{Cancelled, Progress};
use colours::Colours;
use polygons::Polygons;
use traversal::Traversal;

/// The same surface with its faces, vertices and polygons numbered and placed by its shape alone, and by what was marked and painted on it.
///
/// Guaranteed: a surface that was moved, scaled uniformly, renumbered, or whose polygons begin at other corners gives the
/// same mesh and the same polygons bit for bit, except for the cases below. Components come one after the other, those of
/// most polygons first, each near the origin in a frame of its own; the unit of length stays. Each vertex is moved by less
/// than 1e-9 of its component's extent and by less than a thousandth of the smallest feature beside it. What the surface
/// says of the input stays true.
///
/// Not guaranteed: the same form where a coordinate lies within its own rounding of a boundary between two rounded values;
/// then it may be one step of 1e-10 of the extent apart. Nor where two sides look the same as far as they are compared but
/// no symmetry leads from one to the other.
///
/// O(n log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn canonical(surface: Surface, progress: &Progress) -> Result<Surface, Cancelled> {
    let mesh = Arc::clone(&surface.mesh);
    let polygons = Polygons::new(&mesh, &surface.polygon, &surface.corner);
    progress.check()?;
    let components = Components::new(&mesh, &polygons);
    let features = placement::features(&mesh, &polygons);
    progress.check()?;
    let mut traversal = Traversal::new(&mesh, &polygons);
    let mut placed = vec![Point3::origin(); mesh.vertex_count()];
    let mut colours = Colours::new(&mesh, &polygons, surface.own_triangles);
    let mut parts = Vec::with_capacity(components.polygons.len());
    for (polygons, vertices) in components.polygons.iter().zip(components.vertices.iter()) {
        progress.check()?;
        let size = colours.colour(polygons, vertices);
        let start = traversal.start(&colours, polygons, vertices);
        let (order, hash) = traversal.whole(&colours, start);
        placement::place(&mesh, traversal.polygons, &order, vertices, &features, size, &mut placed);
        parts.push(Part { size: colours::step(size), hash, order });
    }
    // Components that agree in all three look the same, and then their order does not matter.
    parts.sort_by_key(|part| (Reverse(part.order.len()), Reverse(part.size), part.hash));
    let order = parts.iter().flat_map(|part| &part.order);
    assemble(surface, &polygons, order, &placed, progress)
}

/// A component in its new order.
struct Part {
    /// In small steps.
    size: u64,
    /// Equal for components that look the same but for their size.
    hash: u64,
    /// The side by which each polygon is reached.
    order: Vec<HalfedgeId>,
}

/// The connected components of a mesh.
struct Components {
    polygons: Groups<u32>,
    vertices: Groups<VertexId>,
}

impl Components {
    fn new(mesh: &TriMesh, polygons: &Polygons<'_>) -> Self {
        let (label, count) = mesh.components();
        let of_polygon: Vec<u32> = (0..polygons.len()).map(|polygon| label[polygons.faces(polygon).start]).collect();
        let of_vertex: Vec<u32> = mesh.vertices().map(|v| label[mesh.an_outgoing(v).face().index()]).collect();
        Self {
            polygons: Groups::by_label(&of_polygon, count, |polygon| FaceId::new(polygon).index() as u32),
            vertices: Groups::by_label(&of_vertex, count, VertexId::new),
        }
    }
}

/// The surface whose polygons come in an order, each reached by the side that is named; `placed` says where each vertex
/// of the old mesh is now.
fn assemble<'a>(
    surface: Surface,
    polygons: &Polygons<'_>,
    order: impl Iterator<Item = &'a HalfedgeId>,
    placed: &[Point3<f64>],
    progress: &Progress,
) -> Result<Surface, Cancelled> {
    let mut assembly = Assembly::new(&surface, polygons, placed);
    for (number, &entry) in order.enumerate() {
        if number.is_multiple_of(1 << 12) {
            progress.check()?;
        }
        assembly.add(entry, progress)?;
    }
    let Assembly { source, corner, twin, polygon, new_side, sides, .. } = assembly;
    let old = &surface.mesh;
    let mut twin = twin;
    for h in old.halfedges().filter(|&h| polygons.is_side(h) && !old.twin(h).is_none()) {
        twin[new_side[h.index()].index()] = new_side[old.twin(h).index()];
    }
    let mut guide = if old.has_guides() { vec![false; twin.len()] } else { Vec::new() };
    for h in old.halfedges().filter(|&h| old.is_guide(h) && polygons.is_side(h)) {
        guide[new_side[h.index()].index()] = true;
    }
    let (mesh, old_vertex) = TriMesh::from_glued(&source, twin, |v| placed[v as usize]);
    let vertex = old_vertex.iter().map(|&v| surface.vertex[v as usize]).collect();
    let old_vertices: Vec<VertexId> = old_vertex.iter().map(|&v| VertexId::new(v as usize)).collect();
    let mesh = mesh.with_guides(guide).with_seam_weights(old.seam_weights_of(&old_vertices));
    let input_polygon = sides.iter().map(|h| surface.input_polygon(h.face()) as u32).collect();
    Ok(Surface { mesh: Arc::new(mesh), polygon, input_polygon, corner, vertex, ..surface })
}

/// The arrays of the new mesh as they grow.
struct Assembly<'a> {
    surface: &'a Surface,
    polygons: &'a Polygons<'a>,
    placed: &'a [Point3<f64>],
    /// The old vertex at each corner.
    source: Vec<u32>,
    /// The input's corner at each corner.
    corner: Vec<u32>,
    /// Opposite half-edges of diagonals so far.
    twin: Vec<HalfedgeId>,
    polygon: Vec<u32>,
    /// What each side of the old mesh is in the new one.
    new_side: Vec<HalfedgeId>,
    /// Whether a quad's diagonal ends where a side of it begins.
    has_diagonal: Vec<bool>,
    /// The side by which each polygon was reached.
    sides: Vec<HalfedgeId>,
    outline: Vec<HalfedgeId>,
    triangles: Vec<[u32; 3]>,
    open: Vec<(u32, u32, HalfedgeId)>,
}

impl<'a> Assembly<'a> {
    fn new(surface: &'a Surface, polygons: &'a Polygons<'a>, placed: &'a [Point3<f64>]) -> Self {
        let count = surface.mesh.halfedge_count();
        Self {
            surface,
            polygons,
            placed,
            source: Vec::with_capacity(count),
            corner: Vec::with_capacity(count),
            twin: Vec::with_capacity(count),
            polygon: Vec::with_capacity(count / 3),
            new_side: vec![HalfedgeId::NONE; count],
            has_diagonal: vec![false; count],
            sides: Vec::with_capacity(polygons.len()),
            outline: Vec::new(),
            triangles: Vec::new(),
            open: Vec::new(),
        }
    }

    /// Appends the polygon that is reached by a side.
    fn add(&mut self, entry: HalfedgeId, progress: &Progress) -> Result<(), Cancelled> {
        self.outline.clear();
        self.outline.extend(self.polygons.around(entry));
        self.triangles.clear();
        let mesh = &self.surface.mesh;
        match *self.outline {
            [_, _, _] => self.triangles.push([0, 1, 2]),
            [a, b, c, d] if self.surface.own_triangles => {
                // Not as placed: rounding there may be more than what tells the diagonals of small quads apart.
                let corners = [a, b, c, d].map(|h| mesh.position(mesh.from(h)));
                self.triangles.extend(halve_quad(
                    corners,
                    self.needed_diagonal([a, b, c, d]),
                    self.wanted_diagonal(entry),
                ));
            }
            _ if self.surface.own_triangles => {
                let corners: Vec<Point3<f64>> =
                    self.outline.iter().map(|&h| self.placed[mesh.from(h).index()]).collect();
                clip_ears(&corners, &mut self.triangles, progress)?;
            }
            _ => self.given_triangles(),
        }
        self.append();
        Ok(())
    }

    /// The diagonal that a quad needs: from a corner where only one other polygon ends, if both would be halved across that corner. Then both had a diagonal between
    /// the same two vertices, and no map with straight edges has room for what lies between them.
    fn needed_diagonal(&self, sides: [HalfedgeId; 4]) -> Option<Diagonal> {
        let mesh = &self.surface.mesh;
        let is_halved_across = |side: HalfedgeId| {
            let corners: Vec<Point3<f64>> = self.polygons.around(side).map(|h| mesh.position(mesh.from(h))).collect();
            <[Point3<f64>; 4]>::try_from(corners)
                .is_ok_and(|corners| halve_quad(corners, None, Diagonal::FromFirst)[0] == [0, 1, 3])
        };
        let is_needed = |side: HalfedgeId| {
            let v = mesh.from(side);
            let around: Vec<HalfedgeId> = mesh.outgoing(v).filter(|&h| self.polygons.is_side(h)).collect();
            !mesh.is_boundary_vertex(v) && around.len() == 2 && around.into_iter().all(is_halved_across)
        };
        let [a, b, c, d] = sides.map(is_needed);
        match (a || c, b || d) {
            (true, false) => Some(Diagonal::FromFirst),
            (false, true) => Some(Diagonal::FromSecond),
            _ => None,
        }
    }

    /// The diagonal that a quad gets where both will do: parallel to that of the quad before, as in a grid of which all
    /// quads begin at the same corner.
    fn wanted_diagonal(&self, entry: HalfedgeId) -> Diagonal {
        let before = self.surface.mesh.twin(entry);
        let at_second = !before.is_none()
            && self.polygons.is_quad(before)
            && !self.new_side[before.index()].is_none()
            && !self.has_diagonal[before.index()];
        if at_second { Diagonal::FromSecond } else { Diagonal::FromFirst }
    }

    /// The triangles that the polygon has, by corner counted from the first of the outline, each beginning with its
    /// lowest; ascending.
    fn given_triangles(&mut self) {
        let Self { surface, polygons, outline, triangles, .. } = self;
        let mut place: Vec<(u32, u32)> = outline.iter().zip(0..).map(|(h, i)| (surface.corner[h.index()], i)).collect();
        place.sort_unstable();
        let local =
            |h: HalfedgeId| place.binary_search_by_key(&surface.corner[h.index()], |p| p.0).map_or(0, |at| place[at].1);
        for f in polygons.faces(polygons.of(outline[0])) {
            let [a, b, c] = FaceId::new(f).halfedges().map(local);
            triangles.push(if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            });
        }
        triangles.sort_unstable();
    }

    /// Appends the triangles of the outline, joined along their diagonals.
    fn append(&mut self) {
        let Self { surface, outline, .. } = self;
        let corners = outline.len() as u32;
        let number = self.sides.len() as u32;
        self.open.clear();
        for triangle in &self.triangles {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let (old, new) = (outline[a as usize], HalfedgeId::new(self.twin.len()));
                self.source.push(surface.mesh.from(old).index() as u32);
                self.corner.push(surface.corner[old.index()]);
                self.twin.push(HalfedgeId::NONE);
                if b == (a + 1) % corners {
                    self.new_side[old.index()] = new;
                } else {
                    self.open.push((a.min(b), a.max(b), new));
                    self.has_diagonal[old.index()] = true;
                }
            }
            self.polygon.push(number);
        }
        self.open.sort_unstable();
        for pair in self.open.chunks_exact(2) {
            let (g, h) = (pair[0].2, pair[1].2);
            self.twin[g.index()] = h;
            self.twin[h.index()] = g;
        }
        self.sides.push(outline[0]);
    }
}
