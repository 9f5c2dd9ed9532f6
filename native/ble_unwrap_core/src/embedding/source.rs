//! The points of a call as something to be measured: all pairs, or all points against some landmarks.

use rayon::prelude::*;

use crate::geodesics::{
    DijkstraScratch, WeightedGraph, connectivity, dijkstra, farthest_nodes, graph_distances, knn_graph, nearest_points,
};
use crate::memory;
use crate::progress::Cancelled;
use crate::progress::Progress;

use super::affinity::{Kernel, KernelWidth, kernel_width};
use super::error::EmbeddingError;
use super::input::{EmbedInput, PointMetric};
use super::landmark_regression::Evidence;
use super::square_matrix::square_matrix;

/// Points looked at a task when distances to one point are taken.
const CHUNK: usize = 4096;

/// Numbers of neighbours looked at for one that connects the graph.
const MOST_NEIGHBOURS_TRIED: usize = 64;

/// Checked input, and the graph it is measured on.
pub(super) enum Source<'a> {
    Points { n: usize, p: usize, data: &'a [f64] },
    Graph { n: usize, p: usize, data: &'a [f64], neighbours: usize, graph: WeightedGraph },
    Distances { n: usize, data: &'a [f64] },
    Affinities { n: usize, data: &'a [f64] },
}

impl<'a> Source<'a> {
    /// Takes checked input; makes the graph of nearest neighbours and sees that it is in one piece.
    pub(super) fn new(input: EmbedInput<'a>, progress: &Progress) -> Result<Self, EmbeddingError> {
        Ok(match input {
            EmbedInput::Points { n, p, data, metric: PointMetric::Euclidean } => Self::Points { n, p, data },
            EmbedInput::Points { n, p, data, metric: PointMetric::Geodesic { neighbours } } => {
                let graph = knn_graph(data, p, neighbours, progress)?;
                let most = MOST_NEIGHBOURS_TRIED.max(2 * neighbours);
                let found = connectivity(&graph, data, p, neighbours, most, progress)?;
                if !found.is_connected() {
                    let largest = found.pieces.iter().map(|piece| piece.size).max().unwrap_or(0);
                    return Err(EmbeddingError::Disconnected {
                        neighbours,
                        pieces: found.pieces.len(),
                        points: n,
                        largest,
                        enough: found.enough,
                    });
                }
                Self::Graph { n, p, data, neighbours, graph }
            }
            EmbedInput::Distances { n, data } => Self::Distances { n, data },
            EmbedInput::Affinities { n, data } => Self::Affinities { n, data },
        })
    }

    pub(super) fn len(&self) -> usize {
        let (Self::Points { n, .. } | Self::Graph { n, .. } | Self::Distances { n, .. } | Self::Affinities { n, .. }) =
            self;
        *n
    }

    pub(super) fn evidence(&self) -> Evidence {
        match self {
            Self::Affinities { .. } => Evidence::Affinities,
            Self::Points { .. } | Self::Graph { .. } | Self::Distances { .. } => Evidence::SquaredDistances,
        }
    }

    /// The squared distances, or affinities, of all pairs: a symmetric n×n matrix.
    ///
    /// # Errors
    /// [`EmbeddingError::TooManyPoints`] where it does not fit in memory.
    pub(super) fn matrix(&self, progress: &Progress) -> Result<Vec<f64>, EmbeddingError> {
        let n = self.len();
        let mut matrix = square_matrix(n)?;
        match self {
            Self::Points { p, data, .. } => {
                let transposed = transpose(data, *p, 0..n);
                matrix.par_chunks_mut(n).zip(data.par_chunks_exact(*p)).try_for_each(|(row, point)| {
                    progress.check()?;
                    squared_to_all(point, &transposed, row);
                    Ok::<(), Cancelled>(())
                })?;
            }
            Self::Graph { graph, .. } => {
                let rows = matrix.par_chunks_mut(n).enumerate();
                rows.try_for_each_init(DijkstraScratch::default, |scratch, (i, row)| {
                    row.copy_from_slice(dijkstra(graph, &[(i, 0.0)], scratch, progress)?);
                    Ok::<(), Cancelled>(())
                })?;
                symmetrise(&mut matrix, n);
                matrix.par_iter_mut().for_each(|d| *d *= *d);
            }
            Self::Distances { data, .. } | Self::Affinities { data, .. } => {
                matrix.copy_from_slice(data);
                (0..n).for_each(|i| matrix[i * n + i] = 0.0);
                symmetrise(&mut matrix, n);
                if let Self::Distances { .. } = self {
                    matrix.par_iter_mut().for_each(|d| *d *= *d);
                }
            }
        }
        progress.check()?;
        Ok(matrix)
    }

    /// The squared distances, or affinities, among landmarks: a symmetric k×k matrix.
    ///
    /// # Errors
    /// [`EmbeddingError::TooManyPoints`].
    pub(super) fn among(&self, landmarks: &[usize], reference: &Reference) -> Result<Vec<f64>, EmbeddingError> {
        let k = landmarks.len();
        let mut matrix = square_matrix(k)?;
        matrix.par_chunks_mut(k.max(1)).zip(landmarks).enumerate().for_each(|(l, (row, &i))| {
            self.observe(reference, i, row);
            row[l] = 0.0;
        });
        symmetrise(&mut matrix, k);
        Ok(matrix)
    }

    /// At most `count` points in farthest-point order: each as far from all before it as any point, ties to the lower
    /// index. The first is farthest from the centroid, along a graph farthest from point 0, else the point farthest from
    /// point 0. Points that coincide with one chosen are left out. O(nk) distances; along a graph far less.
    pub(super) fn farthest_order(&self, count: usize, progress: &Progress) -> Result<Vec<usize>, EmbeddingError> {
        let n = self.len();
        let first = match self {
            Self::Graph { graph, .. } => {
                let mut scratch = DijkstraScratch::default();
                let first = farthest(dijkstra(graph, &[(0, 0.0)], &mut scratch, progress)?).map_or(0, |(v, _)| v);
                return Ok(farthest_nodes(graph, count, first, progress)?);
            }
            Self::Points { p, data, .. } => {
                let centroid = centroid(data, *p);
                let far: Vec<f64> = data.chunks_exact(*p).map(|x| squared_distance(x, &centroid)).collect();
                farthest(&far)
            }
            Self::Distances { .. } | Self::Affinities { .. } => {
                farthest(&(0..n).map(|i| if i > 0 { self.apart(0, i) } else { 0.0 }).collect::<Vec<_>>())
            }
        };
        let mut chosen = Vec::with_capacity(count);
        let mut next = first.map(|(v, _)| v);
        let mut cover = vec![f64::INFINITY; n];
        while let Some(landmark) = next.filter(|_| chosen.len() < count) {
            progress.check()?;
            chosen.push(landmark);
            cover.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, cover)| {
                for (i, cover) in cover.iter_mut().enumerate() {
                    let i = chunk * CHUNK + i;
                    *cover = if i == landmark { 0.0 } else { cover.min(self.apart(landmark, i)) };
                }
            });
            next = farthest(&cover).filter(|(_, d)| *d > 0.0).map(|(v, _)| v);
        }
        Ok(chosen)
    }

    /// Something that grows with the distance of two different points; not for graphs.
    fn apart(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Points { p, data, .. } => squared_distance(&data[i * p..(i + 1) * p], &data[j * p..(j + 1) * p]),
            Self::Distances { n, data } => data[i * n + j] + data[j * n + i],
            Self::Affinities { n, data } => 2.0 - data[i * n + j] - data[j * n + i],
            Self::Graph { .. } => f64::INFINITY,
        }
    }

    /// What distances of these and of later points to landmarks are taken from. For a graph this measures all points
    /// against the landmarks.
    pub(super) fn reference(&self, landmarks: &[usize], progress: &Progress) -> Result<Reference, EmbeddingError> {
        Ok(match self {
            Self::Points { p, data, .. } => {
                Reference::Points { p: *p, transposed: transpose(data, *p, landmarks.iter().copied()) }
            }
            Self::Graph { n, p, data, neighbours, graph } => {
                let k = landmarks.len();
                let room = n.checked_mul(k).and_then(|count| memory::required(count).ok());
                let mut to_landmarks: Vec<f32> = room.ok_or(EmbeddingError::TooManyPoints { points: *n })?;
                to_landmarks.resize(n * k, 0.0);
                // A few rows at a time, so that double precision never holds them all.
                let group = 2 * rayon::current_num_threads().max(4);
                for (g, sources) in landmarks.chunks(group).enumerate() {
                    let rows = graph_distances(graph, sources, progress)?;
                    to_landmarks.par_chunks_mut(k).enumerate().for_each(|(v, place)| {
                        for l in 0..sources.len() {
                            place[g * group + l] = rows[l * n + v] as f32;
                        }
                    });
                }
                Reference::Graph { p: *p, points: data.to_vec(), neighbours: *neighbours, to_landmarks, k }
            }
            Self::Distances { .. } => Reference::Distances { landmarks: landmarks.to_vec() },
            Self::Affinities { .. } => Reference::Affinities { landmarks: landmarks.to_vec() },
        })
    }

    /// Writes the squared distances, or affinities, of point `i` to the landmarks of `reference`.
    pub(super) fn observe(&self, reference: &Reference, i: usize, row: &mut [f64]) {
        match (self, reference) {
            (Self::Points { p, data, .. } | Self::Graph { p, data, .. }, Reference::Points { transposed, .. }) => {
                squared_to_all(&data[i * p..(i + 1) * p], transposed, row);
            }
            (_, Reference::Graph { to_landmarks, k, .. }) => {
                for (square, &d) in row.iter_mut().zip(&to_landmarks[i * k..(i + 1) * k]) {
                    *square = f64::from(d).powi(2);
                }
            }
            (Self::Distances { n, data }, Reference::Distances { landmarks }) => {
                for (square, &l) in row.iter_mut().zip(landmarks) {
                    *square = if i == l { 0.0 } else { (0.5 * (data[i * n + l] + data[l * n + i])).powi(2) };
                }
            }
            (Self::Affinities { n, data }, Reference::Affinities { landmarks }) => {
                for (p, &l) in row.iter_mut().zip(landmarks) {
                    *p = 0.5 * (data[i * n + l] + data[l * n + i]);
                }
            }
            (_, Reference::Points { .. } | Reference::Distances { .. } | Reference::Affinities { .. }) => row.fill(0.0),
        }
    }

    /// The kernel width from landmarks: the mean squared distance is that of all pairs for straight distances, which
    /// costs O(np), else that of landmarks and points; a mean affinity that of the landmarks.
    pub(super) fn landmark_width(
        &self,
        landmarks: &[usize],
        reference: &Reference,
        among: &[f64],
        kernel: Kernel,
        width: KernelWidth,
        progress: &Progress,
    ) -> Result<f64, EmbeddingError> {
        let (n, k) = (self.len(), landmarks.len());
        let mean = match (width, self) {
            (KernelWidth::Absolute(_) | KernelWidth::MeanAffinity(_), _) => {
                return kernel_width(among, k, kernel, width, progress);
            }
            (KernelWidth::Relative(_), Self::Points { p, data, .. }) => {
                // Σ_{i<j} |x_i − x_j|² = n Σ |x_i − mean|².
                let centroid = centroid(data, *p);
                let total: f64 = data.chunks_exact(*p).map(|x| squared_distance(x, &centroid)).sum();
                2.0 * total / (n as f64 - 1.0)
            }
            (KernelWidth::Relative(_), _) => {
                let rows: Vec<f64> = (0..n)
                    .into_par_iter()
                    .map_init(
                        || vec![0.0; k],
                        |row, i| {
                            self.observe(reference, i, row);
                            row.iter().sum()
                        },
                    )
                    .collect();
                // A landmark is at 0 from itself, which does not count.
                rows.iter().sum::<f64>() / (k * n - k).max(1) as f64
            }
        };
        match width {
            KernelWidth::Relative(c) if mean > 0.0 && mean.is_finite() => Ok(c * mean),
            _ => Err(EmbeddingError::NoExtent),
        }
    }
}

/// What relates points to k landmarks.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Reference {
    /// The landmarks' p coordinates, all first ones, then all second ones, …
    Points { p: usize, transposed: Vec<f64> },
    /// All points and, point by point, their distances to the k landmarks along the graph.
    Graph { p: usize, points: Vec<f64>, neighbours: usize, to_landmarks: Vec<f32>, k: usize },
    /// Distances come with the points.
    Distances { landmarks: Vec<usize> },
    /// Affinities come with the points.
    Affinities { landmarks: Vec<usize> },
}

impl Reference {
    /// Number of columns that new points have.
    pub(super) fn columns(&self) -> usize {
        match self {
            Self::Points { p, .. } | Self::Graph { p, .. } => *p,
            Self::Distances { landmarks } | Self::Affinities { landmarks } => landmarks.len(),
        }
    }

    /// For a graph the nearest known points of each new one, else nothing.
    pub(super) fn contacts(&self, data: &[f64], progress: &Progress) -> Result<Vec<(usize, f64)>, Cancelled> {
        match self {
            Self::Graph { p, points, neighbours, .. } => nearest_points(points, data, *p, *neighbours, progress),
            Self::Points { .. } | Self::Distances { .. } | Self::Affinities { .. } => Ok(Vec::new()),
        }
    }

    /// Writes the squared distances, or affinities, of new point `i` to the landmarks.
    pub(super) fn observe_new(&self, data: &[f64], contacts: &[(usize, f64)], i: usize, row: &mut [f64]) {
        let columns = self.columns();
        let given = &data[i * columns..(i + 1) * columns];
        match self {
            Self::Points { transposed, .. } => squared_to_all(given, transposed, row),
            Self::Graph { p, points, neighbours, to_landmarks, k } => {
                let count = (*neighbours).min(points.len() / p);
                row.fill(f64::INFINITY);
                for &(v, length) in &contacts[i * count..(i + 1) * count] {
                    for (d, &beyond) in row.iter_mut().zip(&to_landmarks[v * k..(v + 1) * k]) {
                        *d = d.min(length + f64::from(beyond));
                    }
                }
                row.iter_mut().for_each(|d| *d *= *d);
            }
            Self::Distances { .. } => row.iter_mut().zip(given).for_each(|(square, d)| *square = d * d),
            Self::Affinities { .. } => row.copy_from_slice(given),
        }
    }
}

/// Squared distances of one point to all whose coordinates are `transposed`, summed in the order of coordinates.
fn squared_to_all(point: &[f64], transposed: &[f64], row: &mut [f64]) {
    row.fill(0.0);
    for (x, others) in point.iter().zip(transposed.chunks_exact(row.len().max(1))) {
        for (square, y) in row.iter_mut().zip(others) {
            *square += (x - y) * (x - y);
        }
    }
}

pub(super) fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn centroid(data: &[f64], p: usize) -> Vec<f64> {
    let mut mean = vec![0.0; p];
    for x in data.chunks_exact(p) {
        mean.iter_mut().zip(x).for_each(|(m, x)| *m += x);
    }
    let n = (data.len() / p).max(1) as f64;
    mean.iter_mut().for_each(|m| *m /= n);
    mean
}

/// Index and value of the greatest, the first of equals.
fn farthest(values: &[f64]) -> Option<(usize, f64)> {
    values.iter().copied().enumerate().fold(None, |best, (i, v)| match best {
        Some((_, most)) if v <= most => best,
        _ => Some((i, v)),
    })
}

/// At most `count` points in farthest-point order from the squared distances of all pairs, beginning with the point
/// farthest from point 0.
pub(super) fn farthest_rows(
    squared: &[f64],
    n: usize,
    count: usize,
    progress: &Progress,
) -> Result<Vec<usize>, Cancelled> {
    let mut chosen = Vec::with_capacity(count);
    let mut cover = vec![f64::INFINITY; n];
    let mut next = farthest(&squared[..n]).map(|(v, _)| v);
    while let Some(landmark) = next.filter(|_| chosen.len() < count) {
        progress.check()?;
        chosen.push(landmark);
        let row = &squared[landmark * n..(landmark + 1) * n];
        cover.iter_mut().zip(row).for_each(|(cover, d)| *cover = cover.min(*d));
        cover[landmark] = 0.0;
        next = farthest(&cover).filter(|(_, d)| *d > 0.0).map(|(v, _)| v);
    }
    Ok(chosen)
}

/// Averages a matrix with its transpose, tile by tile: rows of the one are columns of the other.
fn symmetrise(matrix: &mut [f64], n: usize) {
    const TILE: usize = 32;
    for top in (0..n).step_by(TILE) {
        for left in (0..=top).step_by(TILE) {
            for i in top..(top + TILE).min(n) {
                for j in left..(left + TILE).min(i) {
                    let mean = 0.5 * (matrix[i * n + j] + matrix[j * n + i]);
                    matrix[i * n + j] = mean;
                    matrix[j * n + i] = mean;
                }
            }
        }
    }
}

/// The p coordinates of some points: all first ones, then all second ones, …
fn transpose(data: &[f64], p: usize, chosen: impl Iterator<Item = usize> + Clone) -> Vec<f64> {
    (0..p).flat_map(|c| chosen.clone().map(move |i| data[i * p + c])).collect()
}
