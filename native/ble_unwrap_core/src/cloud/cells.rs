//! Large pieces in cells: connected patches of some tens of points, each a node of a coarser sample.
//!
//! Where to cut and how to flatten hardly depends on detail below the width of a chart, and the mean of a cell's points
//! has a fraction of their noise.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use crate::collections::MinHeap;
use crate::geodesics::WeightedGraph;
use crate::progress::{Cancelled, Progress};

use super::sample::Sample;

/// Points between two looks at the cancel flag.
const CHECK_EVERY: usize = 4096;
/// Area of a cell over the square of its radius, where seeds keep that distance and no further fits: discs of half the
/// radius then fill 0.547 of the plane (random sequential addition, Feder 1980).
const CELL_AREA: f64 = PI / 4.0 / 0.547;
/// A covering may have so many times the cells asked for (curves and volumes do), else it is made again with larger
/// ones, at most [`MOST_COVERINGS`] times.
const MOST_EXCESS: usize = 2;
const MOST_COVERINGS: usize = 6;

/// The cells of a connected piece.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// The cell of each point.
    pub(super) of_point: Vec<u32>,
    /// The cells as a sample: means, areas, neighbours.
    pub(super) sample: Sample,
}

impl Cells {
    /// About `wanted` cells of equal radius along the graph. Serial, O(n log n), the same for the same points.
    pub(super) fn new(
        position: &[Point3<f64>],
        area: &[f64],
        graph: &WeightedGraph,
        wanted: usize,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let total: f64 = area.iter().sum();
        let mut radius = (total / wanted.max(1) as f64 / CELL_AREA).sqrt();
        let mut cover = Covering::new(graph, radius, progress)?;
        for _ in 1..MOST_COVERINGS {
            if cover.seeds.len() <= MOST_EXCESS * wanted {
                break;
            }
            radius *= (cover.seeds.len() as f64 / wanted as f64).sqrt().clamp(1.5, 8.0);
            cover = Covering::new(graph, radius, progress)?;
        }
        let count = cover.seeds.len();
        let (mut sum, mut cell_area) = (vec![Vector3::zeros(); count], vec![0.0; count]);
        for ((&cell, p), &a) in cover.of_point.iter().zip(position).zip(area) {
            sum[cell as usize] += p.coords * a;
            cell_area[cell as usize] += a;
        }
        let mean: Vec<Point3<f64>> = sum.iter().zip(&cell_area).map(|(s, a)| Point3::from(s / *a)).collect();
        progress.check()?;
        let coarse = WeightedGraph::from_edges(count, links(graph, &cover.of_point, &mean));
        Ok(Self { of_point: cover.of_point, sample: Sample::new(mean, cell_area, coarse) })
    }
}

/// Edges between cells with neighbouring points, as long as their means are apart.
fn links(graph: &WeightedGraph, of_point: &[u32], mean: &[Point3<f64>]) -> Vec<(usize, usize, f64)> {
    let mut pairs = Vec::new();
    for (i, &a) in of_point.iter().enumerate() {
        for (j, _) in graph.neighbours(i) {
            let b = of_point[j];
            if a < b {
                pairs.push((a, b));
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs.into_iter().map(|(a, b)| (a as usize, b as usize, (mean[a as usize] - mean[b as usize]).norm())).collect()
}

/// Seeds farther apart than a radius such that no point is farther than it from all; every point to its nearest.
struct Covering {
    seeds: Vec<usize>,
    of_point: Vec<u32>,
}

impl Covering {
    /// Seeds in the order of the points: each point that none covers yet becomes one. Its search lowers the distances
    /// of the points it is nearer to than the seeds before, so together the searches cost little more than one.
    fn new(graph: &WeightedGraph, radius: f64, progress: &Progress) -> Result<Self, Cancelled> {
        let n = graph.node_count();
        let mut distance = vec![f64::INFINITY; n];
        let mut of_point = vec![0; n];
        let mut heap = MinHeap::new(n);
        let mut seeds = Vec::new();
        let mut settled = 0usize;
        for seed in 0..n {
            if distance[seed] <= radius {
                continue;
            }
            let number = seeds.len() as u32;
            seeds.push(seed);
            distance[seed] = 0.0;
            of_point[seed] = number;
            heap.push_or_lower(seed, 0.0);
            while let Some((u, here)) = heap.pop() {
                settled += 1;
                if settled.is_multiple_of(CHECK_EVERY) {
                    progress.check()?;
                }
                for (v, length) in graph.neighbours(u) {
                    let there = here + length;
                    if there <= radius && there < distance[v] {
                        distance[v] = there;
                        of_point[v] = number;
                        heap.push_or_lower(v, there);
                    }
                }
            }
        }
        Ok(Self { seeds, of_point })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::local_map::tests::sheet;

    #[test]
    fn cells_cover_evenly_and_keep_the_area() {
        let (sample, _) = sheet(80, |x, y| Point3::new(x, y, 0.2 * x * y));
        let cells =
            Cells::new(&sample.position, &sample.area, &sample.graph, 400, &Progress::new()).expect("not cancelled");
        let count = cells.sample.len();
        assert!((300..800).contains(&count), "{count}");
        let total: f64 = cells.sample.area.iter().sum();
        assert!((total - 4.0).abs() < 1e-9);
        let mut size = vec![0; count];
        cells.of_point.iter().for_each(|&c| size[c as usize] += 1);
        assert!(size.iter().all(|&s| s > 0));
        assert_eq!(cells.sample.graph.components().1, 1);
        for (p, &c) in sample.position.iter().zip(&cells.of_point) {
            assert!((p - cells.sample.position[c as usize]).norm() < 0.3);
        }
    }

    #[test]
    fn a_curve_has_no_more_cells_than_twice_those_wanted() {
        let edges = (1..20_000).map(|i| (i - 1, i, 1e-3));
        let graph = WeightedGraph::from_edges(20_000, edges);
        let position: Vec<_> = (0..20_000).map(|i| Point3::new(1e-3 * f64::from(i), 0.0, 0.0)).collect();
        let cells = Cells::new(&position, &vec![1e-6; 20_000], &graph, 100, &Progress::new()).expect("not cancelled");
        assert!((20..=200).contains(&cells.sample.len()), "{}", cells.sample.len());
    }
}
