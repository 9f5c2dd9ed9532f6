//! Rectangles laid on whole texels.
//!
//! Where a side of a chart runs through a row of texels, these are on the chart in part only: a baker finds samples for
//! some of them, and light of what is beyond the side gets into others. A chart whose outer border is a rectangle along
//! the axes can do without: its sides go to the nearest edges of texels, and what is inside goes with them. That scales
//! it by less than a texel along each axis.
//!
//! Sides lie on the edges of texels, not on their centres, so that every texel is on the chart as a whole or not at
//! all. With a side through the centres, rounding would say which of these a baker counts as covered.
//!
//! Charts are packed with so much more room around them that none comes within the margin of another, wherever sides go
//! ([`with_room`]).

use nalgebra::Point2;

use super::outline::Outline;
use super::{Constraints, PackItem, PackSettings, Pose};
use crate::predicates::orientation;

/// A side moves by at most so many texels.
const NEAREST: f64 = 0.5;
/// What is so near to a side of the box around a chart, in texels, counts as on it, and is put there: what was
/// straightened is so up to rounding and the last steps of a minimisation.
const STRAIGHT: f64 = 1.0 / 16.0;
/// Rectangles narrower than so many texels are left as they are: the nearest edges would stretch them to up to twice
/// their width, or to nothing.
const LEAST_SIDE: f64 = 1.0;

/// Settings and constraints with the room that it takes to lay rectangles on whole texels afterwards: no point moves by
/// more than `outward` along either axis, and two charts may move towards each other.
pub(super) fn with_room<'a>(settings: &PackSettings, constraints: &Constraints<'a>) -> (PackSettings, Constraints<'a>) {
    let outward = NEAREST + STRAIGHT;
    let margin_texels = settings.margin_texels + 8.0f64.sqrt() * outward;
    let border_texels = constraints.border_texels.map(|border| border + outward);
    (PackSettings { margin_texels, ..settings.clone() }, Constraints { border_texels, ..*constraints })
}

/// How a rectangle is laid on whole texels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Snapped {
    /// Its lower left corner, in texels from the corner of its tile, before and afterwards.
    from: [f64; 2],
    to: [f64; 2],
    /// What it is scaled by along each axis.
    factor: [f64; 2],
    /// Points on the border, by number, with the coordinate of the side that each lies on: in both directions, for the
    /// corners.
    border: Vec<(u32, [Option<f64>; 2])>,
}

impl Snapped {
    /// How an item is laid on whole texels after its pose; `None` where its outer border is no rectangle along the
    /// axes, or where a triangle would be turned over. O(n).
    pub(super) fn new(item: &PackItem<'_>, outline: &Outline, pose: &Pose) -> Option<Self> {
        let at: Vec<Point2<f64>> = outline
            .source
            .iter()
            .map(|&p| item.points.get(p as usize).map(|p| pose.texel(*p)))
            .collect::<Option<_>>()?;
        let first = *at.first()?;
        let (low, high) = at.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        if (0..2).any(|k| high[k] - low[k] < LEAST_SIDE) || !is_rectangle(outline, &at, [low, high]) {
            return None;
        }
        let ends = [0, 1].map(|k| [low[k].round(), high[k].round()]);
        let sides = |p: &Point2<f64>| [0, 1].map(|k| side_of(p[k], [low[k], high[k]]).map(|side| ends[k][side]));
        let border = outline.source.iter().zip(&at).map(|(&number, p)| (number, sides(p)));
        let snapped = Self {
            from: low.coords.into(),
            to: ends.map(|[low, _]| low),
            factor: [0, 1].map(|k| (ends[k][1] - ends[k][0]) / (high[k] - low[k])),
            border: border.filter(|(_, sides)| sides.iter().any(Option::is_some)).collect(),
        };
        let before: Vec<Point2<f64>> = item.points.iter().map(|p| pose.texel(*p)).collect();
        let mut after = before.clone();
        snapped.apply(&mut after);
        let sign = |at: &[Point2<f64>], corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| at[corner as usize]);
            orientation(a, b, c).partial_cmp(&0.0)
        };
        item.triangles.iter().all(|corners| sign(&before, corners) == sign(&after, corners)).then_some(snapped)
    }

    /// Moves the points of the item, which are in texels from the corner of its tile.
    pub(super) fn apply(&self, points: &mut [Point2<f64>]) {
        for p in points.iter_mut() {
            for k in 0..2 {
                p[k] = self.to[k] + (p[k] - self.from[k]) * self.factor[k];
            }
        }
        for &(number, sides) in &self.border {
            let Some(p) = points.get_mut(number as usize) else { continue };
            for (k, side) in sides.into_iter().enumerate() {
                p[k] = side.unwrap_or(p[k]);
            }
        }
    }

    /// What areas are multiplied by.
    pub(super) fn area_factor(&self) -> f64 {
        self.factor[0] * self.factor[1]
    }
}

/// Which of two sides a coordinate lies on, if on any.
fn side_of(x: f64, [low, high]: [f64; 2]) -> Option<usize> {
    if x - low <= STRAIGHT {
        Some(0)
    } else if high - x <= STRAIGHT {
        Some(1)
    } else {
        None
    }
}

/// Whether edges of an outline, whose points are `at`, run along all of the box around it. There may be holes and cuts
/// inside.
fn is_rectangle(outline: &Outline, at: &[Point2<f64>], [low, high]: [Point2<f64>; 2]) -> bool {
    // By axis that a side is a place on, and side.
    let mut covered = [[0.0; 2]; 2];
    for edge in &outline.edges {
        let (p, q) = (at[edge.from as usize], at[edge.to as usize]);
        for k in 0..2 {
            let ends = [p, q].map(|p| side_of(p[k], [low[k], high[k]]));
            if let [Some(a), Some(b)] = ends
                && a == b
            {
                covered[k][a] += (q[1 - k] - p[1 - k]).abs();
            }
        }
    }
    (0..2).all(|k| covered[k].iter().all(|covered| *covered >= high[1 - k] - low[1 - k] - 2.0 * STRAIGHT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::tests::{check, items, mixture, packed, regular};
    use crate::packing::{Packed, Rotation};
    use crate::progress::Progress;
    use nalgebra::Vector2;
    use proptest::prelude::*;

    type Chart = (Vec<Point2<f64>>, Vec<[u32; 3]>);

    /// A rectangle in columns, its lower left corner at the origin, with the border shaken by up to `noise`.
    fn rectangle(w: f64, h: f64, columns: u32, noise: f64) -> Chart {
        let shake = |k: u32, side: f64| noise * side * f64::from(k % 3) * 0.5;
        let at = |k: u32| w * f64::from(k) / f64::from(columns);
        let points = (0..=columns)
            .flat_map(|k| [Point2::new(at(k), shake(k, 1.0)), Point2::new(at(k), h + shake(k + 1, -1.0))])
            .collect();
        let quad = |k: u32| [[2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1]];
        (points, (0..columns).flat_map(quad).collect())
    }

    fn posed(offset: [f64; 2]) -> Pose {
        Pose { cos: 1.0, sin: 0.0, centre: Point2::origin(), scale: 1.0, offset: Vector2::from(offset) }
    }

    fn snapped(chart: &Chart, offset: [f64; 2]) -> Option<Snapped> {
        let item = PackItem { points: &chart.0, triangles: &chart.1 };
        Snapped::new(&item, &Outline::new(&item, 0).expect("valid"), &posed(offset))
    }

    fn placed(chart: &Chart, offset: [f64; 2]) -> Vec<Point2<f64>> {
        let mut at: Vec<Point2<f64>> = chart.0.iter().map(|p| posed(offset).texel(*p)).collect();
        snapped(chart, offset).expect("a rectangle").apply(&mut at);
        at
    }

    #[test]
    fn sides_go_to_the_nearest_edges_and_what_is_inside_goes_along() {
        let chart = rectangle(7.3, 3.6, 4, 0.0);
        let at = placed(&chart, [0.4, 0.6]);
        // From 0.4 to 7.7 and from 0.6 to 4.2.
        assert_eq!((at[0], at[9]), (Point2::new(0.0, 1.0), Point2::new(8.0, 4.0)));
        assert!((at[4].x - 4.0).abs() < 1e-12, "the middle column");
        let snapped = snapped(&chart, [0.4, 0.6]).expect("a rectangle");
        assert!((snapped.area_factor() - 8.0 * 3.0 / (7.3 * 3.6)).abs() < 1e-12);
    }

    #[test]
    fn a_border_that_wavers_is_straight_afterwards_and_one_that_winds_is_none() {
        for p in placed(&rectangle(40.0, 10.0, 6, 0.05), [3.2, 5.1]) {
            assert!(p.y == 5.0 || p.y == 15.0, "{p}");
        }
        assert_eq!(snapped(&rectangle(40.0, 10.0, 6, 0.2), [3.2, 5.1]), None);
    }

    #[test]
    fn what_is_no_rectangle_or_narrower_than_a_texel_keeps_its_shape() {
        let l_shape = (
            [[0.0, 0.0], [9.0, 0.0], [9.0, 4.0], [4.0, 4.0], [4.0, 9.0], [0.0, 9.0]].map(Point2::from).to_vec(),
            vec![[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]],
        );
        assert_eq!(snapped(&l_shape, [0.3, 0.3]), None);
        assert_eq!(snapped(&regular(8, 10.0), [20.3, 20.3]), None);
        let cut_corner = (
            [[0.0, 0.0], [9.0, 0.0], [9.0, 8.0], [8.0, 9.0], [0.0, 9.0]].map(Point2::from).to_vec(),
            vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]],
        );
        assert_eq!(snapped(&cut_corner, [0.3, 0.3]), None);
        assert_eq!(snapped(&rectangle(0.9, 9.0, 2, 0.0), [0.3, 0.3]), None);
        assert!(snapped(&rectangle(1.0, 9.0, 2, 0.0), [0.3, 0.3]).is_some());
        assert_eq!(snapped(&(Vec::new(), Vec::new()), [0.0, 0.0]), None);
    }

    #[test]
    fn a_rectangle_may_have_holes() {
        // A square ring of four by four with an oblique hole.
        let rim = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [4.5, 2.0], [7.0, 4.5], [4.5, 7.0], [2.0, 4.5]];
        let triangles = (0..4).flat_map(|k| [[k, (k + 1) % 4, 4 + k], [(k + 1) % 4, 4 + (k + 1) % 4, 4 + k]]).collect();
        let ring = (rim.map(Point2::from).to_vec(), triangles);
        let at = placed(&ring, [0.3, 0.6]);
        assert_eq!((at[0], at[2]), (Point2::new(0.0, 1.0), Point2::new(9.0, 10.0)));
    }

    #[test]
    fn nothing_is_turned_over_for_it() {
        // The lower side has a dent as deep as counts for straight; what lies above the dent would be squeezed into
        // nothing.
        let points = [[0.0, 0.0], [5.0, 0.05], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [5.0, 0.049]];
        let chart = (points.map(Point2::from).to_vec(), vec![[0, 1, 4], [1, 3, 4], [1, 2, 3], [0, 5, 1]]);
        assert_eq!(snapped(&chart, [0.25, 0.25]), None);
    }

    proptest! {
        #[test]
        fn no_point_moves_further_than_there_is_room_for(
            w in 1.0f64..60.0, h in 1.0f64..60.0, x in 0.0f64..9.0, y in 0.0f64..9.0, columns in 1u32..9,
        ) {
            let chart = rectangle(w, h, columns, 0.0);
            for (p, at) in chart.0.iter().zip(placed(&chart, [x, y])) {
                for k in 0..2 {
                    let moved = at[k] - (p[k] + [x, y][k]);
                    prop_assert!(moved.abs() <= NEAREST + 1e-12, "{moved}");
                }
                prop_assert_eq!(at.y.fract(), 0.0);
            }
        }
    }

    fn settings(margin_texels: f64, rotation: Rotation) -> PackSettings {
        PackSettings { width: 256, height: 192, margin_texels, rotation, snap: true, ..PackSettings::default() }
    }

    /// The box of an item as single precision has it, in texels.
    fn box_of(packed: &Packed, item: usize, chart: &Chart) -> [f64; 4] {
        let single = |p: Point2<f64>| [0, 1].map(|k| f64::from(p[k] as f32) * f64::from(packed.size[k]));
        packed.uvs(item, &chart.0).into_iter().map(single).fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |b, p| {
            [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
        })
    }

    #[test]
    fn packed_rectangles_lie_on_whole_texels_and_all_charts_keep_the_margin() {
        let mut charts: Vec<Chart> =
            (0..9).map(|k| rectangle(10.0 + 3.7 * f64::from(k), 5.0 + 2.3 * f64::from(8 - k), 3, 0.0)).collect();
        charts.extend(mixture(12, 3));
        for (margin, rotation) in
            [(0.0, Rotation::Quarter), (2.0, Rotation::Aligned), (5.7, Rotation::None), (5.7, Rotation::Aligned)]
        {
            let settings = settings(margin, rotation);
            let packed = packed(&charts, &settings);
            check(&charts, &settings, &packed);
            for (k, chart) in charts.iter().enumerate().take(9) {
                let corners = box_of(&packed, k, chart);
                assert!(packed.is_snapped(k) && corners.iter().all(|x| (x - x.round()).abs() < 1e-4), "{corners:?}");
            }
        }
    }

    #[test]
    fn a_chart_alone_and_charts_in_rows_and_in_tiles_are_laid_on_whole_texels() {
        let alone = [rectangle(10.0, 3.3, 2, 0.0)];
        let settings = settings(3.0, Rotation::Aligned);
        assert!(packed(&alone, &settings).is_snapped(0));
        let many: Vec<Chart> = (0..700).map(|k| rectangle(1.0 + 0.001 * f64::from(k), 0.7, 1, 0.0)).collect();
        let wide = PackSettings { width: 512, height: 512, margin_texels: 1.0, ..settings.clone() };
        let found = packed(&many, &wide);
        check(&many, &wide, &found);
        assert!((0..700).all(|k| found.is_snapped(k)));
        let tiled = PackSettings { tiles: 2, texel_density: Some(4.0), ..settings };
        let charts: Vec<Chart> = (0..6).map(|k| rectangle(30.0, 10.0 + 3.1 * f64::from(k), 2, 0.0)).collect();
        let found = packed(&charts, &tiled);
        assert!((0..6).all(|k| found.is_snapped(k)) && found.tiles_used == 2);
    }

    #[test]
    fn nothing_is_laid_on_texels_unasked_and_what_is_can_be_undone() {
        let charts = [rectangle(10.0, 3.3, 2, 0.0), rectangle(4.0, 4.0, 1, 0.0)];
        let asked = settings(3.0, Rotation::Aligned);
        let plain = PackSettings { snap: false, ..asked.clone() };
        let unasked = packed(&charts, &plain);
        assert!(!unasked.is_snapped(0) && unasked.snapped.is_empty());
        let mut found = packed(&charts, &asked);
        found.unsnap(0);
        assert!(!found.is_snapped(0) && found.is_snapped(1));
        check(&charts, &asked, &found);
    }

    #[test]
    fn a_border_that_is_given_is_kept() {
        let charts = [rectangle(10.0, 3.3, 2, 0.0), rectangle(4.0, 4.0, 1, 0.0)];
        let constraints = Constraints { border_texels: Some(2.0), ..Constraints::default() };
        let settings = settings(0.0, Rotation::Aligned);
        let found =
            super::super::pack_within(&items(&charts), &constraints, &settings, &Progress::new()).expect("fits");
        for (k, chart) in charts.iter().enumerate() {
            let [left, low, right, high] = box_of(&found, k, chart);
            assert!(left >= 2.0 - 1e-4 && low >= 2.0 - 1e-4 && right <= 254.0 + 1e-4 && high <= 190.0 + 1e-4);
        }
    }
}
