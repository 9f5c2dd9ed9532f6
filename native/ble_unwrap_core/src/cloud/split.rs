//! Cutting a chart that does not flatten: a label a node is all it takes, there is no surface to cut.
//!
//! Representatives and growth as for meshes (iso-charts, section 4.1; see [`crate::segmentation`]): the ends of a
//! leading spectral dimension, then every node to the nearer one along the graph.

use std::collections::VecDeque;

use crate::geodesics::{LandmarkDistances, WeightedGraph};
use crate::mesh::VertexId;
use crate::progress::Cancelled;
use crate::segmentation::SpectralAnalysis;

/// Parts of fewer nodes, or of less than this share of the chart, go to a neighbour.
const LEAST_PART: usize = 4;
const LEAST_SHARE: f64 = 0.01;
/// Dimensions tried.
const MOST_DIMENSIONS: usize = 4;
/// A later dimension is taken if it leaves less than this share of what an earlier one leaves out of the plane.
const CLEARLY: f64 = 0.7;

/// Splits a connected chart in two or more connected parts. `None` if that leaves one part; [`halves`] always does.
///
/// Of the splits across each of the leading dimensions the one is taken whose parts are most planar, as the distances
/// known say: across a ball, but along a tube, which shorter tubes would not help.
pub(super) fn spectral_parts(
    graph: &WeightedGraph,
    distances: &LandmarkDistances,
    analysis: &SpectralAnalysis,
) -> Result<Option<Vec<Vec<u32>>>, Cancelled> {
    let mut best: Option<(f64, [usize; 2])> = None;
    for d in 0..analysis.eigenvalues.len().min(MOST_DIMENSIONS) {
        let Some(ends) = ends(distances, analysis, d) else { continue };
        let bent = bent_share(distances, ends)?;
        if best.is_none_or(|(least, _)| bent < least * CLEARLY) {
            best = Some((bent, ends));
        }
    }
    let Some((_, [first, second])) = best else { return Ok(None) };
    let (a, b) = (distances.row(first), distances.row(second));
    let label: Vec<u32> = a.iter().zip(b).map(|(a, b)| u32::from(b < a)).collect();
    Ok(parts_of(graph, label))
}

/// Halves a chart in breadth-first order from one end: each part has fewer nodes, and together they have all. The
/// second half may come out in several pieces.
pub(super) fn halves(graph: &WeightedGraph) -> Vec<Vec<u32>> {
    let end = breadth_first(graph, 0).last().copied().unwrap_or(0);
    let order = breadth_first(graph, end);
    let mut label = vec![1; graph.node_count()];
    for &v in &order[..order.len() / 2] {
        label[v] = 0;
    }
    let (component, count) = components(graph, &label);
    collect(&component, count)
}

/// The landmarks of least and greatest coordinate in a dimension, if they are apart.
fn ends(distances: &LandmarkDistances, analysis: &SpectralAnalysis, dimension: usize) -> Option<[usize; 2]> {
    let by = |a: &usize, b: &usize| {
        analysis.coordinate(*a, dimension).total_cmp(&analysis.coordinate(*b, dimension)).then(a.cmp(b))
    };
    let (a, b) = ((0..distances.len()).min_by(by)?, (0..distances.len()).max_by(by)?);
    (distances.get(a, distances.landmarks()[b]) > 0.0).then_some([a, b])
}

/// How much of the landmarks' energy lies outside a plane once they are parted by the nearer of two of them.
fn bent_share(distances: &LandmarkDistances, ends: [usize; 2]) -> Result<f64, Cancelled> {
    let at = |end: usize, l: usize| distances.get(ends[end], distances.landmarks()[l]);
    let mut bent = 0.0;
    for side in [false, true] {
        let part: Vec<usize> = (0..distances.len()).filter(|&l| (at(1, l) < at(0, l)) == side).collect();
        let ids = part.iter().map(|&l| distances.landmarks()[l]).collect::<Vec<_>>();
        // The part's landmarks as a cloud of their own: their rows, cut down to their columns.
        let rows = part.iter().flat_map(|&l| ids.iter().map(move |&v| distances.get(l, v) as f32)).collect();
        let own = LandmarkDistances::new((0..ids.len()).map(VertexId::new).collect(), ids.len(), rows);
        bent += part.len() as f64 * (1.0 - SpectralAnalysis::new(&own)?.planarity);
    }
    Ok(bent / distances.len().max(1) as f64)
}

/// Connected parts of equal label, fragments joined to a neighbour; `None` if only one is left.
fn parts_of(graph: &WeightedGraph, mut label: Vec<u32>) -> Option<Vec<Vec<u32>>> {
    let n = graph.node_count();
    let (component, count) = components(graph, &label);
    let parts = collect(&component, count);
    let least = LEAST_PART.max((LEAST_SHARE * n as f64) as usize);
    for part in parts.iter().filter(|p| p.len() < least) {
        // The label of the neighbour with most edges, the lowest of equals.
        let mut votes: Vec<u32> = part
            .iter()
            .flat_map(|&v| graph.neighbours(v as usize))
            .filter(|&(w, _)| component[w] != component[part[0] as usize])
            .map(|(w, _)| label[w])
            .collect();
        votes.sort_unstable();
        let most = votes.chunk_by(|a, b| a == b).max_by(|a, b| a.len().cmp(&b.len()).then(b[0].cmp(&a[0])));
        if let Some(most) = most {
            part.iter().for_each(|&v| label[v as usize] = most[0]);
        }
    }
    let (component, count) = components(graph, &label);
    (count >= 2).then(|| collect(&component, count))
}

/// A number for each connected set of nodes of equal label, by lowest node, and their count.
fn components(graph: &WeightedGraph, label: &[u32]) -> (Vec<u32>, usize) {
    let mut component = vec![u32::MAX; label.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    for seed in 0..label.len() {
        if component[seed] != u32::MAX {
            continue;
        }
        component[seed] = count;
        stack.push(seed);
        while let Some(u) = stack.pop() {
            for (v, _) in graph.neighbours(u) {
                if component[v] == u32::MAX && label[v] == label[u] {
                    component[v] = count;
                    stack.push(v);
                }
            }
        }
        count += 1;
    }
    (component, count as usize)
}

fn collect(component: &[u32], count: usize) -> Vec<Vec<u32>> {
    let mut parts = vec![Vec::new(); count];
    for (v, &c) in component.iter().enumerate() {
        parts[c as usize].push(v as u32);
    }
    parts
}

fn breadth_first(graph: &WeightedGraph, start: usize) -> Vec<usize> {
    let n = graph.node_count();
    let mut seen = vec![false; n];
    let mut order = Vec::with_capacity(n);
    let mut queue: VecDeque<usize> = (start < n).then_some(start).into_iter().collect();
    queue.iter().for_each(|&v| seen[v] = true);
    while let Some(u) = queue.pop_front() {
        order.push(u);
        for (v, _) in graph.neighbours(u) {
            if !std::mem::replace(&mut seen[v], true) {
                queue.push_back(v);
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Progress;

    fn lattice(width: usize, height: usize) -> WeightedGraph {
        let edges = (0..width * height).flat_map(move |i| {
            let right = (i % width + 1 < width).then_some((i, i + 1, 1.0));
            let up = (i / width + 1 < height).then_some((i, i + width, 1.0));
            right.into_iter().chain(up)
        });
        WeightedGraph::from_edges(width * height, edges)
    }

    fn covers(parts: &[Vec<u32>], n: usize) {
        let mut all: Vec<u32> = parts.iter().flatten().copied().collect();
        all.sort_unstable();
        assert_eq!(all, (0..n as u32).collect::<Vec<_>>());
        assert!(parts.len() >= 2 && parts.iter().all(|p| !p.is_empty()));
    }

    #[test]
    fn a_long_sheet_is_cut_across() {
        let graph = lattice(30, 6);
        let landmarks: Vec<usize> = vec![0, 29, 150, 179, 15, 90];
        let rows = crate::geodesics::graph_distances(&graph, &landmarks, &Progress::new()).expect("not cancelled");
        let ids = landmarks.iter().map(|&l| VertexId::new(l)).collect();
        let distances = LandmarkDistances::new(ids, 180, rows.iter().map(|&d| d as f32).collect());
        let parts = spectral_parts(&graph, &distances, &SpectralAnalysis::new(&distances).expect("memory"));
        let parts = parts.expect("memory").expect("two parts");
        covers(&parts, 180);
        assert_eq!(parts.len(), 2);
        assert!(parts.iter().all(|p| p.len() > 70), "{:?}", parts.iter().map(Vec::len).collect::<Vec<_>>());
    }

    #[test]
    fn halves_of_anything() {
        for graph in [lattice(2, 1), lattice(7, 1), lattice(5, 9)] {
            let n = graph.node_count();
            let parts = halves(&graph);
            covers(&parts, n);
            assert!(parts.iter().all(|p| p.len() <= n.div_ceil(2)));
        }
        // A star: the second half falls into single leaves.
        let star = WeightedGraph::from_edges(9, (1..9).map(|i| (0, i, 1.0)));
        covers(&halves(&star), 9);
    }

    #[test]
    fn fragments_join_their_neighbour() {
        let graph = lattice(20, 20);
        let mut label: Vec<u32> = (0..400).map(|i| u32::from(i % 20 >= 10)).collect();
        label[3 * 20 + 4] = 1;
        let parts = parts_of(&graph, label).expect("two parts");
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [200, 200]);
        assert!(parts_of(&graph, vec![0; 400]).is_none());
    }
}
