//! Layouts made to break one rule at a time.

use nalgebra::Point3;

use super::*;
use crate::metrics::Texture;

/// UV triangles with labels; every corner and vertex is its own.
#[derive(Clone, Default)]
struct Soup {
    uv: Vec<Point>,
    chart: Vec<i32>,
}

impl Soup {
    fn add(&mut self, label: i32, triangle: [[f64; 2]; 3]) {
        self.uv.extend(triangle.map(|p| p.map(|x| x as f32)));
        self.chart.push(label);
    }

    /// A triangle strip between two polylines, lower one first.
    fn strip(&mut self, label: i32, low: &[[f64; 2]], high: &[[f64; 2]]) {
        for i in 1..low.len() {
            self.add(label, [low[i - 1], low[i], high[i]]);
            self.add(label, [low[i - 1], high[i], high[i - 1]]);
        }
    }

    fn square(&mut self, label: i32, lo: [f64; 2], side: f64) {
        let at = |x: f64, y: f64| [lo[0] + x * side, lo[1] + y * side];
        self.strip(label, &[at(0.0, 0.0), at(1.0, 0.0)], &[at(0.0, 1.0), at(1.0, 1.0)]);
    }

    /// A ring of squares around an empty middle: from `lo` three cells of `cell` each way.
    fn ring(&mut self, label: i32, lo: [f64; 2], cell: f64) {
        for i in 0..9 {
            if i != 4 {
                self.square(label, [lo[0] + f64::from(i % 3) * cell, lo[1] + f64::from(i / 3) * cell], cell);
            }
        }
    }

    fn verify(&self) -> Certificate {
        self.verify_in(1)
    }

    /// In a texture of so many tiles.
    fn verify_in(&self, tiles: usize) -> Certificate {
        let positions = vec![Point3::origin(); self.uv.len()];
        let triangles: Vec<[u32; 3]> = (0..self.chart.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let texture = Texture { tiles, ..Texture::square(64, 2.0) };
        let mesh =
            UvMesh::new(&positions, &triangles, &self.uv, &triangles, &self.chart, texture).expect("valid arrays");
        verify(&mesh, &Progress::new()).expect("not cancelled")
    }
}

/// A band around the origin moved to (½, ½): from angle 0 to `turns` full turns, radius growing by
/// `rise` a turn.
fn spiral(turns: f64, rise: f64) -> Soup {
    let n = 64 * (turns.ceil() as usize);
    let at = |i: usize, r: f64| {
        let t = turns * i as f64 / n as f64;
        let (s, c) = (std::f64::consts::TAU * t).sin_cos();
        [0.5 + (r + rise * t) * c, 0.5 + (r + rise * t) * s]
    };
    let outer: Vec<_> = (0..=n).map(|i| at(i, 0.2)).collect();
    let inner: Vec<_> = (0..=n).map(|i| at(i, 0.1)).collect();
    let mut soup = Soup::default();
    soup.strip(3, &outer, &inner);
    soup
}

#[test]
fn good_layouts_pass() {
    let mut soup = Soup::default();
    soup.ring(7, [0.25, 0.25], 0.125);
    soup.square(2, [0.0, 0.0], 0.125);
    let c = soup.verify();
    assert!(c.is_valid(), "{c:?}");
    assert_eq!((c.charts, c.unmapped.count, c.faulty_charts.len()), (2, 0, 0));
    assert!((c.gap_texels - 8.0).abs() < 1e-9, "a diagonal eighth is 11.3 texels, beyond the search");
    // In the ring's hole, an eighth wide, with a 32nd around it.
    soup.square(9, [0.375 + 0.03125, 0.375 + 0.03125], 0.0625);
    let c = soup.verify();
    assert!(c.is_valid(), "{c:?}");
    assert!((c.gap_texels - 2.0).abs() < 1e-9);
    assert!(spiral(2.0, 0.15).verify().is_valid());
    assert!(Soup::default().verify().is_valid(), "nothing is injective");
}

#[test]
fn a_chart_over_the_solid_part_of_another_is_found() {
    let mut soup = Soup::default();
    soup.square(0, [0.1, 0.1], 0.5);
    soup.square(1, [0.2, 0.2], 0.1);
    let c = soup.verify();
    assert_eq!((c.nested, c.crossings_between.count), (Defect { count: 1, first: Some((2, 0)) }, 0));
    assert_eq!(c.faulty_charts, [0, 1]);
    assert!(!c.is_valid());
    // A ring whose outer loop surrounds another chart that its hole does not hold.
    let mut soup = Soup::default();
    soup.ring(0, [0.0, 0.0], 0.3);
    soup.square(1, [0.05, 0.65], 0.1);
    assert_eq!(soup.verify().nested.count, 1);
    // A large chart with a small one in its middle, by way of the tree.
    let mut soup = spiral(1.9, 0.15);
    soup.square(8, [0.64, 0.5], 0.01);
    assert_eq!(soup.verify().nested.count, 1);
    let mut soup = spiral(1.9, 0.15);
    soup.square(8, [0.5, 0.5], 0.01);
    assert!(soup.verify().is_valid());
}

#[test]
fn a_band_that_meets_itself_is_found() {
    // One and a half turns at constant radius: all triangles positive, edges on edges.
    let c = spiral(1.5, 0.0).verify();
    assert_eq!(c.flipped.count, 0);
    assert!(c.crossings_inside.count > 0 && !c.is_valid());
    // Rising less than its width: edges cross properly.
    let c = spiral(2.0, 0.05).verify();
    assert_eq!(c.flipped.count, 0);
    assert!(c.crossings_inside.count > 0 && c.faulty_charts == [3]);
}

#[test]
fn a_vertex_wound_around_twice_is_found() {
    // z ↦ z² of a disc: a fan of 32 positive triangles that goes around its middle twice.
    for radius_step in [0.0, 0.002] {
        let mut soup = Soup::default();
        let at = |i: i32| {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / 16.0).sin_cos();
            let r = 0.3 + radius_step * f64::from(i % 32);
            [0.5 + r * c, 0.5 + r * s]
        };
        for i in 0..32 {
            soup.add(0, [[0.5, 0.5], at(i), at(i + 1)]);
        }
        let c = soup.verify();
        assert_eq!(c.flipped.count, 0);
        assert!(!c.is_valid() && c.faulty_charts == [0], "{c:?}");
    }
}

#[test]
fn flips_are_exact() {
    let x = 0.3f32;
    let mut soup = Soup::default();
    // Collinear in float32, and one bit to each side.
    for y in [x, x.next_up(), x.next_down()] {
        soup.uv.extend([[0.1, 0.1], [x, y], [0.7, 0.7]]);
        soup.chart.push(0);
    }
    assert_eq!(soup.verify().flipped, Defect { count: 2, first: Some(0) });
    let mut one = Soup::default();
    one.add(0, [[0.1, 0.1], [0.1, 0.2], [0.2, 0.1]]);
    assert_eq!(one.verify().flipped.count, 1);
}

#[test]
fn touching_is_found() {
    // Corner to corner, of one chart: in one piece by that vertex only.
    let mut soup = Soup::default();
    soup.square(0, [0.25, 0.25], 0.25);
    soup.square(0, [0.5, 0.5], 0.25);
    let c = soup.verify();
    assert!(c.crossings_inside.count > 0 && !c.is_valid());
    // Of two charts.
    let mut soup = Soup::default();
    soup.square(0, [0.25, 0.25], 0.25);
    soup.square(1, [0.5, 0.5], 0.25);
    let c = soup.verify();
    assert!(c.crossings_between.count > 0 && c.gap_texels == 0.0 && !c.is_valid());
    // Edge to edge.
    let mut soup = Soup::default();
    soup.square(0, [0.25, 0.25], 0.25);
    soup.square(1, [0.5, 0.25], 0.25);
    assert!(soup.verify().crossings_between.count > 0);
}

#[test]
fn pieces_range_and_unmapped() {
    let mut soup = Soup::default();
    soup.square(4, [0.1, 0.1], 0.1);
    soup.square(4, [0.5, 0.5], 0.1);
    let c = soup.verify();
    assert_eq!((c.bad_loops, c.crossings_inside.count), (Defect { count: 1, first: Some(4) }, 0));
    let mut soup = Soup::default();
    soup.square(-1, [0.1, 0.1], 0.1);
    soup.square(4, [0.95, 0.5], 0.1);
    soup.add(5, [[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let c = soup.verify();
    assert_eq!(c.unmapped, Defect { count: 2, first: Some(0) });
    assert_eq!(c.out_of_range, Defect { count: 3, first: Some(2) });
    assert_eq!(c.flipped, Defect { count: 1, first: Some(4) });
    assert_eq!(c.faulty_charts, [4, 5]);
}

#[test]
fn a_chart_lies_within_one_of_the_tiles() {
    // The second tile of two, the first of the second row of eleven; each touches the border of its tile all around.
    for (corner, tiles) in [([0.0, 0.0], 1), ([1.0, 0.0], 2), ([0.0, 1.0], 11), ([9.0, 9.0], 100)] {
        let mut soup = Soup::default();
        soup.square(0, corner, 1.0);
        assert!(soup.verify_in(tiles).is_valid(), "{corner:?}");
        if tiles > 1 {
            let c = soup.verify_in(tiles - 1);
            assert_eq!((c.out_of_range, c.faulty_charts), (Defect { count: 2, first: Some(0) }, vec![0]), "{corner:?}");
        }
    }
    let mut soup = Soup::default();
    soup.square(3, [0.2, 0.2], 0.5);
    soup.square(5, [1.2, 0.2], 0.5);
    assert!(soup.verify_in(4).is_valid());
    assert_eq!(soup.verify().faulty_charts, [5]);
    // Across a border, by a triangle that crosses it and by an edge upon it.
    let mut soup = Soup::default();
    soup.square(0, [0.75, 0.25], 0.5);
    let c = soup.verify_in(4);
    assert_eq!((c.out_of_range.count, c.is_valid()), (2, false));
    let mut soup = Soup::default();
    let [low, high] = [0.25, 0.75].map(|y| [0.75, 1.0, 1.25].map(|x| [x, y]));
    soup.strip(7, &low, &high);
    let c = soup.verify_in(4);
    assert_eq!(
        (c.out_of_range, c.flipped.count, c.faulty_charts.clone()),
        (Defect { count: 2, first: Some(2) }, 0, vec![7])
    );
    assert!(c.to_string().contains("2 triangles outside the texture or their tiles"), "{c}");
}

#[test]
fn charts_of_other_tiles_are_apart_as_well() {
    // A texel of 64 to either side of a border, in both tiles and in only one.
    for (first, second, gap) in [(63.0, 65.0, 2.0), (63.5, 64.5, 1.0), (64.0, 64.0, 0.0)] {
        let mut soup = Soup::default();
        soup.square(0, [0.5, 0.25], first / 64.0 - 0.5);
        soup.square(1, [second / 64.0, 0.25], 0.5);
        let c = soup.verify_in(2);
        assert_eq!((c.gap_texels, c.out_of_range.count, c.is_valid()), (gap, 0, gap >= 2.0));
    }
}

#[test]
fn three_triangles_on_an_edge_are_found() {
    let mut soup = Soup::default();
    soup.add(0, [[0.2, 0.2], [0.6, 0.2], [0.4, 0.6]]);
    soup.add(0, [[0.6, 0.2], [0.2, 0.2], [0.4, 0.1]]);
    soup.add(0, [[0.2, 0.2], [0.6, 0.2], [0.4, 0.5]]);
    assert!(!soup.verify().is_valid());
}

/// What the certificate claims is what brute force on all pairs of triangles finds.
#[test]
fn valid_exactly_where_no_two_triangles_overlap() {
    let mut state = 5u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let (mut good, mut bad) = (0, 0);
    for _ in 0..300 {
        let mut soup = Soup::default();
        for label in 0..4 {
            let p = [[next(), next()], [next(), next()], [next(), next()]].map(|p: [f64; 2]| [0.3 * p[0], 0.3 * p[1]]);
            let shift = [0.7 * next(), 0.7 * next()];
            let [a, b, c] = p.map(|p| [p[0] + shift[0], p[1] + shift[1]]);
            let positive = (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0]);
            soup.add(label, if positive { [a, b, c] } else { [a, c, b] });
        }
        let separated =
            |s: &[Point], t: &[Point]| (0..3).any(|i| t.iter().all(|&p| orientation(s[i], s[(i + 1) % 3], p) < 0));
        let apart = (0..4).all(|i| {
            (0..i).all(|j| {
                let (s, t) = (&soup.uv[3 * i..3 * i + 3], &soup.uv[3 * j..3 * j + 3]);
                separated(s, t) || separated(t, s)
            })
        });
        assert_eq!(soup.verify().is_injective(), apart);
        if apart { good += 1 } else { bad += 1 }
    }
    assert!(good > 20 && bad > 20, "{good} {bad}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mut soup = spiral(3.0, 0.05);
    for i in 0..40 {
        soup.square(10 + i, [0.02 * f64::from(i), 0.3], 0.05);
    }
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| soup.verify())
    };
    let one = with(1);
    assert!(one.crossings_between.count > 50 && one.crossings_inside.count > 1, "{one:?}");
    assert_eq!(one, with(2));
    assert_eq!(one, with(8));
}
