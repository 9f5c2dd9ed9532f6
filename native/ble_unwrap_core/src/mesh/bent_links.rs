//! Edges that are cut because the surface bends there by so much.

use nalgebra::Vector3;

use super::glue::Link;

/// By how much the cosine of an angle may be off and still be that of the angle asked for: the rounding of single
/// precision, for a box has to be cut at 90°.
const ROUNDING: f64 = 1e-6;

/// Takes the links away across which the normals of the two polygons are at least `angle` degrees apart, and returns
/// them; both in the order they had. `normals` are those of the polygons as they are wound in the mesh, of any length;
/// one of no length is no normal. `polygon(corner)` names the polygon of a side. O(n).
pub(super) fn take(
    links: &mut Vec<Link>,
    normals: &[Vector3<f64>],
    polygon: impl Fn(u32) -> usize,
    angle: f64,
) -> Vec<Link> {
    let least = angle.to_radians().cos() + ROUNDING;
    let is_bent = |link: &Link| {
        let [a, b] = link.sides.map(|side| normals[polygon(side)]);
        let lengths = a.norm() * b.norm();
        lengths > 0.0 && a.dot(&b) <= least * lengths
    };
    let (bent, kept) = std::mem::take(links).into_iter().partition(is_bent);
    *links = kept;
    bent
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ConditionOptions, MeshInput, condition};
    use crate::progress::Progress;

    /// Connected pieces of quads that follow each other around an axis, each turned against the one before by `angle`
    /// degrees, cut from `cut_angle` on.
    fn pieces(angle: f64, cut_angle: Option<f64>, turned_over: &[usize]) -> usize {
        let mut positions = Vec::new();
        let (mut at, mut direction) = ([0.0, 0.0], 0.0f64);
        for _ in 0..=4 {
            positions.extend([0.0, 1.0].map(|z| [at[0], at[1], z]));
            at = [at[0] + direction.cos(), at[1] + direction.sin()];
            direction += angle.to_radians();
        }
        let quad = |k: i32| {
            let corners = [2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1];
            if turned_over.contains(&(k as usize)) { [corners[3], corners[2], corners[1], corners[0]] } else { corners }
        };
        let corners: Vec<i32> = (0..4).flat_map(quad).collect();
        let input = MeshInput {
            positions: &positions,
            corner_vertices: &corners,
            face_offsets: &[0, 4, 8, 12, 16],
            ..MeshInput::default()
        };
        let options = ConditionOptions { cut_angle, ..ConditionOptions::default() };
        let surface = condition(&input, &options, &Progress::new()).expect("a mesh");
        assert!(!turned_over.is_empty() || surface.defects.warnings().is_empty(), "a cut is no defect");
        surface.mesh.components().1
    }

    #[test]
    fn edges_are_cut_from_the_angle_on_whichever_way_faces_are_wound() {
        for turned_over in [&[][..], &[1], &[0, 2, 3]] {
            for angle in [20.0, 60.0, 90.0, 150.0] {
                assert_eq!(pieces(angle, None, turned_over), 1);
                assert_eq!(pieces(angle, Some(angle), turned_over), 4, "{angle}");
                assert_eq!(pieces(angle, Some(angle - 1.0), turned_over), 4);
                assert_eq!(pieces(angle, Some(angle + 1.0), turned_over), 1);
                assert_eq!(pieces(-angle, Some(angle), turned_over), 4, "valleys, too");
            }
        }
    }

    #[test]
    fn what_has_no_normal_is_not_cut_off() {
        let link = |a, b| Link { sides: [a, b], same_direction: false };
        let mut links = vec![link(0, 1), link(1, 2), link(0, 2)];
        let normals = [Vector3::x(), Vector3::zeros(), 9.0 * Vector3::y()];
        assert_eq!(take(&mut links, &normals, |side| side as usize, 45.0), vec![link(0, 2)]);
        assert_eq!(links, vec![link(0, 1), link(1, 2)]);
    }
}
