//! A priority queue of vertices with keys that fall: the heart of Dijkstra and fast marching.

/// Children of a heap node. Four make the tree half as deep as two, and the four keys compared on
/// the way down share a cache line.
const ARITY: usize = 4;

/// Stands for "not queued".
const ABSENT: u32 = u32::MAX;

/// A 4-ary heap of items `0..n`, each queued at most once, popped by key and, where keys are equal,
/// by index: the order does not depend on the order of insertion.
///
/// Allocates on creation only (and on its first growth); [`MinHeap::clear`] is proportional to what
/// is still queued.
#[derive(Clone, Debug, Default)]
pub(crate) struct MinHeap {
    queue: Vec<(f64, u32)>,
    /// Where in `queue` each item is.
    place: Vec<u32>,
}

impl MinHeap {
    /// An empty queue for items `0..n`.
    pub(crate) fn new(n: usize) -> Self {
        Self { queue: Vec::new(), place: vec![ABSENT; n] }
    }

    /// Empties the queue and fits it to items `0..n`.
    pub(crate) fn reset(&mut self, n: usize) {
        self.clear();
        self.place.resize(n, ABSENT);
    }

    /// Empties the queue.
    pub(crate) fn clear(&mut self) {
        for &(_, item) in &self.queue {
            self.place[item as usize] = ABSENT;
        }
        self.queue.clear();
    }

    /// Queues `item`, or lowers its key if it is queued. A key above the present one is ignored.
    #[inline]
    pub(crate) fn push_or_lower(&mut self, item: usize, key: f64) {
        let mut at = self.place[item] as usize;
        if self.place[item] == ABSENT {
            at = self.queue.len();
            self.queue.push((key, item as u32));
        } else if key >= self.queue[at].0 {
            return;
        }
        let entry = (key, item as u32);
        while at > 0 {
            let parent = (at - 1) / ARITY;
            if !before(entry, self.queue[parent]) {
                break;
            }
            self.put(at, self.queue[parent]);
            at = parent;
        }
        self.put(at, entry);
    }

    /// Takes out the item of least key.
    #[inline]
    pub(crate) fn pop(&mut self) -> Option<(usize, f64)> {
        let &(key, item) = self.queue.first()?;
        self.place[item as usize] = ABSENT;
        let last = self.queue.pop()?;
        let len = self.queue.len();
        if len > 0 {
            let mut at = 0;
            loop {
                let first = ARITY * at + 1;
                if first >= len {
                    break;
                }
                let mut least = first;
                for child in first + 1..(first + ARITY).min(len) {
                    if before(self.queue[child], self.queue[least]) {
                        least = child;
                    }
                }
                if !before(self.queue[least], last) {
                    break;
                }
                self.put(at, self.queue[least]);
                at = least;
            }
            self.put(at, last);
        }
        Some((item as usize, key))
    }

    #[inline]
    fn put(&mut self, at: usize, entry: (f64, u32)) {
        self.queue[at] = entry;
        self.place[entry.1 as usize] = at as u32;
    }
}

#[inline]
fn before(a: (f64, u32), b: (f64, u32)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pops_in_order_of_the_lowest_key_given(pushes in prop::collection::vec((0..60usize, 0..40u32), 0..200)) {
            let mut heap = MinHeap::new(60);
            let mut least = [u32::MAX; 60];
            for &(item, key) in &pushes {
                heap.push_or_lower(item, f64::from(key));
                least[item] = least[item].min(key);
            }
            let mut expected: Vec<_> = (0..60).filter(|&i| least[i] < u32::MAX).map(|i| (least[i], i)).collect();
            expected.sort_unstable();
            for (key, item) in expected {
                prop_assert_eq!(heap.pop(), Some((item, f64::from(key))));
            }
            prop_assert_eq!(heap.pop(), None);
        }
    }

    #[test]
    fn clear_leaves_a_usable_queue() {
        let mut heap = MinHeap::new(5);
        for i in 0..5 {
            heap.push_or_lower(i, i as f64);
        }
        heap.clear();
        assert_eq!(heap.pop(), None);
        heap.push_or_lower(3, 1.0);
        assert_eq!(heap.pop(), Some((3, 1.0)));
    }
}
