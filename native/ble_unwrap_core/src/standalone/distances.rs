//! Geodesic distances between the vertices of any mesh.

use rayon::prelude::*;
use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::geodesics::{DijkstraScratch, FastMarching, MarchScratch, Metric, WeightedGraph, dijkstra};
use crate::memory;
use crate::mesh::{self, ConditionOptions, MeshError, MeshInput, Surface, VertexId};
use crate::progress::{Cancelled, Progress, Stage};

/// Why geodesic distances could not be computed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DistancesError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A source is not a vertex of the mesh.
    #[error("source {number} is vertex {vertex}, but the vertices are numbered 0 to {vertex_count} (exclusive)")]
    Source {
        /// Position in the list of sources, from 0.
        number: usize,
        /// The vertex it names.
        vertex: i32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// There are more distances than fit in memory.
    #[error(
        "{sources} sources times {vertices} vertices are more distances than fit in memory ({}); ask for fewer sources at a time",
        memory::text((*sources as u64).saturating_mul(*vertices as u64).saturating_mul(4))
    )]
    TooLarge {
        /// Number of sources.
        sources: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl DistancesError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Mesh(error) => error.kind(),
            Self::Source { .. } | Self::TooLarge { .. } => ErrorKind::Argument,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

/// Geodesic distances along a surface from each of k `sources`, which are vertices, to each of the n vertices of the mesh:
/// k×n values, row by row, in the unit of the input.
///
/// A distance is infinite where no path leads along the surface: to other components, and to vertices without faces. The
/// distance of a source from itself is 0. Vertices at one position count as one. Where the surface touches itself in a
/// single vertex, paths may begin and end on any side of the vertex, but none passes through it. The accuracy is that of
/// the [`Metric`], rounded to single precision. The result is the same for any number of threads.
///
/// O(n log n) for each source; by fast marching, some 0.4 µs for each pair of a source and a vertex.
///
/// # Errors
/// [`DistancesError`]: the arrays are invalid, a source is not a vertex, the result is too large, or the call was
/// cancelled.
pub fn surface_distances(
    input: &MeshInput<'_>,
    sources: &[i32],
    metric: Metric,
    progress: &Progress,
) -> Result<Vec<f32>, DistancesError> {
    progress.check()?;
    progress.enter(Stage::Condition);
    let n = input.positions.len();
    for (number, &vertex) in sources.iter().enumerate() {
        if !usize::try_from(vertex).is_ok_and(|v| v < n) {
            return Err(DistancesError::Source { number, vertex, vertex_count: n });
        }
    }
    let too_large = || DistancesError::TooLarge { sources: sources.len(), vertices: n };
    let count = sources.len().checked_mul(n).ok_or_else(too_large)?;
    let mut rows: Vec<f32> = memory::required(count).map_err(|_| too_large())?;
    let surface = mesh::condition(input, &ConditionOptions::default(), progress)?;
    let places = Places::new(input, &surface);
    rows.resize(count, f32::INFINITY);
    if rows.is_empty() {
        return Ok(rows);
    }
    progress.enter(Stage::Charts);
    let seeds = |source: i32| -> Vec<(VertexId, f64)> {
        places.of(source as usize).iter().map(|&(_, v)| (VertexId::new(v as usize), 0.0)).collect()
    };
    let write = |row: &mut [f32], distance: &[f64], source: i32| {
        for &(vertex, v) in &places.0 {
            let to = &mut row[vertex as usize];
            *to = to.min((distance[v as usize] * surface.scale) as f32);
        }
        row[source as usize] = 0.0;
    };
    let tasks = rows.par_chunks_mut(n).zip(sources);
    match metric {
        Metric::FastMarching => {
            let marching = FastMarching::new(&surface.mesh);
            tasks.try_for_each_init(MarchScratch::default, |scratch, (row, &source)| {
                progress.check()?;
                write(row, marching.march(&seeds(source), scratch, progress)?, source);
                Ok::<(), Cancelled>(())
            })?;
        }
        Metric::Dijkstra => {
            let graph = WeightedGraph::of_mesh(&surface.mesh);
            tasks.try_for_each_init(DijkstraScratch::default, |scratch, (row, &source)| {
                progress.check()?;
                let seeds: Vec<(usize, f64)> = seeds(source).iter().map(|s| (s.0.index(), s.1)).collect();
                write(row, dijkstra(&graph, &seeds, scratch, progress)?, source);
                Ok::<(), Cancelled>(())
            })?;
        }
    }
    Ok(rows)
}

/// Which vertices of the conditioned mesh lie at each vertex of the input: pairs, sorted.
struct Places(Vec<(u32, u32)>);

impl Places {
    fn new(input: &MeshInput<'_>, surface: &Surface) -> Self {
        let vertex = |corner: u32| input.corner_vertices[corner as usize] as u32;
        let mut pairs: Vec<(u32, u32)> =
            surface.places().into_iter().map(|(corner, v)| (vertex(corner), v.index() as u32)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        Self(pairs)
    }

    fn of(&self, vertex: usize) -> &[(u32, u32)] {
        let begin = self.0.partition_point(|p| (p.0 as usize) < vertex);
        let end = self.0.partition_point(|p| p.0 as usize <= vertex);
        &self.0[begin..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit squares side by side that do not share vertices, a triangle far away, a vertex without face.
    const POSITIONS: [[f64; 3]; 12] = [
        [10.0, 0.0, 5.0],
        [11.0, 0.0, 5.0],
        [11.0, 1.0, 5.0],
        [10.0, 1.0, 5.0],
        [11.0, 0.0, 5.0],
        [12.0, 0.0, 5.0],
        [12.0, 1.0, 5.0],
        [11.0, 1.0, 5.0],
        [90.0, 0.0, 0.0],
        [91.0, 0.0, 0.0],
        [90.0, 1.0, 0.0],
        [50.0, 50.0, 50.0],
    ];

    fn distances(sources: &[i32], metric: Metric) -> Result<Vec<f32>, DistancesError> {
        let input = MeshInput {
            positions: &POSITIONS,
            corner_vertices: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10],
            face_offsets: &[0, 4, 8, 11],
            ..MeshInput::default()
        };
        surface_distances(&input, sources, metric, &Progress::new())
    }

    #[test]
    fn distances_have_the_unit_and_the_numbers_of_the_input() {
        for metric in [Metric::FastMarching, Metric::Dijkstra] {
            let d = distances(&[0, 5], metric).expect("a valid mesh");
            let close = |found: f32, expected: f64| (f64::from(found) - expected).abs() < 1e-5;
            assert_eq!(d.len(), 24);
            assert!(d[0] == 0.0 && close(d[1], 1.0) && close(d[3], 1.0), "{d:?}");
            assert!(close(d[4], 1.0) && close(d[5], 2.0), "across the welded edge: {d:?}");
            assert!(d[8..12].iter().all(|x| x.is_infinite()), "nothing leads there: {d:?}");
            assert!(d[17] == 0.0 && close(d[12], 2.0), "{d:?}");
        }
        let straight = distances(&[0], Metric::FastMarching).expect("a valid mesh")[6];
        assert!((f64::from(straight) - 5.0_f64.sqrt()).abs() < 1e-5, "{straight}");
    }

    #[test]
    fn a_vertex_without_face_is_near_itself_only() {
        let d = distances(&[11], Metric::FastMarching).expect("a valid mesh");
        assert!(d[11] == 0.0 && d[..11].iter().all(|x| x.is_infinite()), "{d:?}");
        assert_eq!(distances(&[], Metric::Dijkstra), Ok(Vec::new()));
    }

    #[test]
    fn a_source_that_is_no_vertex_is_named() {
        for vertex in [12, -1] {
            let found = distances(&[3, vertex], Metric::FastMarching);
            assert_eq!(found, Err(DistancesError::Source { number: 1, vertex, vertex_count: 12 }));
        }
    }
}
