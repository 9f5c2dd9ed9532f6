//! Whole packings against an exact oracle of distances.

use super::*;
use proptest::prelude::*;
use std::f64::consts::TAU;

pub(super) type Chart = (Vec<Point2<f64>>, Vec<[u32; 3]>);

/// Numbers in [0, 1), the same every time.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }
}

fn fan(rim: Vec<Point2<f64>>) -> Chart {
    let triangles = (1..rim.len() as u32 - 1).map(|k| [0, k, k + 1]).collect();
    (rim, triangles)
}

fn rectangle(w: f64, h: f64) -> Chart {
    fan(vec![Point2::new(0.0, 0.0), Point2::new(w, 0.0), Point2::new(w, h), Point2::new(0.0, h)])
}

pub(super) fn regular(n: usize, radius: f64) -> Chart {
    let at = |k: usize| TAU * k as f64 / n as f64;
    fan((0..n).map(|k| Point2::new(radius * at(k).cos(), radius * at(k).sin())).collect())
}

fn l_shape(size: f64, arm: f64) -> Chart {
    let at = |x: f64, y: f64| Point2::new(x, y);
    let points = vec![at(0.0, 0.0), at(size, 0.0), at(size, arm), at(arm, arm), at(arm, size), at(0.0, size)];
    (points, vec![[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
}

fn annulus(outer: f64, inner: f64, n: u32) -> Chart {
    let ring = |r: f64| {
        (0..n).map(move |k| {
            Point2::new(r * (TAU * f64::from(k) / f64::from(n)).cos(), r * (TAU * f64::from(k) / f64::from(n)).sin())
        })
    };
    let triangles = (0..n).flat_map(|k| {
        let next = (k + 1) % n;
        [[k, next, n + k], [next, n + next, n + k]]
    });
    (ring(outer).chain(ring(inner)).collect(), triangles.collect())
}

/// A star-shaped blob of about unit radius.
fn blob(numbers: &mut Numbers, radius: f64) -> Chart {
    let waves: Vec<(f64, f64)> =
        (2..7).map(|k| (0.5 * (numbers.next() - 0.5) / f64::from(k), TAU * numbers.next())).collect();
    let n = 40;
    let mut points: Vec<_> = (0..n)
        .map(|k| {
            let t = TAU * f64::from(k) / f64::from(n);
            let wobble: f64 = waves.iter().zip(2..).map(|(&(a, p), f)| a * (f64::from(f) * t + p).cos()).sum();
            let r = radius * (1.0 + wobble).max(0.3);
            Point2::new(1.2 * r * t.cos(), r * t.sin())
        })
        .collect();
    points.push(Point2::origin());
    let n = n as u32;
    (points, (0..n).map(|k| [n, k, (k + 1) % n]).collect())
}

fn turned((points, triangles): Chart, angle: f64, by: [f64; 2]) -> Chart {
    let turn = nalgebra::Rotation2::new(angle);
    (points.into_iter().map(|p| turn * p + Vector2::new(by[0], by[1])).collect(), triangles)
}

fn blobs(count: usize, seed: u64) -> Vec<Chart> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|_| {
            let radius = (1.5 * numbers.next()).exp();
            let chart = blob(&mut numbers, radius);
            turned(chart, TAU * numbers.next(), [0.0, 0.0])
        })
        .collect()
}

/// A bit of everything.
pub(super) fn mixture(count: usize, seed: u64) -> Vec<Chart> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|k| {
            let size = (2.0 * numbers.next()).exp();
            let chart = match k % 6 {
                0 => regular(3 + (8.0 * numbers.next()) as usize, size),
                1 => l_shape(2.0 * size, 0.6 * size),
                2 => annulus(1.5 * size, 1.2 * size, 24),
                3 => rectangle(5.0 * size, 0.2 * size),
                4 => blob(&mut numbers, 0.3 * size),
                _ => rectangle(0.1 * size, 0.15 * size),
            };
            turned(chart, TAU * numbers.next(), [100.0 * numbers.next(), -1e3])
        })
        .collect()
}

pub(super) fn items(charts: &[Chart]) -> Vec<PackItem<'_>> {
    charts.iter().map(|(points, triangles)| PackItem { points, triangles }).collect()
}

pub(super) fn packed(charts: &[Chart], settings: &PackSettings) -> Packed {
    pack(&items(charts), settings, &Progress::new()).expect("charts fit")
}

pub(super) fn square(size: u32, margin_texels: f64) -> PackSettings {
    PackSettings { margin_texels, width: size, height: size, ..PackSettings::default() }
}

/// All triangles of a chart in texels, after rounding UVs to f32.
pub(super) fn final_triangles(packed: &Packed, item: usize, chart: &Chart) -> Vec<[Point2<f64>; 3]> {
    let [w, h] = packed.size.map(f64::from);
    let uv = packed.uvs(item, &chart.0);
    let corner = packed.tiles[item].corner();
    let at = |v: u32| {
        let [x, y] = [0, 1].map(|k| f64::from(uv[v as usize][k] as f32) - corner[k]);
        Point2::new(x * w, y * h)
    };
    chart.1.iter().map(|t| t.map(at)).collect()
}

fn point_segment(p: Point2<f64>, a: Point2<f64>, b: Point2<f64>) -> f64 {
    let d = b - a;
    let t = if d.norm_squared() > 0.0 { ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + d * t)).norm()
}

/// Euclidean distance of two triangles; 0 where they meet.
pub(super) fn distance(s: &[Point2<f64>; 3], t: &[Point2<f64>; 3]) -> f64 {
    let side = |a: Point2<f64>, b: Point2<f64>, c: Point2<f64>| (b - a).perp(&(c - a));
    let inside = |p: Point2<f64>, t: &[Point2<f64>; 3]| {
        let d = [side(t[0], t[1], p), side(t[1], t[2], p), side(t[2], t[0], p)];
        d.iter().all(|&d| d > 0.0) || d.iter().all(|&d| d < 0.0)
    };
    if inside(s[0], t) || inside(t[0], s) {
        return 0.0;
    }
    let mut least = f64::INFINITY;
    for i in 0..3 {
        for j in 0..3 {
            let (a, b, c, d) = (s[i], s[(i + 1) % 3], t[j], t[(j + 1) % 3]);
            if side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0 {
                return 0.0;
            }
            least = least.min(point_segment(a, c, d)).min(point_segment(c, a, b));
        }
    }
    least
}

/// Asserts the guarantees of [`pack`]; returns the least distance of two charts.
pub(super) fn check(charts: &[Chart], settings: &PackSettings, packed: &Packed) -> f64 {
    let margin = settings.margin_texels;
    let all: Vec<_> = charts.iter().enumerate().map(|(k, c)| final_triangles(packed, k, c)).collect();
    let boxes: Vec<_> = all
        .iter()
        .map(|ts| {
            ts.iter().flatten().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |b, p| {
                [b[0].min(p.x), b[1].min(p.y), b[2].max(p.x), b[3].max(p.y)]
            })
        })
        .collect();
    let mut least = f64::INFINITY;
    for (i, b) in boxes.iter().enumerate() {
        assert!(b.iter().all(|v| v.is_finite()), "chart {i} is finite");
        let half = 0.5 * margin;
        assert!(b[0] >= half && b[1] >= half, "chart {i} at {b:?} is half a margin from the border");
        assert!(
            b[2] <= f64::from(settings.width) - half && b[3] <= f64::from(settings.height) - half,
            "chart {i} at {b:?}"
        );
        let pose = &packed.poses[i];
        assert!((pose.cos.hypot(pose.sin) - 1.0).abs() < 1e-12 && pose.scale > 0.0, "a similarity without mirroring");
        for j in 0..i {
            let c = &boxes[j];
            let apart = |lo: usize| (b[lo] - c[lo + 2]).max(c[lo] - b[lo + 2]).max(0.0);
            if apart(0).hypot(apart(1)) > margin + 1.0 {
                continue;
            }
            for s in &all[i] {
                for t in &all[j] {
                    least = least.min(distance(s, t));
                }
            }
        }
    }
    assert!(least >= margin, "charts are {least} texels apart");
    if margin == 0.0 {
        assert!(least > 0.0, "no two charts touch");
    }
    least
}

#[test]
fn margins_hold_for_every_kind_of_chart() {
    let sizes = [(256, 256), (400, 150), (97, 311)];
    for (n, margin) in [0.0, 1.0, 2.5, 8.0].into_iter().enumerate() {
        for (m, rotation) in
            [Rotation::Aligned, Rotation::Any, Rotation::Quarter, Rotation::None].into_iter().enumerate()
        {
            let (width, height) = sizes[(n + m) % sizes.len()];
            let settings = PackSettings { margin_texels: margin, width, height, rotation, ..PackSettings::default() };
            let charts = mixture(18 + 6 * m, (10 * n + m) as u64);
            let packed = packed(&charts, &settings);
            let least = check(&charts, &settings, &packed);
            assert!(least < margin + 3.0, "the margin is not wasted: {least} for {margin}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn margins_hold_for_any_triangles(
        corners in prop::collection::vec(prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 3..9), 1..12),
        margin in prop_oneof![Just(0.0), 0.0..6.0], width in 40u32..200, height in 40u32..200,
    ) {
        // Foreign UVs: triangles overlap, are turned over, share corners or not.
        let charts: Vec<Chart> = corners.iter().map(|c| {
            let points: Vec<_> = c.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            let n = points.len() as u32;
            let triangles = (0..n - 1).map(|k| [k, k + 1, (k + 2) % n]).collect();
            (points, triangles)
        }).collect();
        let settings = PackSettings { margin_texels: margin, width, height, ..PackSettings::default() };
        let packed = packed(&charts, &settings);
        check(&charts, &settings, &packed);
        prop_assert!(packed.efficiency > 0.0 && packed.efficiency <= 1.0);
    }
}

/// Triangles of some shape and size, and a few large blobs.
fn crowd(triangles: usize, blobs: usize) -> Vec<Chart> {
    let mut numbers = Numbers(7);
    let mut charts: Vec<Chart> = (0..blobs).map(|_| blob(&mut numbers, 40.0)).collect();
    charts.extend((0..triangles).map(|_| {
        let corner = |numbers: &mut Numbers| Point2::new(numbers.next(), numbers.next() * 2.0);
        fan((0..3).map(|_| corner(&mut numbers)).collect())
    }));
    charts
}

#[test]
fn margins_hold_for_thousands_of_charts_in_rows() {
    for (n, rotation) in [Rotation::Aligned, Rotation::Any, Rotation::Quarter, Rotation::None].into_iter().enumerate() {
        let charts = crowd(many::ROWS_ONLY, [0, 9][n % 2]);
        let (width, height) = [(1024, 1024), (1500, 800)][n / 2];
        let settings =
            PackSettings { rotation, margin_texels: [2.0, 0.0][n / 2], width, height, ..PackSettings::default() };
        let packed = packed(&charts, &settings);
        let least = check(&charts, &settings, &packed);
        assert!(least < settings.margin_texels + 0.05, "{least}");
        assert!(packed.efficiency > 0.2, "{}", packed.efficiency);
    }
}

#[test]
fn small_charts_fill_the_corners_between_large_ones() {
    let charts = crowd(many::ROWS_ONLY, 12);
    let settings = square(2048, 1.0);
    let packed = packed(&charts, &settings);
    // 0.72 when this was written, and 0.60 in rows alone.
    assert!(packed.efficiency > 0.70, "{}", packed.efficiency);
}

#[test]
fn holes_are_used() {
    // The ring and the discs only fit at this density if discs lie in the ring.
    let mut charts = vec![annulus(10.0, 9.0, 64)];
    charts.extend((0..20).map(|_| regular(12, 1.5)));
    let settings = square(512, 2.0);
    let packed = packed(&charts, &settings);
    check(&charts, &settings, &packed);
    let middle = packed.poses[0].offset;
    let within =
        (1..charts.len()).filter(|&k| (packed.poses[k].offset - middle).norm() < 9.0 * packed.texels_per_unit).count();
    assert!(within >= 12, "{within} discs in the ring");
}

#[test]
fn the_same_for_any_number_of_threads() {
    let charts = mixture(40, 3);
    let settings = square(256, 2.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| packed(&charts, &settings))
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(8));
}

#[test]
fn orientation_and_size_are_kept() {
    let charts = mixture(12, 8);
    let rotations = [Rotation::Aligned, Rotation::Any, Rotation::Quarter, Rotation::None];
    for (rotation, width) in rotations.into_iter().flat_map(|r| [(r, 512), (r, 700)]) {
        let packed = packed(&charts, &PackSettings { rotation, width, ..square(512, 1.0) });
        assert_eq!(packed.specks, 0);
        for (k, (points, triangles)) in charts.iter().enumerate() {
            let area = |p: [Point2<f64>; 3]| (p[1] - p[0]).perp(&(p[2] - p[0]));
            let pose = &packed.poses[k];
            assert!((pose.scale / packed.texels_per_unit - 1.0).abs() < 1e-12, "one density for all");
            for t in triangles {
                let before = area(t.map(|v| points[v as usize]));
                let after = area(t.map(|v| pose.texel(points[v as usize])));
                assert!((after / (before * pose.scale * pose.scale) - 1.0).abs() < 1e-6);
            }
            let exact = [pose.cos, pose.sin].map(f64::abs);
            match rotation {
                Rotation::Aligned | Rotation::Any => {}
                Rotation::Quarter => assert!(exact == [1.0, 0.0] || exact == [0.0, 1.0]),
                Rotation::None => assert_eq!([pose.cos, pose.sin], [1.0, 0.0]),
            }
        }
    }
}

#[test]
fn equal_squares_nearly_fill_the_texture() {
    for count in [1, 4, 9, 16] {
        let charts: Vec<_> = (0..count).map(|k| turned(rectangle(3.0, 3.0), f64::from(k), [0.0, 0.0])).collect();
        let settings = square(1024, 2.0);
        let packed = packed(&charts, &settings);
        check(&charts, &settings, &packed);
        assert!(packed.efficiency > 0.96, "{count} squares cover {}", packed.efficiency);
    }
}

#[test]
fn blobs_pack_well() {
    // 0.79 to 0.80 when this was written.
    for (count, floor) in [(15, 0.77), (40, 0.77), (100, 0.77)] {
        let charts = blobs(count, 5);
        let settings = square(1024, 2.0);
        let packed = packed(&charts, &settings);
        check(&charts, &settings, &packed);
        assert!(packed.efficiency > floor, "{count} blobs cover {}", packed.efficiency);
    }
}

#[test]
fn few_charts_are_turned_to_fit() {
    // 0.625, 0.748 and 0.784 when this was written.
    for (count, floor) in [(2, 0.61), (4, 0.73), (8, 0.765)] {
        let mean = |seed: u64| {
            let charts = blobs(count, seed);
            let settings = square(2048, 4.0);
            let packed = packed(&charts, &settings);
            check(&charts, &settings, &packed);
            packed.efficiency.ln()
        };
        let mean = (0.25 * (1..=4).map(mean).sum::<f64>()).exp();
        assert!(mean > floor, "{count} blobs cover {mean} on average");
    }
}

#[test]
fn effort_is_bounded() {
    // Trials, not time: some 80 to 110 and 1140 attempts, a dozen and 54 placements when this was written.
    for (count, quality, attempts, placements) in [
        (2, Quality::Fast, 240, 25),
        (30, Quality::Fast, 180, 25),
        (250, Quality::Fast, 180, 25),
        (12, Quality::High, 1700, 150),
    ] {
        let charts = mixture(count, 2);
        let settings = PackSettings { quality, ..square(1024, 2.0) };
        let outlines: Vec<Outline> =
            items(&charts).iter().enumerate().map(|(i, c)| Outline::new(c, i).expect("valid")).collect();
        let (_, trials) =
            density::densest(&outlines, &Constraints::default(), &settings, &Progress::new()).expect("charts fit");
        assert!(trials.attempts <= attempts, "{} attempts for {count} charts", trials.attempts);
        assert!(trials.placements <= placements, "{} placements for {count} charts", trials.placements);
        assert!(trials.attempts > 0 && trials.placements > 0, "charts are searched and refined");
    }
    let outline = Outline::new(&items(&mixture(1, 1))[0], 0).expect("valid");
    let (_, trials) =
        density::densest(&[outline], &Constraints::default(), &square(1024, 2.0), &Progress::new()).expect("fits");
    assert_eq!(trials, density::Trials::default(), "a chart alone needs no search");
}

#[test]
fn a_strip_alone_lies_on_the_diagonal() {
    let settings = PackSettings { rotation: Rotation::Any, ..square(256, 2.0) };
    let charts = vec![rectangle(100.0, 0.5)];
    let any = packed(&charts, &settings);
    check(&charts, &settings, &any);
    assert!(any.texels_per_unit > 1.35 * 256.0 / 100.0, "density {}", any.texels_per_unit);
    for rotation in [Rotation::None, Rotation::Aligned] {
        let along = packed(&charts, &PackSettings { rotation, ..settings.clone() });
        assert!((along.texels_per_unit - 2.54).abs() < 0.02, "density {}", along.texels_per_unit);
    }
}

#[test]
fn specks_grow_to_a_texel() {
    let mut charts = vec![rectangle(10.0, 10.0), annulus(6.0, 5.0, 30)];
    charts.extend((0..1500).map(|k| turned(regular(3, 1e-4), f64::from(k), [f64::from(k), 0.0])));
    let settings = square(512, 1.0);
    let packed = packed(&charts, &settings);
    check(&charts, &settings, &packed);
    assert_eq!(packed.specks, 1500);
    for (k, chart) in charts.iter().enumerate().skip(2) {
        for t in final_triangles(&packed, k, chart) {
            let area = (t[1] - t[0]).perp(&(t[2] - t[0]));
            assert!(area.abs() > 0.3, "corners of chart {k} stay apart");
        }
    }
    let without = self::packed(&charts[..2], &settings);
    assert!(packed.efficiency > 0.9 * without.efficiency, "{} of {}", packed.efficiency, without.efficiency);
}

#[test]
fn any_unit_of_length() {
    let charts = mixture(15, 4);
    let settings = square(256, 2.0);
    let efficiency = packed(&charts, &settings).efficiency;
    for unit in [1e-140, 1e-6, 1e5, 1e140] {
        let scaled: Vec<Chart> =
            charts.iter().map(|(p, t)| (p.iter().map(|p| p * unit).collect(), t.clone())).collect();
        let packed = packed(&scaled, &settings);
        check(&scaled, &settings, &packed);
        assert!((packed.efficiency - efficiency).abs() < 0.05, "{} for {unit}", packed.efficiency);
    }
}

#[test]
fn nothing_points_and_wires_are_packed() {
    let settings = square(64, 2.0);
    assert_eq!(packed(&[], &settings).efficiency, 0.0);
    let at = |x: f64| Point2::new(x, 1.0);
    let empty: Chart = (vec![at(0.0)], vec![]);
    let point: Chart = (vec![at(2.0)], vec![[0, 0, 0]]);
    let wire: Chart = (vec![at(0.0), at(3.0), at(5.0)], vec![[0, 1, 2]]);
    for charts in [
        vec![empty.clone()],
        vec![point.clone(); 5],
        vec![wire.clone()],
        vec![wire.clone(), wire.clone(), point.clone()],
        vec![empty, point, wire, regular(5, 1.0)],
    ] {
        let normal = PackSettings { quality: Quality::Normal, ..settings.clone() };
        assert_eq!(packed(&charts, &normal).poses.len(), charts.len());
        let packed = packed(&charts, &settings);
        let real: Vec<usize> = (0..charts.len()).filter(|&k| !charts[k].1.is_empty()).collect();
        for &k in &real {
            for p in final_triangles(&packed, k, &charts[k]).iter().flatten() {
                assert!((1.0..=63.0).contains(&p.x) && (1.0..=63.0).contains(&p.y));
            }
        }
        assert!(
            packed.poses.len() == charts.len() && packed.poses.iter().all(|p| p.scale.is_finite() && p.scale > 0.0)
        );
    }
}

#[test]
fn errors_say_what_to_do() {
    let charts = mixture(30, 1);
    let fails =
        |settings: PackSettings| pack(&items(&charts), &settings, &Progress::new()).expect_err("cannot be packed");
    assert_eq!(fails(PackSettings { width: 0, ..square(64, 1.0) }), PackError::TextureSize { width: 0, height: 64 });
    assert!(matches!(fails(square(PackSettings::LARGEST_SIZE + 1, 1.0)), PackError::TextureSize { .. }));
    for margin in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(fails(square(64, margin)), PackError::Margin { .. }));
    }
    assert!(matches!(fails(square(64, 63.5)), PackError::MarginTooLarge { width: 64, .. }));
    let full = fails(square(64, 30.0));
    assert!(matches!(full, PackError::TooManyCharts { charts: 30, .. }));
    assert!(full.to_string().contains("smaller margin or a larger texture"), "{full}");
    let points = [Point2::new(f64::INFINITY, 0.0), Point2::origin(), Point2::new(0.0, 1.0)];
    let bad = PackItem { points: &points, triangles: &[[0, 1, 2]] };
    assert_eq!(pack(&[bad], &square(64, 1.0), &Progress::new()), Err(PackError::NotFinite { item: 0, triangle: 0 }));
}

#[test]
fn stops_when_cancelled() {
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(
        pack(&items(&mixture(9, 1)), &square(64, 1.0), &progress),
        Err(PackError::Cancelled(Cancelled::OnRequest))
    );
}

#[test]
fn one_chart_of_many_triangles() {
    // 80,000 triangles; only the boundary is rasterised, a few hundred edges.
    let n = 200u32;
    let points: Vec<_> = (0..=n).flat_map(|y| (0..=n).map(move |x| Point2::new(f64::from(x), f64::from(y)))).collect();
    let corner = |x: u32, y: u32| y * (n + 1) + x;
    let triangles: Vec<_> = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let outline = Outline::new(&PackItem { points: &points, triangles: &triangles }, 0).expect("valid");
    assert_eq!(outline.edges.len() as u32, 4 * n);
    let packed = packed(&[(points, triangles)], &square(1024, 4.0));
    assert!(packed.efficiency > 0.98);
}

#[test]
fn high_quality_is_no_worse() {
    let charts = mixture(24, 6);
    let fast = packed(&charts, &square(256, 2.0));
    let settings = PackSettings { quality: Quality::High, ..square(256, 2.0) };
    let high = packed(&charts, &settings);
    check(&charts, &settings, &high);
    assert!(high.efficiency >= fast.efficiency - 0.005, "{} after {}", high.efficiency, fast.efficiency);
}
