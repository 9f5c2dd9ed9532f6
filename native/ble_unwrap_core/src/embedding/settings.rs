//! Parameters of the embedding, with the presets of practice and of the paper.

use crate::choice::choices;

use super::affinity::{Kernel, KernelWidth};
use super::bernoulli_logistic::{FitOptions, LogitModel, Update};
use super::error::EmbeddingError;

/// The kernel width of the default model, σ over the mean squared distance. From 0.1 to 0.3 the charts are
/// practically the same; below, far pairs stop counting, above, near ones do.
const DEFAULT_RELATIVE_WIDTH: f64 = 0.2;
/// The mean affinity that sets σ for the printed model; near it flips are fewest (an even disc has
/// none, and half its triangles at σ = 0.3 or 1 times the mean squared distance).
const PRINTED_MEAN_AFFINITY: f64 = 0.57;

/// The model by which distances become positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Model {
    /// Bernoulli logistic embedding with intercepts and the logistic kernel. It is exact on charts that unroll into the
    /// plane.
    Default,
    /// Bernoulli logistic embedding as printed in the paper: with the Gaussian kernel and without intercepts. It folds even
    /// flat sheets: it flips 8 % of the triangles of a square of 1,000 vertices, and half of those of a 3:1 rectangle.
    Paper,
    /// Classical scaling of the distances (Isomap); no likelihood is fitted.
    Isomap,
}

choices!(Model {
    Default: "default", "Extended", "Bernoulli logistic embedding with intercepts and logistic affinity.";
    Paper: "paper", "As Printed", "Bernoulli logistic embedding as in the paper: Gaussian affinity, no intercepts.";
    Isomap: "isomap", "Isomap", "Classical scaling of geodesic distances, for comparison.";
});

impl Model {
    pub(super) fn kernel(self) -> Kernel {
        match self {
            Self::Default | Self::Isomap => Kernel::Logistic,
            Self::Paper => Kernel::Gaussian,
        }
    }
}

/// Where the fit starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Initial {
    /// Classical scaling of the distances.
    Mds,
    /// Normally distributed coordinates with standard deviation ½, drawn from the seed.
    Random,
}

choices!(Initial {
    Mds: "mds", "Classical Scaling", "Multidimensional scaling of the landmarks, which needs the fewest sweeps.";
    Random: "random", "Random", "Normally distributed points, drawn from the seed.";
});

/// Parameters of the model and of its fit, for [`embed`](super::embed()) and for the embedding of charts.
#[derive(Clone, Debug, PartialEq)]
pub struct EmbeddingSettings {
    /// The model.
    pub model: Model,
    /// Kernel width σ as a multiple of the mean squared distance; positive. `None` stands for 0.2 with the default model;
    /// with the printed model, σ is then chosen so that the mean affinity is 0.57.
    pub kernel_width: Option<f64>,
    /// Over-relaxation ω of the updates, between 0 and 2, both excluded.
    pub relaxation: f64,
    /// Greatest number of sweeps over all points.
    pub max_sweeps: usize,
    /// The fit stops once a sweep changes the log-likelihood by less than this share of it.
    pub tolerance: f64,
    /// Whether points are updated one after another or all at once.
    pub update: Update,
    /// Where the fit starts from.
    pub initial: Initial,
}

impl Default for EmbeddingSettings {
    fn default() -> Self {
        Self {
            model: Model::Default,
            kernel_width: Some(DEFAULT_RELATIVE_WIDTH),
            relaxation: 1.6,
            max_sweeps: 60,
            tolerance: 1e-5,
            update: Update::Serial,
            initial: Initial::Mds,
        }
    }
}

impl EmbeddingSettings {
    /// The paper's method as printed: its model, from a random start drawn from the seed. The relaxation is ω = 1.7, which
    /// is the best with the bound ¼ that the paper uses for q(1 − q).
    #[must_use]
    pub fn paper() -> Self {
        Self { model: Model::Paper, kernel_width: None, relaxation: 1.7, initial: Initial::Random, ..Self::default() }
    }

    /// Checks all parameters.
    ///
    /// # Errors
    /// [`EmbeddingError::InvalidSetting`], which names the first parameter that is out of range.
    pub fn validate(&self) -> Result<(), EmbeddingError> {
        self.fit_options().validate()?;
        self.width().validate(self.kernel())
    }

    pub(super) fn kernel(&self) -> Kernel {
        self.model.kernel()
    }

    pub(super) fn width(&self) -> KernelWidth {
        match (self.kernel_width, self.model) {
            (Some(c), _) => KernelWidth::Relative(c),
            (None, Model::Paper) => KernelWidth::MeanAffinity(PRINTED_MEAN_AFFINITY),
            (None, Model::Default | Model::Isomap) => KernelWidth::Relative(DEFAULT_RELATIVE_WIDTH),
        }
    }

    pub(super) fn fit_options(&self) -> FitOptions {
        FitOptions {
            model: if self.model == Model::Paper { LogitModel::Printed } else { LogitModel::WithIntercepts },
            update: self.update,
            relaxation: self.relaxation,
            max_sweeps: self.max_sweeps,
            tolerance: self.tolerance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_parameters_out_of_range_are_named() {
        for settings in [EmbeddingSettings::default(), EmbeddingSettings::paper()] {
            assert_eq!(settings.validate(), Ok(()));
        }
        let named = |change: fn(&mut EmbeddingSettings)| {
            let mut settings = EmbeddingSettings::default();
            change(&mut settings);
            match settings.validate() {
                Err(EmbeddingError::InvalidSetting { name, .. }) => name,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(named(|s| s.relaxation = 2.0), "relaxation");
        assert_eq!(named(|s| s.relaxation = f64::NAN), "relaxation");
        assert_eq!(named(|s| s.tolerance = -1.0), "tolerance");
        assert_eq!(named(|s| s.kernel_width = Some(0.0)), "kernel_width");
        assert_eq!(named(|s| s.kernel_width = Some(f64::INFINITY)), "kernel_width");
    }
}
