//! Geodesic distances on meshes and graphs, and the landmarks they are measured from.
//!
//! A tool for the stages; knows nothing of charts. Surfaces are measured by fast marching
//! ([`FastMarching`]), point clouds along their graph of nearest neighbours ([`knn_graph()`],
//! [`graph_distances`]), of which [`connectivity()`] says whether it is in one piece, and
//! [`shortest_bridges`] makes one. The paper, section 5.1.
//!
//! # Accuracy
//!
//! Relative errors over all vertices from four sources, against exact polyhedral distances (the algorithm of
//! Mitchell, Mount and Papadimitriou); `pytest -s tests/test_geodesics.py -k accuracy` prints the whole table.
//!
//! | surface | vertices | obtuse triangles | fast marching: mean, max | along edges: mean, max |
//! |---|--:|--:|--:|--:|
//! | plane, scattered | 2,128 | 24 % | 2e-6 %, 6e-6 % | 5.5 %, 31 % |
//! | hills | 2,128 | 29 % | 0.14 %, 1.0 % | 5.8 %, 39 % |
//! | hills, slivers | 2,128 | 96 % | 0.005 %, 0.04 % | 19 %, 418 % |
//! | sphere | 2,562 | 0 % | 0.20 %, 1.2 % | 6.8 %, 18 % |
//! | torus | 1,440 | 0 % | 0.27 %, 1.5 % | 7.9 %, 22 % |
//! | camel's head | 11,381 | 44 % | 0.20 %, 1.6 % | 8.1 %, 67 % |
//! | fandisk | 6,475 | 24 % | 0.15 %, 2.0 % | 7.6 %, 40 % |
//!
//! Fast marching converges with the first power of the edge length on curved surfaces and is exact to rounding on
//! flat ones; paths along edges do not converge at all. On random points of a plane, a sphere and a
//! swiss roll, distances along the graph are 9 to 11 % too long on average with 6 neighbours, 3 % with 12 and 0.9 %
//! with 24, where no edge leaves the surface.

mod bridges;
mod connectivity;
mod dijkstra;
mod farthest_nodes;
mod fast_marching;
mod kd_tree;
mod knn_graph;
mod landmark_distances;
mod landmarks;
mod nearest_points;
mod settings;
mod weighted_graph;

pub(crate) use bridges::shortest_bridges;
pub(crate) use connectivity::connectivity;
pub use connectivity::{Connectivity, Piece};
pub(crate) use dijkstra::{DijkstraScratch, dijkstra, dijkstra_within, graph_distances};
pub(crate) use farthest_nodes::farthest_nodes;
pub(crate) use fast_marching::{FastMarching, MarchScratch};
pub(crate) use knn_graph::knn_graph;
pub(crate) use landmark_distances::LandmarkDistances;
pub(crate) use landmarks::{geodesic_distances, landmark_distances};
pub(crate) use nearest_points::nearest_points;
pub use settings::{GeodesicSettings, Metric};
pub(crate) use weighted_graph::WeightedGraph;
