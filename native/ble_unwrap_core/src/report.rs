//! What the user is told about a result.

use crate::metrics::Measures;

/// The quality of an unwrapped mesh, and how it came about. Distortions are defined as in [`Measures`]; they are NaN, and a
/// warning says so, where not a single triangle could be measured.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Number of charts.
    pub charts: usize,
    /// Number of charts that share their place in the texture with others, as
    /// [`Settings::stack`](crate::Settings::stack) asks for; [`Atlas::stack`](crate::Atlas::stack) says which.
    pub stacked: usize,
    /// Number of places that these charts share.
    pub stacks: usize,
    /// Number of input faces, polygons counted once.
    pub faces: usize,
    /// Input faces without UVs.
    pub unmapped_faces: usize,
    /// L2 stretch of the whole layout at its best scale; 1 means no stretch.
    pub l2: f64,
    /// L2 stretch with every chart at its own best scale.
    pub l2_chart_scale: f64,
    /// L2 stretch of the worst chart. Tiny charts are left out, as in [`Measures`].
    pub l2_worst_chart: f64,
    /// The number of the worst chart.
    pub worst_chart: Option<usize>,
    /// L-infinity stretch: the largest stretch at any point in any direction.
    pub l_infinity: f64,
    /// Mean angle distortion, weighted by area; 1 means none.
    pub angle_distortion: f64,
    /// Mean area distortion, weighted by area; 1 means none.
    pub area_distortion: f64,
    /// Number of triangles that are turned over.
    pub flips: usize,
    /// Number of quads that are convex on the surface but not in UV. A renderer that divides such a quad by one of its two
    /// diagonals draws a triangle that is turned over.
    pub bent_quads: usize,
    /// Number of pairs of triangles that overlap, without those of charts that are stacked on each other.
    pub overlaps: u64,
    /// Length of the seams, divided by the square root of the surface area.
    pub seam_length: f64,
    /// Length of the seams in the unit of the mesh.
    pub seam_length_absolute: f64,
    /// Share of the tiles in which there are charts that charts cover: of the unit square, if there is only one.
    pub packing_efficiency: f64,
    /// Number of tiles of the texture in which there are charts.
    pub tiles: usize,
    /// The texel density that charts have: texels to a unit of length of the mesh, where a chart is not stretched. Charts that were enlarged have more, and
    /// with [`ChartScale::Stretch`](crate::settings::ChartScale::Stretch) each has this times its own factor.
    pub texels_per_unit: f64,
    /// Least distance between two charts in texels. A distance above eight texels and above twice the margin is given as
    /// the larger of these two values.
    pub gap_texels: f64,
    /// The distance between two charts, in texels, that was to be kept: the margin, or what the mip levels take where
    /// that is more; less where it was too large for the texture and allowed to shrink.
    pub margin_texels: f64,
    /// Name and duration in seconds of each stage, in order. They are for information only: no result depends on time.
    pub seconds: Vec<(&'static str, f64)>,
    /// How many charts were made by each method of flattening: pairs of the method's name and the number of charts. Where
    /// one method fails, the next is tried.
    pub rungs: Vec<(&'static str, usize)>,
    /// The L2 stretch that each chart was held to.
    pub chart_limit: f64,
    /// The L2 stretch that the whole layout was held to, if [`Settings::limit_over`](crate::Settings::limit_over) is the
    /// atlas. It bounds `l2` where charts have uniform scale.
    pub atlas_limit: Option<f64>,
    /// Charts whose L2 stretch is above `chart_limit`: number and L2 stretch of each, in ascending order of the numbers.
    pub charts_over_limit: Vec<(usize, f64)>,
    /// Number of charts whose sides lie on the edges of texels, with
    /// [`PackSettings::snap`](crate::settings::PackSettings::snap).
    pub snapped_charts: usize,
    /// Charts that fit between two parallel lines less than two texels apart: their numbers, ascending. A texture can
    /// show little of what is on them.
    pub narrow_charts: Vec<usize>,
    /// What else the user should know, in whole sentences.
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
            tiles: measures.tiles,
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
