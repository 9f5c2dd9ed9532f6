//! Which elements belong together, found out pair by pair.

/// Union-find; the representative of a set is its lowest element.
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// `count` sets of one element each.
    pub(crate) fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// The lowest element of the set of `i`.
    pub(crate) fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] as usize != i {
            let grandparent = self.parent[self.parent[i] as usize];
            self.parent[i] = grandparent;
            i = grandparent as usize;
        }
        i
    }

    /// Makes one set of the sets of `a` and `b`; whether they were two.
    pub(crate) fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b) as u32;
        a != b
    }

    /// A number for each element's set, ascending with the lowest element, and how many there are.
    pub(crate) fn labels(mut self) -> (Vec<u32>, usize) {
        let mut label = vec![u32::MAX; self.parent.len()];
        let mut count = 0;
        for i in 0..label.len() {
            let root = self.root(i);
            if root == i {
                label[i] = count;
                count += 1;
            } else {
                label[i] = label[root];
            }
        }
        (label, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_labelled_by_their_lowest_element() {
        let mut sets = DisjointSets::new(6);
        assert!(sets.join(4, 1) && sets.join(5, 4) && sets.join(2, 3));
        assert!(!sets.join(1, 5), "they are one already");
        assert_eq!([sets.root(5), sets.root(3), sets.root(0)], [1, 2, 0]);
        assert_eq!(sets.labels(), (vec![0, 1, 2, 2, 1, 1], 3));
    }
}
