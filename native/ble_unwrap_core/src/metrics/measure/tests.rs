//! Layouts whose figures are known by heart.

use super::*;
use crate::metrics::Texture;

/// Arrays that own what a [`UvMesh`] borrows.
#[derive(Clone, Default)]
struct Layout {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    uv: Vec<[f32; 2]>,
    corners: Vec<[u32; 3]>,
    chart: Vec<i32>,
}

impl Layout {
    fn measure(&self, texture: Texture) -> Measures {
        let mesh = UvMesh::new(&self.positions, &self.triangles, &self.uv, &self.corners, &self.chart, texture)
            .expect("valid");
        measure(&mesh, &Progress::new()).expect("not cancelled")
    }

    /// An n×n grid of squares over the unit square, with UV `map(x, y)`.
    fn grid(n: u32, map: impl Fn(f64, f64) -> [f64; 2]) -> Self {
        let mut l = Self::default();
        for j in 0..=n {
            for i in 0..=n {
                let (x, y) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                l.positions.push(Point3::new(x, y, 0.0));
                l.uv.push(map(x, y).map(|t| t as f32));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let a = j * (n + 1) + i;
                l.triangles.push([a, a + 1, a + n + 2]);
                l.triangles.push([a, a + n + 2, a + n + 1]);
            }
        }
        l.corners.clone_from(&l.triangles);
        l
    }

    /// A cube of side 2 with six square charts of side 1/4, three by two, 1/8 apart.
    fn cube() -> Self {
        let mut l = Self::default();
        for i in 0..8 {
            l.positions.push(Point3::new(f64::from(i & 1) * 2.0, f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2) * 2.0));
        }
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        for (q, v) in quads.iter().enumerate() {
            let (x, y) = (0.375 * (q % 3) as f32, 0.375 * (q / 3) as f32);
            let c = l.uv.len() as u32;
            l.uv.extend([[x, y], [x + 0.25, y], [x + 0.25, y + 0.25], [x, y + 0.25]]);
            l.triangles.extend([[v[0], v[1], v[2]], [v[0], v[2], v[3]]]);
            l.corners.extend([[c, c + 1, c + 2], [c, c + 2, c + 3]]);
            l.chart.extend([q as i32, q as i32]);
        }
        l
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs().max(1e-3)
}

#[test]
fn cube_of_six_charts() {
    let m = Layout::cube().measure(Texture::square(64, 4.0));
    assert_eq!((m.charts, m.islands, m.faces, m.unmapped_faces, m.flips), (6, 6, 12, 0, 0));
    assert_eq!((m.overlaps, m.overlaps_complete, m.gap_complete), (0, true, true));
    for one in [m.l2, m.l2_chart_scale, m.l2_worst_chart, m.l_infinity, m.angle_distortion, m.area_distortion] {
        assert!(close(one, 1.0), "{m:?}");
    }
    // Twelve edges of length 2; area 24.
    assert!(close(m.seam_length_absolute, 24.0) && close(m.seam_length, 24.0 / 24f64.sqrt()));
    assert!(close(m.packing_efficiency, 6.0 / 16.0));
    assert!(close(m.gap_texels, 8.0));
    assert!(close(Layout::cube().measure(Texture::square(32, 4.0)).gap_texels, 4.0));
    assert_eq!(
        m.per_chart.iter().map(|c| (c.label, c.faces)).collect::<Vec<_>>(),
        (0..6).map(|l| (l, 2)).collect::<Vec<_>>()
    );
}

#[test]
fn the_share_that_is_used_is_that_of_the_tiles_with_charts() {
    // Each face of the cube has a sixteenth of a tile, and two of them go into other tiles.
    let mut cube = Layout::cube();
    for p in &mut cube.uv[..4] {
        p[0] += 3.0;
    }
    for p in &mut cube.uv[4..8] {
        p[1] += 1.0;
    }
    let tiled = |tiles: usize| cube.measure(Texture { tiles, ..Texture::square(64, 4.0) });
    let m = tiled(12);
    assert_eq!((m.tiles, m.charts), (3, 6));
    assert!(close(m.packing_efficiency, 6.0 / 16.0 / 3.0), "{}", m.packing_efficiency);
    // In fewer tiles one chart is outside, and the bounding square counts.
    let m = tiled(10);
    assert_eq!(m.tiles, 0);
    assert!(close(m.packing_efficiency, 6.0 / 16.0 / 3.25f64.powi(2)), "{}", m.packing_efficiency);
    assert_eq!(Layout::cube().measure(Texture::square(64, 4.0)).tiles, 1);
}

#[test]
fn scaled_axes() {
    // σ of UV→surface: 2 and 1 at unit density ½.
    let m = Layout::grid(6, |x, y| [0.5 * x, y]).measure(Texture::square(64, 0.0));
    assert!(close(m.l2, (2.5f64 * 0.5).sqrt()));
    assert!(close(m.l_infinity, 2.0 * 0.5f64.sqrt()));
    assert!(close(m.angle_distortion, 0.5 * (2.0 + 0.5)));
    assert!(close(m.area_distortion, 1.0));
    assert!(close(m.packing_efficiency, 0.5));
    assert_eq!((m.charts, m.gap_texels), (1, 8.0), "nothing to be near to");
}

#[test]
fn shear_and_a_texture_of_other_proportions() {
    let m = Layout::grid(5, |x, y| [0.4 * (x + 0.5 * y), 0.4 * y]).measure(Texture::square(64, 0.0));
    // Inverse of [[1, ½], [0, 1]]: squared norm 2¼, determinant 1.
    assert!(close(m.l2, 1.125f64.sqrt()));
    let s = (0.5 * (2.25 + (2.25f64 * 2.25 - 4.0).sqrt())).sqrt();
    assert!(close(m.l_infinity, s) && close(m.angle_distortion, 0.5 * (s * s + 1.0 / (s * s))));
    // Made for a texture twice as wide as high: no distortion at all.
    let wide = Texture { width: 128, height: 64, margin: 0.0, tiles: 1 };
    let m = Layout::grid(5, |x, y| [0.5 * x, y]).measure(wide);
    assert!(close(m.l2, 1.0) && close(m.l_infinity, 1.0) && close(m.packing_efficiency, 0.5), "{m:?}");
}

#[test]
fn two_scales_cost_at_layout_scale_only() {
    let mut l = Layout::cube();
    for p in &mut l.uv[..4] {
        *p = p.map(|x| 0.5 * x);
    }
    let m = l.measure(Texture::square(64, 0.0));
    assert!(close(m.l2_chart_scale, 1.0) && close(m.l2_worst_chart, 1.0));
    // Densities: one face at ¼, five at 1.
    let mean = 5.25 / 6.0;
    assert!(close(m.l2, (9.0f64 / 6.0 * mean).sqrt()));
    assert!(close(m.area_distortion, (0.5 * (0.25 / mean + mean / 0.25) + 2.5 * (1.0 / mean + mean)) / 6.0));
}

#[test]
fn flips_and_overlaps_of_a_folded_grid() {
    // The right third is folded back over the middle.
    let l = Layout::grid(6, |x, y| [if x > 0.67 { 4.0 / 3.0 - x } else { x }, y]);
    let m = l.measure(Texture::square(64, 0.0));
    assert_eq!((m.charts, m.flips), (1, 24));
    // Each folded square lies on one other square: its two triangles each meet both of the other's.
    assert_eq!((m.overlaps, m.overlaps_between), (2 * 6 * 4, 0));
    assert!(close(m.packing_efficiency, 2.0 / 3.0));
    // A mirrored layout is not flipped: no majority is wronged.
    assert_eq!(Layout::grid(6, |x, y| [1.0 - x, y]).measure(Texture::square(64, 0.0)).flips, 0);
}

#[test]
fn input_winding_does_not_matter() {
    let mut l = Layout::grid(4, |x, y| [x, y]);
    for f in [3, 7, 8, 20] {
        l.triangles[f].swap(1, 2);
        l.corners[f].swap(1, 2);
    }
    let m = l.measure(Texture::square(64, 0.0));
    assert_eq!((m.charts, m.flips), (1, 0));
    assert!(close(m.l2, 1.0));
}

#[test]
fn hopeless_input_is_measured_all_the_same() {
    let mut l = Layout::grid(4, |x, y| [x, y]);
    l.uv[0] = [f32::NAN, 0.0];
    l.uv[1] = [f32::INFINITY, 0.0];
    l.positions[24] = Point3::new(f64::NAN, 0.0, 0.0);
    l.chart = (0..32).map(|f| if f == 30 { -1 } else { 5 }).collect();
    let m = l.measure(Texture::square(64, 0.0));
    assert_eq!((m.faces, m.nonfinite_faces, m.unmapped_faces), (32, 4, 5));
    assert_eq!(m.degenerate_faces, 2, "both faces of the vertex that is not there");
    assert!(close(m.l2, 1.0) && m.seam_length.is_finite());

    let nothing = Layout::default().measure(Texture::square(0, f64::NAN));
    assert_eq!((nothing.charts, nothing.faces, nothing.packing_efficiency), (0, 0, 0.0));
    let mut point = Layout::grid(3, |_, _| [0.5, 0.5]);
    let m = point.measure(Texture::square(64, 0.0));
    assert_eq!((m.uv_degenerate_faces, m.overlaps), (18, 0));
    assert!(m.l2.is_nan());
    for p in &mut point.positions {
        *p = Point3::new(7.0, 7.0, 7.0);
    }
    assert_eq!(point.measure(Texture::square(64, 0.0)).degenerate_faces, 18);
}

#[test]
fn size_and_place_of_the_mesh_do_not_matter() {
    let plain = Layout::cube().measure(Texture::square(64, 4.0));
    for scale in [1e-200, 1e-30, 1e30, 1e200] {
        let mut l = Layout::cube();
        for p in &mut l.positions {
            *p = Point3::from(p.coords * scale);
        }
        let m = l.measure(Texture::square(64, 4.0));
        assert!(close(m.seam_length_absolute / scale, 24.0));
        assert!(close(m.l2, plain.l2) && close(m.seam_length, plain.seam_length) && m.degenerate_faces == 0);
    }
}

#[test]
fn the_worst_chart_is_named_specks_aside() {
    let mut l = Layout::cube();
    for p in &mut l.uv[8..12] {
        p[0] *= 0.5;
    }
    let m = l.measure(Texture::square(64, 0.0));
    assert_eq!(m.worst_chart, Some(2));
    assert!(close(m.l2_worst_chart, 1.25f64.sqrt()));
    // A far smaller triangle, stretched far more.
    let v = l.positions.len() as u32;
    l.positions.extend([[9.0, 0.0, 0.0], [9.001, 0.0, 0.0], [9.0, 0.001, 0.0]].map(Point3::from));
    l.triangles.push([v, v + 1, v + 2]);
    let c = l.uv.len() as u32;
    l.uv.extend([[0.9, 0.9], [0.91, 0.9], [0.9, 0.99]]);
    l.corners.push([c, c + 1, c + 2]);
    l.chart.push(17);
    let m = l.measure(Texture::square(64, 0.0));
    assert_eq!((m.charts, m.worst_chart), (7, Some(2)));
    assert!(m.per_chart[6].l2 > 1.5 && m.per_chart[6].label == 17);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    // Folded and wavy, so that every figure is far from trivial.
    let l = Layout::grid(60, |x, y| [0.5 + 0.4 * (7.0 * x).sin(), 0.9 * y + 0.05 * (9.0 * x).cos()]);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| l.measure(Texture::square(256, 2.0)))
    };
    let one = with(1);
    assert!(one.overlaps > 1000 && one.flips > 100);
    assert_eq!(one, with(2));
    assert_eq!(one, with(8));
}

/// n×n squares of two triangles each, every one a chart of its own; square `(i, j)` is drawn out by `stretch(i, j)`.
fn squares_apart(n: u32, stretch: impl Fn(u32, u32) -> f64) -> Layout {
    let mut l = Layout::default();
    for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
        let first = l.positions.len() as u32;
        for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            l.positions.push(Point3::new(2.0 * f64::from(i) + x, 2.0 * f64::from(j) + y, 0.0));
            let side = 1.0 / f64::from(2 * n);
            let u = side * (2.0 * f64::from(i) + x * stretch(i, j));
            l.uv.push([u as f32, (side * (2.0 * f64::from(j) + y)) as f32]);
        }
        l.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        l.chart.extend([(j * n + i) as i32; 2]);
    }
    l.corners.clone_from(&l.triangles);
    l
}

#[test]
fn of_many_equal_small_charts_one_is_the_worst() {
    // 10,201 charts of less than 1e-4 of the surface each; one is drawn out by a half: its L2 is ½(1 + 1/2.25)·1.5.
    let m = squares_apart(101, |i, j| if (i, j) == (7, 3) { 1.5 } else { 1.0 }).measure(Texture::square(4096, 0.0));
    assert_eq!((m.charts, m.worst_chart), (101 * 101, Some(3 * 101 + 7)));
    let expected = (0.5 * (1.0 + 1.0 / 2.25) * 1.5f64).sqrt();
    assert!((m.l2_worst_chart - expected).abs() < 1e-3, "{} {expected}", m.l2_worst_chart);
}
