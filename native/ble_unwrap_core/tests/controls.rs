//! What the settings and marks of the user do to whole atlases.

use ble_unwrap_core::settings::{Holes, LimitOver};
use ble_unwrap_core::{Analysis, Atlas, MeshInput, Progress, Settings, UnwrapError, unwrap};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh, catalogue, many_components, uv_sphere, wrapped_grid};
use rayon::ThreadPoolBuilder;

fn input<'a>(mesh: &'a PolyMesh, flat: &'a FlatPolygons) -> MeshInput<'a> {
    MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    }
}

/// A ball with bumps.
fn blob() -> PolyMesh {
    uv_sphere(40, 26).moved(|[x, y, z]| {
        let radius = 1.0 + 0.25 * (7.0 * x + 1.0).sin() * (8.0 * y).cos() + 0.2 * (9.0 * z).sin();
        [radius * x, radius * y, radius * z]
    })
}

/// The sides between faces of two charts, by their vertices, lower first.
fn borders(flat: &FlatPolygons, atlas: &Atlas) -> Vec<[i32; 2]> {
    let mut sides: Vec<([i32; 2], i32)> = Vec::new();
    for (face, ends) in flat.face_offsets.windows(2).enumerate() {
        let corners = &flat.corner_vertices[ends[0] as usize..ends[1] as usize];
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            sides.push(([a.min(b), a.max(b)], atlas.chart[face]));
        }
    }
    sides.sort_unstable();
    sides.chunk_by(|a, b| a.0 == b.0).filter(|s| s.iter().any(|x| x.1 != s[0].1)).map(|s| s[0].0).collect()
}

#[test]
fn borders_follow_guides_on_small_and_on_large_meshes() {
    // Above 3,000 vertices charts are made on a coarse mesh, to which the guides have to come along.
    for (around, along) in [(36, 18), (120, 60)] {
        let mesh = uv_sphere(around, along);
        let flat = mesh.flat();
        // A circle of latitude a tenth off the equator: a place where no border would be by itself.
        let mut heights: Vec<f64> = mesh.positions.iter().map(|p| p[2]).collect();
        heights.sort_by(f64::total_cmp);
        let level = heights[heights.len() * 55 / 100];
        let on = |v: i32| (mesh.positions[v as usize][2] - level).abs() < 1e-9;
        let mut guides: Vec<[i32; 2]> = Vec::new();
        for ends in flat.face_offsets.windows(2) {
            let corners = &flat.corner_vertices[ends[0] as usize..ends[1] as usize];
            let sides = corners.iter().zip(corners.iter().cycle().skip(1));
            guides.extend(sides.map(|(&a, &b)| [a.min(b), a.max(b)]).filter(|s| s.iter().all(|&v| on(v))));
        }
        guides.sort_unstable();
        guides.dedup();
        assert_eq!(guides.len(), around, "a circle");
        let on_guides = |guided: &[[i32; 2]]| {
            let input = MeshInput { guides: guided, ..input(&mesh, &flat) };
            let atlas = unwrap(&input, &Settings::default(), &Progress::new()).expect("unwraps");
            assert!(atlas.report.charts_over_limit.is_empty() && atlas.report.flips == 0 && atlas.report.overlaps == 0);
            borders(&flat, &atlas).iter().filter(|side| guides.contains(side)).count()
        };
        let (with, without) = (on_guides(&guides), on_guides(&[]));
        assert!(10 * with >= 9 * around, "{with} of {around} sides of the circle are borders");
        assert!(2 * without < with, "without guides it is no place for a border: {without}");
    }
}

/// Everything but the seconds, bit for bit.
fn bytes(atlas: &Atlas) -> (Vec<[u32; 2]>, Vec<i32>, String) {
    let mut report = atlas.report.clone();
    report.seconds.clear();
    (atlas.uv.iter().map(|uv| uv.map(f32::to_bits)).collect(), atlas.chart.clone(), format!("{report:?}"))
}

#[test]
fn a_limit_over_the_atlas_is_spent_on_fewer_charts_and_kept() {
    let (mut before, mut after, mut single) = (0, 0, 0);
    for (mesh, stretch_limit) in [
        (blob(), 1.006),
        (blob(), 1.01),
        (blob(), 1.012),
        (blob(), 1.02),
        (blob(), 1.025),
        (blob(), 1.04),
        (many_components(4), 1.02),
    ] {
        let flat = mesh.flat();
        // What is cut for the sake of the texture is no matter of the limit.
        let charts = Settings { stretch_limit, cover_price: 0.0, ..Settings::default() };
        let all = Settings { limit_over: LimitOver::Atlas, ..charts.clone() };
        let run = |settings, threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| unwrap(&input(&mesh, &flat), settings, &Progress::new())).expect("unwraps")
        };
        let (one, two) = (run(&charts, 2).report, run(&all, 2));
        assert_eq!(bytes(&two), bytes(&run(&all, 1)), "threads change nothing");
        let report = two.report;
        assert_eq!((one.chart_limit, one.atlas_limit), (stretch_limit, None));
        assert_eq!((report.chart_limit, report.atlas_limit), (all.chart_limit(), Some(stretch_limit)));
        assert!(report.charts_over_limit.is_empty() && report.warnings.is_empty(), "{:?}", report.warnings);
        assert!(report.l2 <= stretch_limit && report.l2_worst_chart <= report.chart_limit, "{report:?}");
        assert_eq!((report.flips, report.overlaps), (0, 0));
        before += one.charts;
        after += report.charts;
        single += usize::from(report.l2_worst_chart > stretch_limit);
    }
    // Where charts are mirrored, halves that only the plane keeps apart are joined under either limit, so there is little left to save.
    assert!(after < before, "{before} charts became {after}");
    assert!(single > 0, "no chart has more than the limit: the room was not used");
}

#[test]
fn a_texture_is_filled_for_some_seam_and_for_none_where_that_has_no_price() {
    let (mut better, mut longer) = (0.0, 0.0);
    let meshes: Vec<PolyMesh> =
        catalogue().map(|case| (case.build)()).filter(|mesh| mesh.faces.len() < 20_000).collect();
    for mesh in &meshes {
        let flat = mesh.flat();
        let unwrapped = |cover_price: f64| {
            let settings = Settings { cover_price, ..Settings::default() };
            unwrap(&input(mesh, &flat), &settings, &Progress::new()).map(|atlas| atlas.report)
        };
        let (Ok(whole), Ok(cut)) = (unwrapped(0.0), unwrapped(2.5)) else { continue };
        let folds = cut.rungs.iter().find(|rung| rung.0 == "fold").map_or(0, |rung| rung.1);
        assert!(!whole.rungs.iter().any(|rung| rung.0 == "fold"));
        if folds == 0 {
            // Without any area a length has no unit.
            let seam = |length: f64| if length.is_nan() { None } else { Some(length) };
            assert_eq!((cut.charts, seam(cut.seam_length)), (whole.charts, seam(whole.seam_length)));
            continue;
        }
        assert!(cut.charts > whole.charts && cut.seam_length <= 1.2001 * whole.seam_length, "{cut:?}");
        better += (cut.packing_efficiency / whole.packing_efficiency).ln();
        longer += (cut.seam_length / whole.seam_length).ln();
    }
    assert!(better > 0.2 && better > longer, "{better} {longer}");
}

/// Its rims are strips or rings, by `straighten`.
fn hoop() -> PolyMesh {
    wrapped_grid(48, 4, [true, true], |u, v| {
        let [r, z] = [[0.94, 0.0], [1.0, 0.0], [1.0, 0.3], [0.94, 0.3]][(4.0 * v).round() as usize % 4];
        let (s, c) = (std::f64::consts::TAU * u).sin_cos();
        [r * c, r * s, z]
    })
}

#[test]
fn an_analysis_gives_what_unwrap_gives_whatever_came_before() {
    for mesh in [blob(), uv_sphere(80, 40), hoop()] {
        let flat = mesh.flat();
        let analysis = Analysis::new(&input(&mesh, &flat), &Settings::default(), &Progress::new()).expect("a mesh");
        assert_eq!(analysis.face_count(), mesh.faces.len());
        let limit = |stretch_limit| Settings { stretch_limit, ..Settings::default() };
        let calls = [
            limit(1.1),
            limit(1.02),
            limit(1.1),
            limit(1.3),
            Settings { seed: 3, ..limit(1.05) },
            Settings { limit_over: LimitOver::Atlas, ..limit(1.05) },
            Settings { holes: Holes::Cut, ..limit(1.02) },
            Settings { straighten: 0.0, limit_over: LimitOver::Atlas, ..limit(1.05) },
            Settings { straighten: 0.0, ..limit(1.05) },
            limit(1.05),
        ];
        for settings in &calls {
            let fresh = unwrap(&input(&mesh, &flat), settings, &Progress::new()).expect("unwraps");
            let again = analysis.unwrap(settings, &Progress::new()).expect("unwraps");
            assert!(bytes(&fresh) == bytes(&again), "limit {}", settings.stretch_limit);
        }
        // From several threads at once, and after one that was cancelled.
        let fresh: Vec<_> =
            calls[..4].iter().map(|s| bytes(&analysis.unwrap(s, &Progress::new()).expect("unwraps"))).collect();
        let other = Analysis::new(&input(&mesh, &flat), &Settings::default(), &Progress::new()).expect("a mesh");
        let stopped = Progress::new();
        stopped.cancel();
        assert!(matches!(other.unwrap(&calls[0], &stopped), Err(UnwrapError::Cancelled(_))));
        let run = |s| bytes(&other.unwrap(s, &Progress::new()).expect("unwraps"));
        let run = &run;
        std::thread::scope(|scope| {
            let threads: Vec<_> = calls[..4].iter().map(|s| scope.spawn(move || run(s))).collect();
            for (thread, expected) in threads.into_iter().zip(&fresh) {
                assert!(thread.join().expect("no panic") == *expected);
            }
        });
    }
}

#[test]
fn an_analysis_refuses_what_it_was_not_made_for() {
    let mesh = uv_sphere(12, 8);
    let flat = mesh.flat();
    let mut wrong = input(&mesh, &flat);
    wrong.guides = &[[0, 1], [2, 10_000]];
    let error = Analysis::new(&wrong, &Settings::default(), &Progress::new()).expect_err("no such vertex");
    assert!(error.to_string().contains("guide 1 names vertex 10000"), "{error}");
    let welded = Settings { weld: true, weld_distance: Some(1e-3), ..Settings::default() };
    let analysis = Analysis::new(&input(&mesh, &flat), &welded, &Progress::new()).expect("a mesh");
    let error = analysis.unwrap(&Settings::default(), &Progress::new()).expect_err("not welded");
    assert!(matches!(error, UnwrapError::Setting { name: "weld", .. }), "{error}");
    for weld_distance in [None, Some(2e-3)] {
        let error =
            analysis.unwrap(&Settings { weld_distance, ..welded.clone() }, &Progress::new()).expect_err("other");
        assert!(error.to_string().contains("it must be what it was in the analysis"), "{error}");
    }
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        let options = Settings { weld: true, weld_distance: Some(wrong), ..Settings::default() };
        let error = Analysis::new(&input(&mesh, &flat), &options, &Progress::new()).expect_err("no distance");
        assert!(matches!(error, UnwrapError::Setting { name: "weld_distance", .. }), "{error}");
    }
    assert!(analysis.unwrap(&Settings { stretch_limit: 0.5, ..welded.clone() }, &Progress::new()).is_err());
    assert!(analysis.unwrap(&welded, &Progress::new()).is_ok());
}
