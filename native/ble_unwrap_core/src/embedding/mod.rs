//! Embedding: a position in the plane for every vertex of a chart, from geodesic distances.
//!
//! # Terms
//! **Affinity** p_ij: how strongly two points belong together, from their distance through a
//! **kernel** of **width** σ. **Landmarks**: the k vertices the distances are measured from. **Gauge**: what
//! distances leave open (side, direction, place, and for the printed model scale).
//!
//! # Stage
//! 1. Pieces that need no embedding: [`plane`], [`unfold()`].
//! 2. [`embed_chart`]: σ from all distances; the landmarks by Bernoulli logistic embedding
//!    ([`fit`]) from classical scaling or a seeded random start; every other vertex by logistic
//!    regression on the landmarks ([`LandmarkModel`]). Isomap instead, for comparison.
//! 3. [`fix_gauge`]: side, axes, scale.
//!
//! The result may have flips (few with the default model, many with the printed one); removing
//! them is the next stage's.
//!
//! The same method for points, distances or affinities of any kind in any dimension: [`embed()`].
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

pub use affinity::{Affinity, Kernel, KernelWidth, kernel_width, model_affinity};
pub use bernoulli_logistic::{Fit, FitOptions, LogitModel, Update, fit};
pub use chart::{ChartEmbedding, embed_chart};
pub use embed::{EmbedOptions, embed};
pub use embedded::Embedding;
pub use error::EmbeddingError;
pub use gauge::fix_gauge;
pub use input::{EmbedInput, PointMetric};
pub use landmark_regression::{Evidence, LandmarkModel};
pub use placement::{FittedLandmarks, place};
pub use settings::{EmbeddingSettings, Initial, Model};
pub use unfold::{plane, project, unfold};

#[cfg(test)]
mod embed_tests;
#[cfg(test)]
mod flat_shapes;
#[cfg(test)]
mod landmark_tests;
#[cfg(test)]
mod misprints;
