//! Sets and queues that the standard library lacks.

mod disjoint_sets;
mod min_heap;

pub(crate) use disjoint_sets::DisjointSets;
pub(crate) use min_heap::MinHeap;
