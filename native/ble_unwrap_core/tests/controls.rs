//! What the settings and marks of the user do to whole atlases.

use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh, uv_sphere};

fn input<'a>(mesh: &'a PolyMesh, flat: &'a FlatPolygons) -> MeshInput<'a> {
    MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    }
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
