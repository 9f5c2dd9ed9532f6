//! Single steps of an unwrap on plain arrays, for hosts that need only those.
//!
//! Vertices, corners, faces and points are numbered as in the input, whatever is done to the mesh in between.

mod distances;
mod flatten;
mod graph;
mod layout;
mod relax;
mod repack;

pub use distances::{DistancesError, surface_distances};
pub use flatten::{FlattenError, FlattenReport, Flattening, MapQuality, flatten};
pub use graph::{CloudDistanceSettings, CloudDistancesError, Connect, cloud_distances};
pub use layout::{FaceMeasures, LayoutError, LayoutMeasures, certify, measure_layout};
pub use relax::{LeftAsItWas, RelaxError, RelaxRules, RelaxStart, Relaxed, RelaxedIsland, relax};
pub use repack::{RepackError, RepackRules, RepackScale, Repacked, repack};

pub use crate::geodesics::{Connectivity, Piece};
pub use crate::metrics::{ChartMeasures, Measures};
