use super::*;
use crate::geodesics::{DijkstraScratch, WeightedGraph, dijkstra};
use crate::mesh::test_surfaces::{self, cylinder, grid, plate, sphere, torus};

fn from_one(mesh: &TriMesh, source: VertexId) -> Vec<f64> {
    let mut scratch = MarchScratch::default();
    FastMarching::new(mesh).march(&[(source, 0.0)], &mut scratch, &Progress::new()).expect("not cancelled").to_vec()
}

fn along_edges(mesh: &TriMesh, source: VertexId) -> Vec<f64> {
    let mut scratch = DijkstraScratch::default();
    let graph = WeightedGraph::of_mesh(mesh);
    dijkstra(&graph, &[(source.index(), 0.0)], &mut scratch, &Progress::new()).expect("not cancelled").to_vec()
}

/// A number in [0, 1) from two integers.
fn noise(i: u64, j: u64) -> f64 {
    let mut x = (i << 32 | j).wrapping_add(0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (x >> 11) as f64 / (1u64 << 53) as f64
}

/// The mesh with each coordinate of each inner vertex moved by up to `amount` along the given axes.
fn jitter_inside(mesh: &TriMesh, amount: f64, axes: &[usize]) -> TriMesh {
    let mut positions = mesh.positions().to_vec();
    for (i, p) in positions.iter_mut().enumerate() {
        if mesh.is_boundary_vertex(VertexId::new(i)) {
            continue;
        }
        for &axis in axes {
            p[axis] += amount * (2.0 * noise(i as u64, axis as u64) - 1.0);
        }
    }
    let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
    test_surfaces::mesh(&positions, &triangles)
}

/// Greatest relative error against `exact`, over all vertices but the source.
fn worst_error(mesh: &TriMesh, source: VertexId, exact: impl Fn(Point3<f64>, Point3<f64>) -> f64) -> f64 {
    let d = from_one(mesh, source);
    let error = |v: VertexId| {
        let e = exact(mesh.position(source), mesh.position(v));
        (d[v.index()] - e).abs() / e
    };
    mesh.vertices().filter(|&v| v != source).map(error).fold(0.0, f64::max)
}

fn through_space(a: Point3<f64>, b: Point3<f64>) -> f64 {
    (b - a).norm()
}

/// Surfaces of several kinds, some rough, one with long thin triangles.
fn surfaces() -> Vec<TriMesh> {
    vec![
        sphere(3),
        torus(30, 16, 0.4),
        plate(2),
        cylinder(24, 9, 2.0),
        jitter_inside(&grid(20, 15, [1.0, 1.0], 0.5), 0.05, &[2]),
        jitter_inside(&sphere(3), 0.1, &[0, 1, 2]),
        jitter_inside(&torus(60, 6, 0.1), 0.02, &[0, 1, 2]),
    ]
}

#[test]
fn exact_on_a_plane_whatever_the_triangles() {
    for (shear, tolerance) in [(0.0, 1e-12), (0.7, 1e-12), (-1.0, 1e-7), (3.0, 1e-4)] {
        let cell = 1.0 / 40.0;
        let mesh = jitter_inside(&grid(40, 40, [1.0, 1.0], shear), 0.15 * cell / (1.0 + shear * shear), &[0, 1]);
        for source in [0, 5, 800, 1234] {
            let worst = worst_error(&mesh, VertexId::new(source), through_space);
            assert!(worst < tolerance, "shear {shear}, source {source}: {worst}");
        }
    }
}

#[test]
fn nearly_exact_on_thin_triangles_at_a_boundary() {
    // Sheared the other way, corners at the border cannot be unfolded, and paths graze it.
    let mesh = jitter_inside(&grid(40, 40, [1.0, 1.0], -3.0), 0.0004, &[0, 1]);
    for source in [0, 5, 800] {
        let worst = worst_error(&mesh, VertexId::new(source), through_space);
        assert!(worst < 2e-3, "source {source}: {worst}");
    }
}

#[test]
fn exact_on_a_prism() {
    let (m, n, height) = (24, 20, 3.0);
    let mesh = cylinder(m, n, height);
    let side = 2.0 * (std::f64::consts::PI / m as f64).sin();
    let unrolled = |a: Point3<f64>, b: Point3<f64>| {
        let turn = (b.y.atan2(b.x) - a.y.atan2(a.x)).abs() / std::f64::consts::TAU * m as f64;
        (turn.min(m as f64 - turn) * side).hypot(b.z - a.z)
    };
    for source in [0, 7, 250] {
        let worst = worst_error(&mesh, VertexId::new(source), unrolled);
        assert!(worst < 1e-7, "source {source}: {worst}");
    }
}

#[test]
fn first_order_on_a_sphere() {
    // On the half towards the source; beyond it, errors towards the antipode shrink as √h.
    let error = |levels| {
        let (mesh, source) = (sphere(levels), VertexId::new(7));
        let d = from_one(&mesh, source);
        let exact = |v| mesh.position(v).coords.dot(&mesh.position(source).coords).clamp(-1.0, 1.0).acos();
        let near = mesh.vertices().filter(|&v| exact(v) < 1.6);
        near.map(|v| (d[v.index()] - exact(v)).abs()).fold(0.0, f64::max)
    };
    let errors = [2, 3, 4, 5].map(error);
    assert!(errors[3] < 3e-3, "0.3 % of the radius at 10,000 vertices: {errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[1] < 0.6 * pair[0], "halving the edges must nearly halve the error: {errors:?}");
    }
}

#[test]
fn between_the_distance_through_space_and_along_edges() {
    for (i, mesh) in surfaces().iter().enumerate() {
        for source in [0, mesh.vertex_count() / 2] {
            let source = VertexId::new(source);
            let (d, edges) = (from_one(mesh, source), along_edges(mesh, source));
            for v in mesh.vertices() {
                let (d, edges) = (d[v.index()], edges[v.index()]);
                let space = (mesh.position(v) - mesh.position(source)).norm();
                assert!(d >= space && d <= edges * (1.0 + 1e-6), "surface {i}, {v}: {space} {d} {edges}");
            }
        }
    }
}

#[test]
fn nearly_symmetric_and_nearly_a_metric() {
    for (i, mesh) in surfaces().iter().enumerate() {
        // On the plate of unit cubes every edge is as long as the features are large.
        let tolerance = if i == 2 { 0.2 } else { 0.06 };
        let chosen: Vec<_> = (0..12).map(|k| VertexId::new(k * (mesh.vertex_count() - 1) / 11)).collect();
        let rows: Vec<_> = chosen.iter().map(|&s| from_one(mesh, s)).collect();
        let d = |a: usize, b: usize| rows[a][chosen[b].index()];
        for a in 0..12 {
            for b in 0..12 {
                assert!((d(a, b) - d(b, a)).abs() <= tolerance * d(a, b), "surface {i}: {} {}", d(a, b), d(b, a));
                for c in 0..12 {
                    assert!(d(a, c) <= (1.0 + tolerance) * (d(a, b) + d(b, c)), "surface {i}");
                }
            }
        }
    }
}

#[test]
fn several_sources_give_the_nearest_with_its_offset() {
    let mesh = grid(20, 20, [1.0, 1.0], 0.0);
    let sources = [(VertexId::new(0), 0.3), (VertexId::new(440), 0.0), (VertexId::new(99_999), 0.0)];
    let mut scratch = MarchScratch::default();
    let marching = FastMarching::new(&mesh);
    let d = marching.march(&sources, &mut scratch, &Progress::new()).expect("not cancelled").to_vec();
    let [a, b] = [0, 440].map(|s| from_one(&mesh, VertexId::new(s)));
    for v in 0..mesh.vertex_count() {
        let nearest = (a[v] + 0.3).min(b[v]);
        assert!((d[v] - nearest).abs() < 0.02, "v{v}: {} {nearest}", d[v]);
    }
    // The scratch of a larger search serves a smaller one.
    let small = sphere(0);
    let d = FastMarching::new(&small).march(&[(VertexId::new(3), 0.0)], &mut scratch, &Progress::new());
    assert_eq!(d.expect("not cancelled"), from_one(&small, VertexId::new(3)));
}

#[test]
fn what_is_not_connected_is_infinitely_far() {
    let mut positions = grid(2, 2, [1.0, 1.0], 0.0).positions().to_vec();
    let mut triangles: Vec<[u32; 3]> =
        grid(2, 2, [1.0, 1.0], 0.0).triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
    for t in triangles.clone() {
        triangles.push(t.map(|v| v + 9));
    }
    for i in 0..9 {
        positions.push(positions[i] + nalgebra::Vector3::new(0.0, 0.0, 0.1));
    }
    let d = from_one(&test_surfaces::mesh(&positions, &triangles), VertexId::new(0));
    assert!(d[..9].iter().all(|d| d.is_finite()) && d[9..].iter().all(|d| *d == f64::INFINITY));
}

#[test]
fn degenerate_triangles_pass_the_front() {
    // Rows of a grid collapsed onto each other, columns too, and all of it.
    let base = grid(12, 12, [1.0, 1.0], 0.3);
    let triangles: Vec<[u32; 3]> = base.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
    let squash: [fn(Point3<f64>) -> Point3<f64>; 5] = [
        |p| Point3::new(p.x, (p.y * 12.0).round().min(6.0) / 12.0, 0.0),
        |p| Point3::new((p.x * 3.0).floor() / 3.0, p.y, 0.0),
        |p| Point3::new(p.x, 0.0, 0.0),
        |p| Point3::new(p.x, p.y * 1e-14, 0.0),
        |_| Point3::new(0.5, 0.5, 0.5),
    ];
    for (i, squash) in squash.iter().enumerate() {
        let positions: Vec<_> = base.positions().iter().map(|&p| squash(p)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        for source in [0, 80] {
            let source = VertexId::new(source);
            let (d, edges) = (from_one(&mesh, source), along_edges(&mesh, source));
            for v in mesh.vertices() {
                let (d, edges) = (d[v.index()], edges[v.index()]);
                let space = (mesh.position(v) - mesh.position(source)).norm();
                assert!(d >= space && d <= edges * (1.0 + 1e-6) + 1e-15, "case {i}, {v}: {space} {d} {edges}");
            }
        }
    }
}

#[test]
fn infinite_coordinates_do_not_spread() {
    let base = grid(8, 8, [1.0, 1.0], 0.0);
    let triangles: Vec<[u32; 3]> = base.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut positions = base.positions().to_vec();
        positions[40].x = bad;
        let d = from_one(&test_surfaces::mesh(&positions, &triangles), VertexId::new(0));
        assert!(d.iter().all(|d| !d.is_nan()));
        assert!(d.iter().enumerate().all(|(v, d)| v == 40 || *d < 3.0));
    }
}

#[test]
fn cancel_stops_the_march() {
    let mesh = sphere(5);
    let progress = Progress::new();
    progress.cancel();
    let mut scratch = MarchScratch::default();
    assert_eq!(
        FastMarching::new(&mesh).march(&[(VertexId::new(0), 0.0)], &mut scratch, &progress).map(<[f64]>::len),
        Err(Cancelled::OnRequest)
    );
}
