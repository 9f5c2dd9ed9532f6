//! Bernoulli logistic embedding, as in sections 3 and 4 of the paper: it gives coordinates in few dimensions to points of
//! any kind, from the points themselves, from their distances, or from affinities.
//!
//! [`embed()`] fits the model to all pairs of points, or to landmarks, among which it then places the other points.
//! [`place`] and [`Embedding::transform`] place new points. [`unwrap`](crate::unwrap()) embeds each chart by the same
//! model, from the geodesic distances of its landmarks.
//!
//! # Terms
//! **Affinity** p_ij: a number from 0 to 1 that says how strongly points i and j belong together. A **kernel** of **width**
//! σ computes it from their distance. **Landmarks**: the k points from which distances are measured. **Gauge**: what
//! distances do not determine: reflection, rotation and translation, and for the printed model the scale.
//!
//! # References
//! Bernoulli embedding model and its application in texture mapping, 2006 ("the paper"), sections
//! 3 to 5. Wang, Zhao, Zhang, Lochovsky: A Bernoulli relational model for nonlinear embedding,
//! ICDM 2005.

mod affinity;
mod bernoulli_logistic;
mod blocks;
mod chart;
mod embed;
mod embedded;
mod error;
mod gauge;
mod input;
mod isomap;
mod landmark_regression;
mod logistic;
mod placement;
mod settings;
mod source;
mod square_matrix;
mod truncated;
mod unfold;

pub use affinity::KernelWidth;
pub use bernoulli_logistic::Update;
pub use embed::{EmbedOptions, embed};
pub use embedded::Embedding;
pub use error::EmbeddingError;
pub use input::{EmbedInput, PointMetric};
pub use landmark_regression::Evidence;
pub use placement::{FittedLandmarks, place};
pub use settings::{EmbeddingSettings, Initial, Model};

pub(crate) use chart::{ChartEmbedding, embed_chart};
pub(crate) use gauge::fix_gauge;
pub(crate) use unfold::{plane, project, unfold};

#[cfg(test)]
mod embed_tests;
#[cfg(test)]
mod flat_shapes;
#[cfg(test)]
mod landmark_tests;
#[cfg(test)]
mod misprints;
