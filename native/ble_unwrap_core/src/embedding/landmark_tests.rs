//! Tests of placing points by landmarks.

use super::affinity::Kernel;
use super::landmark_regression::{Evidence, LandmarkModel};
use crate::geodesics::LandmarkDistances;
use crate::mesh::VertexId;
use crate::progress::Progress;
use crate::random::normal;

/// k landmarks of q dimensions with exact parameters of the model with intercepts, σ = 1.
fn exact(k: usize, q: usize) -> (LandmarkModel, Vec<Vec<f64>>) {
    let points: Vec<Vec<f64>> = (0..k).map(|i| (0..q).map(|c| normal(1 + c as u64, i as u64)).collect()).collect();
    let intercepts: Vec<f64> = points.iter().map(|x| -0.5 * x.iter().map(|c| c * c).sum::<f64>()).collect();
    (LandmarkModel::new(q, &points.concat(), &intercepts, Kernel::Logistic, 1.0), points)
}

fn place(model: &LandmarkModel, squared: &[f64]) -> Vec<f64> {
    let observe = |_: usize, row: &mut [f64]| row.copy_from_slice(squared);
    model.place_points(1, Evidence::SquaredDistances, observe, &Progress::new()).expect("not cancelled")
}

#[test]
fn flat_points_are_placed_exactly_in_every_dimension() {
    for q in 1..6 {
        let (model, points) = exact(20, q);
        for far in [0.0, 0.7, 1.5] {
            let target: Vec<f64> = (0..q).map(|c| far * (1.0 + 0.3 * c as f64)).collect();
            let squared: Vec<f64> =
                points.iter().map(|x| x.iter().zip(&target).map(|(a, b)| (a - b) * (a - b)).sum()).collect();
            let affinities: Vec<f64> = squared.iter().map(|d| Kernel::Logistic.affinity(0.5 * d)).collect();
            let theta = place(&model, &squared);
            let expected = -0.5 * target.iter().map(|c| c * c).sum::<f64>();
            for (found, expected) in theta.iter().zip(target.iter().chain([&expected])) {
                assert!((found - expected).abs() < 1e-6, "q = {q}, {far}: {theta:?}");
            }
            let observe = |_: usize, row: &mut [f64]| row.copy_from_slice(&affinities);
            let again = model.place_points(1, Evidence::Affinities, observe, &Progress::new()).expect("runs");
            // Given affinities say nothing below 1e-12, where far landmarks are.
            assert!(far > 1.0 || again.iter().zip(&theta).all(|(a, b)| (a - b).abs() < 1e-6), "{again:?} {theta:?}");
        }
    }
}

#[test]
fn every_answer_is_a_maximum() {
    for q in [1, 2, 3, 5] {
        let coordinates: Vec<f64> = (0..30 * q as u64).map(|i| normal(3, i)).collect();
        let intercepts: Vec<f64> = (0..30).map(|i| normal(4, i)).collect();
        for (a, kernel) in [(&intercepts[..], Kernel::Logistic), (&[][..], Kernel::Gaussian)] {
            let model = LandmarkModel::new(q, &coordinates, a, kernel, 1.0);
            for trial in 0..50 {
                let squared: Vec<f64> = (0..30).map(|j| 2.0 * normal(100 + trial, j).powi(2)).collect();
                let theta = place(&model, &squared);
                // The gradient of the likelihood, written out.
                let mut gradient = vec![0.0; q + 1];
                for (j, d) in squared.iter().enumerate() {
                    let x = &coordinates[j * q..(j + 1) * q];
                    let t = x.iter().zip(&theta).map(|(a, b)| a * b).sum::<f64>() + theta[q] + a.get(j).unwrap_or(&0.0);
                    let residual = kernel.affinity(0.5 * d) - 1.0 / (1.0 + (-t).exp());
                    gradient.iter_mut().zip(x.iter().chain([&1.0])).for_each(|(g, z)| *g += residual * z);
                }
                let free = if a.is_empty() { q } else { q + 1 };
                assert!(gradient[..free].iter().all(|g| g.abs() < 1e-7), "{kernel:?} {trial}: {gradient:?}");
                assert!(!a.is_empty() || theta[q] == 0.0);
            }
        }
    }
}

#[test]
fn an_anchored_point_far_from_all_landmarks_has_its_place() {
    for q in 1..4 {
        let (model, points) = exact(20, q);
        let anchored = model.clone().anchored();
        for far in [0.5, 100.0, 1e4] {
            let target: Vec<f64> = (0..q).map(|c| far * (1.0 - 0.7 * c as f64)).collect();
            let squared: Vec<f64> =
                points.iter().map(|x| x.iter().zip(&target).map(|(a, b)| (a - b) * (a - b)).sum()).collect();
            let off = |theta: &[f64]| theta.iter().zip(&target).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / far;
            assert!(off(&place(&anchored, &squared)) < 1e-3, "q = {q}, {far}: {:?}", place(&anchored, &squared));
            assert!(far < 1.0 || off(&place(&model, &squared)) > 0.1, "the likelihood alone does not know it");
        }
    }
}

#[test]
fn an_anchored_point_on_a_landmark_is_put_there() {
    for q in [2, 3] {
        let coordinates: Vec<f64> = (0..10 * q as u64).map(|i| normal(7, i)).collect();
        let a: Vec<f64> = (0..10).map(|i| normal(8, i)).collect();
        let model = LandmarkModel::new(q, &coordinates, &a, Kernel::Logistic, 1.0).anchored();
        // Two landmarks at one place, fitted apart: the first counts.
        let squared: Vec<f64> = (0..10).map(|j| if j == 4 || j == 6 { 0.0 } else { 1.0 }).collect();
        let theta = place(&model, &squared);
        assert_eq!((&theta[..q], theta[q]), (&coordinates[4 * q..5 * q], a[4]));
    }
}

#[test]
fn far_coincident_and_unreached_points_stay_finite() {
    for q in [1, 2, 3] {
        let (model, points) = exact(12, q);
        let gaussian = LandmarkModel::new(q, &points.concat(), &[], Kernel::Gaussian, 1.0);
        let anchored = [model.clone().anchored(), gaussian.clone().anchored()];
        for model in [model.clone(), gaussian, model.truncated(0.01)].into_iter().chain(anchored) {
            for d in [0.0, 1e-30, 1e6, 1e30, f64::INFINITY] {
                let theta = place(&model, &[d; 12]);
                assert!(theta.iter().all(|t| t.is_finite()), "{d}: {theta:?}");
            }
        }
    }
}

#[test]
fn the_same_bytes_for_one_thread_and_four() {
    let (model, _) = exact(20, 2);
    let rows: Vec<f32> = (0..20 * 1000).map(|i| normal(9, i).abs() as f32).collect();
    let distances = LandmarkDistances::new((0..20).map(VertexId::new).collect(), 1000, rows);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
        pool.install(|| model.place_all(&distances, &Progress::new())).expect("not cancelled")
    };
    assert_eq!(run(1), run(4));
}
