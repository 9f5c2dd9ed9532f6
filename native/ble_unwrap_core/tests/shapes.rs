//! Tubes, horns and balls come out as an artist would cut them: few charts, none of them a sliver.

use std::f64::consts::TAU;

use ble_unwrap_core::{MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{PolyMesh, capped_cylinder, ico_sphere, torus, wrapped_grid};

/// A chart of less than this share of the faces is a sliver on these shapes.
const SLIVER: f64 = 0.02;

/// Number of charts, after checks that none is a sliver and that all are under the limit.
fn charts(mesh: &PolyMesh, name: &str) -> usize {
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        corner_triangles: None,
        seams: &[],
        guides: &[],
    };
    let atlas = unwrap(&input, &Settings::default(), &Progress::new()).expect("unwraps");
    let count = atlas.chart.iter().max().map_or(0, |c| *c as usize + 1);
    let mut faces = vec![0usize; count];
    for &c in &atlas.chart {
        faces[usize::try_from(c).expect("every face has a chart")] += 1;
    }
    let least = faces.iter().min().copied().unwrap_or(0);
    assert!(least as f64 >= SLIVER * atlas.chart.len() as f64, "{name}: a chart of {least} faces in {faces:?}");
    assert!(atlas.report.charts_over_limit.is_empty(), "{name}: over the limit");
    count
}

/// A closed surface around an axis that bends, of this radius by place along it, both ends drawn to a point.
fn horn(along: usize, bend: f64, radius: impl Fn(f64) -> f64) -> PolyMesh {
    wrapped_grid(32, along, [true, false], |u, v| {
        let (angle, turn) = (TAU * u, bend * v);
        let r = radius(v);
        let out = 4.0 + r * angle.cos();
        [out * turn.cos(), out * turn.sin(), r * angle.sin()]
    })
}

#[test]
fn few_charts_and_no_slivers() {
    let shapes: [(&str, PolyMesh, usize); 6] = [
        ("closed tube", capped_cylinder(6.0, 32, 40), 2),
        ("ball", ico_sphere(4), 2),
        ("ring", torus(0.3, 64, 24), 2),
        ("long horn", horn(80, 1.5, |v| 0.6 * (1.0 - v) + 0.02), 2),
        ("bent tube", horn(80, 2.0, |_| 0.5), 2),
        ("capsule", horn(60, 0.8, |v| 0.5 * (1.0 - (2.0 * v - 1.0).powi(8)).max(1e-3).sqrt()), 2),
    ];
    for (name, mesh, most) in shapes {
        let count = charts(&mesh, name);
        assert!(count <= most, "{name}: {count} charts");
    }
}
