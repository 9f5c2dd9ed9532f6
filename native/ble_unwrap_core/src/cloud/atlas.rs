//! The result: a UV a point, a chart a point, and what is known about them.

use std::collections::HashMap;

use thiserror::Error;

/// A UV and a chart for every point of a cloud, and the measures of the layout.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PointAtlas {
    /// One UV for each point, in [0, 1]²; (0, 0) for points whose position is not finite.
    pub uv: Vec<[f32; 2]>,
    /// The chart of each point, numbered from 0; −1 for points whose position is not finite.
    pub chart: Vec<i32>,
    /// Measures of the result.
    pub report: CloudReport,
}

/// The quality of an atlas of points, and how it came about.
///
/// The stretch at a point is that of the least-squares map from its neighbourhood, in its tangent plane, to the texture. If
/// σ₁ ≥ σ₂ are the singular values of this map, the squared L2 stretch is ½(1/σ₁² + 1/σ₂²). Points whose neighbours lie on
/// a line have no stretch.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CloudReport {
    /// Number of points.
    pub points: usize,
    /// Number of points without a UV, because their position is not finite.
    pub unmapped_points: usize,
    /// Number of points that coincide with an earlier point. They share its UV.
    pub duplicate_points: usize,
    /// Number of connected pieces of the neighbourhood graph.
    pub pieces: usize,
    /// Number of charts.
    pub charts: usize,
    /// Number of charts that would be smaller than a texel, and were enlarged to about one.
    pub specks: usize,
    /// L2 stretch of the whole layout, without the charts counted by `specks`; 1 means no stretch.
    pub l2: f64,
    /// L2 stretch with every chart at its own best scale.
    pub l2_chart_scale: f64,
    /// L2 stretch of the worst chart. Charts with less than 1e-4 of the surface are left out.
    pub l2_worst_chart: f64,
    /// The number of the worst chart.
    pub worst_chart: Option<usize>,
    /// Charts over the stretch limit: the number and the L2 stretch of each.
    pub charts_over_limit: Vec<(usize, f64)>,
    /// Number of points whose neighbourhood has the opposite orientation to most of their chart.
    pub folded_points: usize,
    /// Number of pairs of points of one chart that are on top of each other in the texture but not near each other on the
    /// surface.
    pub overlaps: usize,
    /// Share of the unit square that is covered, where each point covers a square as large as the distance to its
    /// neighbours.
    pub packing_efficiency: f64,
    /// Number of points that were charted or, in large pieces, of small groups of points that were charted as one.
    pub nodes: usize,
    /// Number of landmarks, summed over all charts.
    pub landmarks: usize,
    /// Number of sweeps, summed over all embeddings.
    pub sweeps: usize,
    /// How many charts were made by each method: pairs of the method's name and the number of charts.
    pub rungs: Vec<(&'static str, usize)>,
    /// Name and duration in seconds of each stage, in order.
    pub seconds: Vec<(&'static str, f64)>,
    /// What else the user should know, in whole sentences.
    pub warnings: Vec<String>,
}

/// A rule that an atlas of points breaks.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PointDefect {
    /// The number of UVs or of chart numbers is not the number of points.
    #[error("there are {uvs} UVs and {charts} chart numbers for {points} points")]
    Count {
        /// Number of UVs.
        uvs: usize,
        /// Number of chart numbers.
        charts: usize,
        /// Number of points.
        points: usize,
    },
    /// A point has a chart but no finite position, or a finite position but no chart.
    #[error("point {point} has chart {chart}, which does not fit its position")]
    Chart {
        /// The point.
        point: usize,
        /// Its chart.
        chart: i32,
    },
    /// A UV lies outside the unit square.
    #[error("the UV of point {point} is ({}, {})", uv[0], uv[1])]
    Outside {
        /// The point.
        point: usize,
        /// Its UV.
        uv: [f32; 2],
    },
    /// Two charts are closer to each other than the margin.
    #[error("points {first} and {second}, of different charts, are {texels} texels apart")]
    Margin {
        /// A point.
        first: usize,
        /// A point of another chart.
        second: usize,
        /// The distance between the two points in texels.
        texels: f64,
    },
}

impl PointAtlas {
    /// Checks what [`unwrap_points()`](crate::unwrap_points()) promises: every point with a finite position has one chart
    /// and a UV in [0, 1]²; all other points have none; points of different charts are at least `margin` texels apart (to
    /// 1/1000 texel) in a texture of `size` texels, width and height. O(n) unless many points crowd in few places.
    ///
    /// # Errors
    /// The first broken rule that was found.
    pub fn check_invariants(&self, positions: &[[f64; 3]], size: [u32; 2], margin: f64) -> Result<(), PointDefect> {
        let points = positions.len();
        if self.uv.len() != points || self.chart.len() != points {
            return Err(PointDefect::Count { uvs: self.uv.len(), charts: self.chart.len(), points });
        }
        let charts = i32::try_from(self.report.charts).unwrap_or(i32::MAX);
        for (point, p) in positions.iter().enumerate() {
            let (chart, uv) = (self.chart[point], self.uv[point]);
            if p.iter().all(|x| x.is_finite()) != (0..charts).contains(&chart) || chart < -1 {
                return Err(PointDefect::Chart { point, chart });
            }
            if !uv.iter().all(|x| (0.0..=1.0).contains(x)) {
                return Err(PointDefect::Outside { point, uv });
            }
        }
        self.check_margin(size, margin - 1e-3)
    }

    fn check_margin(&self, size: [u32; 2], margin: f64) -> Result<(), PointDefect> {
        if margin <= 0.0 {
            return Ok(());
        }
        let texel = |i: usize| [0, 1].map(|c| f64::from(self.uv[i][c]) * f64::from(size[c]));
        let key = |i: usize| texel(i).map(|x| (x / margin).floor() as i64);
        // One list of points for each cell and chart: pairs within a chart are not looked at.
        let mut cells: HashMap<[i64; 2], Vec<(i32, Vec<u32>)>> = HashMap::new();
        for i in (0..self.uv.len()).filter(|&i| self.chart[i] >= 0) {
            let here = cells.entry(key(i)).or_default();
            match here.iter_mut().find(|(chart, _)| *chart == self.chart[i]) {
                Some((_, list)) => list.push(i as u32),
                None => here.push((self.chart[i], vec![i as u32])),
            }
        }
        for i in (0..self.uv.len()).filter(|&i| self.chart[i] >= 0) {
            let ([x, y], here) = (key(i), texel(i));
            for cell in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy])) {
                let others = cells.get(&cell).into_iter().flatten().filter(|(chart, _)| *chart > self.chart[i]);
                for &j in others.flat_map(|(_, list)| list) {
                    let there = texel(j as usize);
                    let texels = (there[0] - here[0]).hypot(there[1] - here[1]);
                    if texels < margin {
                        return Err(PointDefect::Margin { first: i, second: j as usize, texels });
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn atlas(uv: &[[f32; 2]], chart: &[i32]) -> PointAtlas {
        let report = CloudReport { charts: 2, ..CloudReport::default() };
        PointAtlas { uv: uv.to_vec(), chart: chart.to_vec(), report }
    }

    #[test]
    fn broken_rules_are_found() {
        let positions = [[0.0; 3], [1.0; 3], [f64::NAN; 3]];
        let check = |uv: [[f32; 2]; 3], chart: &[i32]| atlas(&uv, chart).check_invariants(&positions, [100, 100], 4.0);
        let good = [[0.1, 0.1], [0.1, 0.15], [0.0, 0.0]];
        assert_eq!(check(good, &[0, 1, -1]), Ok(()));
        assert!(matches!(check(good, &[0, 1]), Err(PointDefect::Count { charts: 2, points: 3, .. })));
        assert_eq!(check(good, &[0, -1, -1]), Err(PointDefect::Chart { point: 1, chart: -1 }));
        assert_eq!(check(good, &[0, 1, 1]), Err(PointDefect::Chart { point: 2, chart: 1 }));
        assert_eq!(check(good, &[0, 2, -1]), Err(PointDefect::Chart { point: 1, chart: 2 }));
        let out = [[0.1, 0.1], [1.1, 0.5], [0.0, 0.0]];
        assert!(matches!(check(out, &[0, 1, -1]), Err(PointDefect::Outside { point: 1, .. })));
        let near = [[0.1, 0.1], [0.13, 0.1], [0.0, 0.0]];
        assert!(matches!(check(near, &[0, 1, -1]), Err(PointDefect::Margin { first: 0, second: 1, .. })));
        assert_eq!(check(near, &[0, 0, -1]), Ok(()));
    }
}
