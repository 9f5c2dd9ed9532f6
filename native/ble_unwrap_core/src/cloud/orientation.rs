//! One side for all tangent planes of a chart.
//!
//! Hoppe, DeRose, Duchamp, McDonald, Stuetzle: Surface reconstruction from unorganized points, SIGGRAPH 1992,
//! section 3.3: the side is handed on along a spanning tree that prefers neighbours whose planes are nearly parallel,
//! because only where planes turn sharply can a wrong side be handed on.

use nalgebra::Vector3;

use crate::collections::MinHeap;
use crate::geodesics::WeightedGraph;

/// Turns unit normals to one side, as far as the surface has two. Prim's minimum spanning tree with the cost
/// 1 − |n·n′|, from the lowest node of each component; O(m log n).
pub(super) fn orient(graph: &WeightedGraph, normal: &mut [Vector3<f64>]) {
    let n = normal.len();
    let mut heap = MinHeap::new(n);
    let mut cost = vec![f64::INFINITY; n];
    let mut parent = vec![u32::MAX; n];
    let mut done = vec![false; n];
    for seed in 0..n {
        if done[seed] {
            continue;
        }
        heap.push_or_lower(seed, 0.0);
        while let Some((u, _)) = heap.pop() {
            done[u] = true;
            if parent[u] != u32::MAX && normal[u].dot(&normal[parent[u] as usize]) < 0.0 {
                normal[u] = -normal[u];
            }
            for (v, _) in graph.neighbours(u) {
                let bend = 1.0 - normal[u].dot(&normal[v]).abs().min(1.0);
                if !done[v] && bend < cost[v] {
                    cost[v] = bend;
                    parent[v] = u as u32;
                    heap.push_or_lower(v, bend);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normals_of_a_cylinder_all_point_outwards() {
        let (around, along) = (40, 10);
        let id = |a: usize, b: usize| b * around + a % around;
        let out = |a: usize| {
            let angle = std::f64::consts::TAU * a as f64 / around as f64;
            Vector3::new(angle.cos(), angle.sin(), 0.0)
        };
        let mut edges = Vec::new();
        let mut normal = Vec::new();
        for b in 0..along {
            for a in 0..around {
                edges.push((id(a, b), id(a + 1, b), 1.0));
                edges.push((id(a, b), id(a, (b + 1) % along), 1.0));
                normal.push(if (a * 7 + b * 3) % 5 < 2 { -out(a) } else { out(a) });
            }
        }
        orient(&WeightedGraph::from_edges(around * along, edges), &mut normal);
        let side = normal[0].dot(&out(0)).signum();
        for b in 0..along {
            for a in 0..around {
                assert!(normal[id(a, b)].dot(&out(a)) * side > 0.99);
            }
        }
    }
}
