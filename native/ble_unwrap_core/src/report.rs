//! What the user is told about a result.

use crate::metrics::Measures;

/// Quality and history of an unwrapped mesh. Distortions as in [`Measures`]: NaN where not one triangle could be measured,
/// of which a warning tells.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Number of charts.
    pub charts: usize,
    /// Number of input faces, polygons counted once.
    pub faces: usize,
    /// Input faces without UVs.
    pub unmapped_faces: usize,
    /// L2 stretch of the whole layout at its best scale; 1 is none.
    pub l2: f64,
    /// L2 stretch with every chart at its own best scale.
    pub l2_chart_scale: f64,
    /// L2 stretch of the worst chart; specks aside, as in [`Measures`].
    pub l2_worst_chart: f64,
    /// That chart.
    pub worst_chart: Option<usize>,
    /// L-infinity stretch: the largest stretch at any point in any direction.
    pub l_infinity: f64,
    /// Mean angle distortion, area weighted; 1 is none.
    pub angle_distortion: f64,
    /// Mean area distortion, area weighted; 1 is none.
    pub area_distortion: f64,
    /// Triangles turned over.
    pub flips: usize,
    /// Quads that are convex on the surface and bent in UV: by one of its two diagonals such a quad is drawn with a triangle
    /// turned over.
    pub bent_quads: usize,
    /// Pairs of triangles that share area.
    pub overlaps: u64,
    /// Length of the seams over the square root of the surface area.
    pub seam_length: f64,
    /// Length of the seams in units of the mesh.
    pub seam_length_absolute: f64,
    /// Covered share of the unit square.
    pub packing_efficiency: f64,
    /// Least distance between charts in texels, up to eight or twice the margin.
    pub gap_texels: f64,
    /// Seconds spent in each stage, in order. For the eye only: nothing is decided by time.
    pub seconds: Vec<(&'static str, f64)>,
    /// How many charts were made by each rung of the ladder of fallbacks.
    pub rungs: Vec<(&'static str, usize)>,
    /// The L2 stretch that each chart was held to.
    pub chart_limit: f64,
    /// The L2 stretch that the whole layout was held to (`l2`, with charts of uniform scale), if the limit was over that.
    pub atlas_limit: Option<f64>,
    /// Charts above `chart_limit`, with their L2 stretch, ascending.
    pub charts_over_limit: Vec<(usize, f64)>,
    /// What the user should know besides, in sentences.
    pub warnings: Vec<String>,
}

impl Report {
    /// A report with the figures of a layout and nothing of its history yet. `limit` is the bound on
    /// the L2 stretch of a chart; charts of any size are held to it.
    #[must_use]
    pub(crate) fn new(measures: &Measures, limit: f64) -> Self {
        // Labels are chart numbers here; several measured pieces of one chart count once, as the worst.
        let mut over: Vec<(usize, f64)> = measures
            .per_chart
            .iter()
            .filter(|c| c.l2 > limit)
            .filter_map(|c| Some((usize::try_from(c.label).ok()?, c.l2)))
            .collect();
        over.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        over.dedup_by_key(|c| c.0);
        Self {
            charts: measures.charts,
            faces: measures.faces,
            unmapped_faces: measures.unmapped_faces,
            l2: measures.l2,
            l2_chart_scale: measures.l2_chart_scale,
            l2_worst_chart: measures.l2_worst_chart,
            worst_chart: measures.worst_chart.and_then(|l| usize::try_from(l).ok()),
            l_infinity: measures.l_infinity,
            angle_distortion: measures.angle_distortion,
            area_distortion: measures.area_distortion,
            flips: measures.flips,
            overlaps: measures.overlaps,
            seam_length: measures.seam_length,
            seam_length_absolute: measures.seam_length_absolute,
            packing_efficiency: measures.packing_efficiency,
            gap_texels: measures.gap_texels,
            chart_limit: limit,
            charts_over_limit: over,
            ..Self::default()
        }
    }
}

/// A number with its noun, and verb if there is one, in the singular or plural: of `[one, many]`.
pub(crate) fn counted(count: usize, [one, many]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{Texture, UvMesh, measure};
    use crate::progress::Progress;
    use nalgebra::Point3;

    #[test]
    fn one_is_singular() {
        let words = ["chart exceeds", "charts exceed"];
        assert_eq!([0, 1, 2].map(|n| counted(n, words)), ["0 charts exceed", "1 chart exceeds", "2 charts exceed"]);
    }

    #[test]
    fn charts_over_the_limit_are_listed_once() {
        // Three right triangles: faithful, stretched 1:2, stretched 1:3.
        let mut positions = Vec::new();
        let mut uv = Vec::new();
        for (i, s) in [1.0f32, 2.0, 3.0].into_iter().enumerate() {
            let x = 4.0 * i as f64;
            positions.extend([Point3::new(x, 0.0, 0.0), Point3::new(x + 1.0, 0.0, 0.0), Point3::new(x, 1.0, 0.0)]);
            let u = 0.3 * i as f32;
            uv.extend([[u, 0.0], [u + 0.1, 0.0], [u, 0.1 * s]]);
        }
        let t = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let mesh = UvMesh::new(&positions, &t, &uv, &t, &[0, 5, 5], Texture::square(64, 0.0)).expect("valid");
        let measures = measure(&mesh, &Progress::new()).expect("not cancelled");
        let r = Report::new(&measures, 1.1);
        assert_eq!((r.charts, r.worst_chart, r.charts_over_limit.len()), (3, Some(5), 1));
        // ½(1 + 1/9)·3
        assert!((r.charts_over_limit[0].1 - (5.0f64 / 3.0).sqrt()).abs() < 1e-6);
        assert_eq!(Report::new(&measures, 1.29), Report { chart_limit: 1.29, ..r.clone() });
        assert!(Report::new(&measures, 1.3).charts_over_limit.is_empty());
    }
}
