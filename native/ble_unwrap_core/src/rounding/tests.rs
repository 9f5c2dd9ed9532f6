//! Charts made too small or too thin for float32.

use nalgebra::Point3;

use super::*;
use crate::mesh::Quad;
use crate::metrics::{Texture, UvMesh};
use crate::progress::Progress;
use crate::verify::verify;

const ROUNDING: Rounding = Rounding { texel: [1.0 / 2048.0; 2], corner: [0.0; 2], diagonal: 1.5 };

/// An n×n grid over the unit square whose inner columns are squeezed together in pairs: every second
/// strip of triangles is `thin` wide. Each row is pushed sideways a little, so that no needle is
/// axis-parallel.
fn grid_with_needles(n: u32, thin: f64) -> (TriMesh, Vec<Point2<f64>>) {
    let mut p = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let x = f64::from(i - i % 2) + if i % 2 == 1 { thin * f64::from(n) } else { 0.0 };
            p.push(Point3::new((x + 0.3 * f64::from(j)) / f64::from(n), f64::from(j) / f64::from(n), 0.0));
        }
    }
    let mut t = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            t.push([a, a + 1, a + n + 2]);
            t.push([a, a + n + 2, a + n + 1]);
        }
    }
    let (mesh, _) = TriMesh::from_triangles(&p, &t);
    let uv = mesh.positions().iter().map(|p| Point2::new(p.x / 1.3, p.y)).collect();
    (mesh, uv)
}

/// Moves a layout to `scale`·uv + `shift`.
fn placed(uv: &[Point2<f64>], scale: f64, shift: [f64; 2]) -> Vec<Point2<f64>> {
    uv.iter().map(|p| Point2::new(scale * p.x + shift[0], scale * p.y + shift[1])).collect()
}

fn broken_by_plain_rounding(mesh: &TriMesh, uv: &[Point2<f64>]) -> usize {
    let r: Vec<[f32; 2]> = uv.iter().map(|p| [p.x as f32, p.y as f32]).collect();
    mesh.triangles()
        .iter()
        .filter(|t| {
            let [a, b, c] = t.map(|v| r[v.index()]);
            double_area(a, b, c) <= 0.0
        })
        .count()
}

/// The certificate of a chart on its own.
fn is_injective(mesh: &TriMesh, uv: &[[f32; 2]]) -> bool {
    let t: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
    let texture = Texture::square(2048, 4.0);
    let soup = UvMesh::new(mesh.positions(), &t, uv, &t, &[], texture).expect("valid arrays");
    verify(&soup, &Progress::new()).expect("not cancelled").is_valid()
}

fn all_positive(mesh: &TriMesh, uv: &[[f32; 2]]) -> bool {
    mesh.triangles().iter().all(|t| {
        let [a, b, c] = t.map(|v| uv[v.index()]);
        double_area(a, b, c) > 0.0
    })
}

#[test]
fn a_healthy_chart_is_rounded_plainly() {
    let (mesh, uv) = grid_with_needles(10, 0.02);
    let r = round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("nothing to mend");
    assert_eq!((r.moved, r.thin_faces), (0, 0));
    assert!(r.uv.iter().zip(&uv).all(|(a, b)| *a == [b.x as f32, b.y as f32]));
}

#[test]
fn charts_are_rounded_and_mended_in_every_tile() {
    for corner in [[1.0, 0.0], [3.0, 2.0], [9.0, 9.0]] {
        let rounding = Rounding { corner, ..ROUNDING };
        for thin in [1e-8, 1e-12] {
            let (mesh, uv) = grid_with_needles(10, thin);
            // To the border of the tile.
            let uv = placed(&uv, 0.99, corner.map(|x| x + 0.001));
            assert!(broken_by_plain_rounding(&mesh, &uv) > 10);
            let r = round_to_f32(&mesh, &[], &uv, &rounding, &Progress::new()).expect("mendable");
            assert!(all_positive(&mesh, &r.uv) && r.moved > 0);
            for (v, (a, b)) in mesh.vertices().zip(r.uv.iter().zip(&uv)) {
                let reach = if mesh.is_boundary_vertex(v) { BOUNDARY_REACH } else { INNER_REACH } / 2048.0;
                for k in 0..2 {
                    let x = f64::from(a[k]);
                    assert!(x >= corner[k] && x <= corner[k] + 1.0, "{x} lies in the tile at {corner:?}");
                    // Half a step of single precision, besides what mending may move it by.
                    assert!((x - b[k]).abs() <= reach + 0.5f64.powi(21));
                }
            }
        }
    }
}

#[test]
fn needles_that_collapse_are_mended() {
    for thin in [3e-8, 1e-9, 1e-12] {
        let (mesh, uv) = grid_with_needles(10, thin);
        let uv = placed(&uv, 0.45, [0.52, 0.51]);
        assert!(broken_by_plain_rounding(&mesh, &uv) > 10);
        let r = round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("mendable");
        assert!(all_positive(&mesh, &r.uv) && is_injective(&mesh, &r.uv) && r.moved > 0);
        for (v, (a, b)) in mesh.vertices().zip(r.uv.iter().zip(&uv)) {
            let d = (f64::from(a[0]) - b.x).abs().max((f64::from(a[1]) - b.y).abs());
            assert!(d <= if mesh.is_boundary_vertex(v) { BOUNDARY_REACH } else { INNER_REACH } / 2048.0);
            assert!(d < 5e-6, "a few grid steps will do, not {d:e}");
        }
    }
}

#[test]
fn thin_but_positive_triangles_are_widened() {
    // On the surface the strips are well above the bound for degenerate triangles, in UV below.
    let (mesh, wide) = grid_with_needles(6, 1e-3);
    let uv = placed(&wide, 1e-4, [0.4, 0.3]);
    let r = round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("mendable");
    assert!(all_positive(&mesh, &r.uv));
    assert_eq!(r.thin_faces, 0, "strips of 1e-7 can be had three times as wide");
}

#[test]
fn a_tiny_chart_with_needles_is_mended() {
    // A hundred thousandth of the texture: some 160 grid steps.
    let (mesh, uv) = grid_with_needles(8, 1e-3);
    let uv = placed(&uv, 1e-5, [0.777_777, 0.654_321]);
    assert!(broken_by_plain_rounding(&mesh, &uv) > 10);
    let r = round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("mendable");
    assert!(all_positive(&mesh, &r.uv) && is_injective(&mesh, &r.uv));
    assert_eq!(round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("mendable"), r);
}

#[test]
fn what_cannot_be_mended_is_named() {
    let (mesh, uv) = grid_with_needles(40, 0.01);
    // 3200 triangles on a handful of grid points.
    let tiny = placed(&uv, 1e-9, [0.9, 0.9]);
    let coarse = Rounding { texel: [1e-9; 2], ..ROUNDING };
    let e = round_to_f32(&mesh, &[], &tiny, &coarse, &Progress::new()).expect_err("no room");
    let RoundingError::Unmendable(e) = e else { panic!("{e}") };
    assert!(!e.faces.is_empty() && e.faces.is_sorted() && e.uv.len() == uv.len());
    assert!(e.to_string().contains("lose their orientation"));
    let mut broken = uv.clone();
    broken[7] = Point2::new(f64::NAN, 0.5);
    assert!(round_to_f32(&mesh, &[], &broken, &ROUNDING, &Progress::new()).is_err());
}

#[test]
fn results_stay_in_the_unit_square() {
    let (mesh, uv) = grid_with_needles(10, 1e-10);
    for shift in [[0.0, 0.0], [1.0 - 1e-4, 1.0 - 1e-4]] {
        let uv: Vec<_> = placed(&uv, 1e-4, shift).iter().map(|p| Point2::new(p.x.min(1.0), p.y.min(1.0))).collect();
        let r = round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("mendable");
        assert!(all_positive(&mesh, &r.uv) && is_injective(&mesh, &r.uv));
        assert!(r.uv.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
    }
}

/// Flat quads side by side, each with a corner that lies only `depth` beyond the other diagonal: all but bent.
fn nearly_bent(n: u32, depth: f64) -> (TriMesh, Vec<Point2<f64>>, Vec<[VertexId; 3]>) {
    let mut p = Vec::new();
    for k in 0..n {
        // A kite: its first and third corner are the ends of the diagonal that is there.
        let (x, y) = (1.1 * f64::from(k), 0.37 * f64::from(k));
        p.extend(
            [[0.5 - depth, 0.5 - depth], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                .map(|q| Point3::new(x + q[0], y + q[1], 0.0)),
        );
    }
    let triangles: Vec<[u32; 3]> =
        (0..n).flat_map(|k| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]).collect();
    let (mesh, _) = TriMesh::from_triangles(&p, &triangles);
    let polygon: Vec<u32> = mesh.faces().map(|f| f.index() as u32 / 2).collect();
    let halves = Quad::all(&mesh, &polygon).flat_map(|q| q.other_halves(&mesh)).collect();
    let uv = mesh.positions().iter().map(|p| Point2::new(p.x, p.y)).collect();
    (mesh, uv, halves)
}

#[test]
fn quads_that_plain_rounding_bends_are_mended() {
    let (mesh, uv, halves) = nearly_bent(60, 1e-7);
    let uv = placed(&uv, 0.007, [0.51, 0.53]);
    let turned = |uv: &[[f32; 2]]| {
        let is_turned = |t: &&[VertexId; 3]| {
            let [a, b, c] = t.map(|v| uv[v.index()]);
            double_area(a, b, c) <= 0.0
        };
        halves.iter().filter(is_turned).count()
    };
    let plain = round_to_f32(&mesh, &[], &uv, &ROUNDING, &Progress::new()).expect("nothing to mend");
    let kept = round_to_f32(&mesh, &halves, &uv, &ROUNDING, &Progress::new()).expect("no face is lost");
    assert_eq!(plain.moved, 0);
    assert!(turned(&plain.uv) > 10, "{}", turned(&plain.uv));
    assert_eq!(turned(&kept.uv), 0);
    assert!(all_positive(&mesh, &kept.uv) && kept.moved > 0);
}

#[test]
fn no_face_is_given_up_for_a_bent_quad() {
    // Bent by far more than rounding may move a vertex.
    let (mesh, uv, halves) = nearly_bent(3, -0.2);
    let uv = placed(&uv, 0.1, [0.1, 0.2]);
    let kept = round_to_f32(&mesh, &halves, &uv, &ROUNDING, &Progress::new()).expect("no face is lost");
    assert!(all_positive(&mesh, &kept.uv));
}
