//! Point clouds from input to atlas: shapes with a known answer, bad input, threads, cancelling.

use std::f64::consts::{PI, TAU};

use ble_unwrap_core::settings::NEIGHBOURS;
use ble_unwrap_core::{CloudError, PointAtlas, Progress, Settings, unwrap_points};
use ble_unwrap_fixtures::random;

fn settings() -> Settings {
    let mut settings = Settings::default();
    (settings.packing.width, settings.packing.height) = (512, 512);
    settings
}

/// Unwraps and checks what holds for every cloud.
fn run(positions: &[[f64; 3]]) -> PointAtlas {
    let settings = settings();
    let atlas = unwrap_points(positions, NEIGHBOURS.default, &settings, &Progress::new()).expect("a valid cloud");
    atlas.check_invariants(positions, [512, 512], settings.packing.margin_texels).expect("the promises hold");
    assert_eq!(atlas.report.points, positions.len());
    atlas
}

fn on_square(n: usize, lift: impl Fn(f64, f64) -> [f64; 3]) -> Vec<[f64; 3]> {
    (0..n as u64).map(|i| lift(random(1, i), random(2, i))).collect()
}

fn sphere(n: usize) -> Vec<[f64; 3]> {
    on_square(n, |u, v| {
        let (z, angle) = (2.0 * u - 1.0, TAU * v);
        let r = (1.0 - z * z).sqrt();
        [r * angle.cos(), r * angle.sin(), z]
    })
}

fn swiss_roll(n: usize) -> Vec<[f64; 3]> {
    on_square(n, |u, v| {
        let t = 1.5 * PI * (1.0 + 2.0 * u);
        [t * t.cos(), 21.0 * v, t * t.sin()]
    })
}

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

fn uv_distance(atlas: &PointAtlas, a: usize, b: usize) -> f64 {
    distance(atlas.uv[a].map(f64::from), atlas.uv[b].map(f64::from))
}

#[test]
fn a_flat_cloud_keeps_its_shape_at_any_scale() {
    for scale in [1.0, 1e-20, 1e20] {
        // More points than are charted one by one.
        let positions = on_square(8_000, |u, v| [3.0 * scale * u, scale * (0.6 * v + 5.0), 0.8 * scale * v]);
        let atlas = run(&positions);
        assert_eq!((atlas.report.charts, atlas.report.folded_points, atlas.report.overlaps), (1, 0, 0));
        assert!((atlas.report.l2 - 1.0).abs() < 1e-5, "{}", atlas.report.l2);
        let unit = uv_distance(&atlas, 0, 1) / distance(positions[0], positions[1]);
        for k in 2..500 {
            let ratio = uv_distance(&atlas, 0, k) / distance(positions[0], positions[k]);
            assert!((ratio / unit - 1.0).abs() < 1e-4, "single precision apart: {ratio} {unit}");
        }
    }
}

#[test]
fn a_swiss_roll_unrolls_and_a_sphere_is_cut() {
    for n in [3_000, 9_000] {
        let roll = run(&swiss_roll(n));
        assert_eq!(roll.report.charts, 1, "{:?}", roll.report);
        assert!(roll.report.l2 < 1.01 && roll.report.folded_points == 0, "{:?}", roll.report);
        let ball = run(&sphere(n)).report;
        assert!((2..=4).contains(&ball.charts) && ball.l2_worst_chart <= 1.1, "{ball:?}");
        assert!(ball.charts_over_limit.is_empty() && ball.folded_points + ball.overlaps == 0, "{ball:?}");
    }
}

#[test]
fn few_coincident_and_collinear_points() {
    for n in 1..4 {
        let points: Vec<[f64; 3]> = (0..n).map(|i| [f64::from(i), f64::from(i * i), 0.0]).collect();
        let atlas = run(&points);
        assert!(atlas.report.charts >= 1);
    }
    let one = run(&[[2.0; 3]; 50]);
    assert_eq!((one.report.charts, one.report.duplicate_points), (1, 49));
    assert!(one.uv.iter().all(|uv| *uv == one.uv[0]));
    let line: Vec<[f64; 3]> = (0..300).map(|i| [f64::from(i), 2.0 * f64::from(i), 0.0]).collect();
    assert_eq!(run(&line).report.charts, 1);
    let none = unwrap_points(&[], 12, &settings(), &Progress::new()).expect("nothing to do");
    assert_eq!((none.uv.len(), none.report.charts), (0, 0));
}

#[test]
fn pieces_outliers_and_bad_points() {
    let mut positions = on_square(1_000, |u, v| [u, v, 0.0]);
    positions.extend(on_square(1_000, |u, v| [u + 5.0, v, 0.2 * u * u]));
    positions.push([2.5, 9.0, 3.0]);
    positions.push([f64::NAN, 0.0, 0.0]);
    let atlas = run(&positions);
    assert_eq!((atlas.report.pieces, atlas.report.unmapped_points), (3, 1));
    assert_eq!((atlas.chart[2001], atlas.uv[2001]), (-1, [0.0, 0.0]));
    assert!(atlas.chart[2000] >= 0 && atlas.chart[..2000].iter().all(|&c| c >= 0 && c != atlas.chart[2000]));
    assert_eq!(atlas.report.warnings.len(), 2, "{:?}", atlas.report.warnings);
}

#[test]
fn points_that_are_no_surface_still_get_an_atlas() {
    let volume: Vec<[f64; 3]> = (0..1_500).map(|i| [random(1, i), random(2, i), random(3, i)]).collect();
    let report = run(&volume).report;
    assert!(report.charts > 10 && !report.charts_over_limit.is_empty());
}

#[test]
fn errors_name_the_remedy() {
    let call = |positions: &[[f64; 3]], neighbours, settings: &Settings| {
        unwrap_points(positions, neighbours, settings, &Progress::new()).expect_err("bad input")
    };
    let good = settings();
    assert!(matches!(call(&[[f64::NAN; 3]], 12, &good), CloudError::NoFinitePoint { points: 1 }));
    for neighbours in [0, 3, 257] {
        assert!(matches!(call(&[[0.0; 3]], neighbours, &good), CloudError::Neighbours { .. }));
    }
    let wrong = Settings { stretch_limit: 0.5, ..settings() };
    assert!(matches!(call(&[[0.0; 3]], 12, &wrong), CloudError::Setting(_)));
    let mut narrow = settings();
    narrow.packing.margin_texels = 900.0;
    assert!(matches!(call(&[[0.0; 3]], 12, &narrow), CloudError::Pack(_)));
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let positions = sphere(9_000);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| run(&positions))
    };
    let one = on(1);
    for threads in [2, 8] {
        let other = on(threads);
        assert!(one.uv == other.uv && one.chart == other.chart);
    }
}

#[test]
fn cancelling_stops_and_progress_rises() {
    let positions = swiss_roll(20_000);
    let progress = Progress::new();
    std::thread::scope(|scope| {
        let work = scope.spawn(|| unwrap_points(&positions, 12, &settings(), &progress));
        let mut last = 0.0;
        while progress.fraction() < 0.05 && !work.is_finished() {
            assert!(progress.fraction() >= last);
            last = progress.fraction();
            std::thread::yield_now();
        }
        progress.cancel();
        assert!(matches!(work.join().expect("no panic"), Err(CloudError::Cancelled(_))));
    });
}
