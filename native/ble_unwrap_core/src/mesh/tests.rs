//! Conditioning of the catalogue's meshes and of whatever index arrays can hold.

use super::defects::Defects;
use super::{ConditionOptions, FaceId, HalfedgeId, MeshError, MeshInput, Surface, condition, measure};
use crate::progress::Progress;
use ble_unwrap_fixtures::{
    Case, FlatPolygons, PolyMesh, book, catalogue, cylinder, grid, ico_sphere, keyhole, moebius, regular_polygon,
    sculpt_like, soup, torus,
};
use proptest::prelude::*;

fn run(input: &MeshInput<'_>, weld: bool) -> Result<Surface, MeshError> {
    condition(input, &ConditionOptions { weld, ..ConditionOptions::default() }, &Progress::new())
}

/// Everything [`Surface`] promises, on any input that was accepted.
fn check(input: &MeshInput<'_>, surface: &Surface) -> Result<(), String> {
    let mesh = &surface.mesh;
    mesh.check_invariants()?;
    let vertex = |corner: u32| input.corner_vertices[corner as usize] as usize;
    let point = |corner: u32| surface.representative[vertex(corner)];
    let mut follows = vec![false; input.corner_vertices.len()];
    surface.followers.iter().for_each(|f| follows[f[0] as usize] = true);
    let mut seen = vec![false; input.corner_vertices.len()];
    let mut triangles = vec![0; input.face_offsets.len().saturating_sub(1)];
    for f in mesh.faces() {
        let polygon = surface.polygon[f.index()] as usize;
        let corners = input.face_offsets[polygon] as u32..input.face_offsets[polygon + 1] as u32;
        triangles[polygon] += 1;
        // Nothing but corners that lie on others is between the ends of a side.
        let is_side = |a: u32, b: u32| {
            let after = |c: u32| if c + 1 == corners.end { corners.start } else { c + 1 };
            let leads = |from: u32, to: u32| {
                let mut c = after(from);
                while c != to && follows[c as usize] {
                    c = after(c);
                }
                c == to
            };
            leads(a, b) || leads(b, a)
        };
        for h in f.halfedges() {
            let corner = surface.corner[h.index()];
            if !corners.contains(&corner) {
                return Err(format!("{h} of face {polygon} lies at corner {corner}"));
            }
            seen[corner as usize] = true;
            let (v, p) = (vertex(corner), mesh.position(mesh.from(h)));
            let w = surface.vertex[mesh.from(h).index()] as usize;
            if point(corner) != surface.representative[w] {
                return Err(format!("corner {corner} of vertex {v} became one of vertex {w}"));
            }
            if p.iter().any(|x| !x.is_finite()) {
                return Err(format!("vertex {v} lies at {p}"));
            }
            let twin = mesh.twin(h);
            let same_polygon = !twin.is_none() && surface.polygon[twin.face().index()] as usize == polygon;
            if same_polygon == is_side(corner, surface.corner[h.next().index()]) {
                return Err(format!("{h} of face {polygon}: glued to its own face is {same_polygon}"));
            }
        }
        if f.index() > 0 && surface.polygon[f.index() - 1] as usize > polygon {
            return Err(format!("{f} is out of order"));
        }
    }
    let used: Vec<usize> = (0..seen.len()).filter(|&c| seen[c]).map(|c| vertex(c as u32)).collect();
    let largest = used.iter().flat_map(|&v| input.positions[v]).fold(0.0, |most: f64, x| most.max(x.abs()));
    for (v, &r) in surface.representative.iter().enumerate() {
        // Two groups' reach around a leader, as the documentation derives it.
        let near = |k: usize| (input.positions[v][k] - input.positions[r as usize][k]).abs() <= 4e-6 * largest;
        if r as usize > v || surface.representative[r as usize] != r || v != r as usize && !(0..3).all(near) {
            return Err(format!("vertex {v} became {r}"));
        }
    }
    let mut left_out = vec![0; triangles.len()];
    for &[corner, with] in &surface.followers {
        if seen[corner as usize] || !seen[with as usize] || point(corner) != point(with) {
            return Err(format!("corner {corner} follows {with}"));
        }
        let polygon = input.face_offsets.partition_point(|&offset| offset as u32 <= corner) - 1;
        left_out[polygon] += 1;
    }
    surface.followers.iter().for_each(|f| seen[f[0] as usize] = true);
    for &[polygon, with] in &surface.absorbed {
        if triangles[polygon as usize] > 0 || triangles[with as usize] == 0 {
            return Err(format!("face {polygon} is absorbed by {with}"));
        }
    }
    let mut unmapped = surface.unmapped.iter().peekable();
    for (polygon, pair) in input.face_offsets.windows(2).enumerate() {
        let (begin, end) = (pair[0] as usize, pair[1] as usize);
        let unmapped = unmapped.next_if(|&&p| p as usize == polygon).is_some();
        let absorbed = surface.absorbed.binary_search_by_key(&(polygon as u32), |a| a[0]).is_ok();
        let expected = if unmapped || absorbed { 0 } else { end - begin - left_out[polygon] - 2 };
        if triangles[polygon] != expected || seen[begin..end].contains(&unmapped) {
            return Err(format!("face {polygon} of {} corners has {} triangles", end - begin, triangles[polygon]));
        }
    }
    let places = surface.places();
    let mapped = seen.iter().filter(|seen| **seen).count();
    if places.len() != mapped || places.windows(2).any(|w| w[0].0 >= w[1].0) {
        return Err(format!("{} places of {mapped} corners", places.len()));
    }
    Ok(())
}

fn input<'a>(mesh: &'a PolyMesh, flat: &'a FlatPolygons) -> MeshInput<'a> {
    MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        corner_triangles: None,
        ..MeshInput::default()
    }
}

/// Conditions a mesh and checks every promise.
fn conditioned(mesh: &PolyMesh, name: &str) -> Surface {
    let flat = mesh.flat();
    let input = input(mesh, &flat);
    let surface = run(&input, true).unwrap_or_else(|e| panic!("{name}: {e}"));
    if let Err(broken) = check(&input, &surface) {
        panic!("{name}: {broken}");
    }
    surface
}

fn assert_facts(case: &Case, surface: &Surface, what: &str) {
    let (name, facts, defects) = (case.name, case.facts, &surface.defects);
    let t = surface.mesh.topology();
    assert_eq!(defects.non_manifold_edges.count, facts.nm_edges, "{name}, {what}: non-manifold edges");
    assert_eq!(defects.contradicting_edges.count == 0, facts.orientable, "{name}, {what}: {defects:?}");
    for (found, known, of) in [
        (t.components, facts.components, "components"),
        (t.loops, facts.loops, "loops"),
        (t.genus(), facts.genus, "genus"),
    ] {
        assert_eq!(found, known.unwrap_or(found), "{name}, {what}: {of}");
    }
    if t.faces > 0 && measure::total_area(&surface.mesh) > 0.0 {
        assert!((measure::total_area(&surface.mesh) - 1.0).abs() < 1e-9, "{name}, {what}: not of unit area");
    }
}

#[test]
fn the_catalogue_has_the_topology_it_states() {
    for case in catalogue() {
        assert_facts(case, &conditioned(&(case.build)(), case.name), "as built");
    }
}

#[test]
fn numbering_and_placement_do_not_matter() {
    for case in catalogue() {
        let mesh = (case.build)();
        let plain = conditioned(&mesh, case.name);
        let renumbered = conditioned(&mesh.renumbered(7), case.name);
        assert_facts(case, &renumbered, "renumbered");
        let mesh_is_empty = mesh.faces.is_empty();
        // Tilted, large and far away.
        let (s, c) = 0.7_f64.sin_cos();
        let placed = mesh.moved(|[x, y, z]| [c * x - s * z + 9.0, y - 4.0, s * x + c * z].map(|x| 1e3 * x));
        let placed = conditioned(&placed, case.name);
        assert_facts(case, &placed, "placed");
        for other in [&renumbered, &placed] {
            assert_eq!(other.mesh.face_count(), plain.mesh.face_count(), "{}", case.name);
            assert_eq!(other.defects.duplicate_faces.count, plain.defects.duplicate_faces.count, "{}", case.name);
            assert_eq!(other.defects.bow_tie_vertices.count, plain.defects.bow_tie_vertices.count, "{}", case.name);
        }
        let ratio = if mesh_is_empty { 1.0 } else { 1e3 };
        assert!((placed.scale / plain.scale - ratio).abs() < 1e-3, "{}: scale {}", case.name, placed.scale);
    }
}

#[test]
fn coordinates_of_any_size_are_scaled_to_unit_area() {
    let mesh = torus(0.4, 24, 12);
    for size in [1e-300, 1e-30, 1e30, 1e300] {
        let surface = conditioned(&mesh.clone().moved(|p| p.map(|x| size * x)), "torus");
        assert!((measure::total_area(&surface.mesh) - 1.0).abs() < 1e-12, "size {size}");
        assert!(surface.defects == Defects::default() && surface.scale > size && surface.scale < 10.0 * size);
    }
}

#[test]
fn windings_are_made_to_agree_with_most_of_the_area() {
    let plane = grid(20, 20, |u, v| [u, v, 0.0]);
    let mixed = conditioned(&plane.clone().flipped(|f| f % 3 == 0), "mixed");
    assert_eq!((mixed.defects.reversed_faces.count, mixed.defects.reversed_faces.first), (134, Some(0)));
    assert!(mixed.mesh.faces().all(|f| measure::area_vector(mixed.mesh.triangle_positions(f)).z > 0.0));
    let mostly_down = conditioned(&plane.flipped(|f| f % 3 != 0), "mostly down");
    assert!(mostly_down.mesh.faces().all(|f| measure::area_vector(mostly_down.mesh.triangle_positions(f)).z < 0.0));
    // The corners of a polygon ascend along its winding.
    let is_reversed = |f: FaceId| {
        let [a, b, c] = f.halfedges().map(|h| mostly_down.corner[h.index()]);
        [a < b, b < c, c < a].into_iter().filter(|rises| *rises).count() == 1
    };
    assert!(mostly_down.mesh.faces().all(|f| is_reversed(f) == mostly_down.polygon[f.index()].is_multiple_of(3)));
}

#[test]
fn a_moebius_strip_is_cut_across_and_nowhere_else() {
    let surface = conditioned(&moebius(60, 4), "Moebius");
    assert_eq!(surface.defects.contradicting_edges.count, 4);
    assert!(surface.mesh.topology().is_disk());
}

#[test]
fn an_edge_of_twenty_thousand_faces_is_paired_up() {
    // Every other page wound the other way, so that sides oppose; far too many to compare all pairs.
    let surface = conditioned(&book(20_000).flipped(|f| f % 2 == 1), "thick book");
    assert_eq!(surface.mesh.topology().components, 10_000);
    assert_eq!((surface.defects.non_manifold_edges.count, surface.defects.contradicting_edges.count), (1, 0));
}

#[test]
fn a_keyhole_is_a_disk_whose_bridge_stays_open() {
    let surface = conditioned(&keyhole(), "keyhole");
    assert!(surface.mesh.topology().is_disk());
    assert_eq!((surface.mesh.vertex_count(), surface.defects.repeated_vertices.count), (10, 1));
    assert_eq!(surface.defects.bow_tie_vertices.count, 0);
}

#[test]
fn sides_of_no_length_are_points_of_the_surface() {
    let sheet = grid(6, 6, |u, v| [u, v, 0.3 * u * v]);
    let plain = conditioned(&sheet, "sheet").mesh.topology();
    let doubled = sheet.clone().with_sides_of_no_length(|f| f % 5 == 0);
    for mesh in
        [doubled.clone(), doubled.clone().triangulated(), doubled.renumbered(3), doubled.renumbered(3).triangulated()]
    {
        let flat = mesh.flat();
        for weld in [false, true] {
            let surface = run(&input(&mesh, &flat), weld).expect("valid");
            assert_eq!(check(&input(&mesh, &flat), &surface), Ok(()));
            let t = surface.mesh.topology();
            assert_eq!((t.vertices, t.faces, t.loops), (plain.vertices, plain.faces, 1), "welded: {weld}");
            assert_eq!(surface.defects.edges_of_no_length.count, 8);
            assert_eq!((surface.defects.zero_area_triangles.count, surface.defects.repeated_vertices.count), (0, 0));
        }
    }
    let flat = doubled.flat();
    let warnings = run(&input(&doubled, &flat), false).expect("valid").defects.warnings();
    assert_eq!(warnings, ["8 edges have no length and became a point (first between vertices 0 and 49)."]);
}

#[test]
fn a_vertex_listed_twice_in_a_row_counts_once() {
    let mut mesh = grid(4, 4, |u, v| [u, v, 0.0]);
    let plain = conditioned(&mesh, "sheet").mesh.topology();
    for face in &mut mesh.faces {
        face.insert(1, face[0]);
        face.insert(1, face[0]);
        // Over the end of the list, too.
        face.rotate_left(2);
    }
    assert_eq!(conditioned(&mesh, "stutter").mesh.topology(), plain);
}

#[test]
fn strips_without_width_join_what_they_lie_between() {
    // Two sheets side by side with borders of their own, and quads of no width from one border to the other.
    let mut mesh = grid(4, 8, |u, v| [u, v, 0.0]).joined(&grid(4, 8, |u, v| [u + 1.0, v, 0.0]));
    let whole = conditioned(&mesh, "welded").mesh.topology();
    mesh.faces.extend((0..8).map(|j| vec![5 * j + 4, 5 * j + 45, 5 * j + 50, 5 * j + 9]));
    let flat = mesh.flat();
    let surface = run(&input(&mesh, &flat), false).expect("valid");
    assert_eq!(check(&input(&mesh, &flat), &surface), Ok(()));
    assert_eq!(surface.mesh.topology(), whole);
    assert_eq!(surface.absorbed.len(), 8);
    // Marked as seams, the long sides of the strip stay apart.
    let seams: Vec<[i32; 2]> = (0..8).map(|j| [5 * j + 4, 5 * j + 9]).collect();
    let cut = run(&MeshInput { seams: &seams, ..input(&mesh, &flat) }, false).expect("valid");
    assert_eq!(cut.mesh.topology().components, 2);
}

#[test]
fn what_narrows_to_a_point_comes_apart_there() {
    // An hourglass whose middle ring is one point, and a torus one ring of whose tube is.
    let hourglass = cylinder(2.0, 24, 8).moved(|[x, y, z]| [(z - 1.0) * x, (z - 1.0) * y, z]);
    let t = conditioned(&hourglass, "hourglass").mesh.topology();
    assert_eq!((t.components, t.loops, t.genus(), t.faces), (2, 2, 0, 2 * 24 * 7));
    let pinched = torus(0.3, 24, 12).moved(|p| if p[0] > 0.0 && p[1] == 0.0 { [1.0, 0.0, 0.0] } else { p });
    let t = conditioned(&pinched, "pinched torus").mesh.topology();
    assert_eq!((t.components, t.loops, t.genus()), (1, 0, 0));
}

#[test]
fn short_sides_of_small_parts_and_rounds_of_them_keep_their_shape() {
    // A ball whose sides are shorter than 1e-7 of a plate's diagonal, and a disc with a rim of very many sides.
    let ball = ico_sphere(2);
    let beside = ball.clone().joined(&grid(1, 1, |u, v| [1e8 * u, 1e8 * v, 0.0]));
    assert_eq!(conditioned(&beside, "ball").mesh.topology().genus(), 0);
    assert_eq!(conditioned(&beside, "ball").mesh.face_count(), ball.faces.len() + 2);
    let rim = regular_polygon(20_000, 0.0).moved(|p| p.map(|x| 1e-5 * x)).joined(&grid(1, 1, |u, v| [u, v, 0.0]));
    let surface = conditioned(&rim, "rim");
    let kept = surface.polygon.iter().filter(|&&p| p == 0).count();
    assert!(kept > 100, "{kept} triangles are left of a disc 2e-5 wide");
}

#[test]
fn given_triangles_survive_the_loss_of_a_corner() {
    let mesh = grid(2, 1, |u, v| [u, v, 0.0]).with_sides_of_no_length(|f| f == 0);
    let flat = mesh.flat();
    let given = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [6, 7, 8], [8, 5, 6]];
    let surface = run(&MeshInput { corner_triangles: Some(&given), ..input(&mesh, &flat) }, false).expect("valid");
    let corners: Vec<[u32; 3]> = surface.corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    assert_eq!(corners, [[0, 2, 4], [2, 3, 4], [6, 7, 8], [8, 5, 6]]);
    assert_eq!((surface.followers.as_slice(), surface.defects.replaced_triangulations.count), ([[1, 0]].as_slice(), 0));
    let wrong = [[0, 1, 4], [1, 2, 5]];
    let error =
        run(&MeshInput { corner_triangles: Some(&wrong), ..input(&mesh, &flat) }, false).expect_err("two faces");
    assert_eq!(error, MeshError::TriangleAcrossFaces { triangle: 1, first: 0, second: 1 });
}

#[test]
fn seams_cut_welded_vertices_too() {
    // Two strips whose common border has vertices of either side.
    let left = grid(4, 8, |u, v| [u, v, 0.0]);
    let mesh = left.joined(&grid(4, 8, |u, v| [u + 1.0, v, 0.0]));
    assert_eq!(conditioned(&mesh, "welded").mesh.topology().components, 1);
    let flat = mesh.flat();
    let seams: Vec<[i32; 2]> = (0..8).map(|j| [5 * j + 9, 5 * j + 4]).collect();
    let cut = run(&MeshInput { seams: &seams, ..input(&mesh, &flat) }, true).expect("valid");
    assert_eq!(cut.mesh.topology().components, 2);
    let half = run(&MeshInput { seams: &seams[..4], ..input(&mesh, &flat) }, true).expect("valid");
    let t = half.mesh.topology();
    assert!(t.is_disk() && t.vertices == 2 * 45 - 5, "{t:?}");
    assert_eq!(run(&input(&mesh, &flat), false).expect("valid").mesh.topology().components, 2);
}

#[test]
fn seams_at_welded_vertices_count_for_the_geometric_mean() {
    let left = grid(4, 8, |u, v| [u, v, 0.0]);
    let mesh = left.joined(&grid(4, 8, |u, v| [u + 1.0, v, 0.0]));
    let flat = mesh.flat();
    let weights: Vec<f32> = (0..90).map(|v| if v < 45 { 4.0 } else { 9.0 }).collect();
    for (weld, on_border) in [(true, 6.0), (false, 0.0)] {
        let painted = MeshInput { seam_weights: Some(&weights), ..input(&mesh, &flat) };
        let surface = run(&painted, weld).expect("valid");
        let m = &surface.mesh;
        for v in m.vertices() {
            let input = surface.vertex[v.index()] as usize;
            let is_welded = weld && mesh.positions[input][0] == 1.0;
            let expected = if is_welded { on_border } else { weights[input] };
            assert!((m.seam_weight(v) - expected).abs() < 1e-6, "{} instead of {expected}", m.seam_weight(v));
        }
    }
}

#[test]
fn guides_mark_both_sides_of_edges_and_nothing_else() {
    let left = grid(4, 8, |u, v| [u, v, 0.0]);
    let mesh = left.joined(&grid(4, 8, |u, v| [u + 1.0, v, 0.0]));
    let flat = mesh.flat();
    // Along the welded border by vertices of the left strip, a diagonal of a quad and a pair that is no edge.
    let mut guides: Vec<[i32; 2]> = (0..8).map(|j| [5 * j + 9, 5 * j + 4]).collect();
    guides.extend([[0, 6], [0, 44]]);
    for (weld, sides) in [(true, 2), (false, 1)] {
        let surface = run(&MeshInput { guides: &guides, ..input(&mesh, &flat) }, weld).expect("valid");
        let m = &surface.mesh;
        let marked: Vec<HalfedgeId> = m.halfedges().filter(|&h| m.is_guide(h)).collect();
        assert_eq!(marked.len(), 8 * sides, "welded: {weld}");
        assert!(marked.iter().all(|&h| m.is_boundary(h) != weld && (weld == m.is_guide(m.twin(h)) || !weld)));
        let faces: Vec<FaceId> = m.faces().collect();
        let (part, _) = m.submesh(&faces[8..], |_| false);
        let kept = faces[8..].iter().flat_map(|f| f.halfedges()).filter(|&h| m.is_guide(h)).count();
        assert_eq!(part.halfedges().filter(|&h| part.is_guide(h)).count(), kept, "parts keep the marks");
    }
    assert!(!run(&input(&mesh, &flat), true).expect("valid").mesh.has_guides());
}

#[test]
fn coincident_copies_stay_apart() {
    let sheet = grid(6, 6, |u, v| [u, v, 0.0]);
    for other in [sheet.clone(), sheet.clone().flipped(|_| true)] {
        let t = conditioned(&sheet.clone().joined(&other), "copies").mesh.topology();
        assert_eq!((t.components, t.loops), (2, 2));
    }
    let ball = torus(0.3, 16, 8);
    let t = conditioned(&ball.clone().joined(&ball), "tori").mesh.topology();
    assert_eq!((t.components, t.loops, t.genus()), (2, 0, 2));
}

#[test]
fn given_triangles_are_kept_and_useless_ones_replaced() {
    let mesh = grid(2, 1, |u, v| [u, v, 0.0]);
    let flat = mesh.flat();
    // The second diagonal of the first quad; of the second quad the same half twice.
    let given = [[1, 2, 3], [3, 0, 1], [4, 5, 6], [4, 5, 6]];
    let surface = run(&MeshInput { corner_triangles: Some(&given), ..input(&mesh, &flat) }, true).expect("valid");
    let corners: Vec<[u32; 3]> = surface.corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    assert_eq!(corners, [[1, 2, 3], [3, 0, 1], [4, 5, 6], [4, 6, 7]]);
    assert_eq!(surface.defects.replaced_triangulations.first, Some(1));
    let wrong =
        |given: [[i32; 3]; 1]| run(&MeshInput { corner_triangles: Some(&given), ..input(&mesh, &flat) }, true).err();
    assert_eq!(wrong([[0, 1, 5]]), Some(MeshError::TriangleAcrossFaces { triangle: 0, first: 0, second: 1 }));
    let out = MeshError::TriangleCornerOutOfRange { triangle: 0, corner: 8, corner_count: 8 };
    assert_eq!(wrong([[0, 1, 8]]), Some(out));
}

#[test]
fn faces_with_non_finite_vertices_are_left_out() {
    let mut mesh = torus(0.3, 16, 8);
    mesh.positions[20][1] = f64::NAN;
    let surface = conditioned(&mesh, "torus with a NaN");
    assert_eq!((surface.unmapped.len(), surface.mesh.topology().loops), (4, 1));
    assert_eq!(surface.defects.non_finite_vertices.first, Some(20));
    mesh.positions.iter_mut().for_each(|p| p[0] = f64::INFINITY);
    let flat = mesh.flat();
    let error = run(&input(&mesh, &flat), true).expect_err("no face is finite");
    assert_eq!(error, MeshError::NoFiniteFace { face: 0, vertex: mesh.faces[0][0] as usize });
}

#[test]
fn welding_restores_a_soup_and_cancelling_stops() {
    let mesh = sculpt_like(2500);
    let (whole, restored) = (conditioned(&mesh, "sculpt"), conditioned(&soup(&mesh), "soup"));
    assert_eq!(whole.mesh.topology(), restored.mesh.topology());
    let progress = Progress::new();
    progress.cancel();
    let flat = mesh.flat();
    let stopped = condition(&input(&mesh, &flat), &ConditionOptions::default(), &progress);
    assert!(matches!(stopped, Err(MeshError::Cancelled(_))));
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
            corner_triangles: None, seams: &seams, ..MeshInput::default()
        };
        match run(&input, weld) {
            Ok(surface) => {
                prop_assert_eq!(check(&input, &surface), Ok(()));
                let mesh = &surface.mesh;
                let polygon = |h: HalfedgeId| surface.polygon[h.face().index()];
                let vertex = |h: HalfedgeId| input.corner_vertices[surface.corner[h.index()] as usize];
                for h in mesh.halfedges().filter(|&h| !mesh.is_boundary(h) && polygon(h) != polygon(mesh.twin(h))) {
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
            corner_triangles: triangles.as_deref(), seams: &seams, ..MeshInput::default()
        };
        match run(&input, true) {
            Ok(surface) => prop_assert_eq!(check(&input, &surface), Ok(())),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
