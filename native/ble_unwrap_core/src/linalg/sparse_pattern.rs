//! The pattern of a sparse symmetric matrix.

use faer::sparse::{SymbolicSparseColMat, SymbolicSparseColMatRef};

/// The upper triangle of a symmetric matrix, column by column: which entries may differ from zero.
///
/// Every diagonal entry is present; rows ascend within a column.
#[derive(Clone)]
pub(crate) struct SparsePattern {
    entries: SymbolicSparseColMat<u32>,
}

impl SparsePattern {
    /// The pattern with a full diagonal and an entry for each pair, in either order and as often as
    /// one likes. O(m log m) for m pairs.
    ///
    /// # Panics
    /// If a pair names a row that is not there.
    #[must_use]
    pub(crate) fn from_pairs(size: usize, pairs: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let mut entries: Vec<(u32, u32)> = pairs.into_iter().map(|(i, j)| (i.max(j), i.min(j))).collect();
        entries.extend((0..size as u32).map(|i| (i, i)));
        entries.sort_unstable();
        entries.dedup();
        let mut column_start = vec![0; size + 1];
        for &(column, _) in &entries {
            column_start[column as usize + 1] += 1;
        }
        for j in 0..size {
            column_start[j + 1] += column_start[j];
        }
        // Not in place of the pairs, which have room for more.
        let row = entries.iter().map(|e| e.1).collect();
        Self::new(column_start, row)
    }

    fn new(column_start: Vec<u32>, row: Vec<u32>) -> Self {
        let n = column_start.len() - 1;
        Self { entries: SymbolicSparseColMat::new_checked(n, n, column_start, None, row) }
    }

    /// Every entry replaced by a 2×2 block: unknown `i` becomes unknowns `2i` and `2i + 1`. O(m).
    #[must_use]
    pub(crate) fn with_blocks_of_two(&self) -> Self {
        let mut column_start = Vec::with_capacity(2 * self.size() + 1);
        let mut row = Vec::with_capacity(4 * self.entry_count());
        column_start.push(0);
        for j in 0..self.size() {
            let above = &self.column(j)[..self.column(j).len() - 1];
            for last in [2 * j as u32, 2 * j as u32 + 1] {
                row.extend(above.iter().flat_map(|&i| [2 * i, 2 * i + 1]));
                row.extend(2 * j as u32..=last);
                column_start.push(row.len() as u32);
            }
        }
        Self::new(column_start, row)
    }

    /// Number of rows and columns.
    #[must_use]
    pub(crate) fn size(&self) -> usize {
        self.starts().len() - 1
    }

    /// Number of stored entries: the length of the array of values that goes with the pattern.
    #[must_use]
    pub(crate) fn entry_count(&self) -> usize {
        self.entries.row_idx().len()
    }

    /// The rows of column `j`, the diagonal last.
    #[must_use]
    pub(crate) fn column(&self, j: usize) -> &[u32] {
        &self.entries.row_idx()[self.start(j)..self.start(j + 1)]
    }

    /// Where the value of entry (i, j), equally (j, i), is kept, if it is in the pattern. O(log).
    #[must_use]
    pub(crate) fn position(&self, i: usize, j: usize) -> Option<usize> {
        let (row, column) = (i.min(j) as u32, i.max(j));
        let found = self.column(column).binary_search(&row).ok()?;
        Some(self.start(column) + found)
    }

    /// Where the value of entry (j, j) is kept.
    #[must_use]
    pub(crate) fn diagonal(&self, j: usize) -> usize {
        self.start(j + 1) - 1
    }

    /// The symmetric matrix with these values times a vector. O(entries).
    pub(super) fn multiply(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for j in 0..self.size() {
            let (start, end) = (self.start(j), self.diagonal(j));
            let mut sum = values[end] * x[j];
            for (v, &i) in values[start..end].iter().zip(&self.entries.row_idx()[start..end]) {
                sum += v * x[i as usize];
                y[i as usize] += v * x[j];
            }
            y[j] += sum;
        }
    }

    /// The row of an entry.
    pub(super) fn row(&self, entry: usize) -> usize {
        self.entries.row_idx()[entry] as usize
    }

    pub(super) fn symbolic(&self) -> SymbolicSparseColMatRef<'_, u32> {
        self.entries.as_ref()
    }

    fn starts(&self) -> &[u32] {
        self.entries.col_ptr()
    }

    fn start(&self, j: usize) -> usize {
        self.starts()[j] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_two_hold_every_pair_of_unknowns() {
        let pattern = SparsePattern::from_pairs(5, [(0, 1), (4, 1), (1, 4), (2, 3)]);
        assert_eq!((pattern.size(), pattern.entry_count()), (5, 8));
        let blocks = pattern.with_blocks_of_two();
        assert_eq!(blocks.size(), 10);
        for i in 0..10 {
            assert_eq!(blocks.position(i, i), Some(blocks.diagonal(i)));
            for j in 0..10 {
                assert_eq!(blocks.position(i, j).is_some(), pattern.position(i / 2, j / 2).is_some());
            }
        }
    }

    #[test]
    fn multiplies_like_the_full_matrix() {
        let pattern = SparsePattern::from_pairs(3, [(0, 2), (1, 2)]);
        // [[1, 0, 3], [0, 2, 4], [3, 4, 5]]
        let mut y = [0.0; 3];
        pattern.multiply(&[1.0, 2.0, 3.0, 4.0, 5.0], &[1.0, 10.0, 100.0], &mut y);
        assert_eq!(y, [301.0, 420.0, 543.0]);
    }
}
