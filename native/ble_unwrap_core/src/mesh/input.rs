//! The mesh as a host hands it over, and the errors that name what is wrong with it.

use std::ops::Range;

use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::progress::Cancelled;

/// A polygon mesh as flat arrays, as Blender and most exchange formats keep it.
///
/// Face `f` has the corners `face_offsets[f]..face_offsets[f + 1]`, each of which names a vertex. The arrays need not be
/// valid: every function that takes them checks all of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshInput<'a> {
    /// Coordinates of the vertices, in any unit.
    pub positions: &'a [[f64; 3]],
    /// The vertex of each corner.
    pub corner_vertices: &'a [i32],
    /// The first corner of each face, and at the end the number of corners. May be empty if there are no faces.
    pub face_offsets: &'a [i32],
    /// Triangles as corner numbers, in any order, that together triangulate every face. Where absent, the faces are
    /// triangulated by this library.
    pub corner_triangles: Option<&'a [[i32; 3]]>,
    /// Pairs of vertices. The edge between the two is always a seam.
    pub seams: &'a [[i32; 2]],
    /// Pairs of vertices. The edge between the two is a good place for a seam, where one is needed.
    pub guides: &'a [[i32; 2]],
    /// What a seam at each vertex counts for, as a multiple of its length, from [`LEAST_SEAM_WEIGHT`](Self::LEAST_SEAM_WEIGHT) to
    /// [`LARGEST_SEAM_WEIGHT`](Self::LARGEST_SEAM_WEIGHT): more than 1 where seams are to keep away, less where they are welcome. Where absent, 1
    /// everywhere. Vertices that are welded count for their geometric mean, and so do a vertex and its mirror image where seams are mirrored.
    pub seam_weights: Option<&'a [f32]>,
}

impl MeshInput<'_> {
    /// The least weight of seams at a vertex: they are as good as free there.
    pub const LEAST_SEAM_WEIGHT: f32 = 1e-3;
    /// The largest weight of seams at a vertex: they run there only where there is no other way.
    pub const LARGEST_SEAM_WEIGHT: f32 = 1e3;
}

/// Why a mesh cannot be unwrapped at all. Numbers of elements count from 0, as the arrays do.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The offsets do not begin at corner 0.
    #[error("the face offsets begin at {first}; they must begin at 0")]
    OffsetsStart {
        /// The first offset.
        first: i32,
    },
    /// The offsets do not end at the number of corners.
    #[error(
        "the face offsets end at {last}, but there are {corners} corners; give one offset a face and the number of corners last"
    )]
    OffsetsEnd {
        /// The last offset.
        last: i32,
        /// Number of corners.
        corners: usize,
    },
    /// There are corners, but no offsets.
    #[error("there are {corners} corners, but no face offsets; give one offset a face and the number of corners last")]
    OffsetsMissing {
        /// Number of corners.
        corners: usize,
    },
    /// An offset is lower than the one before it.
    #[error("the offsets of face {face} run from {begin} down to {end}; they must ascend")]
    OffsetsDescend {
        /// The face.
        face: usize,
        /// Its offset.
        begin: i32,
        /// The offset after it.
        end: i32,
    },
    /// A face has fewer than three corners.
    #[error("face {face} has {corners} corners; remove it or give it at least 3")]
    TooFewCorners {
        /// The face.
        face: usize,
        /// How many corners it has.
        corners: usize,
    },
    /// A corner names a vertex that is not there.
    #[error(
        "corner {corner}, of face {face}, names vertex {vertex}, but the vertices are numbered 0 to {vertex_count} (exclusive); correct or remove the face"
    )]
    VertexOutOfRange {
        /// The face.
        face: usize,
        /// The corner, counted over all faces.
        corner: usize,
        /// The vertex it names.
        vertex: i32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A triangle names a corner that is not there.
    #[error(
        "triangle {triangle} names corner {corner}, but the corners are numbered 0 to {corner_count} (exclusive); triangulate the mesh again or leave the triangles out"
    )]
    TriangleCornerOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The corner it names.
        corner: i32,
        /// Number of corners.
        corner_count: usize,
    },
    /// A triangle joins corners of different faces.
    #[error(
        "triangle {triangle} joins corners of faces {first} and {second}; triangulate the mesh again or leave the triangles out"
    )]
    TriangleAcrossFaces {
        /// The triangle.
        triangle: usize,
        /// The face of its first corner.
        first: usize,
        /// The face of another corner.
        second: usize,
    },
    /// A seam names a vertex that is not there.
    #[error(
        "seam {seam} names vertex {vertex}, but the vertices are numbered 0 to {vertex_count} (exclusive); correct or remove the seam"
    )]
    SeamOutOfRange {
        /// The seam.
        seam: usize,
        /// The vertex it names.
        vertex: i32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A guide names a vertex that is not there.
    #[error(
        "guide {guide} names vertex {vertex}, but the vertices are numbered 0 to {vertex_count} (exclusive); correct or remove the guide"
    )]
    GuideOutOfRange {
        /// The guide.
        guide: usize,
        /// The vertex it names.
        vertex: i32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// The number of weights of seams is not the number of vertices.
    #[error("there are {found} seam weights, but {vertices} vertices; give one a vertex")]
    SeamWeightCount {
        /// Number of weights that were given.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A weight of seams is no number, or out of its range.
    #[error(
        "the seam weight of vertex {vertex} is not a number from {} to {}; correct it",
        MeshInput::LEAST_SEAM_WEIGHT,
        MeshInput::LARGEST_SEAM_WEIGHT
    )]
    SeamWeight {
        /// The vertex.
        vertex: usize,
    },
    /// There are more elements of one kind than can be numbered.
    #[error("the mesh has {count} {element}, more than the {limit} that can be numbered; split it into several meshes")]
    TooLarge {
        /// The kind of element, in the plural.
        element: &'static str,
        /// How many there are.
        count: usize,
        /// How many there can be.
        limit: usize,
    },
    /// Every face has a vertex whose coordinates are not finite.
    #[error(
        "every face has a vertex with non-finite coordinates, such as vertex {vertex} of face {face}; correct the coordinates"
    )]
    NoFiniteFace {
        /// The first face.
        face: usize,
        /// A non-finite vertex of it.
        vertex: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl MeshError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::OffsetsStart { .. }
            | Self::OffsetsEnd { .. }
            | Self::OffsetsMissing { .. }
            | Self::OffsetsDescend { .. }
            | Self::TooFewCorners { .. }
            | Self::VertexOutOfRange { .. }
            | Self::TriangleCornerOutOfRange { .. }
            | Self::TriangleAcrossFaces { .. }
            | Self::SeamOutOfRange { .. }
            | Self::GuideOutOfRange { .. }
            | Self::SeamWeightCount { .. }
            | Self::SeamWeight { .. }
            | Self::TooLarge { .. }
            | Self::NoFiniteFace { .. } => ErrorKind::Mesh,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

/// Most elements of one kind: indices of the input are 32-bit signed.
const LIMIT: usize = i32::MAX as usize;

/// Most triangles: their half-edges are numbered with 32 bits, of which one value means "none".
const TRIANGLE_LIMIT: usize = (u32::MAX as usize - 1) / 3;

/// The faces of an input that was found valid: every index may be used unchecked.
#[derive(Clone, Debug)]
pub(super) struct Polygons<'a> {
    corner_vertices: &'a [i32],
    face_offsets: &'a [i32],
    polygon_of_corner: Vec<u32>,
}

impl<'a> Polygons<'a> {
    /// Checks sizes, offsets, vertex indices, seams, guides and weights of seams; O(n). Triangles are checked where they are
    /// sorted to their faces.
    pub(super) fn new(input: &MeshInput<'a>) -> Result<Self, MeshError> {
        let vertex_count = input.positions.len();
        let corner_count = input.corner_vertices.len();
        for (element, count) in [("vertices", vertex_count), ("corners", corner_count)] {
            if count > LIMIT {
                return Err(MeshError::TooLarge { element, count, limit: LIMIT });
            }
        }
        let mut polygon_of_corner = Vec::with_capacity(corner_count);
        match input.face_offsets {
            [] if corner_count > 0 => return Err(MeshError::OffsetsMissing { corners: corner_count }),
            [first, ..] if *first != 0 => return Err(MeshError::OffsetsStart { first: *first }),
            _ => {}
        }
        for (face, pair) in input.face_offsets.windows(2).enumerate() {
            let (begin, end) = (pair[0], pair[1]);
            if end < begin {
                return Err(MeshError::OffsetsDescend { face, begin, end });
            }
            // Both lie in 0..=i32::MAX here: the first is 0 and they ascend.
            if end as usize > corner_count {
                return Err(MeshError::OffsetsEnd { last: end, corners: corner_count });
            }
            let corners = (end - begin) as usize;
            if corners < 3 {
                return Err(MeshError::TooFewCorners { face, corners });
            }
            polygon_of_corner.resize(end as usize, face as u32);
        }
        if polygon_of_corner.len() != corner_count {
            let last = input.face_offsets.last().copied().unwrap_or(0);
            return Err(MeshError::OffsetsEnd { last, corners: corner_count });
        }
        let triangles = corner_count - 2 * input.face_offsets.len().saturating_sub(1);
        if triangles > TRIANGLE_LIMIT {
            return Err(MeshError::TooLarge { element: "triangles", count: triangles, limit: TRIANGLE_LIMIT });
        }
        let in_range = |vertex: i32| usize::try_from(vertex).is_ok_and(|v| v < vertex_count);
        if let Some(corner) = input.corner_vertices.iter().position(|&v| !in_range(v)) {
            let (face, vertex) = (polygon_of_corner[corner] as usize, input.corner_vertices[corner]);
            return Err(MeshError::VertexOutOfRange { face, corner, vertex, vertex_count });
        }
        let outside = |pairs: &[[i32; 2]]| {
            let wrong = |(i, pair): (usize, &[i32; 2])| Some((i, *pair.iter().find(|&&v| !in_range(v))?));
            pairs.iter().enumerate().find_map(wrong)
        };
        if let Some((seam, vertex)) = outside(input.seams) {
            return Err(MeshError::SeamOutOfRange { seam, vertex, vertex_count });
        }
        if let Some((guide, vertex)) = outside(input.guides) {
            return Err(MeshError::GuideOutOfRange { guide, vertex, vertex_count });
        }
        if let Some(weights) = input.seam_weights {
            if weights.len() != vertex_count {
                return Err(MeshError::SeamWeightCount { found: weights.len(), vertices: vertex_count });
            }
            let range = MeshInput::LEAST_SEAM_WEIGHT..=MeshInput::LARGEST_SEAM_WEIGHT;
            if let Some(vertex) = weights.iter().position(|weight| !range.contains(weight)) {
                return Err(MeshError::SeamWeight { vertex });
            }
        }
        Ok(Self { corner_vertices: input.corner_vertices, face_offsets: input.face_offsets, polygon_of_corner })
    }

    /// Number of polygons.
    pub(super) fn len(&self) -> usize {
        self.face_offsets.len().saturating_sub(1)
    }

    /// Number of corners of all polygons.
    pub(super) fn corner_count(&self) -> usize {
        self.corner_vertices.len()
    }

    /// The corners of a polygon.
    pub(super) fn corners(&self, polygon: usize) -> Range<usize> {
        self.face_offsets[polygon] as usize..self.face_offsets[polygon + 1] as usize
    }

    /// The vertex of a corner.
    pub(super) fn vertex(&self, corner: usize) -> usize {
        self.corner_vertices[corner] as usize
    }

    /// The polygon of a corner.
    pub(super) fn polygon(&self, corner: usize) -> usize {
        self.polygon_of_corner[corner] as usize
    }

    /// The corner after `corner` in its polygon.
    pub(super) fn next(&self, corner: usize) -> usize {
        let corners = self.corners(self.polygon(corner));
        if corner + 1 == corners.end { corners.start } else { corner + 1 }
    }

    /// The vertices at the ends of the side that leaves `corner`.
    pub(super) fn side(&self, corner: usize) -> [usize; 2] {
        [self.vertex(corner), self.vertex(self.next(corner))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    fn check(corner_vertices: &[i32], face_offsets: &[i32]) -> Result<usize, MeshError> {
        let input = MeshInput { positions: &SQUARE, corner_vertices, face_offsets, ..MeshInput::default() };
        Polygons::new(&input).map(|p| p.len())
    }

    #[test]
    fn valid_arrays_pass() {
        assert_eq!(check(&[0, 1, 2, 3], &[0, 4]), Ok(1));
        assert_eq!(check(&[0, 1, 2, 2, 3, 0], &[0, 3, 6]), Ok(2));
        assert_eq!(check(&[], &[]), Ok(0));
        assert_eq!(check(&[], &[0]), Ok(0));
    }

    #[test]
    fn wrong_arrays_are_named() {
        assert_eq!(check(&[0, 1, 2], &[]), Err(MeshError::OffsetsMissing { corners: 3 }));
        assert_eq!(check(&[0, 1, 2], &[1, 3]), Err(MeshError::OffsetsStart { first: 1 }));
        assert_eq!(check(&[0, 1, 2], &[0, 4]), Err(MeshError::OffsetsEnd { last: 4, corners: 3 }));
        assert_eq!(check(&[0, 1, 2, 3], &[0, 3]), Err(MeshError::OffsetsEnd { last: 3, corners: 4 }));
        assert_eq!(check(&[0, 1, 2], &[0]), Err(MeshError::OffsetsEnd { last: 0, corners: 3 }));
        assert_eq!(
            check(&[0, 1, 2], &[0, 3, i32::MIN]),
            Err(MeshError::OffsetsDescend { face: 1, begin: 3, end: i32::MIN })
        );
        assert_eq!(check(&[0, 1, 2, 0], &[0, 3, 4]), Err(MeshError::TooFewCorners { face: 1, corners: 1 }));
        let out = |vertex| Err(MeshError::VertexOutOfRange { face: 1, corner: 4, vertex, vertex_count: 4 });
        assert_eq!(check(&[0, 1, 2, 0, 4, 1], &[0, 3, 6]), out(4));
        assert_eq!(check(&[0, 1, 2, 0, -1, 1], &[0, 3, 6]), out(-1));
    }

    #[test]
    fn seams_are_checked() {
        let seams = [[0, 1], [2, 7]];
        let input = MeshInput {
            positions: &SQUARE,
            corner_vertices: &[0, 1, 2],
            face_offsets: &[0, 3],
            seams: &seams,
            ..MeshInput::default()
        };
        let error = Polygons::new(&input).expect_err("vertex 7 is not there");
        assert_eq!(error, MeshError::SeamOutOfRange { seam: 1, vertex: 7, vertex_count: 4 });
        assert!(error.to_string().contains("seam 1 names vertex 7"), "{error}");
        let error = Polygons::new(&MeshInput { seams: &[], guides: &seams, ..input }).expect_err("nor for a guide");
        assert_eq!(error, MeshError::GuideOutOfRange { guide: 1, vertex: 7, vertex_count: 4 });
        assert!(error.to_string().contains("guide 1 names vertex 7"), "{error}");
    }

    #[test]
    fn weights_of_seams_are_checked() {
        let found = |weights: &[f32]| {
            let input = MeshInput {
                positions: &SQUARE,
                corner_vertices: &[0, 1, 2],
                face_offsets: &[0, 3],
                seam_weights: Some(weights),
                ..MeshInput::default()
            };
            Polygons::new(&input).map(|p| p.len())
        };
        assert_eq!(found(&[1.0, 10.0, 0.001, 1000.0]), Ok(1));
        assert_eq!(found(&[1.0; 3]), Err(MeshError::SeamWeightCount { found: 3, vertices: 4 }));
        for wrong in [0.0, -1.0, 1001.0, f32::NAN, f32::INFINITY] {
            assert_eq!(found(&[1.0, 1.0, wrong, 1.0]), Err(MeshError::SeamWeight { vertex: 2 }), "{wrong}");
        }
    }
}
