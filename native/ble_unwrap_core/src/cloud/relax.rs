//! Less stretch: a chart's nodes moved so that each neighbourhood comes nearer to its shape on the surface.
//!
//! Graph distances are a few per cent too long, and longer in some directions than in others; the embedding inherits
//! that. Neighbourhoods do not: each is known to the precision of the data. Two alternations repair the map:
//!
//! 1. As rigid as possible (Sorkine, Alexa: As-rigid-as-possible surface modeling, SGP 2007; in the plane Liu, Zhang,
//!    Xu, Gotsman, Gortler: A local/global approach to mesh parameterization, SGP 2008): every neighbourhood is turned
//!    to fit its image, then all positions follow from one sparse system whose matrix never changes. Undoes folds.
//! 2. Towards the symmetric Dirichlet energy σ₁² + σ₁⁻² + σ₂² + σ₂⁻² by reweighting the same system (Rabinovich,
//!    Poranne, Panozzo, Sorkine-Hornung: Scalable locally injective mappings, ACM TOG 36, 2017), from a map without
//!    folds, with a line search that keeps it so.

use nalgebra::{Matrix2, Point2, Vector2};
use rayon::prelude::*;

use crate::distortion;
use crate::linalg::{SparseCholesky, SparseError, SparsePattern};
use crate::progress::{Cancelled, Progress};

use super::local_map::Offsets;

/// Most steps of the first kind. Each halves the error at least where it is local; what is global the embedding has
/// right already.
const RIGID_STEPS: usize = 12;
/// Most steps of the second kind.
const DIRICHLET_STEPS: usize = 12;
/// A step that lowers the energy above that of an isometry by a smaller share of it is the last.
const LEAST_GAIN: f64 = 1e-2;
/// Weight of what is not affine in a neighbourhood: the curvature of the energy at an isometry, as in its proxy.
const SMOOTHNESS: f64 = 4.0;
/// Most halvings of a step of the second kind.
const MOST_HALVINGS: usize = 8;
/// Weight by which one node is held where it is, over its diagonal entry: the energy leaves the place open.
const PIN: f64 = 1.0;

/// The energy of spokes: node i's edge to j counts `weight[i]`·|image − target|².
struct Spokes<'a> {
    offsets: &'a Offsets,
    /// 2 aᵢ / Σ|x|²: then the energy of an affine map J against R is aᵢ|J − R|² where offsets spread evenly.
    weight: Vec<f64>,
}

/// Moves the nodes of a connected chart, upright for the most part, towards isometry. The first stage always; the
/// second if no node is folded then. Where a system cannot be solved the map stays as it was. Deterministic.
/// O(n^1.5) for the factor of a sheet of n nodes.
pub(super) fn relax(
    offsets: &Offsets,
    area: &[f64],
    uv: &mut Vec<Point2<f64>>,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let weight = (0..offsets.len())
        .map(|i| {
            let spread: f64 = offsets.around(i).map(|(_, x)| x.norm_squared()).sum();
            if spread > 0.0 { 2.0 * area[i] / spread } else { 0.0 }
        })
        .collect();
    let spokes = Spokes { offsets, weight };
    spokes.rigid_steps(uv, progress)?;
    spokes.dirichlet_steps(area, uv, progress)
}

/// A solver for a pattern; `None` where it is beyond one.
fn solver(pattern: SparsePattern) -> Result<Option<SparseCholesky>, Cancelled> {
    match SparseCholesky::analyse(pattern) {
        Ok(system) => Ok(Some(system)),
        Err(SparseError::OutOfMemory(error)) => Err(Cancelled::OutOfMemory(error)),
        Err(_) => Ok(None),
    }
}

impl Spokes<'_> {
    fn rigid_steps(&self, uv: &mut Vec<Point2<f64>>, progress: &Progress) -> Result<(), Cancelled> {
        let n = self.offsets.len();
        let Some(mut system) = solver(self.pattern())? else { return Ok(()) };
        let mut values = vec![0.0; system.pattern().entry_count()];
        for i in 0..n {
            for (j, _) in self.offsets.around(i) {
                let w = self.weight[i];
                for (r, c, v) in [(i, i, w), (j, j, w), (i, j, -w)] {
                    if let Some(at) = system.pattern().position(r, c) {
                        values[at] += v;
                    }
                }
            }
        }
        let pin = system.pattern().position(0, 0).map_or(0.0, |at| {
            let held = PIN * values[at];
            values[at] += held;
            held
        });
        if system.refactor(&values).is_err() {
            return Ok(());
        }
        let mut last = f64::INFINITY;
        for _ in 0..RIGID_STEPS {
            progress.check()?;
            let turns: Vec<Vector2<f64>> =
                (0..n).into_par_iter().with_min_len(1024).map(|i| self.turn(i, uv)).collect();
            let mut columns = vec![0.0; 2 * n];
            let mut energy = 0.0;
            for i in 0..n {
                let w = self.weight[i];
                for (j, x) in self.offsets.around(i) {
                    let target = turned(turns[i], x);
                    energy += w * (uv[j] - uv[i] - target).norm_squared();
                    for c in 0..2 {
                        columns[c * n + j] += w * target[c];
                        columns[c * n + i] -= w * target[c];
                    }
                }
            }
            if energy >= last * (1.0 - LEAST_GAIN) || !energy.is_finite() {
                break;
            }
            last = energy;
            for c in 0..2 {
                columns[c * n] += pin * uv[0][c];
            }
            system.solve_in_place(&mut columns);
            if columns.iter().any(|x| !x.is_finite()) {
                break;
            }
            *uv = (0..n).map(|i| Point2::new(columns[i], columns[n + i])).collect();
        }
        Ok(())
    }

    fn dirichlet_steps(&self, area: &[f64], uv: &mut Vec<Point2<f64>>, progress: &Progress) -> Result<(), Cancelled> {
        let n = self.offsets.len();
        let mut energy = self.dirichlet(area, uv);
        if !energy.is_finite() {
            return Ok(());
        }
        let Some(mut system) = solver(self.pattern().with_blocks_of_two())? else { return Ok(()) };
        let floor = 4.0 * area.iter().sum::<f64>();
        let blocks = BlockPlaces::new(self.offsets, system.pattern());
        for _ in 0..DIRICHLET_STEPS {
            progress.check()?;
            let (values, mut step) = self.weighted_system(uv, &blocks, system.pattern().entry_count());
            if system.refactor(&values).is_err() {
                break;
            }
            system.solve_in_place(&mut step);
            if step.iter().any(|x| !x.is_finite()) {
                break;
            }
            let mut length = 1.0;
            let found = (0..MOST_HALVINGS).find_map(|_| {
                let moved: Vec<Point2<f64>> = uv
                    .iter()
                    .enumerate()
                    .map(|(i, p)| p + Vector2::new(step[2 * i], step[2 * i + 1]) * length)
                    .collect();
                length *= 0.5;
                let there = self.dirichlet(area, &moved);
                (there < energy).then_some((there, moved))
            });
            let Some((there, moved)) = found else { break };
            *uv = moved;
            let gain = energy - there;
            energy = there;
            // An isometry has energy 4 an area.
            if gain < LEAST_GAIN * (energy - floor).max(LEAST_GAIN * floor) {
                break;
            }
        }
        debug_assert_eq!(uv.len(), n);
        Ok(())
    }

    fn pattern(&self) -> SparsePattern {
        let n = self.offsets.len();
        let pairs = (0..n).flat_map(|i| self.offsets.around(i).map(move |(j, _)| (i as u32, j as u32)));
        SparsePattern::from_pairs(n, pairs)
    }

    /// Cosine and sine of the rotation that takes the offsets of a node nearest to their images.
    fn turn(&self, i: usize, uv: &[Point2<f64>]) -> Vector2<f64> {
        let (mut dot, mut cross) = (0.0, 0.0);
        for (j, x) in self.offsets.around(i) {
            let image = uv[j] - uv[i];
            dot += x.dot(&image);
            cross += x.perp(&image);
        }
        let length = dot.hypot(cross);
        if length > 0.0 { Vector2::new(dot, cross) / length } else { Vector2::x() }
    }

    /// Σ a (|J|² + |J⁻¹|²) + 4 Σ w |image − J x|², infinite if a node is folded. The second sum holds against
    /// maps that waver from node to node, which the Jacobians, being means, do not see.
    fn dirichlet(&self, area: &[f64], uv: &[Point2<f64>]) -> f64 {
        let local: Vec<f64> = (0..self.offsets.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| match self.offsets.jacobian(i, uv) {
                None => 0.0,
                Some(j) => {
                    let det = j.determinant();
                    let rough: f64 = self.offsets.around(i).map(|(k, x)| (uv[k] - uv[i] - j * x).norm_squared()).sum();
                    let smooth = area[i] * j.norm_squared() * (1.0 + 1.0 / (det * det));
                    if det > 0.0 { smooth + SMOOTHNESS * self.weight[i] * rough } else { f64::INFINITY }
                }
            })
            .collect();
        local.iter().sum()
    }

    /// Matrix and right-hand side, for the step, of the quadratic energy Σ w |Wᵢ(uⱼ − uᵢ − Rᵢ x)|².
    fn weighted_system(&self, uv: &[Point2<f64>], blocks: &BlockPlaces, entries: usize) -> (Vec<f64>, Vec<f64>) {
        let n = self.offsets.len();
        let proxies: Vec<(Matrix2<f64>, Matrix2<f64>)> =
            (0..n).into_par_iter().with_min_len(1024).map(|i| self.proxy(i, uv)).collect();
        let mut values = vec![0.0; entries];
        let mut step = vec![0.0; 2 * n];
        let mut arc = 0;
        for i in 0..n {
            let (square, rotation) = &proxies[i];
            let block = square * self.weight[i];
            for (j, x) in self.offsets.around(i) {
                let pull = block * (rotation * x - (uv[j] - uv[i]));
                for c in 0..2 {
                    step[2 * j + c] += pull[c];
                    step[2 * i + c] -= pull[c];
                }
                blocks.add(&mut values, i, &block);
                blocks.add(&mut values, j, &block);
                blocks.subtract_between(&mut values, arc, &block);
                arc += 1;
            }
        }
        let [first, _, second] = blocks.diagonal[0];
        let held = PIN * values[first as usize].max(values[second as usize]);
        values[first as usize] += held;
        values[second as usize] += held;
        (values, step)
    }

    /// W², and the rotation nearest to the Jacobian: at σ the slope of the proxy |W(J − R)|² is that of the energy.
    fn proxy(&self, i: usize, uv: &[Point2<f64>]) -> (Matrix2<f64>, Matrix2<f64>) {
        let turn = self.turn(i, uv);
        let rigid = Matrix2::new(turn.x, -turn.y, turn.y, turn.x);
        let Some(j) = self.offsets.jacobian(i, uv) else { return (Matrix2::identity() * 4.0, rigid) };
        let [high, low] = distortion::singular_values(&j);
        // (σ − σ⁻³)/(σ − 1), whose limit at 1 is 4.
        let square = |s: f64| ((s + 1.0) * (s * s + 1.0) / (s * s * s)).clamp(1e-3, 1e6);
        let rotation = {
            let turn = Vector2::new(j.m11 + j.m22, j.m21 - j.m12);
            let length = turn.norm();
            if length > 0.0 { Matrix2::new(turn.x, -turn.y, turn.y, turn.x) / length } else { rigid }
        };
        // J Jᵀ = U diag(σ²) Uᵀ, so W² is the linear function of it with the right values at both σ².
        let (gram, spread) = (j * j.transpose(), high * high - low * low);
        let isotropic = Matrix2::identity() * square(high);
        let weight = if spread > 1e-9 * high * high {
            let slope = (square(high) - square(low)) / spread;
            isotropic + (gram - Matrix2::identity() * (high * high)) * slope
        } else {
            isotropic
        };
        (weight, rotation)
    }
}

fn turned(turn: Vector2<f64>, x: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(turn.x * x.x - turn.y * x.y, turn.y * x.x + turn.x * x.y)
}

/// Where the 2×2 blocks of nodes and edges are kept in the values of the system.
struct BlockPlaces {
    /// Entries (0,0), (0,1), (1,1) of a node.
    diagonal: Vec<[u32; 3]>,
    /// Entries (0,0), (0,1), (1,0), (1,1) of an arc, row by row of its first node (or the transpose: blocks are
    /// symmetric).
    between: Vec<[u32; 4]>,
}

impl BlockPlaces {
    fn new(offsets: &Offsets, pattern: &SparsePattern) -> Self {
        let at = |i: usize, j: usize| pattern.position(i, j).unwrap_or(0) as u32;
        let diagonal = |i: usize| [at(2 * i, 2 * i), at(2 * i, 2 * i + 1), at(2 * i + 1, 2 * i + 1)];
        let mut between = Vec::with_capacity(offsets.arc_count());
        for i in 0..offsets.len() {
            for (j, _) in offsets.around(i) {
                let (a, b) = (2 * i, 2 * j);
                between.push([at(a, b), at(a, b + 1), at(a + 1, b), at(a + 1, b + 1)]);
            }
        }
        Self { diagonal: (0..offsets.len()).map(diagonal).collect(), between }
    }

    fn add(&self, values: &mut [f64], node: usize, block: &Matrix2<f64>) {
        for (place, v) in self.diagonal[node].iter().zip([block.m11, block.m12, block.m22]) {
            values[*place as usize] += v;
        }
    }

    fn subtract_between(&self, values: &mut [f64], arc: usize, block: &Matrix2<f64>) {
        for (place, v) in self.between[arc].iter().zip([block.m11, block.m12, block.m21, block.m22]) {
            values[*place as usize] -= v;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::local_map::{Offset, measure, tests::sheet};
    use nalgebra::Point3;

    /// The same positions, mirrored if the normals look down.
    fn upright(offsets: &Offsets, area: &[f64], uv: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
        let side = if measure(offsets, area, &uv).mirrored { -1.0 } else { 1.0 };
        uv.into_iter().map(|p| Point2::new(side * p.x, p.y)).collect()
    }

    fn relaxed(offsets: &Offsets, area: &[f64], start: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
        let mut uv = upright(offsets, area, start);
        relax(offsets, area, &mut uv, &Progress::new()).expect("not cancelled");
        uv
    }

    #[test]
    fn a_distorted_plane_becomes_the_plane_again() {
        let (sample, plane) = sheet(25, |x, y| Point3::new(x, y, 0.0));
        let offsets = Offsets::new(&sample, Offset::Unbent);
        let start =
            plane.iter().map(|p| Point2::new(1.1 * p.x + 0.1 * p.y * p.y, p.y + 0.05 * (3.0 * p.x).sin())).collect();
        let uv = relaxed(&offsets, &sample.area, start);
        let stretch = measure(&offsets, &sample.area, &uv);
        assert!(stretch.l2 < 1.0 + 1e-5, "{}", stretch.l2);
    }

    #[test]
    fn a_fold_at_the_border_is_undone() {
        let (sample, plane) = sheet(25, |x, y| Point3::new(x, y, 0.2 * x * y));
        let offsets = Offsets::new(&sample, Offset::Unbent);
        let start: Vec<_> = plane.iter().map(|p| Point2::new(0.75 - (p.x - 0.75).abs(), p.y)).collect();
        assert!(!measure(&offsets, &sample.area, &start).folded.is_empty());
        let stretch = measure(&offsets, &sample.area, &relaxed(&offsets, &sample.area, start));
        assert!(stretch.folded.is_empty() && stretch.l2 < 1.01, "{stretch:?}");
    }

    #[test]
    fn the_second_stage_lowers_the_stretch_of_a_cap() {
        // A cap of 60°, from its azimuthal projection.
        let (sample, plane) = sheet(30, |x, y| {
            let (x, y) = (0.7 * x, 0.7 * y);
            Point3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
        });
        let offsets = Offsets::new(&sample, Offset::Unbent);
        let before = measure(&offsets, &sample.area, &plane).l2;
        let after = measure(&offsets, &sample.area, &relaxed(&offsets, &sample.area, plane)).l2;
        assert!(after < 1.0 + 0.5 * (before - 1.0), "{before} {after}");
    }

    #[test]
    fn the_proxy_has_the_slope_of_the_energy() {
        let (sample, plane) = sheet(9, |x, y| Point3::new(x, y, 0.0));
        let offsets = Offsets::new(&sample, Offset::Unbent);
        let spokes = Spokes { offsets: &offsets, weight: vec![1.0; offsets.len()] };
        let map = Matrix2::new(1.3, 0.2, -0.4, 0.8);
        let uv = upright(&offsets, &sample.area, plane.iter().map(|p| map * p).collect());
        let (square, rotation) = spokes.proxy(40, &uv);
        let [a, b] = sample_frame(&offsets, 40, &uv);
        let slope = square * (a - rotation) * 2.0;
        let energy = |j: &Matrix2<f64>| j.norm_squared() * (1.0 + 1.0 / (j.determinant() * j.determinant()));
        for k in 0..4 {
            let mut there = a;
            there[k] += 1e-6;
            let difference = (energy(&there) - b[0]) / 1e-6;
            assert!((difference - slope[k]).abs() < 1e-4, "{k}: {difference} {}", slope[k]);
        }
    }

    /// The Jacobian at a node, and its energy in every entry of a matrix.
    fn sample_frame(offsets: &Offsets, i: usize, uv: &[Point2<f64>]) -> [Matrix2<f64>; 2] {
        let j = offsets.jacobian(i, uv).expect("spread out");
        let energy = j.norm_squared() * (1.0 + 1.0 / (j.determinant() * j.determinant()));
        [j, Matrix2::from_element(energy)]
    }
}
