//! Truncated kernels: affinities below a threshold are 0, and distances that would give them are not measured.
//!
//! With σ known beforehand the threshold is a radius. Shortest paths stop there, and sums over many coordinates stop
//! as soon as they pass it. (The likelihood itself still needs the model's affinity of every pair.)

use rayon::prelude::*;

use crate::geodesics::{DijkstraScratch, WeightedGraph, dijkstra_within};
use crate::memory;
use crate::progress::Cancelled;
use crate::progress::Progress;

use super::affinity::{Affinity, Kernel};
use super::error::EmbeddingError;
use super::square_matrix::square_matrix;

/// Coordinates summed between two looks at the radius.
const STRIDE: usize = 16;

/// Which affinities count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Threshold {
    pub(super) kernel: Kernel,
    pub(super) sigma: f64,
    /// Affinities below this are 0; positive.
    pub(super) least: f64,
}

impl Threshold {
    /// The squared distance beyond which affinities are below the threshold, a little more for rounding.
    fn squared_radius(self) -> f64 {
        2.0 * self.sigma * self.kernel.scaled_square(self.least) * (1.0 + 1e-9)
    }

    fn affinity(self, squared: f64) -> f64 {
        let p = self.kernel.affinity(squared * (0.5 / self.sigma));
        if p < self.least { 0.0 } else { p }
    }
}

/// Truncated affinities.
pub(super) struct Truncated {
    pub(super) affinity: Affinity,
    /// Along a graph all distances within the radius, infinite beyond: n×n.
    pub(super) distances: Vec<f32>,
}

/// Along a graph, each point searching no farther than the radius; also the number of nodes settled.
pub(super) fn along_graph(
    graph: &WeightedGraph,
    threshold: Threshold,
    progress: &Progress,
) -> Result<(Truncated, usize), EmbeddingError> {
    let n = graph.node_count();
    let radius = threshold.squared_radius().sqrt();
    let mut matrix = square_matrix(n)?;
    let mut distances = memory::required(n * n).map_err(|_| EmbeddingError::TooManyPoints { points: n })?;
    distances.resize(n * n, f32::INFINITY);
    let work: Vec<usize> = matrix
        .par_chunks_mut(n.max(1))
        .zip(distances.par_chunks_mut(n.max(1)))
        .enumerate()
        .map_init(DijkstraScratch::default, |scratch, (i, (row, distances))| {
            progress.check()?;
            let reached = dijkstra_within(graph, &[(i, 0.0)], radius, scratch, progress)?.to_vec();
            for &j in scratch.reached() {
                row[j as usize] = threshold.affinity(reached[j as usize].powi(2));
                distances[j as usize] = reached[j as usize] as f32;
            }
            Ok(scratch.reached().len())
        })
        .collect::<Result<_, Cancelled>>()?;
    let affinity = Affinity::symmetric(matrix, n, threshold.sigma);
    Ok((Truncated { affinity, distances }, work.iter().sum()))
}

/// Between points, each sum of squares stopping beyond the radius; also the number of coordinates summed.
pub(super) fn between_points(
    data: &[f64],
    n: usize,
    p: usize,
    threshold: Threshold,
    progress: &Progress,
) -> Result<(Truncated, usize), EmbeddingError> {
    let limit = threshold.squared_radius();
    let point = |i: usize| &data[i * p..(i + 1) * p];
    let mut matrix = square_matrix(n)?;
    let work: Vec<usize> = matrix
        .par_chunks_mut(n.max(1))
        .enumerate()
        .map(|(i, row)| {
            progress.check()?;
            let mut work = 0;
            for (j, entry) in row[..i].iter_mut().enumerate() {
                let mut square = 0.0;
                for (a, b) in point(i).chunks(STRIDE).zip(point(j).chunks(STRIDE)) {
                    square += a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
                    work += a.len();
                    if square > limit {
                        break;
                    }
                }
                *entry = if square > limit { 0.0 } else { threshold.affinity(square) };
            }
            Ok(work)
        })
        .collect::<Result<_, Cancelled>>()?;
    let affinity = Affinity::from_lower_triangle(matrix, n, threshold.sigma);
    Ok((Truncated { affinity, distances: Vec::new() }, work.iter().sum()))
}

#[cfg(test)]
mod tests {
    use super::super::affinity::KernelWidth;
    use super::*;
    use crate::geodesics::{graph_distances, knn_graph};
    use crate::random::normal;

    fn same(a: &Affinity, b: &Affinity) -> bool {
        let off_diagonal =
            |x: &Affinity, i: usize| x.row(i).iter().enumerate().filter(|e| e.0 != i).map(|e| *e.1).collect::<Vec<_>>();
        (0..a.len()).all(|i| off_diagonal(a, i).iter().zip(off_diagonal(b, i)).all(|(x, y)| (x - y).abs() < 1e-12))
    }

    #[test]
    fn searches_along_a_graph_stop_at_the_radius() {
        let n = 400;
        let points: Vec<f64> = (0..n).flat_map(|i| [(i % 20) as f64, (i / 20) as f64]).collect();
        let graph = knn_graph(&points, 2, 8, &Progress::new()).expect("not cancelled");
        let nodes: Vec<usize> = (0..n).collect();
        let rows = graph_distances(&graph, &nodes, &Progress::new()).expect("not cancelled");
        let squared: Vec<f64> = rows.iter().map(|d| d * d).collect();
        for (kernel, least) in [(Kernel::Gaussian, 0.05), (Kernel::Logistic, 0.02)] {
            let threshold = Threshold { kernel, sigma: 2.0, least };
            let (some, work) = along_graph(&graph, threshold, &Progress::new()).expect("fits");
            let width = KernelWidth::Absolute(2.0);
            let all = Affinity::from_squared_distances(&squared, n, kernel, width, &Progress::new()).expect("valid");
            assert!(same(&some.affinity, &all.truncated(least)), "{kernel:?}");
            assert!(4 * work < n * n, "{kernel:?}: {} of {} nodes settled", work, n * n);
            assert!(some.distances.iter().filter(|d| d.is_finite()).count() == work);
        }
    }

    #[test]
    fn sums_over_many_coordinates_stop_at_the_radius() {
        // Two tight groups far apart in 256 dimensions: half of the pairs end early.
        let (n, p) = (60, 256);
        let group = |i: usize| if i.is_multiple_of(2) { 0.0 } else { 3.0 };
        let data: Vec<f64> = (0..n * p).map(|k| group(k / p) + 0.05 * normal(1, k as u64)).collect();
        let squared: Vec<f64> = (0..n * n)
            .map(|k| super::super::source::squared_distance(&data[k / n * p..][..p], &data[k % n * p..][..p]))
            .collect();
        for kernel in [Kernel::Gaussian, Kernel::Logistic] {
            let threshold = Threshold { kernel, sigma: 1.0, least: 0.01 };
            let (some, work) = between_points(&data, n, p, threshold, &Progress::new()).expect("fits");
            let width = KernelWidth::Absolute(1.0);
            let all = Affinity::from_squared_distances(&squared, n, kernel, width, &Progress::new()).expect("valid");
            assert!(same(&some.affinity, &all.truncated(0.01)), "{kernel:?}");
            let complete = n * (n - 1) / 2 * p;
            assert!(10 * work < 6 * complete, "{kernel:?}: {} of {complete} coordinates", work);
        }
    }
}
