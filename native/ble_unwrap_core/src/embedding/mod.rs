//! Bernoulli logistic embedding, the paper's sections 3 and 4: coordinates in few dimensions for points of any kind, from the
//! points themselves, from their distances or from affinities.
//!
//! [`embed()`] fits the model to all pairs of points, or to landmarks among which it then places the others. [`place`] and
//! [`Embedding::transform`] place further points. [`unwrap`](crate::unwrap()) embeds each chart by the same model from the
//! geodesic distances of its landmarks.
//!
//! # Terms
//! **Affinity** p_ij: how strongly two points belong together, from their distance through a
//! **kernel** of **width** σ. **Landmarks**: the k points the distances are measured from. **Gauge**: what
//! distances leave open (side, direction, place, and for the printed model scale).
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
