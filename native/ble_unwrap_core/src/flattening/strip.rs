//! A thin ring laid out as a straight strip.

use nalgebra::Point2;

use crate::charts::Patch;
use crate::distortion::RestTriangle;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::stretch;

use super::flat::{Flat, Positions, l2};

/// A border that turns by at least so many degrees at a vertex has a corner there: the frame of a picture is no ring.
const CORNER: f64 = 50.0;
/// The shorter border of a thin ring is at least so many times as long as the other: the rim of a hoop, not a washer.
const THIN: f64 = 0.75;

/// A thin ring that was cut open from one of its borders to the other as a rectangle: the rim of a cup, the side of a coin. Its borders and
/// the two sides of the cut become straight. Where it is made of quads, these keep their order, and of what lies across from each other before lies so after;
/// else points on the borders keep their distances but for a factor. `ring` is the patch before the cut.
/// The length of the borders comes with it. `None` for what is no thin ring, for a ring with corners, whose sides are straight as
/// they are, and where a vertex lies between the borders.
pub(crate) fn strip(ring: &Patch, open: &Patch) -> Option<(Flat, f64)> {
    let mesh = &open.mesh;
    let loops = mesh.boundary_loops();
    if loops.len() != 1 || loops.group(0).len() != mesh.vertex_count() {
        return None;
    }
    // A cut keeps the numbers of faces, and so those of half-edges.
    let is_cut = |h: HalfedgeId| !ring.mesh.is_boundary(h);
    let mut outline = loops.group(0).to_vec();
    let corner = (0..outline.len())
        .find(|&k| !is_cut(outline[k]) && is_cut(outline[(k + outline.len() - 1) % outline.len()]))?;
    outline.rotate_left(corner);
    let sides: Vec<&[HalfedgeId]> = outline.chunk_by(|a, b| is_cut(*a) == is_cut(*b)).collect();
    let [low, _, high, _] = sides[..] else { return None };
    let length = |side: &[HalfedgeId]| side.iter().map(|&h| mesh.edge_length(h)).sum::<f64>();
    let has_corner = |side: &[HalfedgeId]| {
        let along = |h: HalfedgeId| mesh.position(mesh.to(h)) - mesh.position(mesh.from(h));
        let least = CORNER.to_radians().cos();
        let turns = |(k, &h): (usize, &HalfedgeId)| {
            let (before, after) = (along(side[(k + side.len() - 1) % side.len()]), along(h));
            before.dot(&after) <= least * before.norm() * after.norm()
        };
        side.iter().enumerate().any(turns)
    };
    if has_corner(low) || has_corner(high) {
        return None;
    }
    let borders = [length(low), length(high)];
    let along = borders[0] + borders[1];
    let long = 0.5 * along;
    if borders[0].min(borders[1]) < THIN * borders[0].max(borders[1]) {
        return None;
    }
    let uv = match stretch::rectangle(mesh, &open.polygon) {
        Some(found) => found.uv,
        None => by_distance(mesh, &sides, [long, open.area() / long])?,
    };
    let l2 = l2(open, &RestTriangle::of_mesh(mesh), &uv);
    Some((Flat { uv, l2 }, along))
}

/// A map to a rectangle whose sides are those of the border, with points on each at distances as on the surface, but for a factor; `None` where that turns a
/// face over.
fn by_distance(mesh: &TriMesh, sides: &[&[HalfedgeId]], [long, wide]: [f64; 2]) -> Option<Positions> {
    let length = |side: &[HalfedgeId]| side.iter().map(|&h| mesh.edge_length(h)).sum::<f64>();
    let corners = [[0.0, 0.0], [long, 0.0], [long, wide], [0.0, wide]].map(Point2::from);
    let mut uv: Positions = vec![Point2::origin(); mesh.vertex_count()];
    for (k, side) in sides.iter().enumerate() {
        let (from, to) = (corners[k], corners[(k + 1) % 4]);
        let (whole, mut gone) = (length(side), 0.0);
        for &h in *side {
            uv[mesh.from(h).index()] = from + (to - from) * (gone / whole);
            gone += mesh.edge_length(h);
        }
    }
    let is_sound = uv.iter().all(|p| p.x.is_finite() && p.y.is_finite()) && stretch::first_flip(mesh, &uv).is_none();
    is_sound.then_some(uv)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::charts;
    use crate::mesh::test_surfaces;

    /// A flat ring of quads between circles of some radii, and the same cut open.
    fn ring(radii: &[f64]) -> [Patch; 2] {
        let profile: Vec<[f64; 2]> = radii.iter().map(|&r| [r, 0.0]).collect();
        let mesh = test_surfaces::turned_wall(24, &profile, false);
        let polygon = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let whole = Patch::whole(Arc::new(mesh), polygon);
        let cut = charts::cut_to_disk(&whole.mesh, |h| whole.mesh.edge_length(h), |h| whole.is_diagonal(h));
        let open = whole.cut(&cut);
        [whole, open]
    }

    #[test]
    fn a_thin_ring_is_a_rectangle_of_its_area() {
        let [whole, open] = ring(&[1.0, 0.9]);
        let (flat, along) = strip(&whole, &open).expect("a strip");
        let (mut low, mut high) = (flat.uv[0], flat.uv[0]);
        for p in &flat.uv {
            (low, high) = (low.inf(p), high.sup(p));
        }
        let [long, wide] = [high.x - low.x, high.y - low.y];
        assert!((long * wide - whole.area()).abs() < 1e-9 && (long / (0.5 * along) - 1.0).abs() < 0.01);
        assert!((along - whole.mesh.boundary_length()).abs() < 1e-9);
        let on_edge = |x: f64, low: f64, high: f64| (x - low).min(high - x).abs() < 1e-9;
        assert!(flat.uv.iter().all(|p| on_edge(p.x, low.x, high.x) || on_edge(p.y, low.y, high.y)));
        assert!(flat.l2 > 1.0 && flat.l2 < 1.02, "{}", flat.l2);
    }

    /// Twice around two wheels: inside, the belt is shorter, and points on both borders must not drift apart along it.
    #[test]
    fn what_lies_across_from_each_other_still_does_on_a_belt() {
        let [whole, _] = ring(&[1.0, 0.9]);
        let stretched = |p: &nalgebra::Point3<f64>| nalgebra::Point3::new(p.x + 5.0 * p.x.signum(), p.y, p.z);
        let positions: Vec<_> = whole.mesh.positions().iter().map(stretched).collect();
        let triangles: Vec<[u32; 3]> = whole.mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let belt = Patch::whole(Arc::new(test_surfaces::mesh(&positions, &triangles)), whole.polygon.clone());
        let cut = charts::cut_to_disk(&belt.mesh, |h| belt.mesh.edge_length(h), |h| belt.is_diagonal(h));
        let open = belt.cut(&cut);
        let (flat, _) = strip(&belt, &open).expect("a strip");
        assert!(flat.l2 < 1.01, "{}", flat.l2);
    }

    #[test]
    fn what_is_wide_or_has_vertices_inside_is_none() {
        let [whole, open] = ring(&[1.0, 0.7]);
        assert!(strip(&whole, &open).is_none(), "wide");
        let [whole, open] = ring(&[1.0, 0.95, 0.9]);
        assert!(strip(&whole, &open).is_none(), "a vertex lies between the borders");
        let [whole, _] = ring(&[1.0, 0.9]);
        assert!(strip(&whole, &whole).is_none(), "not cut");
    }
}
