//! Geodesic distances on meshes and graphs, and the landmarks they are measured from.
//!
//! A tool for the stages; knows nothing of charts.

mod landmark_distances;

pub use landmark_distances::LandmarkDistances;
