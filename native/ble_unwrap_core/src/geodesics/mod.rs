//! Geodesic distances on meshes and graphs, and the landmarks they are measured from.
//!
//! A tool for the stages; knows nothing of charts. Surfaces are measured by fast marching
//! ([`FastMarching`]), point clouds along their graph of nearest neighbours ([`knn_graph()`],
//! [`graph_distances`]).

mod bridges;
mod connectivity;
mod dijkstra;
mod farthest_nodes;
mod fast_marching;
mod kd_tree;
mod knn_graph;
mod landmark_distances;
mod landmarks;
mod min_heap;
mod nearest_points;
mod settings;
mod weighted_graph;

pub use bridges::shortest_bridges;
pub use connectivity::{Connectivity, Piece, connectivity, least_neighbours};
pub use dijkstra::{DijkstraScratch, dijkstra, dijkstra_within, graph_distances, graph_distances_within};
pub use farthest_nodes::farthest_nodes;
pub use fast_marching::{FastMarching, MarchScratch};
pub use knn_graph::knn_graph;
pub use landmark_distances::LandmarkDistances;
pub use landmarks::{choose_landmarks, geodesic_distances, landmark_distances};
pub(crate) use min_heap::MinHeap;
pub use nearest_points::nearest_points;
pub use settings::{GeodesicSettings, Metric};
pub use weighted_graph::WeightedGraph;
