//! Measuring, and exactly checking, any UV map of a polygon mesh.

use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::mesh::{self, MeshError, MeshInput, Surface};
use crate::metrics::{self, LayoutArrays, Measures, NONE, Texture, TooManyTriangles, TriangleMeasures};
use crate::progress::{Cancelled, Progress, Stage};
use crate::settings::Settings;
use crate::verify::{Certificate, verify};

/// Why a layout cannot be measured or checked.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The number of UVs is not the number of corners.
    #[error("there are {found} UVs, but {corners} corners; give one UV a corner")]
    UvCount {
        /// Number of UVs.
        found: usize,
        /// Number of corners.
        corners: usize,
    },
    /// The number of chart numbers is not the number of faces.
    #[error("there are {found} chart numbers, but {faces} faces; give one a face, or none")]
    ChartCount {
        /// Number of chart numbers that were given.
        found: usize,
        /// Number of faces.
        faces: usize,
    },
    /// A chart has no number of a stack.
    #[error(
        "there are {found} numbers of stacks, but a face belongs to chart {chart}; give one a chart, from chart 0 on, or none"
    )]
    StackCount {
        /// Number of stacks that were given.
        found: usize,
        /// The first chart without one.
        chart: i32,
    },
    /// Stacks of charts are given, but not which face belongs to which chart.
    #[error("stacks are given, but no chart numbers; give one a face")]
    StacksOfNoCharts,
    /// The triangulated mesh is too large to be measured.
    #[error("{triangles} triangles are more than the 2^30 that can be measured; give the mesh in parts")]
    TooManyTriangles {
        /// Number of triangles.
        triangles: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl LayoutError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Mesh(error) => error.kind(),
            Self::UvCount { .. } | Self::ChartCount { .. } | Self::StackCount { .. } | Self::StacksOfNoCharts => {
                ErrorKind::Argument
            }
            Self::TooManyTriangles { .. } => ErrorKind::Mesh,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

impl From<TooManyTriangles> for LayoutError {
    fn from(TooManyTriangles { triangles }: TooManyTriangles) -> Self {
        Self::TooManyTriangles { triangles }
    }
}

/// The measures of a UV map of polygons.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LayoutMeasures {
    /// Number of faces.
    pub faces: usize,
    /// Number of faces that have no UVs: those with a negative chart, with a UV that is not finite, or with a vertex that
    /// is not finite.
    pub unmapped_faces: usize,
    /// Number of quads that are convex on the surface but not in UV. A renderer that divides such a quad by one of its two
    /// diagonals draws a triangle that is turned over.
    pub bent_quads: usize,
    /// The measures of the triangulated faces. Faces with a vertex that is not finite are left out.
    pub measures: Measures,
    /// What was found of each face.
    pub by_face: FaceMeasures,
}

/// The measures of each face of a UV map.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FaceMeasures {
    /// Chart of each face, as [`Measures::per_chart`] has them; -1 for a face without UVs.
    pub chart: Vec<i32>,
    /// The faces of which a triangle is one of [`Measures::flips`], ascending.
    pub flipped: Vec<usize>,
    /// The faces of which a triangle is in a pair of [`Measures::overlaps`], ascending. Where that count is incomplete,
    /// so is this list; of triangles of one stack that are the same it has one.
    pub overlapping: Vec<usize>,
    /// The faces of which a triangle is one of [`Measures::uv_degenerate_faces`], ascending.
    pub collapsed: Vec<usize>,
}

impl FaceMeasures {
    /// From what was found of the triangles, each of which is part of a face.
    fn gathered(faces: usize, face_of: &[usize], triangles: &TriangleMeasures) -> Self {
        let with = |has: &[bool]| {
            let mut found: Vec<usize> = (0..face_of.len()).filter(|&t| has[t]).map(|t| face_of[t]).collect();
            found.sort_unstable();
            found.dedup();
            found
        };
        let mut chart = vec![-1; faces];
        for (t, &face) in face_of.iter().enumerate() {
            if triangles.chart[t] != NONE {
                chart[face] = triangles.chart[t] as i32;
            }
        }
        Self {
            chart,
            flipped: with(&triangles.flipped),
            overlapping: with(&triangles.overlapping),
            collapsed: with(&triangles.collapsed),
        }
    }
}

/// Measures a UV map, whoever made it. `uv` holds one UV for each corner. `chart`, if given, holds one number for each
/// face, which is negative for faces without UVs.
///
/// Faces are triangulated as [`unwrap`](crate::unwrap()) does it: by `input.corner_triangles` where they cover a face.
/// Charts are found from the UVs; `chart` only tells which faces have UVs, and which belong together where `stack` is
/// not empty. It then holds one number for each chart, as [`Atlas::stack`](crate::Atlas::stack) does: charts with the
/// same number, which is at least 0, lie on each other on purpose. Their overlaps are not counted, they need keep no
/// margin, each stack covers the place of its largest chart, and they are different charts also where a chart and its
/// mirror image meet. Whether they lie exactly on each other is for [`certify`] to say. Of the settings, only those of
/// welding and of the texture matter. If a mesh repeats its vertices along its seams, then without `settings.weld` the
/// seams count as boundary of the mesh, and their length is not measured.
///
/// UVs are measured in the proportions of the texture, so a layout for a 2:1 texture that shows no distortion on the
/// surface has none here either. One unit of UV is the width and height of the texture in texels, even where the layout
/// leaves the unit square.
///
/// Guaranteed: any UVs are accepted, finite or not, and the result does not depend on the number of threads. Not
/// guaranteed: exactness. Overlaps of less than 1e-9 of the area of the layout's bounding box are not seen; [`certify`] is
/// exact. O(n log n); about two seconds for a million triangles on two cores.
///
/// # Errors
/// [`LayoutError`]: the arrays are invalid or have the wrong lengths, there are too many triangles, or the call was
/// cancelled.
pub fn measure_layout(
    input: &MeshInput<'_>,
    uv: &[[f32; 2]],
    chart: Option<&[i32]>,
    stack: &[i32],
    settings: &Settings,
    progress: &Progress,
) -> Result<LayoutMeasures, LayoutError> {
    let (surface, label) = conditioned(input, uv, chart, stack, settings, progress)?;
    let arrays = LayoutArrays::new(input, &surface);
    let mesh = arrays.uv_mesh(uv, &label, Texture::of(&settings.packing))?.with_stacks(stack);
    let (measures, triangles) = metrics::measure_each(&mesh, progress)?;
    let faces = input.face_offsets.len().saturating_sub(1);
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
    let face_of: Vec<usize> = surface.mesh.faces().map(|f| surface.input_polygon(f)).collect();
    let by_face = FaceMeasures::gathered(faces, &face_of, &triangles);
    Ok(LayoutMeasures { faces, unmapped_faces, bent_quads, measures, by_face })
}

/// Checks a UV map exactly, whoever made it, by the same checks that [`unwrap`](crate::unwrap()) makes before it returns an
/// atlas. `uv` holds one UV for each corner, and `chart` one number for each face, which is negative for faces without UVs.
///
/// The certificate is [valid](Certificate::is_valid) if no triangle is turned over, no chart overlaps itself or
/// another, all UVs lie in the unit square, or each chart in one of the tiles of the texture, and charts are at least
/// the margin apart. `stack`, if it is not empty, holds a number for each chart, as for [`measure_layout`]: charts of
/// one stack must lie exactly on each other instead, to the bit, and may be mirrored as wholes. Faces with the same
/// number in `chart` are one chart. Faces are triangulated and consistently oriented as [`unwrap`](crate::unwrap())
/// does it. The certificate numbers the triangles made in this way, which are in the order of the faces. Of the
/// settings, only those of welding and of the texture matter.
///
/// All signs come from exact predicates, so there is no tolerance. The result is the same for any number of threads. O(n
/// log n); less than a second for a million triangles.
///
/// # Errors
/// [`LayoutError`]: the arrays are invalid or have the wrong lengths, there are too many triangles, or the call was
/// cancelled. A map that breaks a rule is not an error: its certificate names what it breaks.
pub fn certify(
    input: &MeshInput<'_>,
    uv: &[[f32; 2]],
    chart: &[i32],
    stack: &[i32],
    settings: &Settings,
    progress: &Progress,
) -> Result<Certificate, LayoutError> {
    let (surface, label) = conditioned(input, uv, Some(chart), stack, settings, progress)?;
    let arrays = LayoutArrays::new(input, &surface);
    Ok(verify(&arrays.uv_mesh(uv, &label, Texture::of(&settings.packing))?.with_stacks(stack), progress)?)
}

/// The conditioned mesh, and the chart of each of its triangles if charts are given.
fn conditioned(
    input: &MeshInput<'_>,
    uv: &[[f32; 2]],
    chart: Option<&[i32]>,
    stack: &[i32],
    settings: &Settings,
    progress: &Progress,
) -> Result<(Surface, Vec<i32>), LayoutError> {
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
    if !stack.is_empty() {
        let charts = chart.ok_or(LayoutError::StacksOfNoCharts)?;
        let has_none = |&chart: &i32| usize::try_from(chart).is_ok_and(|chart| chart >= stack.len());
        if let Some(chart) = charts.iter().copied().filter(has_none).min() {
            return Err(LayoutError::StackCount { found: stack.len(), chart });
        }
    }
    // In the form that an unwrap works on, so that polygons without triangles are judged by the same ones.
    let surface = mesh::canonical(mesh::condition(input, &settings.conditioning(), progress)?, progress)?;
    let label_of = |chart: &[i32]| surface.mesh.faces().map(|f| chart[surface.input_polygon(f)]).collect();
    let label = chart.map(label_of).unwrap_or_default();
    progress.enter(Stage::Verify);
    Ok((surface, label))
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

    fn input() -> MeshInput<'static> {
        MeshInput {
            positions: &POSITIONS,
            corner_vertices: &[0, 1, 2, 3, 1, 4, 5, 2, 0, 1, 6],
            face_offsets: &[0, 4, 8, 11],
            ..MeshInput::default()
        }
    }

    /// No welding, 100 texels, two of margin.
    fn settings() -> Settings {
        let mut settings = Settings::default();
        (settings.packing.width, settings.packing.height, settings.packing.margin_texels) = (100, 100, 2.0);
        settings
    }

    fn measured(uv: &[[f32; 2]], chart: Option<&[i32]>) -> Result<LayoutMeasures, LayoutError> {
        measure_layout(&input(), uv, chart, &[], &settings(), &Progress::new())
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
            assert_eq!(layout.by_face.chart, [0, 1, -1]);
        }
    }

    #[test]
    fn the_faces_that_are_at_fault_are_named() {
        // The second square lies on a corner of the first one.
        let mut uv = UV;
        for (k, other) in [[0.2, 0.2], [0.4, 0.2], [0.4, 0.4], [0.2, 0.4]].into_iter().enumerate() {
            uv[4 + k] = other;
        }
        let layout = measured(&uv, None).expect("a valid layout");
        assert_eq!(layout.by_face.overlapping, [0, 1]);
        assert!(layout.measures.overlaps > 0);
        // A square that is nothing but a line.
        uv[4..8].copy_from_slice(&[[0.6, 0.6], [0.8, 0.6], [0.8, 0.6], [0.6, 0.6]]);
        let layout = measured(&uv, None).expect("a valid layout");
        assert_eq!((layout.by_face.collapsed, layout.measures.uv_degenerate_faces), (vec![1], 2));
        assert!(layout.by_face.flipped.is_empty() && layout.by_face.overlapping.is_empty());
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

    fn certified(uv: &[[f32; 2]], chart: &[i32]) -> Result<Certificate, LayoutError> {
        certify(&input(), uv, chart, &[], &settings(), &Progress::new())
    }

    #[test]
    fn a_certificate_names_what_a_map_breaks() {
        let good = certified(&UV, &[0, 1, -1]).expect("a valid layout");
        assert!(good.is_valid() && good.charts == 2, "{good:?}");
        // The second square a texel from the first.
        let mut near = UV;
        near[4..8].iter_mut().for_each(|uv| uv[0] -= 0.29);
        let near = certified(&near, &[0, 1, -1]).expect("a valid layout");
        assert!(near.is_injective() && !near.keeps_margin() && (near.gap_texels - 1.0).abs() < 1e-3, "{near:?}");
        // Upon the first, and, by itself, turned over.
        let mut upon = UV;
        upon[4..8].iter_mut().for_each(|uv| uv[0] -= 0.45);
        assert!(certified(&upon, &[0, 1, -1]).is_ok_and(|c| c.crossings_between.count > 0 && !c.is_injective()));
        let mut turned = UV;
        turned[4..8].iter_mut().for_each(|uv| uv[0] = 1.4 - uv[0]);
        assert!(certified(&turned, &[0, 1, -1]).is_ok_and(|c| c.flipped.count == 2 && c.faulty_charts == [1]));
        assert_eq!(certified(&UV, &[0]), Err(LayoutError::ChartCount { found: 1, faces: 3 }));
    }

    #[test]
    fn a_stack_is_measured_and_proven_as_one_place() {
        let settings = settings();
        // The second square upon the first, as it is and mirrored.
        let mut upon = UV;
        upon.copy_within(0..4, 4);
        let mut mirrored = upon;
        mirrored[4..8].swap(0, 1);
        mirrored[4..8].swap(2, 3);
        let chart = [0, 1, -1];
        for uv in [&upon, &mirrored] {
            let proven = certify(&input(), uv, &chart, &[0, 0], &settings, &Progress::new()).expect("valid");
            assert!(proven.is_valid() && (proven.charts, proven.stacked) == (2, 2), "{proven}");
            let m = measure_layout(&input(), uv, Some(&chart), &[5, 5], &settings, &Progress::new());
            let m = m.expect("valid").measures;
            assert_eq!((m.charts, m.overlaps, m.flips, m.gap_texels), (2, 0, 0, 8.0));
            assert!((m.packing_efficiency - 0.04).abs() < 1e-6 && (m.seam_length_absolute - 2.0).abs() < 1e-9, "{m:?}");
            for stack in [[].as_slice(), &[0, -1], &[0, 1]] {
                let broken = certify(&input(), uv, &chart, stack, &settings, &Progress::new()).expect("valid");
                assert!(!broken.is_injective() && broken.stacked == 0, "{broken}");
                let m = measure_layout(&input(), uv, Some(&chart), stack, &settings, &Progress::new());
                assert!(m.expect("valid").measures.overlaps > 0);
            }
        }
        // By one step of single precision beside it.
        let mut beside = upon;
        beside[6][0] = beside[6][0].next_up();
        let found = certify(&input(), &beside, &chart, &[0, 0], &settings, &Progress::new()).expect("valid");
        assert!(found.apart.first == Some(1) && !found.is_valid() && found.faulty_charts == [1], "{found}");
        // Mirrored in one triangle only.
        let mut partly = upon;
        partly[6] = [0.2, 0.05];
        let found = certify(&input(), &partly, &chart, &[0, 0], &settings, &Progress::new()).expect("valid");
        assert!(found.flipped.count == 1 && found.apart.count == 1, "{found}");
    }

    #[test]
    fn stacks_need_a_number_for_each_chart() {
        let of = |chart: Option<&[i32]>, stack: &[i32]| {
            measure_layout(&input(), &UV, chart, stack, &settings(), &Progress::new()).map(|_| ())
        };
        assert_eq!(of(Some(&[0, 1, -1]), &[3]), Err(LayoutError::StackCount { found: 1, chart: 1 }));
        assert_eq!(of(None, &[0, 0]), Err(LayoutError::StacksOfNoCharts));
        assert_eq!(of(Some(&[0, -1, -1]), &[3]), Ok(()));
    }
}
