//! Groups of items as one flat list and offsets.

/// Several lists in two arrays: group `g` is `items[offsets[g]..offsets[g + 1]]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Groups<T> {
    offsets: Vec<usize>,
    items: Vec<T>,
}

impl<T> Default for Groups<T> {
    fn default() -> Self {
        Self { offsets: vec![0], items: Vec::new() }
    }
}

impl<T: Copy> Groups<T> {
    /// No groups.
    #[must_use]
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Sorts `0..labels.len()` into `count` groups by label, in ascending order within each.
    /// Items whose label is `count` or more are left out.
    #[must_use]
    pub(crate) fn by_label(labels: &[u32], count: usize, item: impl Fn(usize) -> T) -> Self {
        let mut offsets = vec![0usize; count + 1];
        for &label in labels {
            if (label as usize) < count {
                offsets[label as usize + 1] += 1;
            }
        }
        for g in 0..count {
            offsets[g + 1] += offsets[g];
        }
        let mut next = offsets.clone();
        let mut order = vec![0u32; offsets[count]];
        for (i, &label) in labels.iter().enumerate() {
            if (label as usize) < count {
                order[next[label as usize]] = i as u32;
                next[label as usize] += 1;
            }
        }
        Self { offsets, items: order.into_iter().map(|i| item(i as usize)).collect() }
    }

    /// Appends an item to the last, still open group.
    pub(crate) fn push(&mut self, item: T) {
        self.items.push(item);
    }

    /// Closes the open group; what is pushed next belongs to a new one.
    pub(crate) fn close(&mut self) {
        self.offsets.push(self.items.len());
    }

    /// Number of closed groups.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The items of group `g`.
    #[must_use]
    pub(crate) fn group(&self, g: usize) -> &[T] {
        &self.items[self.offsets[g]..self.offsets[g + 1]]
    }

    /// All groups in order.
    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = &[T]> + '_ {
        self.offsets.windows(2).map(|w| &self.items[w[0]..w[1]])
    }
}
