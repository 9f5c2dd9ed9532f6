//! Second stage: who is whose neighbour, how much surface a point stands for, and the connected pieces.

use std::f64::consts::PI;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::geodesics::{self, WeightedGraph};
use crate::progress::{Cancelled, Progress};

/// An edge is no neighbourhood if it is so many times longer than the distance to the middle one of a point's
/// neighbours, at either end. On a surface sampled evenly at random the longest are 2.2 times as long; a density that
/// changes by a factor of ten across a line (in points an area) leaves 3.2 times; an outlier is farther away.
const FAR: f64 = 5.0;

/// The neighbourhood graph of a cloud, trimmed, and its pieces.
#[derive(Clone, Debug)]
pub(super) struct Neighbourhood {
    /// Edges of Euclidean length.
    pub(super) graph: WeightedGraph,
    /// Area of surface that each point stands for, positive unless the point is alone.
    pub(super) area: Vec<f64>,
    /// The points of each connected piece, ascending; pieces by their lowest point.
    pub(super) pieces: Vec<Vec<u32>>,
}

impl Neighbourhood {
    /// Joins each point to its `k` nearest (paper, section 5), without edges that bridge empty space.
    ///
    /// The area of a point is π d²/k for the distance d to its k-th neighbour, the unbiased estimate where points lie
    /// evenly at random; at a border it is up to twice too large. O(n log n).
    pub(super) fn new(points: &[Point3<f64>], k: usize, progress: &Progress) -> Result<Self, Cancelled> {
        let flat: Vec<f64> = points.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        let full = geodesics::knn_graph(&flat, 3, k, progress)?;
        drop(flat);
        progress.check()?;
        let measured: Vec<(f64, f64)> = (0..points.len())
            .into_par_iter()
            .map_init(Vec::new, |lengths, i| {
                lengths.clear();
                lengths.extend(full.neighbours(i).map(|(_, length)| length));
                lengths.sort_unstable_by(f64::total_cmp);
                // A point may be a neighbour of many: its own are the nearest.
                lengths.truncate(k);
                let (Some(last), found) = (lengths.last(), lengths.len()) else { return (0.0, 0.0) };
                (lengths[(found - 1) / 2], PI * last * last / found as f64)
            })
            .collect();
        progress.check()?;
        let near = |i: usize, j: usize, length: f64| length <= FAR * measured[i].0.min(measured[j].0);
        let kept = (0..points.len()).flat_map(|i| {
            full.neighbours(i).filter(move |&(j, length)| i < j && near(i, j, length)).map(move |(j, l)| (i, j, l))
        });
        let dropped =
            (0..points.len()).into_par_iter().any(|i| full.neighbours(i).any(|(j, length)| !near(i, j, length)));
        let graph = if dropped { WeightedGraph::from_edges(points.len(), kept) } else { full.clone() };
        progress.check()?;
        let (label, count) = graph.components();
        let mut pieces = vec![Vec::new(); count];
        for (i, &label) in label.iter().enumerate() {
            pieces[label as usize].push(i as u32);
        }
        Ok(Self { graph, area: measured.into_iter().map(|m| m.1).collect(), pieces })
    }
}

/// The part of a graph between some nodes (ascending), renumbered in their order. `local` is scratch as long as the
/// graph, [`u32::MAX`] throughout before and after. O(size of the part · log).
pub(super) fn subgraph(graph: &WeightedGraph, nodes: &[u32], local: &mut [u32]) -> WeightedGraph {
    for (number, &v) in nodes.iter().enumerate() {
        local[v as usize] = number as u32;
    }
    let edges = nodes.iter().enumerate().flat_map(|(number, &v)| {
        let local = &*local;
        graph
            .neighbours(v as usize)
            .filter(move |&(w, _)| local[w] != u32::MAX && (local[w] as usize) > number)
            .map(move |(w, length)| (number, local[w] as usize, length))
    });
    let part = WeightedGraph::from_edges(nodes.len(), edges.collect::<Vec<_>>());
    nodes.iter().for_each(|&v| local[v as usize] = u32::MAX);
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square_lattice(side: usize, step: f64, x: f64) -> Vec<Point3<f64>> {
        let at = |i: usize| Point3::new(x + step * (i % side) as f64, step * (i / side) as f64, 0.0);
        (0..side * side).map(at).collect()
    }

    fn run(points: &[Point3<f64>], k: usize) -> Neighbourhood {
        Neighbourhood::new(points, k, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn an_outlier_is_a_piece_of_its_own_and_areas_are_those_of_the_lattice() {
        let mut points = square_lattice(20, 0.1, 0.0);
        points.push(Point3::new(1.0, 1.0, 1.0));
        let n = run(&points, 12);
        assert_eq!(n.pieces.iter().map(Vec::len).collect::<Vec<_>>(), [400, 1]);
        let inner = n.area[20 * 10 + 10];
        assert!((inner / 0.01 - 1.0).abs() < 0.05, "{inner}");
    }

    #[test]
    fn two_densities_stay_together_and_two_clusters_apart() {
        let mut points = square_lattice(20, 0.1, 0.0);
        points.extend(square_lattice(60, 0.0317, 2.0));
        assert_eq!(run(&points, 12).pieces.len(), 1, "ten times the density beside it");
        let mut points = square_lattice(20, 0.1, 0.0);
        points.extend(square_lattice(20, 0.1, 9.0));
        assert_eq!(run(&points, 12).pieces.len(), 2);
    }

    #[test]
    fn few_points_are_each_others_neighbours() {
        for n in 0..4 {
            let points: Vec<_> = (0..n).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
            let found = run(&points, 12);
            assert_eq!(found.pieces.len(), n.min(1) as usize);
            assert!(found.area.iter().all(|&a| (a > 0.0) == (n > 1)));
        }
    }

    #[test]
    fn a_part_keeps_the_edges_inside() {
        let graph = WeightedGraph::from_edges(4, [(0, 1, 1.0), (1, 3, 2.0), (3, 2, 4.0)]);
        let mut local = vec![u32::MAX; 4];
        let part = subgraph(&graph, &[1, 2, 3], &mut local);
        assert_eq!(part, WeightedGraph::from_edges(3, [(0, 2, 2.0), (2, 1, 4.0)]));
        assert_eq!(local, [u32::MAX; 4]);
    }
}
