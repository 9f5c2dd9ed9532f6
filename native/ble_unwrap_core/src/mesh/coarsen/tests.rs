use std::sync::Arc;

use ble_unwrap_fixtures::{self as fixtures, PolyMesh};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::{Coarse, coarsen};
use crate::mesh::measure::{face_areas, face_normals, total_area, triangle_area};
use crate::mesh::test_surfaces::{cylinder, grid, plate, sphere, torus};
use crate::mesh::{ConditionOptions, MeshInput, TriMesh, VertexId, condition};
use crate::progress::{Cancelled, Progress};

fn conditioned(poly: &PolyMesh) -> TriMesh {
    let flat = poly.flat();
    let input = MeshInput {
        positions: &poly.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        corner_triangles: None,
        ..MeshInput::default()
    };
    let surface = condition(&input, &ConditionOptions::default(), &Progress::new()).expect("a valid mesh");
    Arc::unwrap_or_clone(surface.mesh)
}

fn run(mesh: &TriMesh, target: usize) -> Coarse {
    let coarse = coarsen(mesh, target, &Progress::new()).expect("not cancelled");
    check(mesh, &coarse);
    coarse
}

/// Everything [`Coarse`] promises of any mesh.
fn check(mesh: &TriMesh, coarse: &Coarse) {
    coarse.mesh.check_invariants().expect("a manifold");
    let (fine, less) = (mesh.topology(), coarse.mesh.topology());
    assert_eq!((fine.components, fine.loops, fine.euler()), (less.components, less.loops, less.euler()));
    assert_eq!(coarse.vertex.len(), mesh.vertex_count());
    assert_eq!(coarse.source.len(), coarse.mesh.vertex_count());
    assert_eq!(coarse.face.len(), mesh.face_count());
    for (i, &v) in coarse.source.iter().enumerate() {
        assert_eq!(coarse.vertex[v.index()], VertexId::new(i), "a survivor is its own root");
        assert_eq!(coarse.mesh.position(VertexId::new(i)), mesh.position(v));
        assert_eq!(coarse.mesh.is_boundary_vertex(VertexId::new(i)), mesh.is_boundary_vertex(v));
    }
    assert!(coarse.vertex.iter().all(|v| v.index() < coarse.source.len()));
    assert!(coarse.face.iter().all(|f| f.index() < coarse.mesh.face_count()));
    assert!(doubled_edges(&coarse.mesh) <= doubled_edges(mesh));
}

fn doubled_edges(mesh: &TriMesh) -> usize {
    let mut ends: Vec<[VertexId; 2]> = mesh
        .edges()
        .map(|h| {
            let (a, b) = (mesh.from(h), mesh.to(h));
            [a.min(b), a.max(b)]
        })
        .collect();
    ends.sort_unstable();
    ends.windows(2).filter(|w| w[0] == w[1]).count()
}

/// The largest turn between the normals of a fine face and the coarse face it lies on, as a cosine,
/// over the faces that make up all but `spared` of the area.
fn cosine_at(mesh: &TriMesh, coarse: &Coarse, spared: f64) -> f64 {
    let (fine, less) = (face_normals(mesh), face_normals(&coarse.mesh));
    let areas = face_areas(mesh);
    let mut turns: Vec<(f64, f64)> =
        mesh.faces().map(|f| (fine[f.index()].dot(&less[coarse.face[f.index()].index()]), areas[f.index()])).collect();
    turns.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = spared * total_area(mesh);
    for &(cosine, area) in &turns {
        if left <= 0.0 {
            return cosine;
        }
        left -= area;
    }
    1.0
}

#[test]
fn targets_are_reached_and_topology_stays() {
    let cases = [
        ("sphere", sphere(5), 300),
        ("torus", torus(96, 48, 0.4), 300),
        ("cylinder", cylinder(64, 60, 5.0), 250),
        ("annulus", conditioned(&fixtures::annulus(0.4, 80, 20)), 200),
        ("helix tube", conditioned(&fixtures::helix_tube(3.0, 400, 16)), 600),
        ("sculpture", conditioned(&fixtures::sculpt_like(20_000)), 800),
        ("terrain", conditioned(&fixtures::terrain(60, 3)), 400),
        ("spiral", conditioned(&fixtures::spiral_ramp(800, 5.0, 0.4)), 400),
    ];
    for (name, mesh, target) in cases {
        assert!(mesh.vertex_count() > 2 * target, "{name}: {}", mesh.vertex_count());
        let coarse = run(&mesh, target);
        assert_eq!(coarse.mesh.vertex_count(), target, "{name}");
        let area = total_area(&coarse.mesh) / total_area(&mesh);
        assert!((0.9..1.02).contains(&area), "{name}: area {area}");
        let cosine = cosine_at(&mesh, &coarse, 0.05);
        assert!(cosine > 0.7, "{name}: turned to {cosine}");
    }
}

#[test]
fn collapse_ends_at_the_least_mesh_of_the_topology() {
    for holes in 0..4 {
        run(&plate(holes), 0);
    }
    let ball = run(&sphere(4), 0);
    assert!((4..40).contains(&ball.mesh.vertex_count()), "{}", ball.mesh.vertex_count());
    let square = run(&grid(20, 20, [1.0, 1.0], 0.0), 0);
    assert_eq!(square.mesh.face_count(), 1, "half of the square is the least disk");
    assert_eq!(run(&grid(20, 20, [1.0, 1.0], 0.0), 4).mesh.vertex_count(), 4);
    for f in [[0, 1, 2], [1, 2, 0]] {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|p| Point3::from(Vector3::from(p)));
        let single = TriMesh::from_triangles(&points, &[f]).0;
        assert_eq!(run(&single, 0).mesh.face_count(), 1);
    }
    assert_eq!(run(&TriMesh::default(), 5).mesh.face_count(), 0);
}

#[test]
fn nothing_happens_above_the_target() {
    let mesh = torus(20, 10, 0.3);
    let coarse = run(&mesh, mesh.vertex_count());
    assert!(coarse.vertex.iter().copied().eq(mesh.vertices()));
    assert!(coarse.face.iter().copied().eq(mesh.faces()));
    assert_eq!(coarse.mesh.triangles(), mesh.triangles());
}

#[test]
fn a_plane_keeps_its_outline_and_gets_even_triangles() {
    let mesh = conditioned(&fixtures::l_shape(40));
    let coarse = run(&mesh, 120);
    assert_eq!(coarse.mesh.vertex_count(), 120);
    assert!((total_area(&coarse.mesh) - total_area(&mesh)).abs() < 1e-9, "the outline is kept");
    let areas = face_areas(&coarse.mesh);
    let mean = total_area(&mesh) / areas.len() as f64;
    assert!(areas.iter().all(|a| (0.05 * mean..8.0 * mean).contains(a)), "{areas:?}");
    assert!(cosine_at(&mesh, &coarse, 0.0) > 1.0 - 1e-9, "no face turned over");
}

#[test]
fn creases_stay() {
    // A cube of 24² squares a side: what is left must still be the cube.
    let mesh = crate::mesh::test_surfaces::cubes([24; 3], |_| true);
    let coarse = run(&mesh, 100);
    assert!((total_area(&coarse.mesh) - 6.0 * 24.0 * 24.0).abs() < 1e-6);
    assert!(cosine_at(&mesh, &coarse, 0.0) > 1.0 - 1e-9, "faces lie on their own side of the crease");
    let corner = |v: &VertexId| coarse.mesh.position(*v).iter().all(|&x| x == 0.0 || x == 24.0);
    assert_eq!(coarse.mesh.vertices().filter(corner).count(), 8, "all corners");
}

#[test]
fn octants_prolong_to_octants() {
    for (name, mesh, target) in [
        ("sphere", sphere(6), 3000),
        ("torus", torus(256, 128, 0.4), 3000),
        ("sculpture", conditioned(&fixtures::sculpt_like(40_000)), 2500),
    ] {
        let coarse = run(&mesh, target);
        let octant = |m: &TriMesh, f| {
            let p = m.triangle_positions(f);
            let c = p[0].coords + p[1].coords + p[2].coords;
            (0..3).map(|k| u32::from(c[k] > 0.0) << k).sum::<u32>()
        };
        let (mut same, mut all) = (0.0, 0.0);
        let mut label = Vec::new();
        for f in mesh.faces() {
            let area = triangle_area(mesh.triangle_positions(f));
            label.push(octant(&coarse.mesh, coarse.face[f.index()]));
            all += area;
            same += if label[f.index()] == octant(&mesh, f) { area } else { 0.0 };
        }
        assert!(same >= 0.97 * all, "{name}: {}", same / all);
        // The area outside the largest piece of each label that is one piece on the coarse mesh.
        let coarse_label: Vec<u32> = coarse.mesh.faces().map(|f| octant(&coarse.mesh, f)).collect();
        let lost = stray_area(&mesh, &label) - stray_area(&coarse.mesh, &coarse_label);
        assert!(lost < 0.003 * all, "{name}: {lost} of {all} came apart");
    }
}

/// Area that is not in the largest connected piece of its label.
fn stray_area(mesh: &TriMesh, label: &[u32]) -> f64 {
    let (areas, mut seen) = (face_areas(mesh), vec![false; label.len()]);
    let mut largest = [0.0f64; 8];
    for seed in mesh.faces() {
        let mut stack = vec![seed];
        let mut area = 0.0;
        while let Some(f) = stack.pop() {
            if std::mem::replace(&mut seen[f.index()], true) {
                continue;
            }
            area += areas[f.index()];
            let beyond = f.halfedges().map(|h| mesh.twin(h)).into_iter().filter(|t| !t.is_none());
            stack.extend(beyond.map(|t| t.face()).filter(|g| label[g.index()] == label[f.index()]));
        }
        let best = &mut largest[label[seed.index()] as usize];
        *best = best.max(area);
    }
    areas.iter().sum::<f64>() - largest.iter().sum::<f64>()
}

#[test]
fn sides_of_a_thin_sheet_are_not_confused() {
    // A bent plate much thinner than the coarse triangles.
    let sheet = fixtures::voxels([60, 60, 1], |_| true)
        .moved(|[x, y, z]| [x, y, 0.05 * z + 6.0 * (x / 12.0).sin() * (y / 15.0).cos()]);
    let mesh = conditioned(&sheet);
    let coarse = run(&mesh, 500);
    assert!(cosine_at(&mesh, &coarse, 0.02) > 0.3, "{}", cosine_at(&mesh, &coarse, 0.02));
}

#[test]
fn degenerate_meshes_are_coarsened_too() {
    let mut crumpled = fixtures::rectangle(2, 30);
    crumpled.positions.iter_mut().enumerate().for_each(|(i, p)| {
        if i % 3 == 0 {
            *p = [0.25; 3];
        }
    });
    let scaled = |m: PolyMesh, by: [f64; 3]| m.moved(|p| [p[0] * by[0], p[1] * by[1], p[2] * by[2]]);
    let cases = [
        ("one point", scaled(fixtures::ico_sphere(3), [0.0; 3])),
        ("a line", scaled(fixtures::ico_sphere(3), [1.0, 0.0, 0.0])),
        ("folded flat", scaled(fixtures::ico_sphere(3), [1.0, 1.0, 0.0])),
        ("huge", scaled(fixtures::ico_sphere(3), [1e30; 3])),
        ("needles", fixtures::needles(40, 1e-9)),
        ("caps", fixtures::caps(40, 1e-9)),
        ("fan", fixtures::cone(1.0, 500, 4)),
        ("crumpled", crumpled),
    ];
    for (name, poly) in cases {
        // Without welding: coincident vertices are the point here.
        let points: Vec<_> = poly.positions.iter().map(|&p| Point3::from(Vector3::from(p))).collect();
        let mesh = TriMesh::from_triangles(&points, &poly.triangles()).0;
        for target in [mesh.vertex_count() / 3, 0] {
            let coarse = run(&mesh, target);
            assert!(coarse.mesh.vertex_count() < mesh.vertex_count(), "{name}");
        }
    }
}

#[test]
fn results_repeat_and_do_not_depend_on_threads() {
    let mesh = conditioned(&fixtures::sculpt_like(10_000));
    let a = run(&mesh, 700);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let b = pool.install(|| run(&mesh, 700));
    assert_eq!(a.mesh.triangles(), b.mesh.triangles());
    assert_eq!((a.vertex, a.source, a.face), (b.vertex, b.source, b.face));
}

#[test]
fn cancelling_stops_it() {
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(coarsen(&sphere(3), 20, &progress).map(|c| c.source.len()), Err(Cancelled::OnRequest));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_parts_of_surfaces_keep_their_topology(seed in 0u64..1000, kind in 0usize..4, share in 0.3f64..1.0, target in 0usize..80) {
        let whole = [fixtures::genus_plate(3), fixtures::torus(0.4, 16, 8), fixtures::ico_sphere(2), fixtures::disc(9)][kind].clone();
        let part = whole.retained(|f| fixtures::random(seed, f as u64) < share);
        if part.faces.is_empty() {
            return Ok(());
        }
        run(&conditioned(&part), target);
    }
}
