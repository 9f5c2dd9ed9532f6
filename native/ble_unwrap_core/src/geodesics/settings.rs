//! How geodesic distances are measured, and from how many landmarks.

use crate::choice::choices;

/// How distances along a surface are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Metric {
    /// Fast marching across triangles. On curved surfaces its error is proportional to the edge length: 0.1 to 0.4 % on
    /// average, and up to 3 % at single vertices, for meshes of some thousand vertices. There is practically no error where
    /// the surface unrolls into the plane and the straight path does not meet the boundary.
    FastMarching,
    /// Shortest paths along edges, for comparison. They are never too short; they are some 5 to 9 % too long on average
    /// where triangles are well shaped, and without limit where triangles are not.
    Dijkstra,
}

choices!(Metric {
    FastMarching: "fast_marching", "Fast Marching", "Wave fronts run across the triangles: accurate.";
    Dijkstra: "dijkstra", "Dijkstra", "Shortest paths run along the edges: some 6 % too long, but faster.";
});

/// Landmarks and the distances measured from them.
#[derive(Clone, Debug, PartialEq)]
pub struct GeodesicSettings {
    /// How distances are measured.
    pub metric: Metric,
    /// Number of landmarks divided by the number of vertices: the paper's α (section 5).
    pub landmark_fraction: f64,
    /// Least number of landmarks. If a mesh has fewer vertices than this, all of them are landmarks.
    pub landmark_min: usize,
    /// Greatest number of landmarks.
    pub landmark_max: usize,
}

impl Default for GeodesicSettings {
    /// The paper's fraction, but at least 48 landmarks, since fewer lose accuracy on small charts, and at most 64, since
    /// more gain nothing once stretch is minimised.
    fn default() -> Self {
        Self { metric: Metric::FastMarching, landmark_fraction: 0.01, landmark_min: 48, landmark_max: 64 }
    }
}

impl GeodesicSettings {
    /// The paper's fraction, 1 % of the vertices, without an upper limit. At least three landmarks are needed to span a
    /// plane.
    #[must_use]
    pub fn paper() -> Self {
        Self { landmark_min: 3, landmark_max: usize::MAX, ..Self::default() }
    }

    /// Number of landmarks for a mesh of n vertices: ⌈αn⌉, raised or lowered to the bounds, and never more than n. A
    /// fraction that is NaN counts as 0.
    #[must_use]
    pub fn landmark_count(&self, vertex_count: usize) -> usize {
        // A cast from float to integer saturates, and takes NaN to 0.
        let wanted = (self.landmark_fraction * vertex_count as f64).ceil() as usize;
        wanted.min(self.landmark_max).max(self.landmark_min).min(vertex_count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn landmark_count_is_clamped() {
        let s = GeodesicSettings::default();
        assert_eq!([1, 40, 1_000, 10_000, 100_000].map(|n| s.landmark_count(n)), [1, 40, 48, 64, 64]);
        let p = GeodesicSettings::paper();
        assert_eq!([1, 40, 1_001, 100_000].map(|n| p.landmark_count(n)), [1, 3, 11, 1_000]);
        for odd in [f64::NAN, f64::INFINITY, -1.0] {
            let s = GeodesicSettings { landmark_fraction: odd, ..s.clone() };
            assert!((48..=64).contains(&s.landmark_count(1_000)));
        }
    }
}
