//! Representatives, and growth of parts from them.

use std::collections::VecDeque;

use crate::geodesics::LandmarkDistances;
use crate::mesh::TriMesh;

use super::SpectralAnalysis;
use super::polygon_graph::PolygonGraph;

/// Landmark numbers of at least two (if there are two landmarks) and at most `most` representatives.
///
/// Candidates are the landmarks of least and greatest coordinate in each of the patch's dimensions;
/// they are taken farthest first until the next lies nearer to those taken than the extent of a part
/// would be, √(area / (dimension + 1)) (iso-charts, section 4.1).
pub(super) fn representatives(
    distances: &LandmarkDistances,
    analysis: &SpectralAnalysis,
    area: f64,
    most: usize,
) -> Vec<usize> {
    let mut candidates = Vec::new();
    for d in 0..analysis.dimension {
        let coordinate = |l: usize| analysis.coordinate(l, d);
        let by = |a: &usize, b: &usize| coordinate(*a).total_cmp(&coordinate(*b)).then(a.cmp(b));
        candidates.extend((0..distances.len()).min_by(by));
        candidates.extend((0..distances.len()).max_by(by));
    }
    let between = |a: usize, b: usize| distances.get(a, distances.landmarks()[b]);
    let spacing = (area / (analysis.dimension + 1) as f64).sqrt();
    let mut chosen: Vec<usize> = candidates.iter().copied().take(1).collect();
    while chosen.len() < most.max(2) {
        let gap = |c: usize| chosen.iter().map(|&r| between(r, c)).fold(f64::INFINITY, f64::min);
        let far = candidates.iter().copied().map(|c| (gap(c), c));
        let Some((distance, next)) = far.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))) else { break };
        if distance <= 0.0 || (chosen.len() >= 2 && distance < spacing) {
            break;
        }
        chosen.push(next);
    }
    chosen
}

/// Gives each polygon the number of its nearest representative; ties go to the first.
pub(super) fn nearest(
    mesh: &TriMesh,
    graph: &PolygonGraph,
    distances: &LandmarkDistances,
    representatives: &[usize],
) -> Vec<u32> {
    (0..graph.len())
        .map(|p| {
            let mut best = (f64::INFINITY, 0);
            for (r, &landmark) in representatives.iter().enumerate() {
                let row = distances.row(landmark);
                let distance = graph.mean_at(mesh, p, |v| f64::from(row[v]));
                if distance < best.0 {
                    best = (distance, r);
                }
            }
            u32::try_from(best.1).unwrap_or(0)
        })
        .collect()
}

/// Label 0 for the first half of the polygons in breadth-first order from one end, 1 for the rest.
pub(super) fn halves(graph: &PolygonGraph) -> Vec<u32> {
    let end = breadth_first(graph, 0).last().copied().unwrap_or(0);
    let order = breadth_first(graph, end);
    let mut label = vec![1; graph.len()];
    for &p in &order[..order.len() / 2] {
        label[p] = 0;
    }
    label
}

fn breadth_first(graph: &PolygonGraph, start: usize) -> Vec<usize> {
    let mut seen = vec![false; graph.len()];
    let mut order = Vec::with_capacity(graph.len());
    let mut queue = VecDeque::from([start]);
    seen[start] = true;
    while let Some(p) = queue.pop_front() {
        order.push(p);
        for link in graph.links.group(p) {
            if !std::mem::replace(&mut seen[link.to as usize], true) {
                queue.push_back(link.to as usize);
            }
        }
    }
    order
}
