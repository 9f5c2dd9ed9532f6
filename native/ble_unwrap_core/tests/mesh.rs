//! Conditioning of whatever index arrays can hold.

use ble_unwrap_core::Progress;
use ble_unwrap_core::mesh::{ConditionOptions, MeshError, MeshInput, Surface, condition};
use proptest::prelude::*;

fn run(input: &MeshInput<'_>, weld: bool) -> Result<Surface, MeshError> {
    condition(input, &ConditionOptions { weld }, &Progress::new())
}

/// Everything [`Surface`] promises, on any input that was accepted.
fn check(input: &MeshInput<'_>, surface: &Surface) -> Result<(), String> {
    let mesh = &surface.mesh;
    mesh.check_invariants()?;
    let mut seen = vec![false; input.corner_vertices.len()];
    let mut triangles = vec![0; input.face_offsets.len().saturating_sub(1)];
    for f in mesh.faces() {
        let polygon = surface.polygon[f.index()] as usize;
        let corners = input.face_offsets[polygon] as u32..input.face_offsets[polygon + 1] as u32;
        triangles[polygon] += 1;
        for h in f.halfedges() {
            let corner = surface.corner[h.index()];
            if !corners.contains(&corner) {
                return Err(format!("{h} of face {polygon} lies at corner {corner}"));
            }
            seen[corner as usize] = true;
            let (v, p) = (input.corner_vertices[corner as usize] as usize, mesh.position(mesh.from(h)));
            let w = surface.vertex[mesh.from(h).index()] as usize;
            if input.positions[v] != input.positions[w] {
                return Err(format!("corner {corner} of vertex {v} became one of vertex {w}"));
            }
            if p.iter().any(|x| !x.is_finite()) {
                return Err(format!("vertex {v} lies at {p}"));
            }
            let twin = mesh.twin(h);
            let same_polygon = !twin.is_none() && surface.polygon[twin.face().index()] as usize == polygon;
            if same_polygon != surface.is_diagonal(h) {
                return Err(format!("{h} of face {polygon}: glued to its own face is {same_polygon}"));
            }
        }
        if f.index() > 0 && surface.polygon[f.index() - 1] as usize > polygon {
            return Err(format!("{f} is out of order"));
        }
    }
    let mut left_out = surface.unmapped.iter().peekable();
    for (polygon, pair) in input.face_offsets.windows(2).enumerate() {
        let (begin, end) = (pair[0] as usize, pair[1] as usize);
        let unmapped = left_out.next_if(|&&p| p as usize == polygon).is_some();
        let expected = if unmapped { 0 } else { end - begin - 2 };
        if triangles[polygon] != expected || seen[begin..end].iter().any(|&s| s == unmapped) {
            return Err(format!("face {polygon} of {} corners has {} triangles", end - begin, triangles[polygon]));
        }
    }
    Ok(())
}

/// Polygons over a handful of vertices, so that edges of many faces, repeated vertices, one-sided
/// surfaces and duplicates are the rule.
fn crowded_polygons() -> impl Strategy<Value = (Vec<i32>, Vec<i32>)> {
    prop::collection::vec(prop::collection::vec(0i32..9, 3..8), 0..40).prop_map(|faces| {
        let mut offsets = vec![0];
        for f in &faces {
            offsets.push(offsets[offsets.len() - 1] + f.len() as i32);
        }
        (faces.concat(), offsets)
    })
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        60 => (-2i32..3).prop_map(f64::from),
        20 => -1.0f64..1.0,
        1 => prop::sample::select(vec![-0.0, f64::NAN, f64::INFINITY, 1e308, -1e308, 1e-308, 5e-324, 1e30]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn any_polygons_become_a_manifold(
        positions in prop::collection::vec([coordinate(), coordinate(), coordinate()], 9),
        (corner_vertices, face_offsets) in crowded_polygons(),
        seams in prop::collection::vec([0i32..9, 0i32..9], 0..4),
        weld in any::<bool>(),
    ) {
        let input = MeshInput {
            positions: &positions, corner_vertices: &corner_vertices, face_offsets: &face_offsets,
            corner_triangles: None, seams: &seams,
        };
        match run(&input, weld) {
            Ok(surface) => {
                prop_assert_eq!(check(&input, &surface), Ok(()));
                let mesh = &surface.mesh;
                let vertex = |h: ble_unwrap_core::mesh::HalfedgeId| input.corner_vertices[surface.corner[h.index()] as usize];
                for h in mesh.halfedges().filter(|&h| !mesh.is_boundary(h) && !surface.is_diagonal(h)) {
                    let ends = [vertex(h), vertex(h.next())];
                    prop_assert!(!seams.iter().any(|s| *s == ends || [s[1], s[0]] == ends), "a seam was glued");
                }
            }
            Err(MeshError::NoFiniteFace { vertex, .. }) => {
                prop_assert!(positions[vertex].iter().any(|x| !x.is_finite()));
            }
            Err(other) => prop_assert!(false, "{}", other),
        }
    }

    #[test]
    fn any_arrays_are_accepted_or_named(
        positions in prop::collection::vec([coordinate(), coordinate(), coordinate()], 0..6),
        corner_vertices in prop::collection::vec(-1i32..6, 0..14),
        face_offsets in prop::collection::vec(prop_oneof![8 => 0i32..16, 1 => any::<i32>()], 0..5),
        triangles in prop::option::of(prop::collection::vec([-1i32..14, 0i32..14, 0i32..14], 0..6)),
        seams in prop::collection::vec([-1i32..6, 0i32..7], 0..2),
        tidy in any::<bool>(),
    ) {
        let mut face_offsets = face_offsets;
        if tidy {
            // Mostly meaningful offsets, so that what comes after them is reached.
            face_offsets = (0..=corner_vertices.len() as i32 / 3).map(|i| 3 * i).collect();
            if let Some(last) = face_offsets.last_mut() {
                *last = corner_vertices.len() as i32;
            }
        }
        let input = MeshInput {
            positions: &positions, corner_vertices: &corner_vertices, face_offsets: &face_offsets,
            corner_triangles: triangles.as_deref(), seams: &seams,
        };
        match run(&input, true) {
            Ok(surface) => prop_assert_eq!(check(&input, &surface), Ok(())),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
