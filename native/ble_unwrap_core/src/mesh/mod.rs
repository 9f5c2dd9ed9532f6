//! The mesh: input polygons, their conditioning into an oriented manifold, and its connectivity.
//!
//! Knows nothing of charts, UVs or stages.

mod bent_links;
mod canonical;
mod coarsen;
mod collapse;
mod condition;
mod defects;
mod ear_clipping;
mod frame;
mod glue;
mod groups;
mod index;
mod input;
mod irregular;
mod likeness;
pub(crate) mod measure;
mod mirror;
mod orient;
mod other_diagonals;
mod quad;
#[cfg(test)]
pub(crate) mod test_surfaces;
#[cfg(test)]
mod tests;
mod tri_mesh;
mod triangulate;
mod weld;

pub(crate) use canonical::canonical;
pub(crate) use coarsen::{Coarse, coarsen};
pub(crate) use condition::{ConditionOptions, Surface, condition};
pub(crate) use groups::Groups;
pub(crate) use index::{FaceId, HalfedgeId, VertexId};
pub use input::{MeshError, MeshInput};
pub(crate) use likeness::{Likeness, Shape};
pub(crate) use mirror::{Mirror, Plane, mirror};
pub(crate) use other_diagonals::mirrored_polygons;
pub(crate) use quad::{Quad, is_convex};
pub(crate) use tri_mesh::{Topology, TriMesh};
