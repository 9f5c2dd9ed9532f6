//! The mesh: input polygons, their conditioning into an oriented manifold, and its connectivity.
//!
//! Knows nothing of charts, UVs or stages.

mod groups;
mod index;
pub mod measure;
#[cfg(test)]
pub(crate) mod test_surfaces;
mod tri_mesh;

pub use groups::Groups;
pub use index::{FaceId, HalfedgeId, VertexId};
pub use tri_mesh::{Topology, TriMesh};
