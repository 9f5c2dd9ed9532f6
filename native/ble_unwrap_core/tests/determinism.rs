//! The same input gives the same bytes, whatever the number of threads.

use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{PolyMesh, catalogue, many_components, sculpt_like, terrain};
use rayon::ThreadPoolBuilder;

fn unwrapped(mesh: &PolyMesh, settings: &Settings, threads: usize) -> Atlas {
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        corner_triangles: None,
        ..MeshInput::default()
    };
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| unwrap(&input, settings, &Progress::new())).expect("unwraps")
}

/// Everything but the seconds, bit for bit.
fn assert_same(mesh: &PolyMesh, settings: &Settings, threads: &[usize], name: &str) {
    let bits = |a: &Atlas| -> Vec<u32> { a.uv.iter().flatten().map(|x| x.to_bits()).collect() };
    let untimed = |a: &Atlas| {
        let mut report = a.report.clone();
        report.seconds.clear();
        // NaN is not equal to itself.
        format!("{report:?}")
    };
    let first = unwrapped(mesh, settings, 1);
    for &count in threads {
        let other = unwrapped(mesh, settings, count);
        assert!(bits(&first) == bits(&other), "{name}: other UVs with {count} threads");
        assert!(first.chart == other.chart, "{name}: other charts with {count} threads");
        assert_eq!(untimed(&first), untimed(&other), "{name}, {count} threads");
    }
}

#[test]
fn threads_change_nothing() {
    let some = [
        "crumpled grid",
        "nested shells",
        "torus with a hole",
        "plate with five holes",
        "Klein bottle",
        "sheet with two sides",
        "faces listed twice",
        "helix tube",
        "face",
        "small sculpt",
    ];
    let mut found = 0;
    for case in catalogue().filter(|c| some.contains(&c.name)) {
        assert_same(&(case.build)(), &Settings::default(), &[2, 8], case.name);
        found += 1;
    }
    assert_eq!(found, some.len());
}

#[test]
fn threads_change_nothing_of_a_large_sculpt() {
    // By way of the coarse mesh, beside many components that keep other threads busy.
    let mesh = sculpt_like(20_000).joined(&many_components(300).moved(|p| p.map(|x| x + 5.0)));
    assert_same(&mesh, &Settings::default(), &[8], "sculpt of 20,000 faces");
}

#[test]
fn threads_change_nothing_of_the_papers_method() {
    assert_same(&terrain(14, 5), &Settings::paper(), &[2, 8], "terrain, as printed");
}

#[test]
fn the_seed_is_what_differs() {
    let mesh = terrain(14, 5);
    let with = |seed| unwrapped(&mesh, &Settings { seed, ..Settings::paper() }, 2);
    assert!(with(1).uv == with(1).uv);
    assert!(with(1).uv != with(2).uv);
}
