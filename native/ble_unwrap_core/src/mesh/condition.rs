//! Any polygons in, an oriented manifold out.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::slice::ParallelSliceMut;

use super::defects::Defects;
use super::glue::{Glued, Sides};
use super::index::{HalfedgeId, VertexId};
use super::input::{MeshError, MeshInput, Polygons};
use super::measure::triangle_area;
use super::orient::{Orientation, orient};
use super::tri_mesh::TriMesh;
use super::triangulate::{Triangulation, triangulate};
use super::weld::weld;
use crate::progress::Progress;

/// Least area, in units of half the extent squared, that sets the scale. Below, it may be rounding.
const LEAST_AREA: f64 = 1e-12;

/// Choices of [`condition`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConditionOptions {
    /// Whether vertices at exactly the same position are one.
    pub weld: bool,
}

impl Default for ConditionOptions {
    fn default() -> Self {
        Self { weld: true }
    }
}

/// An oriented manifold made of the input's polygons, and where each part of it came from.
///
/// Guaranteed: the invariants of [`TriMesh`]; each polygon is a topological disk of n − 2 triangles
/// whose inner edges are glued, so cutting along anything but diagonals never splits one; corners
/// of a polygon are distinct corners of the mesh even where they share a vertex.
///
/// Not guaranteed: a boundary, being connected, positive areas, distinct positions.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The mesh, centred on the middle of its box and scaled to unit area (see [`Surface::scale`]).
    pub mesh: Arc<TriMesh>,
    /// The input polygon of each triangle; ascending.
    pub polygon: Vec<u32>,
    /// The input corner of each corner of the mesh.
    pub corner: Vec<u32>,
    /// The input vertex of each vertex of the mesh: of several welded ones, any.
    pub vertex: Vec<u32>,
    /// Whether a half-edge runs inside a polygon; such edges are never cut.
    pub diagonal: Vec<bool>,
    /// Whether a triangle is wound against its polygon.
    pub reversed: Vec<bool>,
    /// Polygons with a non-finite vertex, which have no triangles here; ascending.
    pub unmapped: Vec<u32>,
    /// What was found and mended.
    pub defects: Defects,
    /// Length in the input's unit of one unit of the mesh. A surface of less area than 1e-12 of the
    /// square of half its extent has that half for its unit instead.
    pub scale: f64,
}

impl Default for Surface {
    /// No faces.
    fn default() -> Self {
        Self {
            mesh: Arc::default(),
            polygon: Vec::new(),
            corner: Vec::new(),
            vertex: Vec::new(),
            diagonal: Vec::new(),
            reversed: Vec::new(),
            unmapped: Vec::new(),
            defects: Defects::default(),
            scale: 1.0,
        }
    }
}

impl Surface {
    /// Whether a half-edge runs inside a polygon.
    #[must_use]
    pub fn is_diagonal(&self, h: HalfedgeId) -> bool {
        self.diagonal[h.index()]
    }
}

/// Makes an oriented manifold of any mesh.
///
/// Polygons are triangulated and glued along shared edges, so that edges with more than two faces,
/// bow-ties, one-sided surfaces, keyholes and inconsistent windings come apart where they must and
/// nowhere else. Most area of each component keeps its input winding. Faces with a non-finite
/// vertex are left out and listed. A mesh without faces gives an empty surface.
///
/// O(n log n); deterministic, whatever the number of threads.
///
/// # Errors
/// [`MeshError`] names the first element that makes the arrays meaningless, or is
/// [`MeshError::Cancelled`]; also if every face has a non-finite vertex.
pub fn condition(input: &MeshInput<'_>, options: &ConditionOptions, progress: &Progress) -> Result<Surface, MeshError> {
    let polygons = Polygons::new(input)?;
    progress.check()?;
    let mut defects = Defects::default();
    let mapped = finite_polygons(&polygons, input.positions, &mut defects)?;
    let used = used_vertices(&polygons, &mapped, input.positions.len());
    let frame = Frame::around(input.positions, &used);
    let points: Vec<Point3<f64>> = input
        .positions
        .iter()
        .zip(&used)
        .map(|(p, &used)| if used { frame.place(p) } else { Point3::origin() })
        .collect();
    progress.check()?;

    let triangulation = triangulate(&polygons, &mapped, &points, input.corner_triangles, progress)?;
    defects.replaced_triangulations = triangulation.replaced;
    let inner = InnerEdges::new(&polygons, &triangulation);
    let representative =
        if options.weld { weld(input.positions, &used) } else { (0..input.positions.len() as u32).collect() };
    progress.check()?;

    let sides = Sides {
        polygons: &polygons,
        mapped: &mapped,
        points: &points,
        representative: &representative,
        triangles: &triangulation.triangles,
        side_halfedge: &inner.side_halfedge,
        seams: input.seams,
    };
    let Glued { links, mut severed, non_manifold } = sides.glue(progress)?;
    defects.non_manifold_edges = non_manifold;
    progress.check()?;

    let (areas, total_area) = polygon_areas(&polygons, &points, &triangulation, &mut defects);
    let orientation = orient(polygons.len(), links, |corner| polygons.polygon(corner as usize), &areas);
    for link in &orientation.contradicting {
        let [a, b] = polygons.side(link.sides[0] as usize);
        defects.contradicting_edges.found([a.min(b) as u32, a.max(b) as u32]);
        severed.extend(link.sides);
    }
    for p in (0..polygons.len()).filter(|&p| orientation.reversed[p]) {
        defects.reversed_faces.found(p as u32);
    }
    progress.check()?;

    // The second pass of scaling: from unit extent to unit area.
    let unit = if total_area > LEAST_AREA { total_area.sqrt() } else { 1.0 };
    let assembled = assemble(&triangulation, inner, &orientation);
    let guides = guide_marks(input.guides, &polygons, &representative, &assembled);
    let (mesh, source) = TriMesh::from_glued(&assembled.corner, assembled.twin, |corner| {
        points[polygons.vertex(corner as usize)] / unit
    });
    let mesh = mesh.with_guides(guides);
    let vertex: Vec<u32> = source.iter().map(|&c| polygons.vertex(c as usize) as u32).collect();
    progress.check()?;

    count_welded(&representative, &mut defects);
    let severed = severed_vertices(&polygons, &mapped, &representative, &severed, &mut defects);
    count_bow_ties(&polygons, &mesh, &assembled.corner, &severed, &mut defects);
    count_duplicates(&polygons, &mapped, &mut defects);
    progress.check()?;

    Ok(Surface {
        mesh: Arc::new(mesh),
        polygon: triangulation.polygon,
        corner: assembled.corner,
        vertex,
        diagonal: assembled.diagonal,
        reversed: assembled.reversed,
        unmapped: (0..polygons.len() as u32).filter(|&p| !mapped[p as usize]).collect(),
        defects,
        scale: (unit * frame.half_extent).min(f64::MAX),
    })
}

/// Which polygons have finite vertices only.
fn finite_polygons(
    polygons: &Polygons<'_>,
    positions: &[[f64; 3]],
    defects: &mut Defects,
) -> Result<Vec<bool>, MeshError> {
    let finite: Vec<bool> = positions.iter().map(|p| p.iter().all(|x| x.is_finite())).collect();
    let mut bad = Vec::new();
    let mut mapped = Vec::with_capacity(polygons.len());
    for p in 0..polygons.len() {
        let before = bad.len();
        bad.extend(polygons.corners(p).map(|c| polygons.vertex(c)).filter(|&v| !finite[v]));
        mapped.push(bad.len() == before);
        if bad.len() > before {
            defects.unmapped_faces.found(p as u32);
        }
    }
    if let (Some(&vertex), false) = (bad.first(), mapped.contains(&true)) {
        return Err(MeshError::NoFiniteFace { face: 0, vertex });
    }
    bad.sort_unstable();
    bad.dedup();
    bad.iter().for_each(|&v| defects.non_finite_vertices.found(v as u32));
    Ok(mapped)
}

fn used_vertices(polygons: &Polygons<'_>, mapped: &[bool], vertex_count: usize) -> Vec<bool> {
    let mut used = vec![false; vertex_count];
    for corner in 0..polygons.corner_count() {
        if mapped[polygons.polygon(corner)] {
            used[polygons.vertex(corner)] = true;
        }
    }
    used
}

/// The middle and half the longest side of a box; what it holds is placed in [−1, 1]³.
struct Frame {
    centre: Vector3<f64>,
    half_extent: f64,
}

impl Frame {
    fn around(positions: &[[f64; 3]], used: &[bool]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (p, _) in positions.iter().zip(used).filter(|(_, used)| **used) {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        if low[0] > high[0] {
            return Self { centre: Vector3::zeros(), half_extent: 1.0 };
        }
        // Halved before they are added or subtracted: neither overflows.
        let centre = Vector3::from_fn(|k, _| 0.5 * low[k] + 0.5 * high[k]);
        let half_extent = (0..3).map(|k| 0.5 * high[k] - 0.5 * low[k]).fold(0.0, f64::max);
        Self { centre, half_extent: if half_extent > 0.0 { half_extent } else { 1.0 } }
    }

    fn place(&self, p: &[f64; 3]) -> Point3<f64> {
        // Divided, not multiplied by an inverse, which overflows for the tiniest extents.
        Point3::from((Vector3::from(*p) - self.centre) / self.half_extent)
    }
}

/// Half-edges of the triangulated polygons as wound in the input, before polygons are joined.
struct InnerEdges {
    /// The opposite half-edge of a diagonal; `NONE` for sides.
    twin: Vec<HalfedgeId>,
    /// The half-edge that is the side of each corner; `u32::MAX` for polygons left out.
    side_halfedge: Vec<u32>,
}

impl InnerEdges {
    /// Finds each polygon's sides and joins its triangles along their diagonals. O(n) for triangles
    /// and quads, O(n log n) for a polygon of n corners.
    fn new(polygons: &Polygons<'_>, triangulation: &Triangulation) -> Self {
        let triangles = &triangulation.triangles;
        let mut twin = vec![HalfedgeId::NONE; 3 * triangles.len()];
        let mut side_halfedge = vec![u32::MAX; polygons.corner_count()];
        let mut diagonals: Vec<(u32, u32, usize)> = Vec::new();
        let mut first = 0;
        for group in triangulation.polygon.chunk_by(|a, b| a == b) {
            let corners = polygons.corners(group[0] as usize);
            diagonals.clear();
            for t in first..first + group.len() {
                for k in 0..3 {
                    let (a, b) = (triangles[t][k], triangles[t][(k + 1) % 3]);
                    let next = if a as usize + 1 == corners.end { corners.start } else { a as usize + 1 };
                    if b as usize == next {
                        side_halfedge[a as usize] = (3 * t + k) as u32;
                    } else {
                        diagonals.push((a.min(b), a.max(b), 3 * t + k));
                    }
                }
            }
            diagonals.sort_unstable();
            for pair in diagonals.chunks_exact(2) {
                let (g, h) = (pair[0].2, pair[1].2);
                twin[g] = HalfedgeId::new(h);
                twin[h] = HalfedgeId::new(g);
            }
            first += group.len();
        }
        Self { twin, side_halfedge }
    }
}

/// The arrays of the final mesh: polygons turned over where need be, and joined.
struct Assembled {
    corner: Vec<u32>,
    twin: Vec<HalfedgeId>,
    diagonal: Vec<bool>,
    reversed: Vec<bool>,
}

fn assemble(triangulation: &Triangulation, inner: InnerEdges, orientation: &Orientation) -> Assembled {
    let InnerEdges { twin: mut joined, side_halfedge } = inner;
    let is_diagonal: Vec<bool> = joined.iter().map(|t| !t.is_none()).collect();
    for link in &orientation.links {
        let [a, b] = link.sides.map(|s| HalfedgeId::new(side_halfedge[s as usize] as usize));
        joined[a.index()] = b;
        joined[b.index()] = a;
    }
    let reversed: Vec<bool> = triangulation.polygon.iter().map(|&p| orientation.reversed[p as usize]).collect();
    // Turning triangle (a, b, c) to (a, c, b) exchanges its half-edges 0 and 2.
    let turned = |h: HalfedgeId| if reversed[h.face().index()] { h.face().halfedge(2 - h.slot()) } else { h };
    let mut corner = Vec::with_capacity(joined.len());
    for (t, &[a, b, c]) in triangulation.triangles.iter().enumerate() {
        corner.extend(if reversed[t] { [a, c, b] } else { [a, b, c] });
    }
    let mut twin = vec![HalfedgeId::NONE; joined.len()];
    let mut diagonal = vec![false; joined.len()];
    for (h, &t) in joined.iter().enumerate() {
        let to = turned(HalfedgeId::new(h)).index();
        diagonal[to] = is_diagonal[h];
        if !t.is_none() {
            twin[to] = turned(t);
        }
    }
    Assembled { corner, twin, diagonal, reversed }
}

/// For each half-edge whether its ends are those of a guide; nothing where there are no guides. Vertices that are welded
/// count as one. O(n log g).
fn guide_marks(
    guides: &[[i32; 2]],
    polygons: &Polygons<'_>,
    representative: &[u32],
    assembled: &Assembled,
) -> Vec<bool> {
    if guides.is_empty() {
        return Vec::new();
    }
    let key = |[a, b]: [usize; 2]| {
        let (a, b) = (representative[a], representative[b]);
        (a.min(b), a.max(b))
    };
    let mut keys: Vec<(u32, u32)> = guides.iter().map(|pair| key(pair.map(|v| v as usize))).collect();
    keys.sort_unstable();
    keys.dedup();
    let is_guide = |h: usize| {
        let ends = [HalfedgeId::new(h), HalfedgeId::new(h).next()];
        !assembled.diagonal[h]
            && keys.binary_search(&key(ends.map(|c| polygons.vertex(assembled.corner[c.index()] as usize)))).is_ok()
    };
    (0..assembled.corner.len()).map(is_guide).collect()
}

/// Area of each polygon and of all, in the frame's unit. Counts the triangles that have none.
fn polygon_areas(
    polygons: &Polygons<'_>,
    points: &[Point3<f64>],
    triangulation: &Triangulation,
    defects: &mut Defects,
) -> (Vec<f64>, f64) {
    // Relative to the longest side: far below what anybody models, above rounding.
    const NO_HEIGHT: f64 = 1e-12;
    let mut areas = vec![0.0; polygons.len()];
    let mut total = 0.0;
    for (corners, &p) in triangulation.triangles.iter().zip(&triangulation.polygon) {
        let q = corners.map(|c| points[polygons.vertex(c as usize)]);
        let area = triangle_area(q);
        let longest = (q[1] - q[0]).norm_squared().max((q[2] - q[1]).norm_squared()).max((q[0] - q[2]).norm_squared());
        if area <= 0.5 * NO_HEIGHT * longest {
            defects.zero_area_triangles.found(p);
        }
        areas[p as usize] += area;
        total += area;
    }
    (areas, total)
}

fn count_welded(representative: &[u32], defects: &mut Defects) {
    for v in (0..representative.len() as u32).filter(|&v| representative[v as usize] != v) {
        defects.welded_vertices.found(v);
    }
}

/// Vertices at which an edge was cut or at which a polygon meets itself: several fans are no bow-tie
/// there. Counts the polygons that meet themselves.
fn severed_vertices(
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
fn count_bow_ties(polygons: &Polygons<'_>, mesh: &TriMesh, corner: &[u32], severed: &[bool], defects: &mut Defects) {
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
fn count_duplicates(polygons: &Polygons<'_>, mapped: &[bool], defects: &mut Defects) {
    let vertices = |p: usize| polygons.corners(p).map(|c| polygons.vertex(c) as u32);
    // A sum is the same in any order; scattered, few different sets share one.
    let mut keyed: Vec<(u64, u32)> = (0..polygons.len())
        .filter(|&p| mapped[p])
        .map(|p| (vertices(p).fold(0u64, |sum, v| sum.wrapping_add(scatter(v))), p as u32))
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

/// A 64-bit number for a vertex, by the finaliser of SplitMix64 (Steele, Lea, Flood 2014).
fn scatter(v: u32) -> u64 {
    let mut z = (u64::from(v) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
