use super::*;
use crate::embedding::Initial;

/// A mesh of quads.
struct Quads {
    positions: Vec<[f64; 3]>,
    corners: Vec<i32>,
    offsets: Vec<i32>,
}

impl Quads {
    fn grid(columns: usize, rows: usize, place: impl Fn(f64, f64) -> [f64; 3]) -> Self {
        let at = |i: usize, n: usize| i as f64 / n as f64;
        let positions = (0..(columns + 1) * (rows + 1))
            .map(|k| place(at(k % (columns + 1), columns), at(k / (columns + 1), rows)))
            .collect();
        let side = columns as i32 + 1;
        let corners: Vec<i32> = (0..columns * rows)
            .flat_map(|k| {
                let first = (k / columns) as i32 * side + (k % columns) as i32;
                [first, first + 1, first + side + 1, first + side]
            })
            .collect();
        let offsets = (0..=columns * rows).map(|k| 4 * k as i32).collect();
        Self { positions, corners, offsets }
    }

    fn without(mut self, face: usize) -> Self {
        self.corners.drain(4 * face..4 * face + 4);
        self.offsets.pop();
        self
    }

    fn input(&self) -> MeshInput<'_> {
        MeshInput {
            positions: &self.positions,
            corner_vertices: &self.corners,
            face_offsets: &self.offsets,
            ..MeshInput::default()
        }
    }

    fn flatten(&self, settings: &Settings) -> Result<Flattening, FlattenError> {
        flatten(&self.input(), true, settings, &Progress::new())
    }
}

fn hill() -> Quads {
    Quads::grid(14, 14, |x, y| [40.0 * x, 40.0 * y, 12.0 * (-9.0 * ((x - 0.5).powi(2) + (y - 0.5).powi(2))).exp()])
}

fn all_together(model: Model) -> Settings {
    let mut settings = if model == Model::Paper { Settings::paper() } else { Settings::default() };
    settings.embedding.model = model;
    settings.geodesics.landmark_fraction = 1.0;
    settings
}

#[test]
fn a_bent_sheet_comes_out_in_its_own_unit() {
    // A quarter of a cylinder, 30 by 10.
    let radius = 30.0 / std::f64::consts::FRAC_PI_2;
    let sheet = Quads::grid(24, 8, |x, y| {
        let angle = x * std::f64::consts::FRAC_PI_2;
        [radius * angle.cos() + 500.0, radius * angle.sin(), 10.0 * y]
    });
    for settings in [Settings::default(), all_together(Model::Default), all_together(Model::Isomap)] {
        let flat = sheet.flatten(&settings).expect("a patch");
        let reach = |k: usize, uv: &[[f64; 2]]| {
            let all = uv.iter().map(|p| p[k]);
            all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
        };
        for uv in [&flat.embedded, &flat.uv] {
            assert!((reach(0, uv) - 30.0).abs() < 0.1 && (reach(1, uv) - 10.0).abs() < 0.1, "{:?}", flat.report);
        }
        let report = flat.report;
        assert_eq!((report.before.flips, report.after.flips), (0, 0));
        assert!(report.before.l2 < 1.001 && report.after.l2 < 1.001 && report.before.distance_correlation > 0.9999);
        assert_eq!(report.landmarks, if settings == Settings::default() { 48 } else { 25 * 9 });
        assert!(report.boundary_is_simple && report.vertices == 225 && report.triangles == 384);
    }
}

#[test]
fn every_model_ends_without_flips() {
    let hill = hill();
    for (model, flips) in [(Model::Default, 0..1), (Model::Isomap, 0..1), (Model::Paper, 4..390)] {
        let flat = hill.flatten(&all_together(model)).expect("a patch");
        let report = &flat.report;
        assert!(flips.contains(&report.before.flips), "{report:?}");
        assert!(report.after.flips == 0 && report.after.l2 < 1.2 && report.after.l_infinity.is_finite(), "{report:?}");
        assert!(report.after.distance_correlation > 0.98, "{report:?}");
        assert_eq!(report.log_likelihood.is_none(), model == Model::Isomap);
        assert_eq!(report.log_likelihood, report.trace.last().copied());
        assert!(report.trace.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9 * pair[0].abs()), "serial sweeps rise");
    }
}

#[test]
fn minimising_may_be_left_out() {
    let settings = all_together(Model::Paper);
    let flat = flatten(&hill().input(), false, &settings, &Progress::new()).expect("a patch");
    let full = hill().flatten(&settings).expect("a patch");
    assert_eq!(flat.embedded, full.embedded);
    assert_eq!((flat.report.after.flips, flat.report.stretch_iterations), (0, 0));
    assert!(flat.report.after.l2 > full.report.after.l2);
}

#[test]
fn small_patches_of_the_paper_are_embedded_as_a_whole() {
    let landmarks = |settings: &Settings| hill().flatten(settings).expect("a patch").report.landmarks;
    assert_eq!(landmarks(&Settings::paper()), 225);
    assert_eq!(landmarks(&Settings::iso_charts()), 225);
    assert_eq!(landmarks(&Settings { together_max: 224, ..Settings::paper() }), 3);
    assert_eq!(landmarks(&Settings::default()), 48);
}

#[test]
fn threads_and_unused_vertices_do_not_matter() {
    let mut sheet = hill().without(17);
    sheet.positions.push([7.0; 3]);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
        let mut settings = all_together(Model::Default);
        settings.embedding.initial = Initial::Random;
        pool.install(|| sheet.flatten(&settings)).expect("a patch with a hole")
    };
    let (one, other) = (run(1), run(3));
    let bits = |f: &Flattening| -> Vec<u64> { f.uv.iter().chain(&f.embedded).flatten().map(|x| x.to_bits()).collect() };
    assert_eq!(bits(&one), bits(&other));
    assert_eq!(one.report.after, other.report.after);
    assert!(one.uv[225][0].is_nan() && one.uv[..225].iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn what_is_no_patch_is_named() {
    let settings = Settings::default();
    let text = |mesh: &Quads| mesh.flatten(&settings).expect_err("not a patch").to_string();
    let empty = Quads { positions: Vec::new(), corners: Vec::new(), offsets: vec![0] };
    assert_eq!(text(&empty), "the mesh has no faces");
    let mut apart = Quads::grid(2, 1, |x, y| [x, y, 0.0]);
    apart.positions.extend([[9.0, 0.0, 0.0], [9.0, 1.0, 0.0]]);
    apart.corners[4..].copy_from_slice(&[6, 2, 5, 7]);
    assert!(text(&apart).starts_with("the surface comes in 2 pieces, one with face 0 and another with face 1"));
    let mut tube = Quads::grid(6, 1, |x, y| [(6.3 * x).cos(), (6.3 * x).sin(), y]);
    assert!(tube.flatten(&settings).is_ok());
    for c in &mut tube.corners {
        *c = if *c % 7 == 6 { *c - 6 } else { *c };
    }
    let open = tube.flatten(&settings).expect("an open tube is a ring in the plane");
    assert!(open.report.after.flips == 0 && open.report.boundary_is_simple);
    let cube = Quads {
        positions: (0..8).map(|k| [f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)]).collect(),
        corners: vec![0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5],
        offsets: (0..=6).map(|f| 4 * f).collect(),
    };
    assert!(text(&cube).starts_with("the surface is closed;"));
    let mut nan = Quads::grid(2, 1, |x, y| [x, y, 0.0]);
    nan.positions[2][1] = f64::NAN;
    assert!(text(&nan).starts_with("face 1 has a vertex with non-finite coordinates"));
    // A ring of quads whose first and last vertex are glued at one point only.
    let mut pinched = Quads::grid(5, 1, |x, y| [(5.0 * x).cos(), (5.0 * x).sin(), y]);
    pinched.corners[17] = 0;
    assert!(text(&pinched).starts_with("vertex 0 holds together"), "{}", text(&pinched));
    let thread = Quads::grid(3, 1, |x, _| [x, 0.0, 0.0]);
    assert!(text(&thread).starts_with("the surface has no area"));
    let wrong = Settings { stretch_limit: 0.5, ..Settings::default() };
    assert!(matches!(hill().flatten(&wrong), Err(FlattenError::Setting(_))));
    let progress = Progress::new();
    progress.cancel();
    assert!(matches!(flatten(&hill().input(), true, &settings, &progress), Err(FlattenError::Cancelled(_))));
}

#[test]
fn handles_are_named() {
    // A torus without one face.
    let (around, across) = (6, 5);
    let positions = (0..around * across).map(|k| {
        let (a, b) = (f64::from(k % around) * 1.047, f64::from(k / around) * 1.257);
        [(3.0 + b.cos()) * a.cos(), (3.0 + b.cos()) * a.sin(), b.sin()]
    });
    let at = |i: i32, j: i32| i % around + around * (j % across);
    let corners = (0..around * across - 1).flat_map(|k| {
        let (i, j) = (k % around, k / around);
        [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
    });
    let torus = Quads {
        positions: positions.collect(),
        corners: corners.collect(),
        offsets: (0..around * across).map(|f| 4 * f).collect(),
    };
    let error = torus.flatten(&Settings::default()).expect_err("no patch");
    assert!(matches!(error, FlattenError::Handles { genus: 1 }), "{error}");
}
