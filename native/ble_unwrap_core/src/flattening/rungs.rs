//! The fallback ladder of a chart, and how often each rung was taken.

/// How a chart, or the decision to split it, came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Rung {
    /// Coplanar faces, projected.
    Plane,
    /// A developable piece, unfolded isometrically.
    Unfold,
    /// A patch that hardly leaves its mean plane, projected: no flip to clear.
    Projection,
    /// A chart of the coarse mesh, carried over: no flip to clear.
    Prolonged,
    /// Two charts joined along their border, no flip to clear.
    Sewn,
    /// Bernoulli logistic embedding, no flip to clear.
    Embedding,
    /// Any of these, its flips cleared by the foldover-free energy.
    FoldoverFree,
    /// Tutte's embedding in the convexified outline of the embedding.
    TutteShape,
    /// Tutte's embedding in a circle.
    TutteCircle,
    /// A surface with handles, or a closed one, was cut open along short loops.
    CutOpen,
    /// Holes were joined by a cut, or a dart led to the worst point.
    Dart,
    /// Split by spectral segmentation.
    Split,
    /// Split in half by breadth-first order.
    Bisect,
    /// Faces that rounding to single precision would have flipped became charts of their own.
    Separate,
    /// A polygon too thin or too small for single precision was drawn thicker.
    Thicken,
    /// Two charts joined to one.
    Merge,
    /// A cut was closed from its end on.
    Zip,
    /// A few polygons crushed at a border were handed over it.
    Recut,
    /// One half of a mirrored component was charted, and the other got mirror images.
    Mirrored,
    /// A component that is like another got copies of its charts.
    Copied,
    /// Quads that came out bent were made convex.
    Unbend,
    /// Triangles stretched far more than the others of a chart were relaxed.
    Relax,
    /// Sides that are straight on the surface were laid along the axes.
    Straighten,
    /// A chart was opened so that its parts cover more of the texture.
    Fold,
}

impl Rung {
    const ALL: [Self; 24] = [
        Self::Plane,
        Self::Unfold,
        Self::Projection,
        Self::Prolonged,
        Self::Sewn,
        Self::Embedding,
        Self::FoldoverFree,
        Self::TutteShape,
        Self::TutteCircle,
        Self::CutOpen,
        Self::Dart,
        Self::Split,
        Self::Bisect,
        Self::Separate,
        Self::Thicken,
        Self::Merge,
        Self::Zip,
        Self::Recut,
        Self::Mirrored,
        Self::Copied,
        Self::Unbend,
        Self::Relax,
        Self::Straighten,
        Self::Fold,
    ];

    /// A short name for reports.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Unfold => "unfold",
            Self::Projection => "projection",
            Self::Prolonged => "prolonged",
            Self::Sewn => "sewn",
            Self::Embedding => "embedding",
            Self::FoldoverFree => "foldover_free",
            Self::TutteShape => "tutte_shape",
            Self::TutteCircle => "tutte_circle",
            Self::CutOpen => "cut_open",
            Self::Dart => "dart",
            Self::Split => "split",
            Self::Bisect => "bisect",
            Self::Separate => "separate",
            Self::Thicken => "thicken",
            Self::Merge => "merge",
            Self::Zip => "zip",
            Self::Recut => "recut",
            Self::Mirrored => "mirrored",
            Self::Copied => "copied",
            Self::Unbend => "unbend",
            Self::Relax => "relax",
            Self::Straighten => "straighten",
            Self::Fold => "fold",
        }
    }
}

/// Counts of rungs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rungs([usize; Rung::ALL.len()]);

impl Rungs {
    /// Counts one more.
    pub(crate) fn take(&mut self, rung: Rung) {
        self.0[rung as usize] += 1;
    }

    /// Whether it was taken at all.
    pub(crate) fn has(&self, rung: Rung) -> bool {
        self.0[rung as usize] > 0
    }

    /// Adds the counts of another.
    pub(crate) fn add(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a += b;
        }
    }

    /// Names and counts of the rungs taken at least once, in the order of the ladder.
    #[must_use]
    pub(crate) fn taken(&self) -> Vec<(&'static str, usize)> {
        Rung::ALL.iter().map(|&r| (r.name(), self.0[r as usize])).filter(|&(_, n)| n > 0).collect()
    }
}
