//! Conservative rasters: every cell an outline touches.

use nalgebra::Point2;

use super::mask::Mask;
use super::outline::Outline;

/// An outline turned, scaled and rasterised.
#[derive(Clone, Debug)]
pub(super) struct Raster {
    /// Every cell whose square comes within `inflation` cells (in either coordinate) of the union.
    pub(super) mask: Mask,
    /// What to add to the turned and scaled points to get into the mask's frame.
    pub(super) shift: [f64; 2],
}

/// Raster of an outline turned by the angle of (cos, sin) = `turn`, with `scale` cells to an outline unit.
///
/// Guarantee: a cell outside the mask is at least `inflation` cells from every triangle in the
/// maximum norm, as long as `inflation` exceeds 1e-9 times the mask's extent (rounding). No cell is
/// set that is further than that. With a negative inflation (more than −½) cells are left out that the
/// outline enters by less than that; one cell is set at least. Cost: O(cells of the boundary + words of the mask).
pub(super) fn rasterise(outline: &Outline, turn: [f64; 2], scale: f64, inflation: f64) -> Raster {
    let [c, s] = turn;
    let mut at: Vec<Point2<f64>> =
        outline.points.iter().map(|p| Point2::new(scale * (c * p.x - s * p.y), scale * (s * p.x + c * p.y))).collect();
    let (mut low, mut high) = (Point2::new(0.0, 0.0), Point2::new(0.0, 0.0));
    if let Some(first) = at.first() {
        (low, high) = (*first, *first);
        for p in &at {
            low = low.inf(p);
            high = high.sup(p);
        }
    }
    let shift = [inflation - low.x, inflation - low.y];
    let cells = |size: f64| ((size + 2.0 * inflation).ceil() as usize).max(1);
    let mut mask = Mask::new(cells(high.x - low.x), cells(high.y - low.y));
    for p in &mut at {
        p.x += shift[0];
        p.y += shift[1];
    }
    let mut crossings: Vec<Crossing> = Vec::new();
    for edge in &outline.edges {
        let (p, q) = (at[edge.from as usize], at[edge.to as usize]);
        cover_segment(&mut mask, p, q, inflation);
        if edge.winding != 0 {
            cross_rows(p, q, edge.winding, mask.height(), &mut crossings);
        }
    }
    fill(&mut mask, &crossings);
    if mask.is_empty() {
        let (x, y) = (mask.width() / 2, mask.height() / 2);
        mask.set_run(y, x, x);
    }
    Raster { mask, shift }
}

/// Sets the cells met by a segment inflated by a square of half-width `e`.
fn cover_segment(mask: &mut Mask, p: Point2<f64>, q: Point2<f64>, e: f64) {
    let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
    let clamp = |v: f64, n: usize| (v.floor().max(0.0) as usize).min(n - 1);
    if q.y + e < 0.0 || q.y + e < (p.y - e).floor() {
        return;
    }
    let (first, last) = (clamp(p.y - e, mask.height()), clamp(q.y + e, mask.height()));
    let slope = (q.x - p.x) / (q.y - p.y);
    for row in first..=last {
        // The part of the segment within the row grown by e, where it exists at all.
        let along = |y: f64| {
            if y <= p.y {
                p.x
            } else if y >= q.y {
                q.x
            } else {
                (p.x + (y - p.y) * slope).clamp(p.x.min(q.x), p.x.max(q.x))
            }
        };
        let (a, b) = (along(row as f64 - e), along(row as f64 + 1.0 + e));
        mask.set_run(row, clamp(a.min(b) - e, mask.width()), clamp(a.max(b) + e, mask.width()));
    }
}

/// Where an edge crosses the middle line of a row.
#[derive(Clone, Copy, Default)]
struct Crossing {
    row: u32,
    /// Change of the winding number there.
    winding: i32,
    x: f64,
}

/// Collects where an edge crosses the middle lines of rows. Half-open in y, by comparing the end
/// points themselves: crossings of a closed chain balance exactly in every row.
fn cross_rows(p: Point2<f64>, q: Point2<f64>, winding: i32, height: usize, out: &mut Vec<Crossing>) {
    let (low, high, sign) = if p.y < q.y { (p, q, -winding) } else { (q, p, winding) };
    let middle = |row: f64| row + 0.5;
    let mut row = (low.y - 0.5).floor().max(0.0);
    while middle(row) < low.y {
        row += 1.0;
    }
    while middle(row) < high.y && row < height as f64 {
        let t = (middle(row) - low.y) / (high.y - low.y);
        out.push(Crossing { row: row as u32, winding: sign, x: low.x + t * (high.x - low.x) });
        row += 1.0;
    }
}

/// Sets the cells whose centre has a winding number other than zero. A cell no edge touches lies
/// wholly inside or wholly outside, so its centre decides.
fn fill(mask: &mut Mask, crossings: &[Crossing]) {
    for row in by_row(crossings, mask.height()).chunk_by_mut(|a, b| a.row == b.row) {
        // A row has few.
        row.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.winding.cmp(&b.winding)));
        let mut winding = 0;
        for pair in row.windows(2) {
            winding += pair[0].winding;
            let (from, to) = ((pair[0].x - 0.5).ceil().max(0.0), (pair[1].x - 0.5).floor());
            if winding != 0 && from <= to {
                mask.set_run(pair[0].row as usize, from as usize, to as usize);
            }
        }
    }
}

/// The crossings row by row: a sort by counting.
fn by_row(crossings: &[Crossing], rows: usize) -> Vec<Crossing> {
    let mut next = vec![0; rows + 1];
    crossings.iter().for_each(|c| next[c.row as usize + 1] += 1);
    for row in 0..rows {
        next[row + 1] += next[row];
    }
    let mut sorted = vec![Crossing::default(); crossings.len()];
    for c in crossings {
        sorted[next[c.row as usize]] = *c;
        next[c.row as usize] += 1;
    }
    sorted
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::packing::PackItem;
    use proptest::prelude::*;

    /// Whether the axis-aligned square [x, x+1] × [y, y+1] grown by e meets a triangle: separating axes.
    pub(crate) fn touches(tri: &[Point2<f64>; 3], x: f64, y: f64, e: f64) -> bool {
        let (lo, hi) = ([x - e, y - e], [x + 1.0 + e, y + 1.0 + e]);
        let square = [
            Point2::new(lo[0], lo[1]),
            Point2::new(hi[0], lo[1]),
            Point2::new(hi[0], hi[1]),
            Point2::new(lo[0], hi[1]),
        ];
        let mut axes = vec![[1.0, 0.0], [0.0, 1.0]];
        for k in 0..3 {
            let d = tri[(k + 1) % 3] - tri[k];
            axes.push([-d.y, d.x]);
        }
        axes.iter().all(|a| {
            let range = |ps: &[Point2<f64>]| {
                ps.iter().map(|p| a[0] * p.x + a[1] * p.y).fold((f64::MAX, f64::MIN), |r, v| (r.0.min(v), r.1.max(v)))
            };
            let (r, t) = (range(&square), range(tri));
            r.0 <= t.1 && t.0 <= r.1
        })
    }

    proptest! {
        #[test]
        fn covers_exactly_the_touched_cells(
            coords in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 3..10),
            picks in prop::collection::vec((0u32..100, 0u32..100, 0u32..100), 1..6),
            angle in 0.0f64..6.3, scale in 0.1f64..90.0,
        ) {
            let points: Vec<_> = coords.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            let n = points.len() as u32;
            let triangles: Vec<_> = picks.iter().map(|&(a, b, c)| [a % n, b % n, c % n]).collect();
            let outline = Outline::new(&PackItem { points: &points, triangles: &triangles }, 0).expect("valid");
            let e = 1.0 / 128.0;
            let (s, c) = angle.sin_cos();
            let raster = rasterise(&outline, [c, s], scale, e);
            let placed: Vec<[Point2<f64>; 3]> = triangles.iter().map(|t| t.map(|v| {
                let p = (points[v as usize] - outline.centre) / outline.unit();
                Point2::new(scale * (c * p.x - s * p.y) + raster.shift[0], scale * (s * p.x + c * p.y) + raster.shift[1])
            })).collect();
            for y in 0..raster.mask.height() {
                for x in 0..raster.mask.width() {
                    let near = |e: f64| placed.iter().any(|t| touches(t, x as f64, y as f64, e));
                    if raster.mask.get(x, y) {
                        prop_assert!(near(e + 1e-6), "cell {x} {y} set for nothing");
                    } else {
                        prop_assert!(!near(e - 1e-6), "cell {x} {y} missed");
                    }
                }
            }
            for p in placed.iter().flatten() {
                prop_assert!(p.x > 0.0 && p.y > 0.0);
                prop_assert!(p.x < raster.mask.width() as f64 && p.y < raster.mask.height() as f64);
            }
        }
    }

    #[test]
    fn a_negative_inflation_leaves_out_cells_barely_touched() {
        let points: Vec<_> = [[0.0, 0.0], [1.0, 0.1], [0.9, 0.8], [0.1, 0.7]].map(|[x, y]| Point2::new(x, y)).into();
        let outline =
            Outline::new(&PackItem { points: &points, triangles: &[[0, 1, 2], [0, 2, 3]] }, 0).expect("valid");
        let area = outline.area * 50.0 * 50.0;
        let count = |inflation: f64| rasterise(&outline, [0.8, 0.6], 50.0, inflation).mask.count() as f64;
        let perimeter = 3.2 * 50.0;
        assert!((count(-0.499) - area).abs() < 0.1 * perimeter, "{} cells for an area of {area}", count(-0.499));
        assert!(count(0.0) - area > 0.4 * perimeter);
        assert!(count(-0.25) < count(0.0) && count(-0.25) > count(-0.499));
        // Even a chart of a tenth of a cell has one.
        assert_eq!(rasterise(&outline, [1.0, 0.0], 0.1, -0.4).mask.count(), 1);
    }

    #[test]
    fn a_hole_stays_open_and_a_point_has_a_cell() {
        // A square ring: 8 points, 8 triangles.
        let points: Vec<_> = [3.0, 1.0]
            .iter()
            .flat_map(|&r| [[-r, -r], [r, -r], [r, r], [-r, r]])
            .map(|[x, y]| Point2::new(x, y))
            .collect();
        let triangles: Vec<[u32; 3]> =
            (0..4).flat_map(|k| [[k, (k + 1) % 4, 4 + k], [(k + 1) % 4, 4 + (k + 1) % 4, 4 + k]]).collect();
        let outline = Outline::new(&PackItem { points: &points, triangles: &triangles }, 0).expect("valid");
        let mask = rasterise(&outline, [1.0, 0.0], 60.0, 0.01).mask;
        assert_eq!(mask.width(), 61);
        assert!(!mask.get(30, 30) && mask.get(10, 30) && mask.get(30, 50));
        let inner = 61 * 61 - mask.count();
        assert!((18 * 18..=20 * 20).contains(&inner), "{inner} cells are open");

        let point = Outline::new(&PackItem { points: &points, triangles: &[[0, 0, 0]] }, 0).expect("valid");
        assert_eq!(rasterise(&point, [1.0, 0.0], 60.0, 0.01).mask, Mask::full(1, 1));
    }
}
