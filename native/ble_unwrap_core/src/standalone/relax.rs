//! Islands of a UV map, whoever made it, with less stretch than they had.

mod part;

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Point2;
use rayon::prelude::*;
use thiserror::Error;

use crate::collections::DisjointSets;
use crate::error::UnwrapError;
use crate::error_kind::ErrorKind;
use crate::flattening::NEGLIGIBLE;
use crate::mesh::{self, ConditionOptions, FaceId, HalfedgeId, MeshError, MeshInput, Surface, TriMesh, VertexId};
use crate::metrics::{self, NONE, Texture, UvMesh};
use crate::progress::{Cancelled, Progress, Stage};
use crate::settings::Settings;
use crate::stretch;

pub use part::LeftAsItWas;
use part::{Frame, Part, Stop};

/// An island whose stretch would fall by no more than this share is not moved: single precision resolves no less.
const LEAST_GAIN: f64 = 1e-6;

/// What the islands are relaxed from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum RelaxStart {
    /// From how they are.
    #[default]
    AsTheyAre,
    /// From an embedding of each island by itself, as [`unwrap`](crate::unwrap()) makes it, whatever shape the island had: for islands too far
    /// from flat to be relaxed well. Their outlines, and so their seams, stay the same on the surface.
    Anew,
}

/// What [`relax`] keeps to besides its settings. The default holds nothing and relaxes all islands.
#[derive(Clone, Copy, Debug, Default)]
pub struct RelaxRules<'a> {
    /// For each corner, whether it stays where it is; so do all corners that are joined to it.
    pub pinned: Option<&'a [bool]>,
    /// For each face, whether the island that it belongs to is relaxed. One such face is enough.
    pub selected: Option<&'a [bool]>,
    /// What the islands are relaxed from.
    pub start: RelaxStart,
}

/// Why no island could be relaxed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RelaxError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(MeshError),
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] UnwrapError),
    /// The number of UVs is not the number of corners.
    #[error("there are {found} UVs, but {corners} corners; give one UV a corner")]
    UvCount {
        /// Number of UVs.
        found: usize,
        /// Number of corners.
        corners: usize,
    },
    /// The number of flags for pins is not the number of corners.
    #[error("there are {found} flags for pins, but {corners} corners; give one a corner, or none")]
    PinCount {
        /// Number of flags that were given.
        found: usize,
        /// Number of corners.
        corners: usize,
    },
    /// The number of flags for selected faces is not the number of faces.
    #[error("there are {found} flags for selected faces, but {faces} faces; give one a face, or none")]
    SelectionCount {
        /// Number of flags that were given.
        found: usize,
        /// Number of faces.
        faces: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl RelaxError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Mesh(error) => error.kind(),
            Self::Setting(error) => error.kind(),
            Self::UvCount { .. } | Self::PinCount { .. } | Self::SelectionCount { .. } => ErrorKind::Argument,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

impl From<MeshError> for RelaxError {
    fn from(error: MeshError) -> Self {
        match error {
            MeshError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Mesh(other),
        }
    }
}

/// What became of an island.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RelaxedIsland {
    /// Its lowest face.
    pub face: usize,
    /// Number of its faces.
    pub faces: usize,
    /// Number of its pinned vertices.
    pub pinned: usize,
    /// Its area on the surface, as a share of that of the whole mesh.
    pub area: f64,
    /// Its L2 stretch as it was, at its own best scale; each flipped triangle counts as its mirror image. Infinite where a
    /// triangle has no area in the map, NaN where none has one on the surface.
    pub l2_before: f64,
    /// The same of the result.
    pub l2_after: f64,
    /// Iterations of the minimisation, over all attempts.
    pub iterations: usize,
    /// Whether it was moved. If not, it either had the least stretch already, or was left as it was.
    pub moved: bool,
    /// Why it was left as it was, if it was for a reason other than that no lower stretch was found.
    pub left: Option<LeftAsItWas>,
}

/// A map whose islands were relaxed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Relaxed {
    /// A UV for each corner. Those of what was not moved are as they were, to the bit.
    pub uv: Vec<[f32; 2]>,
    /// The island of each face, numbered by its lowest face; -1 for faces with a UV or a vertex that is not finite.
    pub island: Vec<i32>,
    /// What became of each island that was to be relaxed, with its number, ascending.
    pub islands: Vec<(usize, RelaxedIsland)>,
    /// L2 stretch before of all islands that were relaxed or had the least stretch: the root of the mean of their squares,
    /// weighted by area on the surface. NaN where there are none.
    pub l2_before: f64,
    /// The same of the result.
    pub l2_after: f64,
}

/// Lowers the stretch of the islands of a UV map, whoever made it, each from where and how it lies. `uv` holds one UV for
/// each corner.
///
/// An island is what hangs together in the map: two faces belong to one if they have a vertex in common that has the same
/// UV in both. The `rules` say which corners are pinned, and which islands are meant. The minimisation is the one that
/// [`unwrap`](crate::unwrap()) ends with: Newton's method, whatever [`solver`](crate::settings::StretchSettings::solver)
/// says, with the number of iterations and the tolerance that `settings.stretch` has. Of the other settings, only those of
/// welding, of distances and embedding if the islands are to [start anew](RelaxStart::Anew), and the proportions of the texture matter. Seams, guides and weights of the `input` are not looked at.
///
/// Guaranteed:
/// - Corners that were joined are joined afterwards, to the bit, and no others are joined.
/// - Pinned corners stay where they are, to the bit.
/// - An island without pins keeps its area, its centroid, and its orientation: it is turned so that its vertices come as
///   near as possible to where they were. With one pin it is moved to that instead of its centroid. With several, they
///   alone determine where it lies and how large it is. Mirrored islands stay mirrored.
/// - An island that was moved has no triangle turned over and does not overlap itself, by exact tests of the numbers that
///   are returned. If it had neither before, its stretch is lower than it was.
/// - An island that has flips or overlaps itself is cleared of these first, as `unwrap` does it. Where that fails, as it
///   may because of pins, the island is left as it was, to the bit, and its [`left`](RelaxedIsland::left) says why. It is
///   no error.
/// - Where parts of an island are joined at a vertex only, that vertex is held as if it were pinned. If such parts would
///   overlap each other, the island is left as it was; an overlap of less than 1e-9 of the island is not seen.
/// - The result is the same for any number of threads.
///
/// Not guaranteed: that an island keeps clear of others, since its outline changes; [`measure_layout`](super::measure_layout)
/// finds where it does not, and [`repack`](super::repack()) gives each a place of its own. Nor that a quad stays convex, as long as
/// the triangles that it comes with, or is divided into, are not turned over; `measure_layout` counts such quads.
///
/// A few dozen sparse linear systems for each island; about as long as `unwrap` minimises the stretch of charts as large.
///
/// # Errors
/// [`RelaxError`]: the arrays are invalid or have the wrong lengths, a setting is out of its range, or the call was
/// cancelled.
pub fn relax(
    input: &MeshInput<'_>,
    uv: &[[f32; 2]],
    rules: &RelaxRules<'_>,
    settings: &Settings,
    progress: &Progress,
) -> Result<Relaxed, RelaxError> {
    progress.check()?;
    settings.validate()?;
    progress.enter(Stage::Condition);
    let (corners, faces) = (input.corner_vertices.len(), input.face_offsets.len().saturating_sub(1));
    if uv.len() != corners {
        return Err(RelaxError::UvCount { found: uv.len(), corners });
    }
    if let Some(found) = rules.pinned.map(<[bool]>::len).filter(|&found| found != corners) {
        return Err(RelaxError::PinCount { found, corners });
    }
    if let Some(found) = rules.selected.map(<[bool]>::len).filter(|&found| found != faces) {
        return Err(RelaxError::SelectionCount { found, faces });
    }
    let plain = MeshInput { seams: &[], guides: &[], seam_weights: None, ..*input };
    let options = ConditionOptions { cut_angle: None, ..settings.conditioning() };
    // In the form that an unwrap works on, so that polygons without triangles are divided as they are measured.
    let surface = mesh::canonical(mesh::condition(&plain, &options, progress)?, progress)?;
    let layout = Layout::new(&plain, &surface, uv, rules, progress)?;

    progress.enter(Stage::Charts);
    let texture = Texture::of(&settings.packing);
    let frame = Frame {
        aspect: texture.aspect(),
        texel: texture.texels().map(|texels| 1.0 / texels),
        diagonal: surface.diagonal,
        settings,
        is_anew: rules.start == RelaxStart::Anew,
        progress,
    };
    let meant = layout.meant(rules);
    let (done, all) = (AtomicUsize::new(0), meant.iter().map(|(_, faces)| faces.len()).sum::<usize>().max(1));
    let relaxed = meant.par_iter().with_max_len(1).map(|&(number, faces)| {
        let relaxed = layout.relaxed(number, faces, &frame, texture)?;
        let so_far = done.fetch_add(faces.len(), Ordering::Relaxed) + faces.len();
        progress.advance(Stage::Charts, so_far as f64 / all as f64);
        Ok((number, relaxed))
    });
    let relaxed: Vec<(usize, (RelaxedIsland, Moves))> = relaxed.collect::<Result<_, Cancelled>>()?;
    progress.check()?;

    let mut place_uv: Vec<Option<[f32; 2]>> = vec![None; layout.place_count];
    let mut islands = Vec::with_capacity(relaxed.len());
    for (number, (island, moves)) in relaxed {
        for (place, to) in moves {
            place_uv[place as usize] = Some(to);
        }
        islands.push((number, island));
    }
    let moved = |(c, &before): (usize, &[f32; 2])| match layout.place[c] {
        NONE => before,
        place => place_uv[place as usize].unwrap_or(before),
    };
    let uv = uv.iter().enumerate().map(moved).collect();
    let over_all = |l2: &dyn Fn(&RelaxedIsland) -> f64| {
        let relaxed = || islands.iter().map(|(_, island)| island).filter(|island| island.left.is_none());
        let squares: f64 = relaxed().map(|island| island.area * l2(island).powi(2)).sum();
        (squares / relaxed().map(|island| island.area).sum::<f64>()).sqrt()
    };
    let (l2_before, l2_after) = (over_all(&|island| island.l2_before), over_all(&|island| island.l2_after));
    Ok(Relaxed { uv, island: layout.island, islands, l2_before, l2_after })
}

/// The places of an island that move, and where to.
type Moves = Vec<(u32, [f32; 2])>;

/// What hangs together in a map. A *place* is a vertex with a UV: corners of the same place are joined.
struct Layout<'a> {
    surface: &'a Surface,
    corner_vertices: &'a [i32],
    /// The place of each corner; [`NONE`] where its UV is not finite.
    place: Vec<u32>,
    place_count: usize,
    /// The UV of each place.
    place_uv: Vec<[f32; 2]>,
    /// Whether a corner of the place is pinned.
    is_pinned: Vec<bool>,
    /// The island of each face of the input, -1 for none.
    island: Vec<i32>,
    /// The lowest face of each island, and the number of its faces.
    faces: Vec<(usize, usize)>,
    /// The triangles of each island.
    triangles: mesh::Groups<FaceId>,
    /// A vertex of each island at which an edge has no length on the surface, but one in the map; [`NONE`] for none.
    shrunk: Vec<u32>,
    total_area: f64,
}

impl<'a> Layout<'a> {
    /// O(n log n).
    fn new(
        input: &MeshInput<'a>,
        surface: &'a Surface,
        uv: &[[f32; 2]],
        rules: &RelaxRules<'_>,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let is_finite = |c: usize| uv[c].iter().all(|x| x.is_finite());
        // Adding 0 makes −0 plain.
        let key = |c: u32| {
            let vertex = surface.representative[input.corner_vertices[c as usize] as usize];
            let [u, v] = uv[c as usize].map(|x| (x + 0.0).to_bits());
            (vertex, u, v)
        };
        let mut ordered: Vec<u32> = (0..uv.len() as u32).filter(|&c| is_finite(c as usize)).collect();
        ordered.par_sort_unstable_by_key(|&c| (key(c), c));
        progress.check()?;
        let (mut place, mut place_uv, mut is_pinned) = (vec![NONE; uv.len()], Vec::new(), Vec::new());
        for same in ordered.chunk_by(|&a, &b| key(a) == key(b)) {
            same.iter().for_each(|&c| place[c as usize] = place_uv.len() as u32);
            place_uv.push(uv[same[0] as usize]);
            is_pinned.push(rules.pinned.is_some_and(|pinned| same.iter().any(|&c| pinned[c as usize])));
        }
        progress.check()?;

        let face_count = input.face_offsets.len().saturating_sub(1);
        let corners = |f: usize| input.face_offsets[f] as usize..input.face_offsets[f + 1] as usize;
        let is_mapped =
            |f: usize| surface.unmapped.binary_search(&(f as u32)).is_err() && corners(f).all(|c| place[c] != NONE);
        let mut sets = DisjointSets::new(place_uv.len());
        let mapped: Vec<usize> = (0..face_count).filter(|&f| is_mapped(f)).collect();
        for &f in &mapped {
            let first = place[corners(f).start] as usize;
            corners(f).for_each(|c| {
                sets.join(first, place[c] as usize);
            });
        }
        progress.check()?;
        let (mut island, mut faces) = (vec![-1; face_count], Vec::new());
        let mut number = vec![NONE; place_uv.len()];
        for &f in &mapped {
            let root = sets.root(place[corners(f).start] as usize);
            if number[root] == NONE {
                number[root] = faces.len() as u32;
                faces.push((f, 0));
            }
            island[f] = number[root] as i32;
            faces[number[root] as usize].1 += 1;
        }
        let mut shrunk = vec![NONE; faces.len()];
        for &[corner, with] in &surface.followers {
            let f = input.face_offsets.partition_point(|&begin| begin as u32 <= corner) - 1;
            if island[f] >= 0 && place[corner as usize] != place[with as usize] {
                shrunk[island[f] as usize] = input.corner_vertices[corner as usize] as u32;
            }
        }
        let label: Vec<u32> = surface.mesh.faces().map(|f| island[surface.input_polygon(f)] as u32).collect();
        let triangles = mesh::Groups::by_label(&label, faces.len(), FaceId::new);
        let (place_count, total_area) = (place_uv.len(), mesh::measure::total_area(&surface.mesh));
        let corner_vertices = input.corner_vertices;
        Ok(Self {
            surface,
            corner_vertices,
            place,
            place_count,
            place_uv,
            is_pinned,
            island,
            faces,
            triangles,
            shrunk,
            total_area,
        })
    }

    /// The islands that are to be relaxed, and their triangles.
    fn meant(&self, rules: &RelaxRules<'_>) -> Vec<(usize, &[FaceId])> {
        let mut is_meant = vec![rules.selected.is_none(); self.faces.len()];
        for (f, _) in rules.selected.unwrap_or_default().iter().enumerate().filter(|f| *f.1) {
            if let Ok(island) = usize::try_from(self.island[f]) {
                is_meant[island] = true;
            }
        }
        self.triangles.iter().enumerate().filter(|(island, _)| is_meant[*island]).collect()
    }

    /// The place of a corner of the surface.
    fn place_of(&self, h: HalfedgeId) -> u32 {
        self.place[self.surface.corner[h.index()] as usize]
    }

    /// What becomes of an island, and where its places go; none of them if it is not moved.
    fn relaxed(
        &self,
        number: usize,
        faces: &[FaceId],
        frame: &Frame<'_>,
        texture: Texture,
    ) -> Result<(RelaxedIsland, Moves), Cancelled> {
        frame.progress.check()?;
        let whole = Island::new(self, faces);
        let in_proportion = |uv: &[[f32; 2]]| -> Vec<Point2<f64>> {
            let [ax, ay] = frame.aspect;
            uv.iter().map(|&[u, v]| Point2::new(ax * f64::from(u), ay * f64::from(v))).collect()
        };
        let l2 = |uv: &[[f32; 2]]| stretch::l2_unsigned(&whole.mesh, &in_proportion(uv), NEGLIGIBLE);
        let before = l2(&whole.uv);
        let mut pinned: Vec<u32> = whole.place.iter().copied().filter(|&p| self.is_pinned[p as usize]).collect();
        pinned.sort_unstable();
        pinned.dedup();
        let mut island = RelaxedIsland {
            face: self.faces[number].0,
            faces: self.faces[number].1,
            pinned: pinned.len(),
            area: mesh::measure::total_area(&whole.mesh) / self.total_area,
            l2_before: before,
            l2_after: before,
            iterations: 0,
            moved: false,
            left: None,
        };
        let shrunk = self.shrunk[number];
        if shrunk != NONE {
            island.left = Some(LeftAsItWas::EdgeOfNoLength { vertex: shrunk as usize });
            return Ok((island, Moves::new()));
        }
        let found = match whole.relaxed(self, frame, texture) {
            Ok(found) => found,
            Err(Stop::Cancelled(cancelled)) => return Err(cancelled),
            Err(Stop::Left(reason)) => {
                island.left = Some(if pinned.is_empty() { reason.without_pins() } else { reason });
                return Ok((island, Moves::new()));
            }
        };
        island.iterations = found.iterations;
        let after = l2(&found.uv);
        let is_lower = after < before * (1.0 - LEAST_GAIN);
        if found.was_sound && !is_lower {
            return Ok((island, Moves::new()));
        }
        (island.l2_after, island.moved) = (after, true);
        // What is pinned is not written: each of its corners keeps its own bits.
        let goes = |v: &usize| !self.is_pinned[whole.place[*v] as usize];
        let moves = (0..found.uv.len()).filter(goes).map(|v| (whole.place[v], found.uv[v])).collect();
        Ok((island, moves))
    }
}

/// An island with vertices of its own: corners are of one vertex if they are joined across edges.
struct Island {
    mesh: TriMesh,
    /// The place of each vertex; several vertices may be at one place, where the island is joined at a vertex only.
    place: Vec<u32>,
    uv: Vec<[f32; 2]>,
    /// The number in the input of each vertex.
    vertex: Vec<u32>,
}

/// The parts of an island, relaxed.
struct RelaxedParts {
    uv: Vec<[f32; 2]>,
    iterations: usize,
    was_sound: bool,
}

impl Island {
    /// O(m log m) in the number of its triangles.
    fn new(layout: &Layout<'_>, faces: &[FaceId]) -> Self {
        let surface = &layout.surface.mesh;
        let is_cut = |h: HalfedgeId| {
            let t = surface.twin(h);
            !t.is_none()
                && (layout.place_of(h) != layout.place_of(t.next()) || layout.place_of(h.next()) != layout.place_of(t))
        };
        let (mesh, source) = surface.submesh(faces, is_cut);
        let mut place = vec![NONE; mesh.vertex_count()];
        let mut vertex = vec![0; mesh.vertex_count()];
        for h in mesh.halfedges() {
            let v = mesh.from(h).index();
            let corner = layout.surface.corner[faces[h.face().index()].halfedge(h.slot()).index()];
            place[v] = layout.place[corner as usize];
            vertex[v] = layout.corner_vertices[corner as usize] as u32;
        }
        debug_assert_eq!(source.len(), place.len(), "a source for each vertex");
        let uv = place.iter().map(|&p| layout.place_uv[p as usize]).collect();
        Self { mesh, place, uv, vertex }
    }

    /// All parts relaxed, each by itself; what joins two of them is held.
    fn relaxed(&self, layout: &Layout<'_>, frame: &Frame<'_>, texture: Texture) -> Result<RelaxedParts, Stop> {
        if self.mesh.face_count() == 0 {
            return Err(LeftAsItWas::NoSurface.into());
        }
        let (label, count) = self.mesh.components();
        let mut held: Vec<bool> = self.place.iter().map(|&p| layout.is_pinned[p as usize]).collect();
        self.hold_joints(&label, &mut held)?;
        if count == 1 {
            let part = Part { mesh: &self.mesh, uv: &self.uv, held: &held, vertex: &self.vertex };
            let found = part.relaxed(frame)?;
            return Ok(RelaxedParts { uv: found.uv, iterations: found.iterations, was_sound: found.was_sound });
        }
        let mut all = RelaxedParts { uv: self.uv.clone(), iterations: 0, was_sound: true };
        let mut moving = 0;
        for faces in mesh::Groups::by_label(&label, count, FaceId::new).iter() {
            let (mesh, source) = self.mesh.submesh(faces, |_| false);
            let uv: Vec<[f32; 2]> = source.iter().map(|v| self.uv[v.index()]).collect();
            let held: Vec<bool> = source.iter().map(|v| held[v.index()]).collect();
            let vertex: Vec<u32> = source.iter().map(|v| self.vertex[v.index()]).collect();
            let part = Part { mesh: &mesh, uv: &uv, held: &held, vertex: &vertex };
            let found = match part.relaxed(frame) {
                // A part of which nothing can move stays, and the others may move around it.
                Err(Stop::Left(LeftAsItWas::AllPinned)) if part.is_sound() => continue,
                Err(Stop::Left(LeftAsItWas::AllPinned)) => return Err(LeftAsItWas::PinsTurnFacesOver.into()),
                found => found?,
            };
            moving += 1;
            source.iter().zip(found.uv).for_each(|(v, uv)| all.uv[v.index()] = uv);
            all.iterations += found.iterations;
            all.was_sound &= found.was_sound;
        }
        if moving == 0 {
            return Err(LeftAsItWas::AllPinned.into());
        }
        if self.overlaps(&all.uv, frame, texture)? > 0 {
            return Err(LeftAsItWas::PartsOverlap.into());
        }
        Ok(all)
    }

    /// Marks the vertices that are at the place of another: of another part, or it is an error.
    fn hold_joints(&self, label: &[u32], held: &mut [bool]) -> Result<(), LeftAsItWas> {
        let mut part = vec![0; self.mesh.vertex_count()];
        for f in self.mesh.faces() {
            self.mesh.triangle(f).iter().for_each(|v| part[v.index()] = label[f.index()]);
        }
        let mut ordered: Vec<VertexId> = self.mesh.vertices().collect();
        ordered.sort_unstable_by_key(|v| (self.place[v.index()], part[v.index()], *v));
        for pair in ordered.windows(2) {
            let [a, b] = [pair[0].index(), pair[1].index()];
            if self.place[a] == self.place[b] {
                if part[a] == part[b] {
                    return Err(LeftAsItWas::Pinched { vertex: self.vertex[a] as usize });
                }
                (held[a], held[b]) = (true, true);
            }
        }
        Ok(())
    }

    /// Number of pairs of triangles that overlap.
    fn overlaps(&self, uv: &[[f32; 2]], frame: &Frame<'_>, texture: Texture) -> Result<u64, Stop> {
        let triangles: Vec<[u32; 3]> = self.mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let of = UvMesh::new(self.mesh.positions(), &triangles, uv, &triangles, &[], texture);
        // More than a thousand million triangles: nobody can tell.
        let of = of.map_err(|_| LeftAsItWas::PartsOverlap)?;
        Ok(metrics::measure_each(&of, frame.progress)?.0.overlaps)
    }
}

#[cfg(test)]
mod tests;
