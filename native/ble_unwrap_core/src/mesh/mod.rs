//! The mesh: input polygons, their conditioning into an oriented manifold, and its connectivity.
//!
//! Knows nothing of charts, UVs or stages.

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
pub mod measure;
mod orient;
mod quad;
#[cfg(test)]
pub(crate) mod test_surfaces;
mod tri_mesh;
mod triangulate;
mod weld;

pub use coarsen::{Coarse, coarsen};
pub use condition::{ConditionOptions, Surface, condition};
pub use defects::{Defect, Defects};
pub use groups::Groups;
pub use index::{FaceId, HalfedgeId, VertexId};
pub use input::{MeshError, MeshInput};
pub use quad::{Quad, is_convex};
pub use tri_mesh::{Topology, TriMesh};
