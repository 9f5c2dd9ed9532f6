//! What cutting along a side costs: less at a crease.

use crate::mesh::{TriMesh, measure};

use super::polygon_graph::PolygonGraph;

/// Capacities are integers, so that the cut does not depend on the order of sums; a side of mean
/// length and mean cost gets this many units.
const UNIT: f64 = 65536.0;

/// 1 − cos(dihedral) of each side, in the order of the graph's links.
pub(super) struct Bends {
    first: Vec<usize>,
    bend: Vec<f64>,
    /// What a border costs on a side besides: less on a guide.
    guidance: Vec<f64>,
    mean_bend: f64,
    crease_weight: f64,
    /// Mean length of a side, above 0.
    pub(super) mean_length: f64,
}

impl Bends {
    pub(super) fn new(mesh: &TriMesh, graph: &PolygonGraph, crease_weight: f64) -> Self {
        let normals = measure::face_normals(mesh);
        let mut first = Vec::with_capacity(graph.len());
        let (mut bend, mut guidance) = (Vec::new(), Vec::new());
        let (mut sum_bend, mut sum_length) = (0.0, 0.0);
        for links in graph.links.iter() {
            first.push(bend.len());
            for link in links {
                let (f, g) = (link.halfedge.face(), mesh.twin(link.halfedge).face());
                let d = (1.0 - normals[f.index()].dot(&normals[g.index()])).clamp(0.0, 2.0);
                sum_bend += d * link.length;
                sum_length += link.length;
                bend.push(d);
                guidance.push(mesh.border_cost(link.halfedge));
            }
        }
        let mean = |sum: f64, n: f64| if n > 0.0 { sum / n } else { 0.0 };
        let mean_bend = mean(sum_bend, sum_length).max(f64::MIN_POSITIVE);
        let mean_length = mean(sum_length, bend.len() as f64).max(f64::MIN_POSITIVE);
        Self { first, bend, guidance, mean_bend, crease_weight, mean_length }
    }

    /// Cost of cutting along side `k` of polygon `p`: 1 where the surface is flat, near 0 at a crease, and on a guide a
    /// share of that. With w the crease weight: 1/(1 + d/mean)ʷ.
    pub(super) fn crease(&self, p: usize, k: usize) -> f64 {
        let side = self.first[p] + k;
        self.guidance[side] * (1.0 + self.bend[side] / self.mean_bend).powf(-self.crease_weight)
    }
}

/// Capacity of a side with this cost, relative to a flat side of mean length.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the range of capacities")]
pub(super) fn capacity(relative: f64) -> u64 {
    (relative * UNIT).clamp(1.0, 1e12) as u64
}
