//! Charts so narrow that a texture can show little of what is on them.

use nalgebra::Point2;

use crate::mesh::MeshInput;
use crate::packing::{PackSettings, least_width};
use crate::progress::{Cancelled, Progress};
use crate::report::counted;

use super::placed::Placed;

/// Texels below which a chart is narrow. On one of two, bilinear filtering finds a texel on either side of every point;
/// on less, all that it shows is what was filled in around the chart.
const NARROW: f64 = 2.0;
/// By how much single precision may make a chart of two texels narrower, in texels.
const ROUNDING: f64 = 1e-3;

/// The narrow charts of a layout.
pub(super) struct Narrow {
    /// Their numbers, ascending.
    pub(super) charts: Vec<usize>,
    /// The narrowest, the first of several, and how wide it is in texels.
    narrowest: Option<(usize, f64)>,
    /// Whether mip levels may have made the margin wider.
    has_mip_levels: bool,
}

impl Narrow {
    /// Those among the charts as they are in single precision. O(n log n), and O(n) for all but those that are nearly
    /// narrow.
    pub(super) fn of(
        input: &MeshInput<'_>,
        layout: &Placed,
        packing: &PackSettings,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let size = [packing.width, packing.height].map(f64::from);
        let mut polygons: Vec<usize> =
            (0..layout.polygon_chart.len()).filter(|&p| layout.polygon_chart[p] >= 0).collect();
        polygons.sort_by_key(|&p| layout.polygon_chart[p]);
        let mut found = Self { charts: Vec::new(), narrowest: None, has_mip_levels: packing.mip_levels > 0 };
        let mut points: Vec<Point2<f64>> = Vec::new();
        for same in polygons.chunk_by(|&a, &b| layout.polygon_chart[a] == layout.polygon_chart[b]) {
            progress.check()?;
            points.clear();
            let mut area = 0.0;
            for &p in same {
                let corners = input.face_offsets[p] as usize..input.face_offsets[p + 1] as usize;
                let first = points.len();
                points.extend(layout.uv[corners].iter().map(|uv| {
                    let [x, y] = [0, 1].map(|k| f64::from(uv[k]) * size[k]);
                    Point2::new(x, y)
                }));
                // Some polygons may be wound the other way round than the surface.
                area += double_area(&points[first..]).abs();
            }
            if is_wide(&points, 0.5 * area) {
                continue;
            }
            let width = least_width(&points);
            if width < NARROW - ROUNDING {
                let chart = usize::try_from(layout.polygon_chart[same[0]]).unwrap_or(usize::MAX);
                found.charts.push(chart);
                if found.narrowest.is_none_or(|(_, least)| width < least) {
                    found.narrowest = Some((chart, width));
                }
            }
        }
        Ok(found)
    }

    /// What the user is told of them.
    pub(super) fn warning(&self) -> Option<String> {
        let (chart, width) = self.narrowest?;
        let are = counted(self.charts.len(), ["chart is", "charts are"]);
        let fewer = if self.has_mip_levels { ", or fewer mip levels" } else { "" };
        Some(format!(
            "{are} narrower than two texels, the narrowest is chart {chart} with {width:.2}: a texture can show little of \
             what is there; choose a larger texture or a smaller margin{fewer}"
        ))
    }
}

/// Twice the area of a polygon, negative where its corners run clockwise.
fn double_area(corners: &[Point2<f64>]) -> f64 {
    let Some(&first) = corners.first() else { return 0.0 };
    corners.windows(2).map(|side| (side[0] - first).perp(&(side[1] - first))).sum()
}

/// Whether points that span so much area certainly are not narrow: their area is at most their width times their
/// diameter.
fn is_wide(points: &[Point2<f64>], area: f64) -> bool {
    let Some(&first) = points.first() else { return true };
    let (low, high) = points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    area >= NARROW * (high - low).norm() && area > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A layout of quads, each a chart, by their corners in a texture of 100 by 200 texels.
    fn narrow(quads: &[[[f32; 2]; 4]], chart: &[i32], mip_levels: usize) -> Narrow {
        let uv = quads.iter().flatten().map(|p| [p[0] / 100.0, p[1] / 200.0]).collect();
        let face_offsets: Vec<i32> = (0..=quads.len() as i32).map(|f| 4 * f).collect();
        let input = MeshInput { face_offsets: &face_offsets, ..MeshInput::default() };
        let layout = Placed { uv, polygon_chart: chart.to_vec(), ..Placed::default() };
        let packing = PackSettings { width: 100, height: 200, mip_levels, ..PackSettings::default() };
        Narrow::of(&input, &layout, &packing, &Progress::new()).expect("not cancelled")
    }

    fn rectangle(w: f32, h: f32) -> [[f32; 2]; 4] {
        [[3.0, 5.0], [3.0 + w, 5.0], [3.0 + w, 5.0 + h], [3.0, 5.0 + h]]
    }

    #[test]
    fn charts_below_two_texels_are_listed_with_the_narrowest() {
        let slanting = [[10.0, 10.0], [50.0, 50.0], [49.0, 51.0], [9.0, 11.0]];
        let mut turned = rectangle(30.0, 1.0);
        turned.reverse();
        let quads = [rectangle(40.0, 40.0), rectangle(2.0, 90.0), rectangle(1.9, 3.0), slanting, turned];
        let found = narrow(&quads, &[0, 1, 2, 3, 4], 0);
        assert_eq!(found.charts, [2, 3, 4]);
        let text = found.warning().expect("some are");
        assert!(
            text.starts_with("3 charts are narrower than two texels, the narrowest is chart 4 with 1.00"),
            "{text}"
        );
        assert!(text.ends_with("a smaller margin") && found.charts.len() == 3);
        let one = narrow(&[rectangle(1.0, 1.0)], &[0], 2).warning().expect("one is");
        assert!(one.starts_with("1 chart is narrower") && one.ends_with("or fewer mip levels"), "{one}");
        assert_eq!(narrow(&[rectangle(9.0, 9.0)], &[0], 0).warning(), None);
    }

    #[test]
    fn a_chart_is_as_wide_as_all_its_faces_and_unmapped_faces_are_none() {
        let above = rectangle(30.0, 1.5).map(|[x, y]| [x, y + 1.5]);
        let quads = [rectangle(30.0, 1.5), above, [[0.0; 2]; 4]];
        assert!(narrow(&quads, &[0, 0, -1], 0).charts.is_empty());
        assert_eq!(narrow(&quads, &[1, 0, -1], 0).charts, [0, 1]);
    }
}
