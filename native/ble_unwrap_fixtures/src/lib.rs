//! Procedural meshes for tests and benchmarks: plain arrays, made the same on every machine.
//!
//! [`catalogue()`] lists one mesh of each kind with its topology; the functions behind it take
//! sizes, for when another is wanted.

mod catalogue;
mod closed;
mod noise;
mod non_manifold;
mod one_sided;
mod open;
mod organic;
mod poly_mesh;
mod polygons;
mod surface_net;

pub use catalogue::{Case, Facts, catalogue};
pub use closed::{capped_cylinder, genus_plate, hedgehog, ico_sphere, nested_shells, torus, uv_sphere, voxels};
pub use noise::{random, smooth_noise};
pub use non_manifold::{book, bow_tie, checkerboard, double_sided, duplicated_faces, fin, touching_cubes};
pub use one_sided::{klein_bottle, moebius, projective_plane};
pub use open::{
    annulus, caps, cone, cylinder, disc, grid, helix_tube, l_shape, many_components, needles, rectangle, soup,
    spherical_cap, spiral_ramp, wrapped_grid, zigzag,
};
pub use organic::{face_like, sculpt_like, terrain};
pub use poly_mesh::{FlatPolygons, PolyMesh};
pub use polygons::{comb, keyhole, regular_polygon, star_polygon};
