//! Quality of a UV layout, whoever made it: stretch, distortion, seams, overlaps, packing, gaps.
//!
//! [`measure()`] follows the project's independent evaluator definition by definition, so that figures of
//! this library, of other tools and of hand-made UVs compare. It takes any finite or non-finite
//! numbers; only index arrays are checked, by [`UvMesh::new`]. The exact checks of our own results
//! are in [`verify`](mod@crate::verify).

mod bent_quads;
mod box_tree;
mod gap;
mod layout_arrays;
mod measure;
mod overlap;
mod uv_mesh;
mod uv_topology;

pub(crate) use bent_quads::bent_quads;
pub(crate) use layout_arrays::LayoutArrays;
pub use measure::{ChartMeasures, Measures};
pub(crate) use measure::{TriangleMeasures, measure, measure_each};
pub(crate) use uv_mesh::{Texture, TooManyTriangles, UvMesh};

pub(crate) use box_tree::{Bounds, BoxTree, Visitor, in_batches};
pub(crate) use gap::{GAP_SEARCH_TEXELS, OwnedSegment, least_gap};
pub(crate) use uv_topology::{NONE, for_each_edge};
