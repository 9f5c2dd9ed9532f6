//! Where a surface bulges, and how far from flat that leaves it: told from one linear system, before any map is made.
//!
//! A conformal map into the plane scales lengths by e⁻ᵘ, where −Δu is the Gaussian curvature and u = 0 on a free
//! boundary. Where u peaks there is more surface than its surroundings leave room for, and a cut from there to the boundary
//! gives it room: so M. Ben-Chen, C. Gotsman, G. Bunin place their cones (Conformal flattening by curvature prescription and
//! metric scaling, Eurographics 2008). And the spread of u tells the stretch of that
//! map. The map of least stretch, which need not keep angles, has far less, but more where this has more.

use std::f64::consts::FRAC_PI_6;

use super::StretchError;
use super::doubled_edge::enclosed_vertex;
use super::laplacian::Laplacian;
use crate::distortion::RestTriangle;
use crate::mesh::{TriMesh, VertexId, measure};

/// Peaks below this (in u: two parts in a hundred of length) are no bulge.
const LEAST_PEAK: f64 = 0.02;

/// A vertex of more angle defect is a corner: 30°, a third of a box's. What is rounder has no net worth cutting.
const SHARP_DEFECT: f64 = FRAC_PI_6;

/// How a surface bulges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bulge {
    /// L2 stretch of the conformal map with a free boundary, at its best scale, to first order in the curvature.
    pub l2: f64,
    /// The inner vertex where that map shrinks most; none where it shrinks nowhere, as in planes, rolls and saddles.
    pub tip: Option<VertexId>,
    /// On a closed surface its sharpest vertex, where the map is held in place of a boundary.
    pub root: Option<VertexId>,
    /// A vertex between two edges that join the same two, which no map with straight edges can have inside.
    pub enclosed: Option<VertexId>,
}

/// How a connected surface bulges. `rest` holds the triangle of each face. Not guaranteed: that a map of this stretch does
/// not overlap itself. O(n^1.5).
///
/// # Errors
/// [`StretchError::Solver`] where the system cannot be factored.
pub(crate) fn bulge(mesh: &TriMesh, rest: &[RestTriangle]) -> Result<Bulge, StretchError> {
    let defect = measure::angle_defects(mesh);
    let is_closed = mesh.halfedges().all(|h| !mesh.is_boundary(h));
    let sharpest =
        || mesh.vertices().max_by(|a, b| defect[a.index()].total_cmp(&defect[b.index()]).then_with(|| b.cmp(a)));
    let root = if is_closed { sharpest() } else { None };
    let is_held = |v| mesh.is_boundary_vertex(v) || Some(v) == root;
    let mut u: Vec<f64> = mesh.vertices().map(|v| if is_held(v) { 0.0 } else { 2.0 * defect[v.index()] }).collect();
    Laplacian::new(mesh, rest, is_held)?.solve_in_place(&mut u);

    let peak = mesh.vertices().max_by(|a, b| u[a.index()].total_cmp(&u[b.index()]).then_with(|| b.cmp(a)));
    let (mut surface, mut grown, mut shrunk) = (0.0, 0.0, 0.0);
    for (f, r) in mesh.faces().zip(rest) {
        for v in mesh.triangle(f) {
            let squared = (2.0 * u[v.index()]).exp();
            surface += r.area();
            grown += r.area() * squared;
            shrunk += r.area() / squared;
        }
    }
    Ok(Bulge {
        l2: (grown * shrunk).sqrt() / surface,
        tip: peak.filter(|v| u[v.index()] > LEAST_PEAK),
        root,
        enclosed: enclosed_vertex(mesh),
    })
}

/// The inner vertices of a surface that is flat everywhere else, as of a box, sharpest first; `None` where it is curved at
/// more than so many of them, or bent inwards. O(n).
#[must_use]
pub(crate) fn corners(mesh: &TriMesh, most: usize) -> Option<Vec<VertexId>> {
    let defect = measure::angle_defects(mesh);
    let curved = |v: &VertexId| !mesh.is_boundary_vertex(*v) && defect[v.index()].abs() > measure::FLAT_DEFECT;
    let mut corners: Vec<VertexId> = mesh.vertices().filter(curved).take(most + 1).collect();
    corners.sort_by(|a, b| defect[b.index()].total_cmp(&defect[a.index()]).then_with(|| a.cmp(b)));
    let all_sharp = corners.iter().all(|v| defect[v.index()] > SHARP_DEFECT);
    (corners.len() <= most && all_sharp).then_some(corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::stretch::test_meshes::grid;
    use nalgebra::Point3;

    fn of(mesh: &TriMesh) -> Bulge {
        bulge(mesh, &RestTriangle::of_mesh(mesh)).expect("factored")
    }

    fn relief(height: impl Fn(f64, f64) -> f64) -> (Bulge, Option<(f64, f64)>) {
        let mesh = grid(30, 20, |x, y| Point3::new(x, y, height(x, y)));
        let found = of(&mesh);
        (found, found.tip.map(|v| mesh.positions()[v.index()]).map(|p| (p.x, p.y)))
    }

    #[test]
    fn a_bump_is_found_wherever_it_is_and_a_cone_at_its_tip() {
        let bump = |x0: f64, y0: f64| relief(move |x, y| 6.0 * (-((x - x0).powi(2) + (y - y0).powi(2)) / 12.0).exp());
        for (x0, y0) in [(8.0, 10.0), (20.0, 7.0)] {
            let (found, tip) = bump(x0, y0);
            let (x, y) = tip.expect("a bulge");
            assert!((x - x0).abs() <= 2.0 && (y - y0).abs() <= 2.0, "{x} {y}");
            assert!(found.l2 > 1.01 && found.root.is_none(), "{found:?}");
        }
        let cone = |x: f64, y: f64| -2.0 * ((x - 11.0).powi(2) + (y - 9.0).powi(2)).sqrt();
        assert_eq!(relief(cone).1, Some((11.0, 9.0)));
    }

    #[test]
    fn planes_rolls_and_saddles_do_not_bulge() {
        for found in
            [relief(|_, _| 0.0), relief(|x, _| 3.0 * (0.3 * x).sin()), relief(|x, y| 0.05 * (x - 15.0) * (y - 10.0))]
        {
            assert_eq!(found.1, None);
        }
        assert!(relief(|x, _| 3.0 * (0.3 * x).sin()).0.l2 < 1.0 + 1e-6, "a roll is an isometry");
    }

    /// On a cap of the unit sphere of opening angle a the conformal map scales by (1 + cos a)/(1 + cos t) at angle t.
    #[test]
    fn the_stretch_of_a_cap_is_that_of_its_stereographic_image() {
        let sphere = test_surfaces::sphere(5);
        let faces: Vec<_> =
            sphere.faces().filter(|f| sphere.triangle_positions(*f).iter().all(|p| p.z > 0.5)).collect();
        let (cap, _) = sphere.submesh(&faces, |_| false);
        let (mut grown, mut shrunk) = (0.0, 0.0);
        for k in 0..1000 {
            let z = 0.5 + 0.5 * (f64::from(k) + 0.5) / 1000.0;
            grown += (1.0 + z).powi(2) / 1000.0;
            shrunk += (1.0 + z).powi(-2) / 1000.0;
        }
        let exact = (grown * shrunk).sqrt();
        let found = of(&cap);
        assert!((found.l2 - exact).abs() < 0.1 * (exact - 1.0), "{} {exact}", found.l2);
        let top = found.tip.map(|v| cap.positions()[v.index()].z);
        assert!(top.is_some_and(|z| z > 0.99), "{top:?}");
    }

    #[test]
    fn a_closed_surface_is_held_at_its_sharpest_vertex_and_bulges_across_from_it() {
        let sphere = test_surfaces::sphere(3);
        let found = of(&sphere);
        let [root, tip] = [found.root, found.tip].map(|v| sphere.positions()[v.expect("closed and round").index()]);
        assert!(root.coords.dot(&tip.coords) < -0.9 && found.l2 > 2.0, "{found:?}");
    }
}
