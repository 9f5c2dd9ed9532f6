//! Every vertex that is no landmark, by logistic regression on the landmarks.
//!
//! With the landmarks fixed the likelihood (4) falls apart: each other vertex is a concave logistic regression of
//! its own in (x, y, a), or (x, y) for the printed model, with k observations. k = 100 landmarks lose
//! nothing measurable against embedding every vertex.

use rayon::prelude::*;

use crate::Progress;
use crate::geodesics::LandmarkDistances;
use crate::mesh::VertexId;
use crate::progress::Cancelled;

use super::affinity::{Kernel, log_odds};
use super::blocks::planar_solve;
use super::logistic::{Exact, PlanarPoints, RowSums, planar_row};

/// Most evaluations a vertex; three or four are usual. A vertex that uses them all keeps its best place.
const MOST_EVALUATIONS: usize = 24;
/// A Newton step shorter than this is the last: the next would be of its square, 1e-10 in units of √σ.
const LAST_STEP: f64 = 1e-5;
/// Vertices a task: a distance row is read a cache line or more at a time.
const CHUNK: usize = 64;

/// Landmarks with their fitted parameters, ready to place further points of the plane.
#[derive(Clone, Debug)]
pub struct LandmarkModel {
    x: Vec<f64>,
    y: Vec<f64>,
    a: Vec<f64>,
    intercepts: bool,
    kernel: Kernel,
    sigma: f64,
}

/// Working memory of one placement.
#[derive(Default)]
struct Scratch {
    affinities: Vec<f64>,
}

impl LandmarkModel {
    /// From k×2 coordinates and k intercepts (none for the printed model), as a fit gives them, with the kernel
    /// and width of its affinities.
    #[must_use]
    pub fn new(coordinates: &[f64], intercepts: &[f64], kernel: Kernel, sigma: f64) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = coordinates.chunks_exact(2).map(|c| (c[0], c[1])).unzip();
        let with = !intercepts.is_empty();
        let a = if with { intercepts.to_vec() } else { vec![0.0; x.len()] };
        Self { x, y, a, intercepts: with, kernel, sigma }
    }

    fn points(&self) -> PlanarPoints<'_> {
        PlanarPoints { x: &self.x, y: &self.y, a: &self.a }
    }

    /// The parameters (x, y, a) of greatest likelihood for a point with these squared distances to the
    /// landmarks; a is 0 for the printed model. Always finite.
    fn place(&self, squared: &[f64], scratch: &mut Scratch) -> [f64; 3] {
        let scale = 0.5 / self.sigma;
        let p = &mut scratch.affinities;
        p.clear();
        p.extend(squared.iter().map(|d| self.kernel.affinity(d * scale)));

        let mut theta = self.start(squared, p);
        let mut sums = planar_row::<Exact>(p, self.points(), theta);
        let mut step = planar_solve(&sums, self.intercepts);
        for _ in 0..MOST_EVALUATIONS {
            let next: [f64; 3] = std::array::from_fn(|c| theta[c] + step[c]);
            if step.iter().all(|s| s.abs() < LAST_STEP) {
                return next;
            }
            let there = planar_row::<Exact>(p, self.points(), next);
            // Rounding may eat the gain of a step that is already tiny; halving it ends at LAST_STEP.
            if there.log_likelihood > sums.log_likelihood {
                (theta, sums) = (next, there);
                step = planar_solve(&sums, self.intercepts);
            } else {
                step = step.map(|s| 0.5 * s);
            }
        }
        theta
    }

    /// Weighted least squares on the log-odds (Berkson 1944): linear in the parameters, and already
    /// the answer where model and distances agree exactly, as on a flat patch.
    fn start(&self, squared: &[f64], p: &[f64]) -> [f64; 3] {
        let mut sums = RowSums::default();
        for (j, (&p, d)) in p.iter().zip(squared).enumerate() {
            let target = match self.kernel {
                Kernel::Logistic => -0.5 * d / self.sigma,
                Kernel::Gaussian => log_odds(p),
            };
            let (x, y, w) = (self.x[j], self.y[j], p * (1.0 - p));
            let r = w * (target - self.a[j]);
            for (sum, v) in sums.gradient.iter_mut().zip([r * x, r * y, r]) {
                *sum += v;
            }
            for (sum, v) in sums.curvature.iter_mut().zip([w * x * x, w * x * y, w * y * y, w * x, w * y, w]) {
                *sum += v;
            }
        }
        planar_solve(&sums, self.intercepts)
    }

    /// Places every vertex of a mesh by its distances to the landmarks: (x, y, a) a vertex.
    ///
    /// Vertices are independent, so the bytes are the same for any number of threads. O(kn), about 3 µs a vertex
    /// for k = 100.
    ///
    /// # Errors
    /// Cancelled.
    ///
    /// # Panics
    /// If the distances are not from as many landmarks as the model has.
    pub fn place_all(&self, distances: &LandmarkDistances, progress: &Progress) -> Result<Vec<[f64; 3]>, Cancelled> {
        assert_eq!(distances.len(), self.x.len(), "the distances are those of the model's landmarks");
        let mut placed = vec![[0.0; 3]; distances.vertex_count()];
        placed.par_chunks_mut(CHUNK).enumerate().try_for_each_init(Scratch::default, |scratch, (c, chunk)| {
            progress.check()?;
            let mut squared = vec![0.0; distances.len()];
            for (i, place) in chunk.iter_mut().enumerate() {
                let v = VertexId::new(c * CHUNK + i);
                for (l, d) in squared.iter_mut().enumerate() {
                    *d = distances.get(l, v).powi(2);
                }
                *place = self.place(&squared, scratch);
            }
            Ok(())
        })?;
        Ok(placed)
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::normal;
    use super::*;

    /// Landmarks with exact parameters of the model with intercepts, σ = 1.
    fn exact(k: usize) -> (LandmarkModel, Vec<[f64; 2]>) {
        let points: Vec<[f64; 2]> = (0..k as u64).map(|i| [normal(1, i), normal(2, i)]).collect();
        let coordinates: Vec<f64> = points.iter().flatten().copied().collect();
        let intercepts: Vec<f64> = points.iter().map(|c| -0.5 * (c[0] * c[0] + c[1] * c[1])).collect();
        (LandmarkModel::new(&coordinates, &intercepts, Kernel::Logistic, 1.0), points)
    }

    #[test]
    fn flat_points_are_placed_exactly() {
        let (model, points) = exact(20);
        for target in [[0.0, 0.0], [0.7, -1.1], [4.0, 5.0], points[3]] {
            let squared: Vec<f64> =
                points.iter().map(|c| (c[0] - target[0]).powi(2) + (c[1] - target[1]).powi(2)).collect();
            let [x, y, a] = model.place(&squared, &mut Scratch::default());
            let expected = -0.5 * (target[0] * target[0] + target[1] * target[1]);
            assert!((x - target[0]).abs() + (y - target[1]).abs() + (a - expected).abs() < 1e-8, "{target:?} {x} {y}");
        }
    }

    #[test]
    fn every_answer_is_a_maximum() {
        let coordinates: Vec<f64> = (0..60).map(|i| normal(3, i)).collect();
        let intercepts: Vec<f64> = (0..30).map(|i| normal(4, i)).collect();
        for (a, kernel) in [(&intercepts[..], Kernel::Logistic), (&[][..], Kernel::Gaussian)] {
            let model = LandmarkModel::new(&coordinates, a, kernel, 1.0);
            for trial in 0..50 {
                let squared: Vec<f64> = (0..30).map(|j| 2.0 * normal(100 + trial, j).powi(2)).collect();
                let p: Vec<f64> = squared.iter().map(|d| kernel.affinity(0.5 * d)).collect();
                let theta = model.place(&squared, &mut Scratch::default());
                let sums = planar_row::<Exact>(&p, model.points(), theta);
                let free = if a.is_empty() { 2 } else { 3 };
                assert!(sums.gradient[..free].iter().all(|g| g.abs() < 1e-7), "{kernel:?} {trial}: {sums:?}");
            }
        }
    }

    #[test]
    fn far_and_coincident_points_stay_finite() {
        let (model, points) = exact(12);
        let gaussian = LandmarkModel::new(&points.concat(), &[], Kernel::Gaussian, 1.0);
        for model in [&model, &gaussian] {
            for d in [0.0, 1e-30, 1e6, 1e30] {
                let theta = model.place(&[d; 12], &mut Scratch::default());
                assert!(theta.iter().all(|t| t.is_finite()), "{d}: {theta:?}");
            }
        }
    }

    #[test]
    fn the_same_bytes_for_one_thread_and_four() {
        let (model, _) = exact(20);
        let rows: Vec<f32> = (0..20 * 1000).map(|i| normal(9, i).abs() as f32).collect();
        let distances = LandmarkDistances::new((0..20).map(VertexId::new).collect(), 1000, rows);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
            pool.install(|| model.place_all(&distances, &Progress::new())).expect("not cancelled")
        };
        assert_eq!(run(1), run(4));
    }
}
