//! A priority queue of vertices whose keys can change.

use crate::mesh::VertexId;

/// Children of a node: a flatter heap touches fewer cache lines.
const ARITY: usize = 4;

/// Vertices by ascending key, ties by ascending number: a heap that knows where each vertex is.
#[derive(Debug)]
pub(super) struct VertexQueue {
    /// Key bits and vertex number; non-negative floats order as their bits.
    heap: Vec<(u64, u32)>,
    /// Place of each vertex in the heap, or `ABSENT`.
    place: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

fn entry(v: VertexId, key: f64) -> (u64, u32) {
    (key.max(0.0).to_bits(), v.index() as u32)
}

impl VertexQueue {
    /// The vertices that have a key: `keys[v]` for vertex v. O(n).
    pub(super) fn new(keys: impl Iterator<Item = Option<f64>>) -> Self {
        let mut queue = Self { heap: Vec::new(), place: Vec::new() };
        for (v, key) in keys.enumerate() {
            queue.place.push(key.map_or(ABSENT, |_| queue.heap.len() as u32));
            queue.heap.extend(key.map(|key| entry(VertexId::new(v), key)));
        }
        for at in (0..queue.heap.len().div_ceil(ARITY)).rev() {
            queue.sink(at);
        }
        queue
    }

    /// Whether `v` with `key` would come before all vertices in the queue.
    pub(super) fn precedes(&self, v: VertexId, key: f64) -> bool {
        self.heap.first().is_none_or(|&top| entry(v, key) <= top)
    }

    /// Takes out the vertex with the least key.
    pub(super) fn pop(&mut self) -> Option<VertexId> {
        let v = VertexId::new(self.heap.first()?.1 as usize);
        self.set(v, None);
        Some(v)
    }

    /// Gives a vertex a key, whether or not it had one; `None` takes it out. O(log n).
    pub(super) fn set(&mut self, v: VertexId, key: Option<f64>) {
        let at = self.place[v.index()];
        match (key, at) {
            (None, ABSENT) => {}
            (None, at) => {
                let at = at as usize;
                self.place[v.index()] = ABSENT;
                let last = self.heap.pop();
                if let Some(last) = last.filter(|_| at < self.heap.len()) {
                    self.heap[at] = last;
                    self.settle(at);
                }
            }
            (Some(key), ABSENT) => {
                self.heap.push(entry(v, key));
                self.rise(self.heap.len() - 1);
            }
            (Some(key), at) => {
                self.heap[at as usize] = entry(v, key);
                self.settle(at as usize);
            }
        }
    }

    /// Lowers the key of a vertex in the queue to `key` if it is higher, and tells whether it was.
    pub(super) fn lower(&mut self, v: VertexId, key: f64) -> bool {
        let Some(at) = Some(self.place[v.index()]).filter(|&at| at != ABSENT) else { return false };
        let lower = entry(v, key) < self.heap[at as usize];
        if lower {
            self.heap[at as usize] = entry(v, key);
            self.rise(at as usize);
        }
        lower
    }

    fn settle(&mut self, at: usize) {
        let at = self.rise(at);
        self.sink(at);
    }

    fn put(&mut self, at: usize, item: (u64, u32)) {
        self.heap[at] = item;
        self.place[item.1 as usize] = at as u32;
    }

    fn rise(&mut self, mut at: usize) -> usize {
        let item = self.heap[at];
        while at > 0 {
            let parent = (at - 1) / ARITY;
            if self.heap[parent] <= item {
                break;
            }
            self.put(at, self.heap[parent]);
            at = parent;
        }
        self.put(at, item);
        at
    }

    fn sink(&mut self, mut at: usize) {
        let item = self.heap[at];
        loop {
            let first = ARITY * at + 1;
            let children = first..(first + ARITY).min(self.heap.len());
            let Some(least) = children.min_by_key(|&c| self.heap[c]).filter(|&c| self.heap[c] < item) else { break };
            self.put(at, self.heap[least]);
            at = least;
        }
        self.put(at, item);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn pops_in_order_while_keys_change() {
        let key = |v: usize, round: usize| ((v * 7919 + round * 104_729) % 97) as f64;
        let mut queue = VertexQueue::new((0..300).map(|v| (v % 5 != 0).then(|| key(v, 0))));
        let mut expected: BTreeSet<(u64, u32)> =
            (0..300).filter(|v| v % 5 != 0).map(|v| entry(VertexId::new(v), key(v, 0))).collect();
        for round in 1..400 {
            let v = VertexId::new((round * 31) % 300);
            let new = (round % 7 != 0).then(|| key(v.index(), round));
            expected.retain(|e| e.1 as usize != v.index());
            expected.extend(new.map(|k| entry(v, k)));
            queue.set(v, new);
            let other = VertexId::new((round * 17) % 300);
            if let Some(old) = expected.iter().copied().find(|e| e.1 as usize == other.index()) {
                let lower = entry(other, 30.0) < old;
                assert_eq!(queue.lower(other, 30.0), lower);
                if lower {
                    expected.remove(&old);
                    expected.insert(entry(other, 30.0));
                }
            } else {
                assert!(!queue.lower(other, 0.0), "absent vertices stay absent");
            }
            if round % 3 == 0 {
                let least = expected.pop_first().map(|e| e.1 as usize);
                assert_eq!(queue.pop().map(VertexId::index), least, "round {round}");
            }
            let top = expected.first().copied();
            let probe = VertexId::new(round % 300);
            assert_eq!(queue.precedes(probe, 20.0), top.is_none_or(|t| entry(probe, 20.0) <= t));
        }
        while let Some(least) = expected.pop_first() {
            assert_eq!(queue.pop().map(VertexId::index), Some(least.1 as usize));
        }
        assert_eq!(queue.pop(), None);
    }
}
