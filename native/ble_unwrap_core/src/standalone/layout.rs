//! The quality of any UV map of a polygon mesh.

use nalgebra::Point3;
use thiserror::Error;

use crate::mesh::{self, ConditionOptions, MeshError, MeshInput};
use crate::metrics::{self, Measures, Texture, UvMesh, UvMeshError};
use crate::progress::{Cancelled, Progress, Stage};

/// Why a layout cannot be measured.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LayoutError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Not one UV a corner.
    #[error("there are {found} UVs, but {corners} corners; give one UV a corner")]
    UvCount {
        /// Number of UVs.
        found: usize,
        /// Number of corners.
        corners: usize,
    },
    /// Not one chart a face.
    #[error("there are {found} chart numbers, but {faces} faces; give one a face, or none")]
    ChartCount {
        /// Number of charts given.
        found: usize,
        /// Number of faces.
        faces: usize,
    },
    /// The triangulated mesh is too large to be measured.
    #[error(transparent)]
    Triangles(#[from] UvMeshError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The figures of a UV map of polygons.
#[derive(Clone, Debug, PartialEq)]
pub struct LayoutMeasures {
    /// Number of faces.
    pub faces: usize,
    /// Faces that have a negative chart, a corner whose UV is not finite, or a vertex that is not.
    pub unmapped_faces: usize,
    /// Quads that are convex on the surface and not in UV, see [`bent_quads`](metrics::bent_quads()).
    pub bent_quads: usize,
    /// The figures of the triangulated faces, those with a non-finite vertex left out.
    pub measures: Measures,
}

/// Measures a UV map, whoever made it: one UV a corner in `uv`, and in `chart`, if given, a number a face
/// that is negative for faces without UVs.
///
/// Faces are triangulated as [`unwrap`](crate::unwrap()) does it (with `input.corner_triangles` where they cover
/// a face) and measured as [`metrics::measure`] says. Charts are found from the UVs; `chart` only tells
/// which faces have any. Without `options.weld` a mesh that is split along its seams has no seams left. O(n log n).
///
/// # Errors
/// [`LayoutError`]: invalid arrays, wrong lengths, cancelled.
pub fn measure_layout(
    input: &MeshInput<'_>,
    uv: &[[f32; 2]],
    chart: Option<&[i32]>,
    options: &ConditionOptions,
    texture: Texture,
    progress: &Progress,
) -> Result<LayoutMeasures, LayoutError> {
    progress.check()?;
    progress.enter(Stage::Condition);
    let corners = input.corner_vertices.len();
    if uv.len() != corners {
        return Err(LayoutError::UvCount { found: uv.len(), corners });
    }
    let faces = input.face_offsets.len().saturating_sub(1);
    if let Some(found) = chart.map(<[i32]>::len).filter(|&found| found != faces) {
        return Err(LayoutError::ChartCount { found, faces });
    }
    let surface = mesh::condition(input, options, progress)?;
    let positions: Vec<Point3<f64>> = input.positions.iter().map(|&p| Point3::from(p)).collect();
    let corner_triangles: Vec<[u32; 3]> = surface.corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let vertex = |c: u32| surface.representative[input.corner_vertices[c as usize] as usize];
    let triangles: Vec<[u32; 3]> = corner_triangles.iter().map(|c| c.map(vertex)).collect();
    let label: Vec<i32> =
        chart.map(|chart| surface.polygon.iter().map(|&p| chart[p as usize]).collect()).unwrap_or_default();
    progress.enter(Stage::Verify);
    let mesh = UvMesh::new(&positions, &triangles, uv, &corner_triangles, &label, texture)?;
    let measures = metrics::measure(&mesh, progress)?;
    let mut mapped = vec![true; faces];
    for &p in &surface.unmapped {
        mapped[p as usize] = false;
    }
    for (p, mapped) in mapped.iter_mut().enumerate() {
        let corners = input.face_offsets[p] as usize..input.face_offsets[p + 1] as usize;
        *mapped &= chart.is_none_or(|chart| chart[p] >= 0) && uv[corners].iter().flatten().all(|x| x.is_finite());
    }
    let bent_quads = metrics::bent_quads(input, uv, |face| mapped[face]).len();
    let unmapped_faces = mapped.iter().filter(|mapped| !**mapped).count();
    Ok(LayoutMeasures { faces, unmapped_faces, bent_quads, measures })
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSITIONS: [[f64; 3]; 7] = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [0.0, 2.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 2.0, 0.0],
        [f64::NAN, 0.0, 0.0],
    ];
    const UV: [[f32; 2]; 11] = [
        [0.1, 0.1],
        [0.3, 0.1],
        [0.3, 0.3],
        [0.1, 0.3],
        [0.6, 0.1],
        [0.8, 0.1],
        [0.8, 0.3],
        [0.6, 0.3],
        [0.0, 0.0],
        [0.0, 0.0],
        [0.0, 0.0],
    ];

    fn measured(uv: &[[f32; 2]], chart: Option<&[i32]>) -> Result<LayoutMeasures, LayoutError> {
        let input = MeshInput {
            positions: &POSITIONS,
            corner_vertices: &[0, 1, 2, 3, 1, 4, 5, 2, 0, 1, 6],
            face_offsets: &[0, 4, 8, 11],
            ..MeshInput::default()
        };
        let split = ConditionOptions { weld: false, weld_distance: None };
        measure_layout(&input, uv, chart, &split, Texture::square(100, 2.0), &Progress::new())
    }

    #[test]
    fn two_faithful_squares_of_a_strip() {
        for chart in [None, Some([0, 1, -1].as_slice())] {
            let layout = measured(&UV, chart).expect("a valid layout");
            assert_eq!((layout.faces, layout.unmapped_faces), (3, 1));
            let m = layout.measures;
            assert_eq!((m.charts, m.faces, m.flips, m.overlaps), (2, 4, 0, 0));
            assert!((m.l2 - 1.0).abs() < 1e-6 && (m.packing_efficiency - 0.08).abs() < 1e-6, "{m:?}");
            assert!((m.seam_length_absolute - 2.0).abs() < 1e-9, "{m:?}");
            assert!((m.gap_texels - 8.0).abs() < 1e-4, "beyond the search limit: {m:?}");
        }
    }

    #[test]
    fn a_chart_below_zero_has_no_uv() {
        let mut uv = UV;
        uv[5][1] = f32::NAN;
        for (uv, chart) in [(&UV, [0, -1, -1]), (&uv, [0, 1, 2])] {
            let layout = measured(uv, Some(&chart)).expect("a valid layout");
            assert_eq!((layout.measures.charts, layout.unmapped_faces), (chart[1].max(0) as usize + 1, 2));
        }
    }

    #[test]
    fn wrong_lengths_are_named() {
        assert_eq!(measured(&UV[..9], None), Err(LayoutError::UvCount { found: 9, corners: 11 }));
        assert_eq!(measured(&UV, Some(&[0])), Err(LayoutError::ChartCount { found: 1, faces: 3 }));
    }
}
