use nalgebra::Point3;

use super::*;
use crate::mesh::Topology;
use crate::mesh::test_surfaces::{self, cubes, cylinder, grid, plate, sphere, torus};

fn length(mesh: &TriMesh) -> impl Fn(HalfedgeId) -> f64 + '_ {
    |h| mesh.edge_length(h)
}

fn after(mesh: &TriMesh, cuts: &[HalfedgeId]) -> Topology {
    assert!(cuts.is_sorted() && cuts.windows(2).all(|w| w[0] != w[1]), "ascending, each once: {cuts:?}");
    assert!(cuts.iter().all(|&h| !mesh.is_boundary(h) && h < mesh.twin(h)));
    let faces: Vec<_> = mesh.faces().collect();
    let (cut, _) = mesh.submesh(&faces, |h| cuts.binary_search(&h).is_ok());
    cut.check_invariants().expect("a mesh");
    for boundary in cut.boundary_loops().iter() {
        assert!(boundary.len() >= 3, "a boundary that can be laid out: {boundary:?}");
    }
    cut.topology()
}

fn total(mesh: &TriMesh, cuts: &[HalfedgeId]) -> f64 {
    cuts.iter().map(|&h| mesh.edge_length(h)).sum()
}

/// Diagonals of squares that are made of triangles 2i and 2i + 1.
fn diagonals(mesh: &TriMesh) -> impl Fn(HalfedgeId) -> bool + '_ {
    |h| !mesh.is_boundary(h) && mesh.twin(h).face().index() / 2 == h.face().index() / 2
}

fn pillow() -> TriMesh {
    let p = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    test_surfaces::mesh(&p, &[[0, 1, 2], [0, 2, 1]])
}

fn tetrahedron() -> TriMesh {
    let p = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0), Point3::new(0.0, 0.0, 1.0)];
    test_surfaces::mesh(&p, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
}

/// The surface without the faces for which `gone` holds.
fn without(mesh: &TriMesh, gone: impl Fn(FaceId) -> bool) -> TriMesh {
    let faces: Vec<_> = mesh.faces().filter(|&f| !gone(f)).collect();
    mesh.submesh(&faces, |_| false).0
}

/// Closed and open surfaces of genus 0 to 5 and their names.
fn surfaces() -> Vec<(&'static str, TriMesh)> {
    let holed = |mesh: &TriMesh, every: usize| without(mesh, |f| f.index() % every == 3);
    vec![
        ("pillow", pillow()),
        ("tetrahedron", tetrahedron()),
        ("cube", cubes([1, 1, 1], |_| true)),
        ("sphere", sphere(3)),
        ("holed sphere", holed(&sphere(3), 97)),
        ("torus", torus(24, 12, 0.4)),
        ("coarsest torus", torus(3, 3, 0.4)),
        ("holed torus", holed(&torus(24, 12, 0.4), 51)),
        ("double torus", plate(2)),
        ("plate", plate(5)),
        ("holed plate", holed(&plate(5), 41)),
        ("frame of cubes", cubes([5, 5, 5], |c| c.iter().filter(|&&x| x % 4 == 0).count() >= 2)),
        ("cylinder", cylinder(12, 5, 2.0)),
        ("annulus", without(&grid(7, 7, [1.0, 1.0], 0.0), |f| f.index() == 48 || f.index() == 49)),
        ("square", grid(3, 3, [1.0, 1.0], 0.0)),
        ("sieve", without(&grid(20, 20, [1.0, 1.0], 0.0), |f| (f.index() / 2).is_multiple_of(27))),
    ]
}

#[test]
fn every_surface_opens_and_becomes_a_disk() {
    for (name, mesh) in surfaces() {
        let before = mesh.topology();
        let open = cut_open(&mesh, length(&mesh), |_| false);
        assert!(after(&mesh, &open).is_chart(), "{name}: {before:?} {:?}", after(&mesh, &open));
        assert_eq!(open.is_empty(), before.is_chart(), "{name}");
        let disk = cut_to_disk(&mesh, length(&mesh), |_| false);
        assert!(after(&mesh, &disk).is_disk(), "{name}: {before:?} {:?}", after(&mesh, &disk));
        assert_eq!(disk.is_empty(), before.is_disk(), "{name}");
    }
}

#[test]
fn diagonals_of_polygons_are_never_cut() {
    let pairs = ["cube", "torus", "coarsest torus", "double torus", "plate", "frame of cubes", "cylinder", "square"];
    for (name, mesh) in surfaces().iter().filter(|(name, _)| pairs.contains(name)) {
        let diagonal = diagonals(mesh);
        // Make the diagonals tempting.
        let weight = |h| if diagonal(h) { 1e-3 } else { mesh.edge_length(h) };
        for cuts in [cut_open(mesh, weight, &diagonal), cut_to_disk(mesh, weight, &diagonal)] {
            assert!(!cuts.iter().any(|&h| diagonal(h)), "{name}");
        }
        assert!(after(mesh, &cut_to_disk(mesh, weight, &diagonal)).is_disk(), "{name}");
    }
}

#[test]
fn pentagons_stay_whole() {
    // A dodecahedron: fans of three triangles around the first corner of each pentagon.
    let icosahedron = sphere(0);
    let mut positions = Vec::new();
    for f in icosahedron.faces() {
        let p = icosahedron.triangle_positions(f);
        positions.push(Point3::from((p[0].coords + p[1].coords + p[2].coords) / 3.0));
    }
    let mut triangles = Vec::new();
    let mut pentagon = Vec::new();
    for v in icosahedron.vertices() {
        let around: Vec<_> = icosahedron.outgoing(v).map(|h| h.face().index() as u32).collect();
        for k in 1..4 {
            triangles.push([around[0], around[k], around[k + 1]]);
            pentagon.push(v);
        }
    }
    let mesh = test_surfaces::mesh(&positions, &triangles);
    let diagonal = |h: HalfedgeId| pentagon[h.face().index()] == pentagon[mesh.twin(h).face().index()];
    let cuts = cut_to_disk(&mesh, length(&mesh), diagonal);
    assert!(after(&mesh, &cuts).is_disk() && cuts.iter().all(|&h| !diagonal(h)) && cuts.len() >= 2);
}

#[test]
fn cuts_are_short() {
    // A torus: once around the tube, and once around the hole on the inside.
    let mesh = torus(40, 20, 0.3);
    let cuts = cut_open(&mesh, length(&mesh), |_| false);
    let shortest = std::f64::consts::TAU * (0.3 + 0.7);
    assert!(total(&mesh, &cuts) < 1.02 * shortest, "{} {shortest}", total(&mesh, &cuts));
    // A cylinder: straight from end to end.
    let mesh = cylinder(20, 8, 3.0);
    let cuts = cut_to_disk(&mesh, length(&mesh), |_| false);
    assert!((total(&mesh, &cuts) - 3.0).abs() < 1e-9);
    // A torus with a slit: its hole serves as part of the cut, and nothing hangs loose.
    let mesh = without(&torus(40, 20, 0.3), |f| f.index() < 60);
    let cuts = cut_open(&mesh, length(&mesh), |_| false);
    assert!(after(&mesh, &cuts).is_chart() && total(&mesh, &cuts) < 1.02 * shortest);
}

#[test]
fn components_are_cut_one_by_one() {
    let (a, b) = (torus(9, 6, 0.4), sphere(1));
    let mut positions = a.positions().to_vec();
    positions.extend_from_slice(b.positions());
    let n = a.vertex_count() as u32;
    let ids = |m: &TriMesh| m.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect::<Vec<_>>();
    let mut triangles = ids(&a);
    triangles.extend(ids(&b).iter().map(|t| t.map(|v| v + n)));
    let mesh = test_surfaces::mesh(&positions, &triangles);
    let t = after(&mesh, &cut_to_disk(&mesh, length(&mesh), |_| false));
    assert_eq!((t.components, t.loops, t.genus()), (2, 2, 0));
    assert!(cut_open(&TriMesh::default(), |_| 1.0, |_| false).is_empty());
}

#[test]
fn whatever_the_weights_and_however_much_is_forbidden() {
    for (name, mesh) in surfaces() {
        let weights: [fn(HalfedgeId) -> f64; 5] = [
            |_| 0.0,
            |_| f64::NAN,
            |_| -1.0,
            |h| if h.index() % 2 == 0 { f64::INFINITY } else { 1.0 },
            |h| (h.index() * 7919 % 101) as f64 * 1e306,
        ];
        for weight in weights {
            let same = |h: HalfedgeId| weight(if mesh.is_boundary(h) { h } else { h.min(mesh.twin(h)) });
            let cuts = cut_to_disk(&mesh, same, |_| false);
            assert!(after(&mesh, &cuts).is_disk(), "{name}");
            assert!(name != "sphere" || cuts.len() <= 40, "{name}: {}", cuts.len());
            assert!(after(&mesh, &cut_to_disk(&mesh, same, |h| h.index() % 3 == 0)).is_disk(), "{name}");
            assert!(after(&mesh, &cut_to_disk(&mesh, same, |_| true)).is_disk(), "{name}");
        }
    }
}

#[test]
fn darts_reach_the_boundary_and_keep_a_chart() {
    let mesh = grid(20, 20, [1.0, 1.0], 0.0);
    let near = |x: f64, y: f64| {
        let d = |v: &VertexId| (mesh.position(*v) - Point3::new(x, y, 0.0)).norm();
        mesh.vertices().min_by(|a, b| d(a).total_cmp(&d(b))).expect("a vertex")
    };
    let from = near(0.5, 0.3);
    let path = shortest_path_to_boundary(&mesh, from, None, length(&mesh), |_| false).expect("a boundary");
    assert!((total(&mesh, &path) - 0.3).abs() < 1e-9);
    assert_eq!(mesh.from(path[0]), from);
    assert!(path.windows(2).all(|w| mesh.to(w[0]) == mesh.from(w[1])));
    let mut cuts: Vec<_> = path.iter().map(|&h| h.min(mesh.twin(h))).collect();
    cuts.sort_unstable();
    assert!(after(&mesh, &cuts).is_disk());
    // Around what is forbidden, or not at all.
    let low = |h: HalfedgeId| mesh.position(mesh.from(h)).y.min(mesh.position(mesh.to(h)).y) < 0.19;
    let around = shortest_path_to_boundary(&mesh, from, None, length(&mesh), low).expect("the other sides are free");
    assert!((total(&mesh, &around) - 0.5).abs() < 1e-9);
    assert_eq!(shortest_path_to_boundary(&mesh, from, None, length(&mesh), |_| true), None);
    assert_eq!(shortest_path_to_boundary(&mesh, near(0.0, 0.4), None, length(&mesh), |_| true), Some(vec![]));
    let ball = sphere(1);
    let [from, root] = [0, ball.vertex_count() - 1].map(VertexId::new);
    assert_eq!(shortest_path_to_boundary(&ball, from, None, |_| 1.0, |_| false), None);
    let slit = shortest_path_to_boundary(&ball, from, Some(root), |_| 1.0, |_| false).expect("the root");
    assert_eq!((ball.from(slit[0]), slit.last().map(|&h| ball.to(h))), (from, Some(root)));
}
