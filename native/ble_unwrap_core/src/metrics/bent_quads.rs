//! Quads that are convex on the surface and not in UV.

use nalgebra::Point3;

use crate::mesh::{MeshInput, is_convex};
use crate::predicates::orientation;

/// The quads of a mesh that are [convex](is_convex) on the surface and bent in UV: neither all four corners turn left nor all
/// four right, by an exact test. By one of its two diagonals such a quad is drawn with a triangle turned over.
///
/// `uv` holds a UV a corner; faces for which `has_uv` does not hold, and those with a UV that is not finite, are left out.
/// Ascending. The arrays of `input` must be those of a mesh. O(n).
#[must_use]
pub(crate) fn bent_quads(input: &MeshInput<'_>, uv: &[[f32; 2]], has_uv: impl Fn(usize) -> bool) -> Vec<usize> {
    let faces = input.face_offsets.windows(2).enumerate();
    let is_bent_quad = |&(face, ends): &(usize, &[i32])| {
        let Ok(first) = usize::try_from(ends[0]) else { return false };
        if ends[1] - ends[0] != 4 || !has_uv(face) {
            return false;
        }
        let corners = [first, first + 1, first + 2, first + 3];
        let position = |c: usize| usize::try_from(input.corner_vertices[c]).map(|v| Point3::from(input.positions[v]));
        let [Ok(a), Ok(b), Ok(c), Ok(d)] = corners.map(position) else { return false };
        is_bent(corners.map(|c| uv[c])) && is_convex([a, b, c, d])
    };
    faces.filter(is_bent_quad).map(|(face, _)| face).collect()
}

/// Whether a finite quad in the plane is not strictly convex. Exact.
fn is_bent(uv: [[f32; 2]; 4]) -> bool {
    if !uv.iter().flatten().all(|x| x.is_finite()) {
        return false;
    }
    let uv = uv.map(|p| p.map(f64::from));
    let turn = |k: usize| orientation(uv[k], uv[(k + 1) % 4], uv[(k + 2) % 4]);
    !((0..4).all(|k| turn(k) > 0.0) || (0..4).all(|k| turn(k) < 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bent_straight_and_mirrored_quads() {
        // A convex quad, one with a straight corner, and a triangle.
        let positions =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.4], [2.0, 1.0, 0.0]];
        let input = MeshInput {
            positions: &positions,
            corner_vertices: &[0, 1, 2, 3, 0, 1, 4, 3, 1, 4, 5],
            face_offsets: &[0, 4, 8, 11],
            ..MeshInput::default()
        };
        let count = |quad: [[f32; 2]; 4]| {
            let mut uv = vec![[0.5; 2]; 11];
            uv[..4].copy_from_slice(&quad);
            let found = bent_quads(&input, &uv, |_| true);
            assert!(found.iter().all(|&face| face == 0), "the straight one and the triangle never: {found:?}");
            found.len()
        };
        let with = |p: [f32; 2]| count([[0.0, 0.0], [0.5, 0.0], p, [0.0, 0.5]]);
        assert_eq!((with([0.5, 0.5]), with([0.250_001, 0.25])), (0, 0));
        assert_eq!((with([0.25, 0.25]), with([0.2, 0.2]), with([0.5, 0.0])), (1, 1, 1));
        assert_eq!(with([f32::NAN, 0.5]), 0);
        assert_eq!(count([[0.0, 0.5], [0.5, 0.5], [0.5, 0.0], [0.0, 0.0]]), 0, "mirrored");
        assert_eq!(count([[0.0, 0.0], [0.5, 0.5], [0.5, 0.0], [0.0, 0.5]]), 1, "a bow tie");
        assert_eq!(bent_quads(&input, &[[0.5; 2]; 11], |face| face > 0), Vec::<usize>::new());
    }
}
