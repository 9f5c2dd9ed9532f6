//! The vertices in the order in which they go.

use crate::collections::MinHeap;
use crate::mesh::VertexId;

/// Vertices by ascending cost, ties by ascending number. A cost that rounding made negative counts as none, so that
/// vertices whose removal is free go in the order of their numbers.
#[derive(Debug)]
pub(super) struct VertexQueue(MinHeap);

impl VertexQueue {
    /// The vertices that have a cost: `costs[v]` for vertex v. O(n).
    pub(super) fn new(costs: impl Iterator<Item = Option<f64>>) -> Self {
        Self(MinHeap::with_keys(costs.map(|cost| cost.map(key))))
    }

    /// Whether `v` at `cost` would come before all vertices in the queue.
    pub(super) fn precedes(&self, v: VertexId, cost: f64) -> bool {
        self.0.precedes(v.index(), key(cost))
    }

    /// Takes out the vertex of least cost.
    pub(super) fn pop(&mut self) -> Option<VertexId> {
        self.0.pop().map(|(v, _)| VertexId::new(v))
    }

    /// Gives a vertex a cost, whether or not it had one; `None` takes it out. O(log n).
    pub(super) fn set(&mut self, v: VertexId, cost: Option<f64>) {
        self.0.set(v.index(), cost.map(key));
    }

    /// Lowers the cost of a vertex in the queue to `cost` if it is higher, and tells whether it was.
    pub(super) fn lower(&mut self, v: VertexId, cost: f64) -> bool {
        self.0.lower(v.index(), key(cost))
    }
}

fn key(cost: f64) -> f64 {
    cost.max(0.0)
}
