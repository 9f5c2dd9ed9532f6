//! What a chart of points covers in the texture: squares around the points, joined to a mesh the packer can take.

use std::collections::HashMap;

use nalgebra::Point2;

/// The raster of a footprint has at most so many cells along its longer side; finer would be below a texel.
const MOST_ACROSS: f64 = 1024.0;

/// Quads, as triangles, over every raster cell that a point's splat touches. A splat is the square of half side
/// `half[i]` around a point: neighbouring splats overlap, so that a sheet is covered without gaps.
#[derive(Clone, Debug, Default)]
pub(super) struct Footprint {
    pub(super) points: Vec<Point2<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Footprint {
    /// The footprint of points with the given half sides, on a raster of half the typical half side. A point whose
    /// splat has no extent contributes itself. O(cells).
    pub(super) fn new(uv: &[Point2<f64>], half: &[f64]) -> Self {
        let mut sorted: Vec<f64> = half.iter().copied().filter(|h| *h > 0.0).collect();
        let mut footprint = Self::default();
        if sorted.is_empty() {
            // Points as triangles without extent, for the packer to give them a texel each.
            for p in uv {
                let v = footprint.points.len() as u32;
                footprint.points.push(*p);
                footprint.triangles.push([v; 3]);
            }
            return footprint;
        }
        let middle = (sorted.len() - 1) / 2;
        let typical = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
        let (low, high) = bounds(uv);
        let extent = (high.x - low.x).max(high.y - low.y);
        let side = (0.5 * typical).max(extent / MOST_ACROSS);
        // A lone sparse point must not cover the sheet.
        let reach = |h: f64| if h > 0.0 { h.min(4.0 * typical) } else { typical };
        let cell = |x: f64, low: f64| ((x - low) / side).floor() as i32;
        let mut cells: Vec<[i32; 2]> = Vec::new();
        for (p, &h) in uv.iter().zip(half) {
            let h = reach(h);
            for y in cell(p.y - h, low.y)..=cell(p.y + h, low.y) {
                for x in cell(p.x - h, low.x)..=cell(p.x + h, low.x) {
                    cells.push([y, x]);
                }
            }
            if cells.len() > 1 << 22 {
                cells.sort_unstable();
                cells.dedup();
            }
        }
        cells.sort_unstable();
        cells.dedup();
        let mut number: HashMap<[i32; 2], u32> = HashMap::with_capacity(2 * cells.len());
        for [y, x] in cells {
            let corners = [[y, x], [y, x + 1], [y + 1, x + 1], [y + 1, x]].map(|key| {
                *number.entry(key).or_insert_with(|| {
                    let [y, x] = key.map(f64::from);
                    footprint.points.push(Point2::new(low.x + x * side, low.y + y * side));
                    footprint.points.len() as u32 - 1
                })
            });
            footprint.triangles.push([corners[0], corners[1], corners[2]]);
            footprint.triangles.push([corners[0], corners[2], corners[3]]);
        }
        footprint
    }
}

fn bounds(uv: &[Point2<f64>]) -> (Point2<f64>, Point2<f64>) {
    let start = (Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY));
    uv.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(f: &Footprint) -> f64 {
        let double = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| f.points[v as usize]);
            (b - a).perp(&(c - a))
        };
        f.triangles.iter().map(|t| 0.5 * double(t)).sum()
    }

    #[test]
    fn a_lattice_is_covered_with_its_border() {
        let uv: Vec<_> = (0..400).map(|i| Point2::new(f64::from(i % 20), f64::from(i / 20))).collect();
        let f = Footprint::new(&uv, &vec![1.0; 400]);
        // 19 units between the outer points and one on each side, and less than a raster cell more.
        assert!((21.0f64.powi(2)..22.01f64.powi(2)).contains(&area(&f)), "{}", area(&f));
        let (low, high) = bounds(&f.points);
        assert!(low.x <= -1.0 && high.y >= 20.0);
    }

    #[test]
    fn large_and_small_clouds_have_a_bounded_raster() {
        let uv: Vec<_> = (0..10_000).map(|i| Point2::new(f64::from(i), 0.0)).collect();
        assert!(Footprint::new(&uv, &vec![1e-3; 10_000]).triangles.len() < 20_000);
        let one = Footprint::new(&[Point2::new(3.0, 4.0)], &[0.0]);
        assert_eq!((one.points.len(), one.triangles.len()), (1, 1));
        let mixed = Footprint::new(&uv[..3], &[1.0, 0.0, 1e9]);
        assert!(area(&mixed) < 200.0);
    }
}
