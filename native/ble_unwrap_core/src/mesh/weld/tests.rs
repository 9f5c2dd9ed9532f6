//! Welding of vertices that coincide, nearly coincide, and must not be joined.

use super::*;
use crate::mesh::MeshInput;

/// Representatives of vertices of a mesh of polygons.
fn welded(positions: &[[f64; 3]], faces: &[&[i32]], distance: Option<f64>) -> Vec<u32> {
    let corner_vertices: Vec<i32> = faces.concat();
    let mut face_offsets = vec![0];
    for face in faces {
        face_offsets.push(face_offsets[face_offsets.len() - 1] + face.len() as i32);
    }
    let input =
        MeshInput { positions, corner_vertices: &corner_vertices, face_offsets: &face_offsets, ..MeshInput::default() };
    let polygons = Polygons::new(&input).expect("a mesh");
    let mut used = vec![false; positions.len()];
    corner_vertices.iter().for_each(|&v| used[v as usize] = true);
    let frame = Frame::around(positions, &used);
    let points: Vec<Point3<f64>> = positions.iter().map(|p| frame.place(p)).collect();
    let mapped = vec![true; faces.len()];
    let places =
        Places { polygons: &polygons, mapped: &mapped, positions, used: &used, points: &points, frame: &frame };
    weld(&places, distance, &Progress::new()).expect("not cancelled")
}

/// `cells`² quads of side 1 as a soup, each corner off by up to `noise` along every axis.
fn soup(cells: usize, noise: f64) -> (Vec<[f64; 3]>, Vec<Vec<i32>>) {
    let mut state = 1u64;
    let mut wobble = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        noise * ((state >> 33) as f64 / f64::from(1u32 << 30) - 1.0)
    };
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for i in 0..cells {
        for j in 0..cells {
            faces.push((0..4).map(|k| positions.len() as i32 + k).collect());
            for [x, y] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                positions.push([(i + x) as f64 + wobble(), (j + y) as f64 + wobble(), wobble()]);
            }
        }
    }
    (positions, faces)
}

fn count(representative: &[u32]) -> usize {
    representative.iter().enumerate().filter(|&(v, &r)| v == r as usize).count()
}

fn slices(faces: &[Vec<i32>]) -> Vec<&[i32]> {
    faces.iter().map(Vec::as_slice).collect()
}

#[test]
fn equal_positions_share_their_lowest_vertex() {
    let p = [
        [1.0, 2.0, 3.0],
        [0.0, -0.0, 0.0],
        [1.0, 2.0, 3.0],
        [-0.0, 0.0, 0.0],
        [1.0, 2.0, 3.0 + 1e-15],
        [1.0, 2.0, 3.0],
    ];
    assert_eq!(coincident(&p, &[true; 6]), [0, 1, 0, 1, 4, 0]);
    assert_eq!(coincident(&p, &[false, true, true, true, true, true]), [0, 1, 2, 1, 4, 2]);
    // A distance of 0 takes coincident vertices alone.
    assert_eq!(welded(&p, &[&[0, 1, 2], &[3, 4, 5]], Some(0.0)), [0, 1, 0, 1, 4, 0]);
    // By default the last digit does not count, but between two corners of one polygon.
    assert_eq!(welded(&p, &[&[0, 1, 3], &[2, 5, 1], &[4, 1, 3]], None), [0, 1, 0, 1, 0, 0]);
    assert_eq!(welded(&p, &[&[0, 1, 4], &[2, 3, 5]], None), [0, 1, 0, 1, 4, 0]);
}

#[test]
fn what_single_precision_cannot_tell_apart_is_one_at_any_size_and_place() {
    for size in [1e-30, 1e-3, 1.0, 1e3, 1e30] {
        let (positions, faces) = soup(6, 1e-7);
        let scaled: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| size * x)).collect();
        assert_eq!(count(&welded(&scaled, &slices(&faces), None)), 49, "size {size}");
        assert_eq!(count(&welded(&scaled, &slices(&faces), Some(0.0))), 144, "size {size}");
    }
    // Far away as single precision has them: one step there is 6e-5.
    let (positions, faces) = soup(6, 1e-7);
    let far: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| f64::from((x + 1000.0) as f32))).collect();
    assert_eq!(count(&welded(&far, &slices(&faces), None)), 49);
    // So far that a step is as long as a side: what polygons tell apart stays apart.
    let (positions, faces) = soup(6, 0.0);
    let farther: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| x + 8e6)).collect();
    assert_eq!(count(&welded(&farther, &slices(&faces), None)), 49);
}

#[test]
fn a_distance_is_in_the_unit_of_the_input_and_bounds_a_group_around_its_leader() {
    // A chain of specks 1 apart, each of a polygon of its own: 0 takes 1 and 2, then 3 takes 4 and 5.
    let mut positions: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let mut faces = Vec::new();
    for i in 0..6 {
        let far = 100.0 * f64::from(i + 1);
        positions.extend([[far, 50.0, 0.0], [far, 90.0, 7.0]]);
        faces.push(vec![i, 6 + 2 * i, 7 + 2 * i]);
    }
    assert_eq!(welded(&positions, &slices(&faces), Some(2.25))[..6], [0, 0, 0, 3, 3, 3]);
    assert_eq!(welded(&positions, &slices(&faces), Some(0.75))[..6], [0, 1, 2, 3, 4, 5]);
    // The order of the vertices does not decide: as many groups, of the same places.
    positions[..6].reverse();
    assert_eq!(welded(&positions, &slices(&faces), Some(2.25))[..6], [0, 0, 0, 3, 3, 3]);
}

#[test]
fn no_polygon_is_welded_to_itself() {
    let (positions, faces) = soup(5, 1e-3);
    for distance in [2e-3, 0.5, 1.0, 1e3, 1e300] {
        let r = welded(&positions, &slices(&faces), Some(distance));
        for face in &faces {
            let mut own: Vec<u32> = face.iter().map(|&v| r[v as usize]).collect();
            own.sort_unstable();
            own.dedup();
            assert_eq!(own.len(), 4, "distance {distance}");
        }
    }
    // Opposite corners of a thin quad are nearer than any side is long.
    let kite = [[0.0, 0.0, 0.0], [5.0, 0.01, 0.0], [10.0, 0.0, 0.0], [5.0, -0.01, 0.0]];
    assert_eq!(welded(&kite, &[&[0, 1, 2, 3]], Some(0.5)), [0, 1, 2, 3]);
}

#[test]
fn a_polygon_with_many_corners_in_one_place_keeps_them() {
    // Zigzag: half of the corners within the distance of each other, all of one polygon.
    let n = 3_000;
    let positions: Vec<[f64; 3]> =
        (0..n).map(|i| [f64::from(i % 2), 1e-9 * f64::from(i), 1e-9 * f64::from(i * i % 97)]).collect();
    let comb: Vec<i32> = (0..n).collect();
    assert_eq!(count(&welded(&positions, &[&comb], Some(1e-2))), n as usize);
}
