//! Choosing landmarks and measuring from them.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::dijkstra::{DijkstraScratch, add_source, dijkstra};
use super::fast_marching::{FastMarching, MarchScratch};
use super::landmark_distances::LandmarkDistances;
use super::settings::{GeodesicSettings, Metric};
use super::weighted_graph::WeightedGraph;
use crate::collections::MinHeap;
use crate::memory;
use crate::mesh::{TriMesh, VertexId, measure};
use crate::progress::{Cancelled, Progress};

/// Chooses at most `count` landmarks, all different, each as far from all before it as any vertex.
///
/// Farthest is measured along edges, which costs one bounded search a landmark, O(n log n log k)
/// together, where marching would cost k whole marches; the choice hardly differs. The
/// first landmark is the vertex farthest from the middle of the surface. A component
/// without landmark is farther than anything else, so each gets one while they last. Ties go to the
/// lower index. Fewer than `count` are returned if the rest coincides with those chosen.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn choose_landmarks(mesh: &TriMesh, count: usize, progress: &Progress) -> Result<Vec<VertexId>, Cancelled> {
    let n = mesh.vertex_count();
    let count = count.min(n);
    let graph = WeightedGraph::of_mesh(mesh);
    let mut cover = vec![f64::INFINITY; n];
    let mut heap = MinHeap::new(n);
    let mut landmarks = Vec::with_capacity(count);
    let mut take = |v: VertexId, cover: &mut [f64], landmarks: &mut Vec<VertexId>| {
        landmarks.push(v);
        add_source(&graph, v.index(), cover, &mut heap, progress)
    };
    if count > 0 {
        let middle = middle_vertex(mesh);
        let mut scratch = DijkstraScratch::default();
        let from_middle = dijkstra(&graph, &[(middle.index(), 0.0)], &mut scratch, progress)?;
        let first = farthest(from_middle, |d| d.is_finite()).unwrap_or(middle);
        take(first, &mut cover, &mut landmarks)?;
    }
    while landmarks.len() < count {
        let Some(next) = farthest(&cover, |d| d > 0.0) else { break };
        take(next, &mut cover, &mut landmarks)?;
    }
    Ok(landmarks)
}

/// The vertex of greatest distance among those allowed, the lowest of several.
fn farthest(distance: &[f64], allowed: impl Fn(f64) -> bool) -> Option<VertexId> {
    let mut best: Option<(f64, usize)> = None;
    for (v, &d) in distance.iter().enumerate() {
        if allowed(d) && best.is_none_or(|(most, _)| d > most) {
            best = Some((d, v));
        }
    }
    best.map(|(_, v)| VertexId::new(v))
}

/// The vertex nearest to the centroid of the area.
fn middle_vertex(mesh: &TriMesh) -> VertexId {
    let (mut moment, mut area) = (Vector3::zeros(), 0.0);
    for f in mesh.faces() {
        let p = mesh.triangle_positions(f);
        let a = measure::triangle_area(p);
        if a.is_finite() {
            moment += (p[0].coords + p[1].coords + p[2].coords) * (a / 3.0);
            area += a;
        }
    }
    let centroid = if area > 0.0 { Point3::from(moment / area) } else { Point3::origin() };
    let mut best = (f64::INFINITY, VertexId::new(0));
    for v in mesh.vertices() {
        let d = (mesh.position(v) - centroid).norm_squared();
        if d < best.0 {
            best = (d, v);
        }
    }
    best.1
}

/// Geodesic distances from each of `sources` to every vertex, one row a source; infinite where a
/// source does not lead. The row of a source that is no vertex of the mesh is infinite throughout.
///
/// Sources run in parallel; the result is the same for any number of threads. What the distances
/// promise is said at [`FastMarching::march`]; rows are rounded to single precision. Time: some 0.4 µs
/// a vertex and source (fast marching); memory: the result, and 30 bytes a vertex and thread.
///
/// # Errors
/// [`Cancelled`] if `progress` says so, or there is no memory for the rows.
pub(crate) fn geodesic_distances(
    mesh: &TriMesh,
    sources: &[VertexId],
    metric: Metric,
    progress: &Progress,
) -> Result<LandmarkDistances, Cancelled> {
    let n = mesh.vertex_count();
    // As many as the caller likes: too many for the memory is an error, and a product that overflows is too many.
    let mut rows = memory::filled(n.saturating_mul(sources.len()), f32::INFINITY).map_err(Cancelled::OutOfMemory)?;
    if rows.is_empty() {
        return Ok(LandmarkDistances::new(sources.to_vec(), n, rows));
    }
    let round = |row: &mut [f32], distance: &[f64]| {
        for (to, &from) in row.iter_mut().zip(distance) {
            *to = from as f32;
        }
    };
    let tasks = rows.par_chunks_mut(n).zip(sources);
    match metric {
        Metric::FastMarching => {
            let marching = FastMarching::new(mesh);
            tasks.try_for_each_init(MarchScratch::default, |scratch, (row, &source)| {
                progress.check()?;
                round(row, marching.march(&[(source, 0.0)], scratch, progress)?);
                Ok(())
            })?;
        }
        Metric::Dijkstra => {
            let graph = WeightedGraph::of_mesh(mesh);
            tasks.try_for_each_init(DijkstraScratch::default, |scratch, (row, &source)| {
                progress.check()?;
                round(row, dijkstra(&graph, &[(source.index(), 0.0)], scratch, progress)?);
                Ok(())
            })?;
        }
    }
    Ok(LandmarkDistances::new(sources.to_vec(), n, rows))
}

/// Landmarks of a mesh by farthest-point sampling, and the distances from them.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn landmark_distances(
    mesh: &TriMesh,
    settings: &GeodesicSettings,
    progress: &Progress,
) -> Result<LandmarkDistances, Cancelled> {
    let landmarks = choose_landmarks(mesh, settings.landmark_count(mesh.vertex_count()), progress)?;
    geodesic_distances(mesh, &landmarks, settings.metric, progress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces::{self, grid, sphere};

    fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool").install(work)
    }

    #[test]
    fn landmarks_are_far_apart_and_cover() {
        let mesh = grid(30, 30, [1.0, 1.0], 0.0);
        let landmarks = choose_landmarks(&mesh, 40, &Progress::new()).expect("not cancelled");
        assert_eq!(landmarks.len(), 40);
        let distance = |a: VertexId, b: VertexId| (mesh.position(a) - mesh.position(b)).norm();
        let nearest =
            |v: VertexId, others: &[VertexId]| others.iter().map(|&l| distance(v, l)).fold(f64::INFINITY, f64::min);
        let apart = (0..40).map(|i| nearest(landmarks[i], &landmarks[..i])).fold(f64::INFINITY, f64::min);
        let cover = mesh.vertices().map(|v| nearest(v, &landmarks)).fold(0.0, f64::max);
        // Farthest-point sampling covers as far as its points are apart, here up to the edges' detour.
        assert!(apart > 0.1 && cover < 1.5 * apart, "{apart} {cover}");
        // The first is a corner: nothing is farther from the middle.
        let first = mesh.position(landmarks[0]);
        assert!([first.x, first.y].iter().all(|&x| x == 0.0 || x == 1.0), "{first}");
    }

    #[test]
    fn every_component_gets_a_landmark_and_coincident_vertices_none() {
        let a = sphere(1);
        let mut positions = a.positions().to_vec();
        positions.extend(a.positions().iter().map(|p| p + Vector3::new(5.0, 0.0, 0.0)));
        positions.extend([Point3::new(9.0, 9.0, 9.0); 3]);
        let n = a.vertex_count() as u32;
        let mut triangles: Vec<[u32; 3]> = a.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        triangles.extend(triangles.clone().iter().map(|t| t.map(|v| v + n)));
        triangles.push([2 * n, 2 * n + 1, 2 * n + 2]);
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let landmarks = choose_landmarks(&mesh, 3, &Progress::new()).expect("not cancelled");
        let mut part: Vec<_> = landmarks.iter().map(|l| l.index() as u32 / n).collect();
        part.sort_unstable();
        assert_eq!(part, [0, 1, 2]);
        let all = choose_landmarks(&mesh, 1000, &Progress::new()).expect("not cancelled");
        assert_eq!(all.len(), 2 * n as usize + 1);
    }

    #[test]
    fn same_bytes_for_any_number_of_threads() {
        let mesh = sphere(4);
        let run = |threads| {
            on_threads(threads, || landmark_distances(&mesh, &GeodesicSettings::default(), &Progress::new()))
                .expect("not cancelled")
        };
        let one = run(1);
        assert_eq!(one.len(), 48);
        for threads in [2, 8] {
            let other = run(threads);
            assert_eq!(one.landmarks(), other.landmarks());
            let bits = |d: LandmarkDistances| d.into_rows().into_iter().map(f32::to_bits).collect::<Vec<_>>();
            assert!(bits(one.clone()) == bits(other));
        }
    }

    #[test]
    fn both_metrics_and_absent_sources() {
        let mesh = grid(10, 10, [1.0, 1.0], 0.0);
        let sources = [VertexId::new(0), VertexId::new(5_000)];
        for (metric, corner) in [(Metric::FastMarching, 2.0_f32.sqrt()), (Metric::Dijkstra, 2.0_f32.sqrt())] {
            let d = geodesic_distances(&mesh, &sources, metric, &Progress::new()).expect("not cancelled");
            let far = d.row(0).iter().copied().fold(0.0, f32::max);
            assert!((far - corner).abs() < 1e-6 || metric == Metric::Dijkstra && far > corner);
            assert!(d.row(1).iter().all(|d| d.is_infinite()));
        }
        let empty = geodesic_distances(&TriMesh::default(), &sources, Metric::FastMarching, &Progress::new());
        assert_eq!(empty.expect("not cancelled").vertex_count(), 0);
        let none = landmark_distances(&TriMesh::default(), &GeodesicSettings::default(), &Progress::new());
        assert_eq!(none.expect("not cancelled").len(), 0);
        let cancelled = Progress::new();
        cancelled.cancel();
        assert!(geodesic_distances(&mesh, &sources, Metric::FastMarching, &cancelled).is_err());
    }
}
