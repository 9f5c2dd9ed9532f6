//! A priority queue of numbered items whose keys can change: the heart of Dijkstra's search, of fast marching and of
//! coarsening.

/// Children of a heap node. Four make the tree half as deep as two, and the four keys compared on
/// the way down share a cache line.
const ARITY: usize = 4;

/// Stands for "not queued".
const ABSENT: u32 = u32::MAX;

/// A 4-ary heap of items `0..n`, each queued at most once, popped by key and, where keys are equal,
/// by index: the order does not depend on the order of insertion. Keys are numbers, infinite ones included, not NaN.
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

    /// A queue for as many items as there are keys, of those that have one. O(n).
    pub(crate) fn with_keys(keys: impl Iterator<Item = Option<f64>>) -> Self {
        let mut heap = Self::default();
        for (item, key) in keys.enumerate() {
            heap.place.push(key.map_or(ABSENT, |_| heap.queue.len() as u32));
            heap.queue.extend(key.map(|key| (key, item as u32)));
        }
        for at in (0..heap.queue.len().div_ceil(ARITY)).rev() {
            heap.sink(at, heap.queue[at]);
        }
        heap
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
        if self.place[item] == ABSENT {
            self.push(item, key);
        } else {
            self.lower(item, key);
        }
    }

    /// Lowers the key of an item that is queued, and tells whether `key` was below it.
    #[inline]
    pub(crate) fn lower(&mut self, item: usize, key: f64) -> bool {
        let at = self.place[item];
        let lower = at != ABSENT && key < self.queue[at as usize].0;
        if lower {
            self.rise(at as usize, (key, item as u32));
        }
        lower
    }

    /// Gives an item a key, whether or not it had one and be it higher or lower; `None` takes it out. O(log n).
    pub(crate) fn set(&mut self, item: usize, key: Option<f64>) {
        let at = self.place[item];
        match key {
            Some(key) if at == ABSENT => self.push(item, key),
            Some(key) => self.settle(at as usize, (key, item as u32)),
            None if at == ABSENT => {}
            None => {
                self.place[item] = ABSENT;
                if let Some(last) = self.queue.pop().filter(|last| last.1 as usize != item) {
                    self.settle(at as usize, last);
                }
            }
        }
    }

    /// Whether `item` with `key` would be popped before all that are queued.
    pub(crate) fn precedes(&self, item: usize, key: f64) -> bool {
        self.queue.first().is_none_or(|&first| !before(first, (key, item as u32)))
    }

    /// Takes out the item of least key.
    #[inline]
    pub(crate) fn pop(&mut self) -> Option<(usize, f64)> {
        let &(key, item) = self.queue.first()?;
        self.place[item as usize] = ABSENT;
        let last = self.queue.pop()?;
        if !self.queue.is_empty() {
            self.sink(0, last);
        }
        Some((item as usize, key))
    }

    #[inline]
    fn push(&mut self, item: usize, key: f64) {
        let entry = (key, item as u32);
        self.queue.push(entry);
        self.rise(self.queue.len() - 1, entry);
    }

    /// Puts an entry where it belongs, from a place whose own entry is gone.
    fn settle(&mut self, at: usize, entry: (f64, u32)) {
        if at > 0 && before(entry, self.queue[(at - 1) / ARITY]) {
            self.rise(at, entry);
        } else {
            self.sink(at, entry);
        }
    }

    #[inline]
    fn rise(&mut self, mut at: usize, entry: (f64, u32)) {
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

    #[inline]
    fn sink(&mut self, mut at: usize, entry: (f64, u32)) {
        let len = self.queue.len();
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
            if !before(self.queue[least], entry) {
                break;
            }
            self.put(at, self.queue[least]);
            at = least;
        }
        self.put(at, entry);
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
    use std::collections::BTreeSet;

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

        #[test]
        fn pops_in_order_while_keys_rise_and_fall_and_items_go(
            first in prop::collection::vec(prop::option::of(0..20u32), 1..50),
            changes in prop::collection::vec((0..50usize, prop::option::of(0..20u32), 0..4u8), 0..200),
        ) {
            let n = first.len();
            let mut heap = MinHeap::with_keys(first.iter().map(|key| key.map(f64::from)));
            let mut key = first.clone();
            let queue = |key: &[Option<u32>]| -> BTreeSet<(u32, usize)> {
                key.iter().enumerate().filter_map(|(item, &key)| Some((key?, item))).collect()
            };
            for &(item, new, what) in changes.iter().filter(|change| change.0 < n) {
                match (what, new) {
                    (0, _) => {
                        let least = queue(&key).first().copied();
                        prop_assert_eq!(heap.pop(), least.map(|(key, item)| (item, f64::from(key))));
                        least.map(|(_, item)| key[item].take());
                    }
                    (1, Some(new)) => {
                        let falls = key[item].is_some_and(|old| new < old);
                        prop_assert_eq!(heap.lower(item, f64::from(new)), falls);
                        key[item] = key[item].map(|old| old.min(new));
                    }
                    (2, Some(new)) => {
                        let first = queue(&key).first().is_none_or(|&least| (new, item) <= least);
                        prop_assert_eq!(heap.precedes(item, f64::from(new)), first);
                    }
                    _ => {
                        heap.set(item, new.map(f64::from));
                        key[item] = new;
                    }
                }
            }
            for (key, item) in queue(&key) {
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
