//! Any polygons in, an oriented manifold out.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::bent_links;
use super::collapse::{Collapsed, join_ends};
use super::defects::Defects;
use super::frame::Frame;
use super::glue::{Glued, Sides};
use super::index::{FaceId, HalfedgeId, VertexId};
use super::input::{MeshError, MeshInput, Polygons};
use super::irregular::{count_bow_ties, count_duplicates, count_welded, severed_vertices};
use super::measure::{area_vector, triangle_area};
use super::orient::{Orientation, orient};
use super::tri_mesh::TriMesh;
use super::triangulate::{Triangulation, check_given, triangulate};
use super::weld::{Places, weld};
use crate::progress::Progress;

/// Least area, in units of half the extent squared, that sets the scale. Below, it may be rounding.
const LEAST_AREA: f64 = 1e-12;

/// Choices of [`condition`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ConditionOptions {
    /// Whether vertices at the same position are one.
    pub weld: bool,
    /// How near to each other such vertices are, as [`Settings::weld_distance`](crate::Settings::weld_distance) says.
    pub weld_distance: Option<f64>,
    /// The angle between two faces, in degrees, from which on the edge between them is cut; `None` cuts none.
    pub cut_angle: Option<f64>,
}

impl Default for ConditionOptions {
    fn default() -> Self {
        Self { weld: true, weld_distance: None, cut_angle: None }
    }
}

/// An oriented manifold made of the input's polygons, and where each part of it came from.
///
/// Guaranteed: the invariants of [`TriMesh`]; each polygon is a topological disk of n − 2 triangles
/// whose inner edges are glued, so cutting along anything but diagonals never splits one; corners
/// of a polygon are distinct corners of the mesh even where they share a vertex. Where a polygon has
/// a side of no length, n counts its ends as one corner: see [`Surface::followers`].
///
/// Not guaranteed: a boundary, being connected, positive areas, distinct positions.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// The mesh, centred on the middle of its box and scaled to unit area (see [`Surface::scale`]).
    pub mesh: Arc<TriMesh>,
    /// The polygon of each triangle; ascending. Numbered as in the input, unless `input_polygon` says otherwise.
    pub polygon: Vec<u32>,
    /// The input's number of each polygon; empty where they are numbered as there.
    pub input_polygon: Vec<u32>,
    /// Whether all polygons were divided into triangles here, so that they may be divided in another way.
    pub own_triangles: bool,
    /// The input corner of each corner of the mesh.
    pub corner: Vec<u32>,
    /// The input vertex of each vertex of the mesh: of several that are one, any.
    pub vertex: Vec<u32>,
    /// The lowest of the input vertices that are one with each input vertex, welded or joined by an edge of no length.
    pub representative: Vec<u32>,
    /// Each input corner that is no corner of the mesh, since a side of no length ends there, with the input corner that
    /// lies at the same point and is.
    pub followers: Vec<[u32; 2]>,
    /// Each input polygon that is nothing but a segment or a point on the border of another, with that one; it has no
    /// triangles, and its corners follow the other's. Ascending.
    pub absorbed: Vec<[u32; 2]>,
    /// Polygons with a non-finite vertex, which have no triangles here; ascending.
    pub unmapped: Vec<u32>,
    /// What was found and mended.
    pub defects: Defects,
    /// Length in the input's unit of one unit of the mesh. A surface of less area than 1e-12 of the
    /// square of half its extent has that half for its unit instead.
    pub scale: f64,
    /// The diagonal of the input's bounding box, in units of the mesh.
    pub diagonal: f64,
}

impl Default for Surface {
    /// No faces.
    fn default() -> Self {
        Self {
            mesh: Arc::default(),
            polygon: Vec::new(),
            input_polygon: Vec::new(),
            own_triangles: true,
            corner: Vec::new(),
            vertex: Vec::new(),
            representative: Vec::new(),
            followers: Vec::new(),
            absorbed: Vec::new(),
            unmapped: Vec::new(),
            defects: Defects::default(),
            scale: 1.0,
            diagonal: 0.0,
        }
    }
}

impl Surface {
    /// The input's number of the polygon of a face.
    #[must_use]
    pub(crate) fn input_polygon(&self, f: FaceId) -> usize {
        let polygon = self.polygon[f.index()];
        self.input_polygon.get(polygon as usize).map_or(polygon, |&input| input) as usize
    }

    /// The vertex of the mesh that each input corner lies at, by corner, ascending; corners of unmapped polygons have none.
    /// O(n log n).
    #[must_use]
    pub(crate) fn places(&self) -> Vec<(u32, VertexId)> {
        let mut places: Vec<(u32, VertexId)> =
            self.mesh.halfedges().map(|h| (self.corner[h.index()], self.mesh.from(h))).collect();
        places.sort_unstable();
        places.dedup();
        let own = places.len();
        for &[corner, with] in &self.followers {
            if let Ok(at) = places[..own].binary_search_by_key(&with, |p| p.0) {
                places.push((corner, places[at].1));
            }
        }
        places.sort_unstable();
        places
    }
}

/// Makes an oriented manifold of any mesh.
///
/// Polygons are triangulated and glued along shared edges, so that edges with more than two faces,
/// bow-ties, one-sided surfaces, keyholes and inconsistent windings come apart where they must and
/// nowhere else. Most area of each component keeps its input winding. Faces with a non-finite
/// vertex are left out and listed. A mesh without faces gives an empty surface.
///
/// Edges of no length become points: those whose ends are one vertex or lie at one position, or within
/// 1e-7 of the bounding box's diagonal and a thousandth of the longest side of each of their polygons.
///
/// O(n log n); deterministic, whatever the number of threads.
///
/// # Errors
/// [`MeshError`] names the first element that makes the arrays meaningless, or is
/// [`MeshError::Cancelled`]; also if every face has a non-finite vertex.
pub(crate) fn condition(
    input: &MeshInput<'_>,
    options: &ConditionOptions,
    progress: &Progress,
) -> Result<Surface, MeshError> {
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

    let mut representative: Vec<u32> = if options.weld {
        let (polygons, mapped, positions, used) = (&polygons, &mapped, input.positions, &used);
        let places = Places { polygons, mapped, positions, used, points: &points, frame: &frame };
        weld(&places, options.weld_distance, progress)?
    } else {
        (0..input.positions.len() as u32).collect()
    };
    count_welded(&representative, &mut defects);
    join_ends(&polygons, &mapped, &points, frame.diagonal, &mut representative);
    progress.check()?;

    let unmapped = (0..polygons.len() as u32).filter(|&p| !mapped[p as usize]).collect();
    let surface = match Collapsed::new(&polygons, &mapped, &representative) {
        None => surface_of(&polygons, &mapped, &points, &representative, input, options, defects, progress)?,
        Some(collapsed) => {
            collapsed.edges.iter().for_each(|&edge| defects.edges_of_no_length.found(edge));
            let given = input.corner_triangles;
            given.map_or(Ok(()), |given| check_given(&polygons, given))?;
            let given = given.map(|given| collapsed.triangles(given, polygons.corner_count()));
            let input = MeshInput {
                corner_vertices: &collapsed.corner_vertices,
                face_offsets: &collapsed.face_offsets,
                corner_triangles: given.as_deref(),
                ..*input
            };
            let mapped: Vec<bool> = collapsed.polygon.iter().map(|&p| mapped[p as usize]).collect();
            let polygons = Polygons::new(&input)?;
            let surface = surface_of(&polygons, &mapped, &points, &representative, &input, options, defects, progress)?;
            uncollapsed(surface, collapsed)
        }
    };
    Ok(Surface {
        unmapped,
        representative,
        own_triangles: input.corner_triangles.is_none(),
        diagonal: frame.diagonal / surface.scale,
        scale: (surface.scale * frame.half_extent).min(f64::MAX),
        ..surface
    })
}

/// A surface of collapsed polygons with the numbers of the input.
fn uncollapsed(mut surface: Surface, collapsed: Collapsed) -> Surface {
    surface.corner.iter_mut().for_each(|c| *c = collapsed.corner[*c as usize]);
    surface.polygon.iter_mut().for_each(|p| *p = collapsed.polygon[*p as usize]);
    surface.defects.renumber_faces(|p| collapsed.polygon[p as usize]);
    Surface { followers: collapsed.followers, absorbed: collapsed.absorbed, ..surface }
}

/// The surface of polygons none of whose sides are to be collapsed, in the frame's unit, with `defects` and those found.
/// Of `input`, which holds the same polygons, only triangles, seams, guides and weights of seams are looked at; of the
/// options only the angle.
#[expect(clippy::too_many_arguments, reason = "each is the result of another step before")]
fn surface_of(
    polygons: &Polygons<'_>,
    mapped: &[bool],
    points: &[Point3<f64>],
    representative: &[u32],
    input: &MeshInput<'_>,
    options: &ConditionOptions,
    mut defects: Defects,
    progress: &Progress,
) -> Result<Surface, MeshError> {
    let triangulation = triangulate(polygons, mapped, points, input.corner_triangles, progress)?;
    defects.replaced_triangulations = triangulation.replaced;
    let inner = InnerEdges::new(polygons, &triangulation);
    progress.check()?;

    let sides = Sides {
        polygons,
        mapped,
        points,
        representative,
        triangles: &triangulation.triangles,
        side_halfedge: &inner.side_halfedge,
        seams: input.seams,
    };
    let Glued { links, mut severed, non_manifold } = sides.glue(progress)?;
    defects.non_manifold_edges = non_manifold;
    progress.check()?;

    let (areas, total_area) = polygon_areas(polygons, points, &triangulation, &mut defects);
    let mut orientation = orient(polygons.len(), links, |corner| polygons.polygon(corner as usize), &areas);
    for link in &orientation.contradicting {
        let [a, b] = polygons.side(link.sides[0] as usize);
        defects.contradicting_edges.found([a.min(b) as u32, a.max(b) as u32]);
        severed.extend(link.sides);
    }
    if let Some(angle) = options.cut_angle {
        let normals = normals(polygons, points, &triangulation, &orientation.reversed);
        let polygon = |side: u32| polygons.polygon(side as usize);
        for link in bent_links::take(&mut orientation.links, &normals, polygon, angle) {
            severed.extend(link.sides);
        }
    }
    for p in (0..polygons.len()).filter(|&p| orientation.reversed[p]) {
        defects.reversed_faces.found(p as u32);
    }
    progress.check()?;

    // The second pass of scaling: from unit extent to unit area.
    let unit = if total_area > LEAST_AREA { total_area.sqrt() } else { 1.0 };
    let assembled = assemble(&triangulation, inner, &orientation);
    let guides = guide_marks(input.guides, polygons, representative, &assembled);
    let (mesh, source) = TriMesh::from_glued(&assembled.corner, assembled.twin, |corner| {
        points[polygons.vertex(corner as usize)] / unit
    });
    let vertex: Vec<u32> = source.iter().map(|&c| polygons.vertex(c as usize) as u32).collect();
    let weights = input.seam_weights.map(|weights| seam_weights(weights, representative, &vertex));
    let mesh = mesh.with_guides(guides).with_seam_weights(weights.unwrap_or_default());
    progress.check()?;

    let severed = severed_vertices(polygons, mapped, representative, &severed, &mut defects);
    count_bow_ties(polygons, &mesh, &assembled.corner, &severed, &mut defects);
    count_duplicates(polygons, mapped, &mut defects);
    progress.check()?;

    Ok(Surface {
        mesh: Arc::new(mesh),
        polygon: triangulation.polygon,
        corner: assembled.corner,
        vertex,
        defects,
        scale: unit,
        ..Surface::default()
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
    /// Whether a half-edge runs inside a polygon.
    diagonal: Vec<bool>,
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
    Assembled { corner, twin, diagonal }
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

/// What a seam at each vertex of the surface counts for, given what it counts for at those of the input: where some are welded, the geometric mean of
/// all of these. O(n).
fn seam_weights(weights: &[f32], representative: &[u32], vertex: &[u32]) -> Vec<f32> {
    let mut welded = vec![(0.0, 0.0); weights.len()];
    for (weight, r) in weights.iter().zip(representative) {
        let (sum, count) = &mut welded[*r as usize];
        *sum += f64::from(*weight).ln();
        *count += 1.0;
    }
    let mean = |v: &u32| {
        let (sum, count) = welded[representative[*v as usize] as usize];
        // The very number that was given where nothing was welded.
        if count > 1.0 { f64::exp(sum / count) as f32 } else { weights[*v as usize] }
    };
    vertex.iter().map(mean).collect()
}

/// The normal of each polygon as it is wound in the mesh, times twice its area.
fn normals(
    polygons: &Polygons<'_>,
    points: &[Point3<f64>],
    triangulation: &Triangulation,
    reversed: &[bool],
) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); polygons.len()];
    for (corners, &p) in triangulation.triangles.iter().zip(&triangulation.polygon) {
        let normal = area_vector(corners.map(|c| points[polygons.vertex(c as usize)]));
        normals[p as usize] += if reversed[p as usize] { -normal } else { normal };
    }
    normals
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
