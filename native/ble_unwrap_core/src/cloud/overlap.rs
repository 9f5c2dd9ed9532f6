//! Parts of a chart that lie upon each other: nodes near in the plane and far apart on the surface.

use std::collections::HashMap;

use nalgebra::{Point2, Point3};
use rayon::prelude::*;

/// Two nodes are near in the plane below this share of the spacing there. At the density of the sample about every
/// second node over another sheet has one so near.
const NEAR: f64 = 0.5;
/// They are far in space above so many spacings: a sheet would have to be squeezed six times to do that by stretch.
const FAR: f64 = 3.0;
/// Neighbours of one grid cell looked at for a node: enough for a sixfold density, and a bound where all coincide.
const MOST_IN_CELL: usize = 64;

/// Pairs of nodes (lower first, sorted) that lie upon each other although they are not near on the surface.
///
/// `spacing` is the distance of neighbours on the surface a node, `scale` what the map makes of one unit. Points are
/// compared within a group of equal `group` only. Not found: overlaps narrower than about a spacing. O(n) where the
/// map's density is bounded.
pub(super) fn overlapping_pairs(
    uv: &[Point2<f64>],
    position: &[Point3<f64>],
    spacing: &[f64],
    scale: f64,
    group: impl Fn(usize) -> u32 + Sync,
) -> Vec<(u32, u32)> {
    let mut sorted: Vec<f64> = spacing.iter().copied().filter(|s| *s > 0.0).collect();
    if sorted.is_empty() || scale.is_nan() || scale <= 0.0 {
        return Vec::new();
    }
    let middle = sorted.len() / 2;
    let typical = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let side = NEAR * typical * scale;
    let cell = |i: usize| [i64::from(group(i)), (uv[i].x / side).floor() as i64, (uv[i].y / side).floor() as i64];
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for i in 0..uv.len() {
        let nodes = cells.entry(cell(i)).or_default();
        if nodes.len() < MOST_IN_CELL {
            nodes.push(i as u32);
        }
    }
    let mut pairs: Vec<(u32, u32)> = (0..uv.len())
        .into_par_iter()
        .with_min_len(1024)
        .flat_map_iter(|i| {
            let [group, x, y] = cell(i);
            let cells = &cells;
            let around = (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| [group, x + dx, y + dy]));
            around.filter_map(move |key| cells.get(&key)).flatten().filter_map(move |&j| {
                let other = j as usize;
                let s = spacing[i].min(spacing[other]).min(typical);
                let near = (uv[i] - uv[other]).norm() < NEAR * s * scale;
                let wide = spacing[i].max(spacing[other]).max(typical);
                let far = (position[i] - position[other]).norm() > FAR * wide;
                (other > i && near && far).then_some((i as u32, j))
            })
        })
        .collect();
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(turns: f64) -> (Vec<Point2<f64>>, Vec<Point3<f64>>) {
        // An annulus strip of radius 1 to 1.3 laid flat that runs `turns` times around, a helix in space.
        let mut uv = Vec::new();
        let mut position = Vec::new();
        let steps = (turns * 120.0) as usize;
        for i in 0..steps {
            for k in 0..7 {
                let (angle, r) =
                    (i as f64 * std::f64::consts::TAU / 120.0 + 0.003 * f64::from(k), 1.0 + 0.05 * f64::from(k));
                uv.push(Point2::new(r * angle.cos(), r * angle.sin()));
                position.push(Point3::new(r * angle.cos(), r * angle.sin(), 0.3 * angle));
            }
        }
        (uv, position)
    }

    #[test]
    fn a_spiral_that_closes_on_itself_overlaps() {
        for (turns, overlaps) in [(0.9, false), (1.4, true)] {
            let (uv, position) = strip(turns);
            let pairs = overlapping_pairs(&uv, &position, &vec![0.05; uv.len()], 1.0, |_| 0);
            assert_eq!(!pairs.is_empty(), overlaps, "{turns} turns");
            let overlapping = 0.4 * 120.0 * 7.0;
            assert!(!overlaps || pairs.len() as f64 > 0.3 * overlapping, "{}", pairs.len());
            assert!(pairs.iter().all(|p| p.0 < p.1));
            let apart = overlapping_pairs(&uv, &position, &vec![0.05; uv.len()], 1.0, |i| (i / 420) as u32);
            assert!(apart.len() < pairs.len() || !overlaps);
        }
    }

    #[test]
    fn nothing_is_compared_where_there_is_no_spacing() {
        let uv = vec![Point2::origin(); 1000];
        let position: Vec<_> = (0..1000).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        assert!(overlapping_pairs(&uv, &position, &vec![0.0; 1000], 1.0, |_| 0).is_empty());
        // All upon one spot: bounded work.
        assert!(!overlapping_pairs(&uv, &position, &vec![1.0; 1000], 1.0, |_| 0).is_empty());
    }
}
