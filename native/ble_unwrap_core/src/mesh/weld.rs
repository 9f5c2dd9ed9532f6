//! Coincident vertices as one.

use rayon::slice::ParallelSliceMut;

/// The lowest vertex at the same position as each vertex, itself where it is alone.
///
/// Positions are equal when every coordinate is, with −0 equal to 0; no tolerance, so that nothing
/// depends on scale. Vertices that are not `used` stand for themselves. O(n log n).
pub(crate) fn weld(positions: &[[f64; 3]], used: &[bool]) -> Vec<u32> {
    // Adding 0 turns −0 into 0; equal numbers then have equal bits.
    let mut keyed: Vec<([u64; 3], u32)> = (0..positions.len())
        .filter(|&v| used[v])
        .map(|v| (positions[v].map(|x| (x + 0.0).to_bits()), v as u32))
        .collect();
    keyed.par_sort_unstable();
    let mut representative: Vec<u32> = (0..positions.len() as u32).collect();
    for group in keyed.chunk_by(|a, b| a.0 == b.0) {
        for &(_, v) in &group[1..] {
            representative[v as usize] = group[0].1;
        }
    }
    representative
}

#[cfg(test)]
mod tests {
    use super::weld;

    #[test]
    fn equal_positions_share_their_lowest_vertex() {
        let p = [
            [1.0, 2.0, 3.0],
            [0.0, -0.0, 0.0],
            [1.0, 2.0, 3.0],
            [-0.0, 0.0, 0.0],
            [1.0, 2.0, 3.0 + 1e-15],
            [1.0, 2.0, 3.0],
        ];
        assert_eq!(weld(&p, &[true; 6]), [0, 1, 0, 1, 4, 0]);
        assert_eq!(weld(&p, &[false, true, true, true, true, true]), [0, 1, 2, 1, 4, 2]);
    }
}
