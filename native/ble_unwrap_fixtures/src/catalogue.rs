//! One mesh of each kind, with what is known of it.

use std::f64::consts::FRAC_PI_2;

use crate::closed::{capped_cylinder, genus_plate, hedgehog, ico_sphere, nested_shells, torus, uv_sphere};
use crate::noise::random;
use crate::non_manifold::{book, bow_tie, checkerboard, double_sided, duplicated_faces, fin, touching_cubes};
use crate::one_sided::{klein_bottle, moebius, projective_plane};
use crate::open::{
    annulus, caps, cone, cylinder, disc, grid, helix_tube, l_shape, many_components, needles, rectangle, soup,
    spherical_cap, spiral_ramp, zigzag,
};
use crate::organic::{face_like, sculpt_like, terrain};
use crate::poly_mesh::PolyMesh;
use crate::polygons::{comb, keyhole, regular_polygon, star_polygon};

/// Topology of a mesh whose faces are joined over edges: bow-ties are apart, vertices at one
/// position are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// Number of components, unless how edges of many faces are cut decides.
    pub components: Option<usize>,
    /// Number of boundary loops, where the surface has two sides and needs no cut.
    pub loops: Option<usize>,
    /// Genus summed over the components, likewise.
    pub genus: Option<usize>,
    /// Whether the surface has two sides.
    pub orientable: bool,
    /// Edges with more than two faces.
    pub nm_edges: usize,
}

impl Facts {
    /// An orientable manifold.
    const fn manifold(components: usize, loops: usize, genus: usize) -> Self {
        Self { components: Some(components), loops: Some(loops), genus: Some(genus), orientable: true, nm_edges: 0 }
    }

    /// A connected surface with one side.
    const fn one_sided() -> Self {
        Self { components: Some(1), loops: None, genus: None, orientable: false, nm_edges: 0 }
    }

    /// A surface that must be cut at edges of many faces.
    const fn branching(nm_edges: usize) -> Self {
        Self { components: None, loops: None, genus: None, orientable: true, nm_edges }
    }
}

/// A mesh of the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// What it is, in words fit for a message.
    pub name: &'static str,
    /// Makes the mesh, the same each time.
    pub build: fn() -> PolyMesh,
    /// What is known of it.
    pub facts: Facts,
}

impl Case {
    const fn new(name: &'static str, facts: Facts, build: fn() -> PolyMesh) -> Self {
        Self { name, build, facts }
    }
}

/// A disk.
const DISK: Facts = Facts::manifold(1, 1, 0);
/// A closed surface without handles.
const BALL: Facts = Facts::manifold(1, 0, 0);

/// All cases, in a fixed order.
pub fn catalogue() -> impl ExactSizeIterator<Item = &'static Case> {
    CASES.iter()
}

fn bumpy(u: f64, v: f64) -> [f64; 3] {
    [u, v, 0.2 * (7.0 * u).sin() * (5.0 * v).cos()]
}

static CASES: [Case; 55] = [
    Case::new("nothing", Facts::manifold(0, 0, 0), PolyMesh::default),
    Case::new("one triangle", DISK, || spherical_cap(1.0, 1).retained(|f| f == 0)),
    Case::new("flat grid", DISK, || grid(20, 20, |u, v| [u, v, 0.0])),
    Case::new("bumpy grid", DISK, || grid(24, 24, bumpy)),
    Case::new("bumpy grid of mixed winding", DISK, || grid(24, 24, bumpy).flipped(|f| random(5, f as u64) < 0.3)),
    Case::new("crumpled grid", DISK, || {
        let draw = |u: f64, v: f64, k: u64| random(k, u.to_bits() ^ v.to_bits().rotate_left(17));
        grid(20, 20, |u, v| [0, 1, 2].map(|k| draw(u, v, k)))
    }),
    Case::new("disc", DISK, || disc(18)),
    Case::new("rectangle", DISK, || rectangle(3, 18)),
    Case::new("L shape", DISK, || l_shape(16)),
    Case::new("annulus", Facts::manifold(1, 2, 0), || annulus(0.4, 60, 10)),
    Case::new("annulus of 3,000 sides", Facts::manifold(1, 2, 0), || annulus(0.2, 3000, 1).triangulated()),
    Case::new("cap of 40 degrees", DISK, || spherical_cap(40.0_f64.to_radians(), 18)),
    Case::new("cap of 100 degrees", DISK, || spherical_cap(100.0_f64.to_radians(), 18)),
    Case::new("hemisphere", DISK, || spherical_cap(FRAC_PI_2, 18)),
    Case::new("icosahedron", BALL, || ico_sphere(0)),
    Case::new("icosphere", BALL, || ico_sphere(3)),
    Case::new("icosphere with a pinhole", DISK, || ico_sphere(3).retained(|f| f != 700)),
    Case::new("uv sphere", BALL, || uv_sphere(32, 16)),
    Case::new("icosphere in triangles of their own", BALL, || soup(&ico_sphere(2))),
    Case::new("nested shells", Facts::manifold(3, 0, 0), nested_shells),
    Case::new("hedgehog", BALL, hedgehog),
    Case::new("open cylinder", Facts::manifold(1, 2, 0), || cylinder(3.0, 40, 20)),
    Case::new("capped cylinder", BALL, || capped_cylinder(2.0, 64, 1)),
    Case::new("cone", DISK, || cone(2.0, 40, 12)),
    Case::new("helix tube", Facts::manifold(1, 2, 0), || helix_tube(12.0, 600, 8)),
    Case::new("torus", Facts::manifold(1, 0, 1), || torus(0.35, 40, 20)),
    Case::new("torus with a hole", Facts::manifold(1, 1, 1), || torus(0.35, 40, 20).retained(|f| f != 77)),
    Case::new("plate with five holes", Facts::manifold(1, 0, 5), || genus_plate(5)),
    Case::new("Moebius strip", Facts::one_sided(), || moebius(60, 4)),
    Case::new("Klein bottle", Facts::one_sided(), || klein_bottle(48, 24)),
    Case::new("projective plane of 10 triangles", Facts::one_sided(), || projective_plane(0)),
    Case::new("projective plane", Facts::one_sided(), || projective_plane(3)),
    Case::new("bow-tie", Facts::manifold(2, 2, 0), bow_tie),
    Case::new("checkerboard", Facts::manifold(128, 128, 0), || checkerboard(16)),
    Case::new("book of 60 pages", Facts { components: Some(60), ..Facts::branching(1) }, || book(60)),
    Case::new("fin", Facts { components: Some(2), loops: Some(2), genus: Some(0), ..Facts::branching(8) }, || fin(8)),
    Case::new(
        "cubes that share an edge",
        Facts { components: Some(2), loops: Some(0), genus: Some(0), ..Facts::branching(1) },
        touching_cubes,
    ),
    Case::new("faces listed twice", Facts::branching(71), || duplicated_faces(12)),
    Case::new(
        "sheet with two sides",
        Facts { components: Some(1), loops: Some(0), genus: Some(0), ..Facts::branching(112) },
        || double_sided(8),
    ),
    Case::new("spiral ramp", DISK, || spiral_ramp(120, 2.0, 0.01)),
    Case::new("zigzag", DISK, || zigzag(5, 10)),
    Case::new("five thousand pieces", Facts::manifold(5000, 5000, 0), || many_components(5000)),
    Case::new("needles", DISK, || needles(300, 1e-6)),
    Case::new("caps", DISK, || caps(60, 1e-7)),
    Case::new("polygon of 500 corners", DISK, || regular_polygon(500, 0.0)),
    Case::new("wavy polygon", DISK, || regular_polygon(64, 0.8)),
    Case::new("pentagram", DISK, || star_polygon(5)),
    Case::new("comb", DISK, || comb(40)),
    Case::new("keyhole", DISK, keyhole),
    Case::new("sides of no length", DISK, || grid(12, 12, bumpy).with_sides_of_no_length(|f| f % 5 == 0)),
    Case::new("triangles of no length", DISK, || {
        grid(12, 12, bumpy).with_sides_of_no_length(|f| f % 5 == 0).triangulated()
    }),
    Case::new("terrain", DISK, || terrain(48, 3)),
    Case::new("face", DISK, face_like),
    Case::new("small sculpt", BALL, || sculpt_like(2500)),
    Case::new("sculpt", BALL, || sculpt_like(12_000)),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_unique_and_indices_valid() {
        let mut names = BTreeSet::new();
        for case in catalogue() {
            assert!(names.insert(case.name), "{} twice", case.name);
            let mesh = (case.build)();
            assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()), "{}", case.name);
            assert!(mesh.faces.iter().all(|f| f.len() >= 3), "{}", case.name);
            assert!(mesh.faces.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()), "{}", case.name);
            assert_eq!(mesh, (case.build)(), "{} differs when made again", case.name);
        }
    }

    #[test]
    fn sculpts_have_about_the_faces_asked_for() {
        for target in [2_000, 8_000, 50_000] {
            let faces = sculpt_like(target).faces.len();
            assert!(faces.abs_diff(target) * 20 < target, "{faces} for {target}");
        }
    }

    #[test]
    fn the_face_has_about_a_thousand_vertices() {
        assert_eq!(face_like().positions.len(), 1024);
    }
}
