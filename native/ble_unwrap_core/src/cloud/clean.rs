//! First stage: finite, distinct points in a box of standard size.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};

/// Stands for "has no point": the input point is not finite.
pub(super) const NO_POINT: u32 = u32::MAX;

/// The distinct finite points of a cloud, whatever its unit and place.
#[derive(Clone, Debug)]
pub(super) struct CleanCloud {
    /// Distinct points, in the order of their first occurrence, in [−1, 1]³; the widest axis fills it.
    pub(super) points: Vec<Point3<f64>>,
    /// For each input point its number in `points`, or [`NO_POINT`].
    pub(super) of_input: Vec<u32>,
    /// Input points that are not finite.
    pub(super) unmapped: usize,
    /// Input points that coincide with an earlier one.
    pub(super) duplicates: usize,
}

/// Leaves out points that are not finite, brings the rest to a box of side 2 and merges those that coincide there.
///
/// Exact in scale: no intermediate overflows or underflows for coordinates from 1e-290 to 1e308. O(n log n).
pub(super) fn clean(positions: &[[f64; 3]], progress: &Progress) -> Result<CleanCloud, Cancelled> {
    let finite: Vec<u32> =
        (0..positions.len() as u32).filter(|&i| positions[i as usize].iter().all(|x| x.is_finite())).collect();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &i in &finite {
        for c in 0..3 {
            low[c] = low[c].min(positions[i as usize][c]);
            high[c] = high[c].max(positions[i as usize][c]);
        }
    }
    // Halves first: a difference of the largest doubles would overflow.
    let half: [f64; 3] = std::array::from_fn(|c| 0.5 * high[c] - 0.5 * low[c]);
    let middle: [f64; 3] = std::array::from_fn(|c| 0.5 * low[c] + 0.5 * high[c]);
    let extent = half[0].max(half[1]).max(half[2]);
    let place = |i: u32| {
        let p = positions[i as usize];
        // Adding zero turns −0 into 0, so that equal places are equal bit for bit.
        let x = |c: usize| if extent > 0.0 { (p[c] - middle[c]) / extent + 0.0 } else { 0.0 };
        Point3::new(x(0), x(1), x(2))
    };
    let mut sorted: Vec<(Point3<f64>, u32)> = finite.par_iter().map(|&i| (place(i), i)).collect();
    progress.check()?;
    sorted.par_sort_unstable_by(|(p, i), (q, j)| {
        let by = |c: usize| p[c].total_cmp(&q[c]);
        by(0).then(by(1)).then(by(2)).then(i.cmp(j))
    });
    progress.check()?;
    let mut first_at_place = vec![NO_POINT; positions.len()];
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        for &(_, i) in same {
            first_at_place[i as usize] = same[0].1;
        }
    }
    let (mut points, mut of_input) = (Vec::new(), vec![NO_POINT; positions.len()]);
    for &i in &finite {
        let first = first_at_place[i as usize];
        if first == i {
            of_input[i as usize] = points.len() as u32;
            points.push(place(i));
        } else {
            of_input[i as usize] = of_input[first as usize];
        }
    }
    let duplicates = finite.len() - points.len();
    Ok(CleanCloud { points, of_input, unmapped: positions.len() - finite.len(), duplicates })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(positions: &[[f64; 3]]) -> CleanCloud {
        clean(positions, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn coincident_points_share_a_number_and_bad_ones_have_none() {
        let nan = f64::NAN;
        let cloud =
            run(&[[1.0, 0.0, -0.0], [nan, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, -0.0, 0.0], [0.0, f64::INFINITY, 0.0]]);
        assert_eq!(cloud.of_input, [0, NO_POINT, 1, 0, NO_POINT]);
        assert_eq!((cloud.unmapped, cloud.duplicates), (2, 1));
        assert_eq!(cloud.points, [Point3::new(-1.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0)]);
    }

    #[test]
    fn any_scale_and_place_fill_the_same_box() {
        let shape = [[0.0, 0.0, 0.0], [4.0, 1.0, 0.0], [2.0, 2.0, 1.0]];
        let unit = run(&shape).points;
        assert_eq!(unit[1], Point3::new(1.0, 0.0, -0.25));
        for scale in [1e-290, 1e-30, 1e30, 4e307] {
            let scaled: Vec<[f64; 3]> = shape.iter().map(|p| p.map(|x| x * scale)).collect();
            for (a, b) in run(&scaled).points.iter().zip(&unit) {
                assert!((a - b).norm() < 1e-12, "{scale}");
            }
        }
        let whole = run(&[[-f64::MAX; 3], [f64::MAX; 3]]).points;
        assert_eq!(whole, [Point3::new(-1.0, -1.0, -1.0), Point3::new(1.0, 1.0, 1.0)]);
    }

    #[test]
    fn one_place_and_nothing() {
        let one = run(&[[5.0; 3]; 4]);
        assert_eq!((one.points.len(), one.duplicates), (1, 3));
        assert_eq!(one.points[0], Point3::origin());
        assert!(run(&[]).points.is_empty());
        assert!(run(&[[f64::NAN; 3]]).points.is_empty());
    }
}
