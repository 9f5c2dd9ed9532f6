//! The whole pipeline on every kind of mesh: each result is proven, whatever went in.

use ble_unwrap_core::internals::Layout;
use ble_unwrap_core::settings::Moves;
use ble_unwrap_core::settings::{ChartScale, Holes};
use ble_unwrap_core::standalone::{ChartMeasures, Measures, certify, measure_layout};
use ble_unwrap_core::{Atlas, Certificate, MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh, book, catalogue, fin, grid, ico_sphere, sculpt_like, soup, torus};
use proptest::prelude::*;

fn input<'a>(mesh: &'a PolyMesh, flat: &'a FlatPolygons) -> MeshInput<'a> {
    MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        corner_triangles: None,
        ..MeshInput::default()
    }
}

/// The certificate and the figures of an atlas, from the input alone: nothing of the pipeline's own is
/// believed but its conditioning.
fn judge(input: &MeshInput<'_>, settings: &Settings, atlas: &Atlas) -> Result<(Certificate, Measures), String> {
    let progress = Progress::new();
    let polygons = input.face_offsets.len().saturating_sub(1);
    if atlas.uv.len() != input.corner_vertices.len() || atlas.chart.len() != polygons {
        return Err(format!("{} UVs, {} labels", atlas.uv.len(), atlas.chart.len()));
    }
    let finite = |face: &[i32]| {
        let corners = face[0] as usize..face[1] as usize;
        input.corner_vertices[corners].iter().flat_map(|&v| input.positions[v as usize]).all(f64::is_finite)
    };
    if let Some(p) = (0..polygons).find(|&p| finite(&input.face_offsets[p..p + 2]) != (atlas.chart[p] >= 0)) {
        return Err(format!("face {p} has chart {}", atlas.chart[p]));
    }
    let certificate =
        certify(input, &atlas.uv, &atlas.chart, &atlas.stack, settings, &progress).map_err(|e| e.to_string())?;
    let layout = measure_layout(input, &atlas.uv, Some(&atlas.chart), &atlas.stack, settings, &progress)
        .map_err(|e| e.to_string())?;
    Ok((certificate, layout.measures))
}

/// Whether the report counts the charts that the labels tell apart.
fn counted_as_labelled(atlas: &Atlas) -> Result<(), String> {
    let mut labels: Vec<i32> = atlas.chart.iter().copied().filter(|&c| c >= 0).collect();
    labels.sort_unstable();
    labels.dedup();
    let (told, labels) = (atlas.report.charts, labels.len());
    if told == labels { Ok(()) } else { Err(format!("{told} charts in the report, {labels} by their labels")) }
}

/// Whether an atlas keeps every promise.
fn check(input: &MeshInput<'_>, settings: &Settings, atlas: &Atlas) -> Result<Measures, String> {
    let (certificate, measures) = judge(input, settings, atlas)?;
    if !certificate.is_valid() {
        return Err(format!("{certificate:?}"));
    }
    if certificate.gap_texels < settings.packing.margin_texels {
        return Err(format!("a gap of {} texels", certificate.gap_texels));
    }
    let unlisted = |c: &&ChartMeasures| {
        c.l2 > settings.stretch_limit + 1e-3 && !atlas.report.charts_over_limit.iter().any(|o| o.0 as i32 == c.label)
    };
    if let Some(c) = measures.per_chart.iter().find(unlisted) {
        return Err(format!("chart {} has an L2 of {} and is not listed", c.label, c.l2));
    }
    if let Some(w) = atlas.report.warnings.iter().find(|w| w.contains("proven")) {
        return Err(w.clone());
    }
    let mut labels: Vec<i32> = atlas.chart.iter().copied().filter(|&c| c >= 0).collect();
    labels.sort_unstable();
    labels.dedup();
    if labels != (0..labels.len() as i32).collect::<Vec<_>>() {
        return Err("charts are not numbered from 0".into());
    }
    counted_as_labelled(atlas)?;
    Ok(measures)
}

fn unwrapped(mesh: &PolyMesh, settings: &Settings, name: &str) -> (Atlas, Measures) {
    let flat = mesh.flat();
    let input = input(mesh, &flat);
    let atlas = unwrap(&input, settings, &Progress::new()).unwrap_or_else(|e| panic!("{name}: {e}"));
    match check(&input, settings, &atlas) {
        Ok(measures) => {
            assert_eq!((measures.flips, measures.overlaps, measures.nonfinite_faces), (0, 0, 0), "{name}");
            (atlas, measures)
        }
        Err(broken) => panic!("{name}: {broken}"),
    }
}

#[test]
fn every_kind_of_mesh_gets_a_proven_atlas() {
    for case in catalogue() {
        let (_, measures) = unwrapped(&(case.build)(), &Settings::default(), case.name);
        assert_eq!(measures.uv_degenerate_faces, 0, "{}", case.name);
    }
}

#[test]
fn other_settings_keep_the_same_promises() {
    let some = [
        "crumpled grid",
        "annulus",
        "icosahedron",
        "torus with a hole",
        "projective plane",
        "faces listed twice",
        "spiral ramp",
        "needles",
        "caps",
        "comb",
        "keyhole",
        "checkerboard",
    ];
    let mut wide = Settings { chart_scale: ChartScale::Stretch, holes: Holes::Cut, ..Settings::default() };
    (wide.packing.width, wide.packing.height, wide.packing.margin_texels) = (2048, 256, 3.0);
    let mut large = Settings { moves: Moves::Split, stretch_limit: 1.02, ..Settings::default() };
    (large.packing.width, large.packing.height, large.packing.margin_texels) = (16_384, 16_384, 8.0);
    let mut small = Settings { stretch_limit: 3.0, weld: false, ..Settings::default() };
    (small.packing.width, small.packing.height, small.packing.margin_texels) = (96, 96, 0.5);
    let mut settings = vec![("wide", wide), ("large", large), ("small", small), ("paper", Settings::paper())];
    settings[3].1.stretch.max_iterations = 5;
    for case in catalogue().filter(|c| some.contains(&c.name)) {
        for (name, settings) in &settings {
            unwrapped(&(case.build)(), settings, &format!("{}, {name}", case.name));
        }
    }
}

#[test]
fn pages_of_one_winding_stay_apart() {
    // Glued in pairs, one page of each would lie on its back.
    assert_eq!(unwrapped(&book(7), &Settings::default(), "book").1.charts, 7);
    let wall = fin(6);
    assert_eq!(unwrapped(&wall, &Settings::default(), "fin").1.charts, 2);
    assert_eq!(unwrapped(&wall.flipped(|f| f % 3 == 0), &Settings::default(), "mixed fin").1.flips, 0);
}

#[test]
fn faces_without_area_get_some() {
    // A point, a line, a folded quad, and a face of 200 corners at one place, beside a good face.
    let mut mesh = grid(1, 1, |u, v| [u, v, 0.0]);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([[2.0; 3]; 200]);
    mesh.positions.extend([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [5.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
    mesh.faces.push((first..first + 200).collect());
    mesh.faces.push(vec![first, first + 1, first + 2]);
    mesh.faces.push(vec![first + 200, first + 201, first + 202]);
    mesh.faces.push(vec![first + 200, first + 201, first + 202, first + 203]);
    for weld in [false, true] {
        let (atlas, measures) = unwrapped(&mesh, &Settings { weld, ..Settings::default() }, "no area");
        assert_eq!(measures.unmapped_faces, 0);
        assert!(measures.packing_efficiency > 0.4, "the good face has its room: {:?}", atlas.report);
    }
    let nothing =
        PolyMesh { positions: vec![[7.0; 3]; 5], faces: vec![vec![0, 1, 2], vec![0, 1, 2, 3, 4], vec![1, 1, 1]] };
    unwrapped(&nothing, &Settings::default(), "no area at all");
}

/// The figures of an atlas by a fan of triangles over every face, those without area among them, under the vertex numbers
/// of the input: as a reader sees it that knows nothing of how the mesh was conditioned.
fn fanned(mesh: &PolyMesh, atlas: &Atlas) -> Measures {
    let offsets = mesh.flat().face_offsets;
    let fan = |f: usize| {
        let first = offsets[f] as u32;
        (2..mesh.faces[f].len() as u32).map(move |k| [0, k - 1, k].map(|c| first + c))
    };
    let corners: Vec<[u32; 3]> = (0..mesh.faces.len()).flat_map(fan).collect();
    let vertex: Vec<u32> = mesh.faces.concat();
    let triangles: Vec<[u32; 3]> = corners.iter().map(|t| t.map(|c| vertex[c as usize])).collect();
    Layout::new(&mesh.positions, triangles, corners, atlas.uv.clone(), Vec::new()).measure()
}

#[test]
fn edges_of_no_length_cost_no_chart_and_no_seam() {
    let (s, c) = 0.7_f64.sin_cos();
    for size in [1e-3, 1.0, 1e3] {
        let turned = |[x, y, z]: [f64; 3]| [c * x - s * z, y, s * x + c * z].map(|x| size * x);
        let sheet = grid(6, 6, |u, v| [u, v, 0.3 * u * v]).moved(turned).with_sides_of_no_length(|f| f % 5 == 0);
        // Not quite at one place either, as other programs write them.
        let mut near = sheet.clone();
        near.positions[49..].iter_mut().for_each(|p| p[0] += 5e-8 * size);
        for mesh in [sheet.clone(), sheet.triangulated(), near.clone(), near.triangulated()] {
            for weld in [false, true] {
                let plain = || unwrapped(&mesh, &Settings::default(), "doubled corners").0;
                let atlas = if weld { unwrapped_welded(&mesh).0 } else { plain() };
                let report = &atlas.report;
                assert_eq!((report.charts, report.seam_length), (1, 0.0), "size {size}, welded: {weld}");
                assert!(report.l2 < 1.005, "size {size}, welded: {weld}: {}", report.l2);
                let seen = fanned(&mesh, &atlas);
                assert_eq!((seen.charts, seen.flips, seen.overlaps, seen.unmapped_faces), (1, 0, 0, 0));
                assert_eq!((seen.uv_degenerate_faces, seen.seam_length), (0, 0.0), "size {size}, welded: {weld}");
            }
        }
    }
}

#[test]
fn vertices_that_differ_in_their_last_digits_weld() {
    let sheet = soup(&grid(12, 8, |u, v| [2.0 * u, v, 0.3 * (4.0 * u).sin()]).triangulated());
    let wobble = |k: usize| ((k as f64 * 12.9898).sin() * 43758.5453).fract();
    // At the last place single precision has steps of 6e-5.
    for (size, place, noise) in [(1.0, 0.0, 1e-7), (1e-3, 0.0, 1e-7), (1e3, 0.0, 1e-7), (1.0, 1e3, 2e-5)] {
        let mut mesh = sheet.clone();
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            *p = [0, 1, 2].map(|k| f64::from((size * (p[k] + noise * wobble(3 * i + k)) + place) as f32));
        }
        let (atlas, _) = unwrapped_welded(&mesh);
        assert_eq!((atlas.report.charts, atlas.report.seam_length), (1, 0.0), "size {size} at {place}");
        let exact = Settings { weld: true, weld_distance: Some(0.0), ..Settings::default() };
        let flat = mesh.flat();
        let apart = unwrap(&input(&mesh, &flat), &exact, &Progress::new()).expect("unwraps");
        assert!(apart.report.charts > 1, "size {size} at {place}: a test of nothing");
    }
}

#[test]
fn a_spike_in_a_plane_is_not_projected_away() {
    // The quads at the spike are needles: too thin to tell a normal by, but most of the area.
    let mut mesh = grid(20, 20, |u, v| [u, v, 0.0]);
    mesh.positions[10 * 21 + 10][2] = 50.0;
    let (_, measures) = unwrapped(&mesh, &Settings::default(), "spike");
    assert!(measures.l2_worst_chart < 2.0, "{}", measures.l2_worst_chart);
}

#[test]
fn one_polygon_of_three_hundred_specks() {
    // A sphere so small beside its plate that all its charts are specks of one texel.
    let plate = grid(3, 3, |u, v| [1e6 * u, 1e6 * v, 0.0]);
    let mesh = plate.joined(&ico_sphere(3)).joined(&soup(&ico_sphere(1)).moved(|p| p.map(|x| 1e-9 * x)));
    unwrapped(&mesh, &Settings::default(), "specks");
}

#[test]
fn size_and_place_change_nothing_that_matters() {
    let base = torus(0.35, 24, 12);
    let plain = unwrapped(&base, &Settings::default(), "torus").1;
    let (s, c) = 0.7_f64.sin_cos();
    for size in [1e-18, 1e-3, 1e6, 1e18] {
        let mesh = base.clone().moved(|[x, y, z]| [c * x - s * z, y, s * x + c * z].map(|x| size * x));
        let other = unwrapped(&mesh, &Settings::default(), &format!("torus of size {size}")).1;
        assert_eq!(other.charts, plain.charts, "size {size}");
        assert!((other.l2 - plain.l2).abs() < 1e-2, "size {size}: {} for {}", other.l2, plain.l2);
    }
    let far = base.moved(|p| p.map(|x| x + 1e7));
    assert_eq!(unwrapped(&far, &Settings::default(), "far torus").1.charts, plain.charts);
}

#[test]
fn powers_of_two_change_not_a_bit() {
    let base = sculpt_like(1200);
    let plain = unwrapped(&base, &Settings::default(), "sculpt").0;
    for exponent in [-60, -10, 20, 60] {
        let mesh = base.clone().moved(|p| p.map(|x| x * 2f64.powi(exponent)));
        let other = unwrapped(&mesh, &Settings::default(), "scaled sculpt").0;
        assert!(plain.uv == other.uv && plain.chart == other.chart, "2^{exponent}");
    }
}

#[test]
fn welding_makes_one_chart_of_a_soup() {
    let mesh = soup(&grid(8, 8, |u, v| [u, v, 0.1 * (3.0 * u).sin()]));
    let apart = unwrapped(&mesh, &Settings::default(), "soup").0;
    assert_eq!(apart.report.charts, 64);
    let (joined, _) = unwrapped_welded(&mesh);
    assert_eq!((joined.report.charts, joined.report.seam_length, joined.report.gap_texels > 4.0), (1, 0.0, true));
}

/// As [`unwrapped`], where the caller's own measure cannot know which vertices are one.
fn unwrapped_welded(mesh: &PolyMesh) -> (Atlas, Certificate) {
    let settings = Settings { weld: true, ..Settings::default() };
    let flat = mesh.flat();
    let input = input(mesh, &flat);
    let atlas = unwrap(&input, &settings, &Progress::new()).expect("valid");
    let (certificate, _) = judge(&input, &settings, &atlas).expect("arrays that fit");
    assert!(certificate.is_valid());
    (atlas, certificate)
}

/// Polygons over a handful of vertices, so that every defect there is occurs.
fn crowded_polygons() -> impl Strategy<Value = (Vec<i32>, Vec<i32>)> {
    prop::collection::vec(prop::collection::vec(0i32..10, 3..6), 0..20).prop_map(|faces| {
        let mut offsets = vec![0];
        for f in &faces {
            offsets.push(offsets[offsets.len() - 1] + f.len() as i32);
        }
        (faces.concat(), offsets)
    })
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        40 => (-2i32..3).prop_map(f64::from),
        40 => -1.0f64..1.0,
        4 => -1e-7f64..1e-7,
        1 => prop::sample::select(vec![-0.0, f64::NAN, f64::INFINITY, 1e308, -1e308, 1e-308, 5e-324, 1e30]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, max_shrink_iters: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_arrays_give_a_proven_atlas_or_an_error(
        positions in prop::collection::vec([coordinate(), coordinate(), coordinate()], 10),
        (corner_vertices, face_offsets) in crowded_polygons(),
        wrong in prop::option::weighted(0.1, (0usize..60, -3i32..14)),
        weld in any::<bool>(),
    ) {
        let mut corner_vertices = corner_vertices;
        if let Some((at, vertex)) = wrong && let Some(v) = corner_vertices.get_mut(at) {
            *v = vertex;
        }
        let input = MeshInput {
            positions: &positions, corner_vertices: &corner_vertices, face_offsets: &face_offsets,
            corner_triangles: None, ..MeshInput::default()
        };
        let mut settings = Settings { weld, ..Settings::default() };
        // Small, for speed.
        (settings.packing.width, settings.packing.height, settings.packing.margin_texels) = (512, 512, 2.0);
        match unwrap(&input, &settings, &Progress::new()) {
            Ok(atlas) if weld => {
                prop_assert!(judge(&input, &settings, &atlas).is_ok_and(|(c, _)| c.is_valid()));
                prop_assert_eq!(counted_as_labelled(&atlas), Ok(()));
            }
            Ok(atlas) => {
                if let Err(broken) = check(&input, &settings, &atlas) {
                    prop_assert!(false, "{}", broken);
                }
            }
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
