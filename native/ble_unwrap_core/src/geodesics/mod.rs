//! Geodesic distances on meshes and graphs, and the landmarks they are measured from.
//!
//! A tool for the stages; knows nothing of charts. Surfaces are measured by fast marching
//! ([`FastMarching`]), point clouds along their graph of nearest neighbours ([`knn_graph()`],
//! [`graph_distances`]).

mod dijkstra;
mod fast_marching;
mod kd_tree;
mod knn_graph;
mod landmark_distances;
mod landmarks;
mod min_heap;
mod settings;
mod weighted_graph;

pub use dijkstra::{DijkstraScratch, dijkstra, dijkstra_within, graph_distances, graph_distances_within};
pub use fast_marching::{FastMarching, MarchScratch};
pub use knn_graph::knn_graph;
pub use landmark_distances::LandmarkDistances;
pub use landmarks::{choose_landmarks, geodesic_distances, landmark_distances};
pub(crate) use min_heap::MinHeap;
pub use settings::{GeodesicSettings, Metric};
pub use weighted_graph::WeightedGraph;
