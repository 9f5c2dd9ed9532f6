//! Energies of one triangle's map, with exact gradients and projected Hessians in closed form.
//!
//! Every energy here is a function h(I, d) of two invariants of the Jacobian J: I = |J|² = σ₁² + σ₂²
//! and d = det J = σ₁σ₂, where σ₂ carries the sign. Its Hessian in J has four eigenmatrices known in
//! advance (Smith, de Goes, Kim: Analytic eigensystems for isotropic distortion energies, ACM TOG
//! 2019, section 4): with J = U diag(σ) Vᵀ
//! - twist, U [0 −1; 1 0] Vᵀ/√2, eigenvalue 2h_I + h_d;
//! - flip, U [0 1; 1 0] Vᵀ/√2, eigenvalue 2h_I − h_d;
//! - the two stretchings, a 2×2 block, ∂²h/∂σᵢ∂σⱼ.
//!
//! Setting negative eigenvalues to zero gives the nearest positive semidefinite Hessian.

use nalgebra::{Matrix2, Vector2};

use crate::distortion::{RestTriangle, squared_stretch_of};

/// Derivatives of h(I, d).
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivatives {
    pub(super) i: f64,
    pub(super) d: f64,
    pub(super) ii: f64,
    pub(super) id: f64,
    pub(super) dd: f64,
}

/// An energy of a 2×2 Jacobian that depends on its singular values only.
pub(super) trait IsotropicEnergy {
    /// h(I, d); infinite where the energy is not defined.
    fn value(&self, i: f64, d: f64) -> f64;
    /// Derivatives of h, where h is finite.
    fn derivatives(&self, i: f64, d: f64) -> Derivatives;
}

/// (1−w)·½(e + d) + w·¼(I + I/d²), with e = ½(1/σ₁² + 1/σ₂²) = I/2d² the squared stretch and d the
/// area ratio; infinite for d ≤ 0 and 1 at an isometry.
///
/// Summed over a chart with the areas A₃ (ΣA₃ = 1) as weights, its first part is ½(E + A₂), with
/// E = Σ A₃e and A₂ the area in the plane. Scaling the chart by t makes that ½(E/t² + t²A₂), whose
/// least value over t is √(E·A₂): the L2 stretch itself. So minimising this plain sum of triangles,
/// scale free, minimises the *area-normalised* L2 stretch exactly; inflating the chart gains
/// nothing. The second part is the symmetric Dirichlet energy, which keeps all derivatives in check
/// where L2 alone lets a triangle grow (Smith and Schaefer 2015).
#[derive(Clone, Copy, Debug)]
pub(super) struct StretchEnergy {
    area: f64,
    dirichlet: f64,
}

impl StretchEnergy {
    /// The energy with weight `w` (0 to 1) of the symmetric Dirichlet part.
    pub(super) fn new(w: f64) -> Self {
        let w = w.clamp(0.0, 1.0);
        Self { area: 0.5 * (1.0 - w), dirichlet: 0.25 * w }
    }
}

impl IsotropicEnergy for StretchEnergy {
    fn value(&self, i: f64, d: f64) -> f64 {
        if d > 0.0 { 0.5 * squared_stretch_of(i, d) + self.area * d + self.dirichlet * i } else { f64::INFINITY }
    }

    fn derivatives(&self, i: f64, d: f64) -> Derivatives {
        let r = 1.0 / d;
        let r2 = r * r;
        Derivatives {
            i: 0.25 * r2 + self.dirichlet,
            d: -0.5 * i * r2 * r + self.area,
            ii: 0.0,
            id: -0.5 * r2 * r,
            dd: 1.5 * i * r2 * r2,
        }
    }
}

/// The stretch energy h, and beside it a power of the squared stretch e that counts only where e is near its peak m:
/// h + W·m/p·(e/m)ᵖ. The slope of the second term in e is W at the peak and an eighth of that at half of it; that of h is ½.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeakEnergy {
    plain: StretchEnergy,
    peak: f64,
}

impl PeakEnergy {
    /// W.
    const WEIGHT: f64 = 4.0;
    /// p.
    const POWER: i32 = 4;

    /// For a map whose greatest squared stretch is `peak`, with weight `w` of the symmetric Dirichlet part.
    pub(super) fn new(w: f64, peak: f64) -> Self {
        Self { plain: StretchEnergy::new(w), peak }
    }
}

impl IsotropicEnergy for PeakEnergy {
    fn value(&self, i: f64, d: f64) -> f64 {
        let share = squared_stretch_of(i, d) / self.peak;
        self.plain.value(i, d) + Self::WEIGHT * self.peak / f64::from(Self::POWER) * share.powi(Self::POWER)
    }

    fn derivatives(&self, i: f64, d: f64) -> Derivatives {
        let r = 1.0 / d;
        let r2 = r * r;
        // e in I and d, then the power in e.
        let (e_i, e_d, e_id, e_dd) = (0.5 * r2, -i * r2 * r, -r2 * r, 3.0 * i * r2 * r2);
        let share = squared_stretch_of(i, d) / self.peak;
        let slope = Self::WEIGHT * share.powi(Self::POWER - 1);
        let curve = Self::WEIGHT * f64::from(Self::POWER - 1) * share.powi(Self::POWER - 2) / self.peak;
        let plain = self.plain.derivatives(i, d);
        Derivatives {
            i: plain.i + slope * e_i,
            d: plain.d + slope * e_d,
            ii: plain.ii + curve * e_i * e_i,
            id: plain.id + curve * e_i * e_d + slope * e_id,
            dd: plain.dd + curve * e_d * e_d + slope * e_dd,
        }
    }
}

/// ½(I + d² + 1)/χ(d) with χ(d) = ½(d + √(d² + ε²)): finite for every map, 2 at an isometry as ε → 0.
///
/// As ε falls flipped triangles cost more and more, while the energy of positive ones tends to
/// I/2d + ½(d + 1/d) (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps in
/// 50 lines of code, ACM TOG 2021, equations 3 to 5).
#[derive(Clone, Copy, Debug)]
pub(super) struct FoldoverEnergy {
    pub(super) epsilon: f64,
}

impl IsotropicEnergy for FoldoverEnergy {
    fn value(&self, i: f64, d: f64) -> f64 {
        0.5 * (i + d * d + 1.0) / self.chi(d)[0]
    }

    fn derivatives(&self, i: f64, d: f64) -> Derivatives {
        let [chi, chi1, chi2] = self.chi(d);
        let (n, r) = (0.5 * (i + d * d + 1.0), 1.0 / chi);
        let slope = -chi1 * r * r;
        let curve = (2.0 * chi1 * chi1 * r - chi2) * r * r;
        Derivatives { i: 0.5 * r, d: d * r + n * slope, ii: 0.0, id: 0.5 * slope, dd: r + 2.0 * d * slope + n * curve }
    }
}

impl FoldoverEnergy {
    /// χ, χ' and χ'', without cancellation for negative d.
    fn chi(&self, d: f64) -> [f64; 3] {
        let e2 = self.epsilon * self.epsilon;
        let root = (d * d + e2).sqrt();
        let chi = if d > 0.0 { 0.5 * (d + root) } else { 0.5 * e2 / (root - d) };
        [chi, chi / root, 0.5 * e2 / (root * root * root)]
    }
}

/// Gradients of a rest triangle's barycentric coordinates: J = Σ pₖ gₖᵀ for corners pₖ in the plane. That of the third
/// corner is (0, `up`), and all three add up to nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct HatGradients {
    second: Vector2<f64>,
    up: f64,
}

impl HatGradients {
    pub(super) fn new(rest: &RestTriangle) -> Self {
        Self { second: Vector2::new(1.0 / rest.x1, -rest.x2 / (rest.x1 * rest.y2)), up: 1.0 / rest.y2 }
    }

    #[inline]
    fn of_corners(&self) -> [Vector2<f64>; 3] {
        let third = Vector2::new(0.0, self.up);
        [-(self.second + third), self.second, third]
    }

    /// Jacobian of the map that takes the rest triangle to a triangle with edges `d1`, `d2` from its
    /// first corner; also of a displacement field.
    #[inline]
    pub(super) fn jacobian(&self, d1: Vector2<f64>, d2: Vector2<f64>) -> Matrix2<f64> {
        let (a, up) = (self.second, self.up);
        Matrix2::new(d1.x * a.x, d1.x * a.y + d2.x * up, d1.y * a.x, d1.y * a.y + d2.y * up)
    }
}

/// First and projected second derivative of an energy in the positions of a triangle's corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceDerivatives {
    pub(super) gradient: [Vector2<f64>; 3],
    /// `diagonal[k]` is the symmetric block of corner k.
    pub(super) diagonal: [Matrix2<f64>; 3],
    /// `across[k]` is the block with corner k down and corner k + 1 across.
    pub(super) across: [Matrix2<f64>; 3],
}

/// Derivatives of h for Jacobian `j`, eigenvalues of the Hessian clamped at zero; exact otherwise.
pub(super) fn face_derivatives<E: IsotropicEnergy>(
    energy: &E,
    hat: &HatGradients,
    j: &Matrix2<f64>,
) -> FaceDerivatives {
    // J = R(phi) diag(s) R(theta).
    let (e, f) = (0.5 * (j.m11 + j.m22), 0.5 * (j.m11 - j.m22));
    let (g, h) = (0.5 * (j.m21 + j.m12), 0.5 * (j.m21 - j.m12));
    let (q, r) = ((e * e + h * h).sqrt(), (f * f + g * g).sqrt());
    // theta is half the angle of (e, h) less half that of (f, g), phi the sum of both.
    let ((c2, s2), (c1, s1)) = (half_angle(e, h, q), half_angle(f, g, r));
    let (ct, st) = (c2 * c1 + s2 * s1, s2 * c1 - c2 * s1);
    let (cp, sp) = (c2 * c1 - s2 * s1, s2 * c1 + c2 * s1);
    let d = j.determinant();
    let s1 = q + r;
    let s2 = if s1 > 0.0 { d / s1 } else { 0.0 };
    let n = energy.derivatives(j.norm_squared(), d);

    let slope = [2.0 * s1 * n.i + s2 * n.d, 2.0 * s2 * n.i + s1 * n.d];
    let twist = (2.0 * n.i + n.d).max(0.0);
    let flip = (2.0 * n.i - n.d).max(0.0);
    let (x, y, p) = (s1 * s1, s2 * s2, s1 * s2);
    let [a, b, c] = project(
        2.0 * n.i + 4.0 * x * n.ii + 4.0 * p * n.id + y * n.dd,
        4.0 * p * n.ii + 2.0 * (x + y) * n.id + p * n.dd + n.d,
        2.0 * n.i + 4.0 * y * n.ii + 4.0 * p * n.id + x * n.dd,
    );
    let (same, cross) = (0.5 * (twist + flip), 0.5 * (flip - twist));

    // In the frame of U, corner k moves stretch 1 by g·v₁ along the first axis, and so on.
    let v = hat.of_corners().map(|g| Vector2::new(ct * g.x - st * g.y, st * g.x + ct * g.y));
    let out = |x: f64, y: f64| Vector2::new(cp * x - sp * y, sp * x + cp * y);
    let block = |k: usize, l: usize| {
        let (k, l) = (v[k], v[l]);
        let m11 = a * k.x * l.x + same * k.y * l.y;
        let m22 = c * k.y * l.y + same * k.x * l.x;
        let m12 = b * k.x * l.y + cross * k.y * l.x;
        let m21 = b * k.y * l.x + cross * k.x * l.y;
        // R(phi) M R(phi)ᵀ.
        let (c1, c2) = (out(m11, m21), out(m12, m22));
        let (r1, r2) = (out(c1.x, c2.x), out(c1.y, c2.y));
        Matrix2::new(r1.x, r1.y, r2.x, r2.y)
    };
    FaceDerivatives {
        gradient: v.map(|v| out(slope[0] * v.x, slope[1] * v.y)),
        diagonal: [block(0, 0), block(1, 1), block(2, 2)],
        across: [block(0, 1), block(1, 2), block(2, 0)],
    }
}

/// Cosine and sine of half the angle of (x, y), which lies between −90° and 90°, where (x, y) has this norm; of no angle
/// if that is 0. Four times as fast as the arc tangent.
#[inline]
fn half_angle(x: f64, y: f64, norm: f64) -> (f64, f64) {
    if norm == 0.0 {
        return (1.0, 0.0);
    }
    let (c, s) = (x / norm, y / norm);
    // The root that does not cancel first.
    if c > 0.0 {
        let cos = (0.5 * (1.0 + c)).sqrt();
        (cos, 0.5 * s / cos)
    } else {
        let sin = (0.5 * (1.0 - c)).sqrt().copysign(s);
        (0.5 * s / sin, sin)
    }
}

/// The nearest positive semidefinite matrix to [a b; b c].
fn project(a: f64, b: f64, c: f64) -> [f64; 3] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = (half * half + b * b).sqrt();
    if mean - radius >= 0.0 {
        return [a, b, c];
    }
    let top = mean + radius;
    if top <= 0.0 {
        return [0.0; 3];
    }
    // top · (unit eigenvector)(unit eigenvector)ᵀ; here radius > |mean| ≥ 0.
    let scale = 0.5 * top / radius;
    [scale * (radius + half), scale * b, scale * (radius - half)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, SVector, Vector6};
    use proptest::prelude::*;

    type V6 = SVector<f64, 6>;

    fn jacobian(hat: &HatGradients, x: &V6) -> Matrix2<f64> {
        hat.jacobian(Vector2::new(x[2] - x[0], x[3] - x[1]), Vector2::new(x[4] - x[0], x[5] - x[1]))
    }

    fn value<E: IsotropicEnergy>(energy: &E, hat: &HatGradients, x: &V6) -> f64 {
        let j = jacobian(hat, x);
        energy.value(j.norm_squared(), j.determinant())
    }

    fn gradient<E: IsotropicEnergy>(energy: &E, hat: &HatGradients, x: &V6) -> V6 {
        let d = face_derivatives(energy, hat, &jacobian(hat, x));
        Vector6::from_iterator(d.gradient.iter().flat_map(|g| [g.x, g.y]))
    }

    fn hessian<E: IsotropicEnergy>(energy: &E, hat: &HatGradients, x: &V6) -> Matrix6<f64> {
        let d = face_derivatives(energy, hat, &jacobian(hat, x));
        let mut m = Matrix6::zeros();
        for k in 0..3 {
            let l = (k + 1) % 3;
            m.fixed_view_mut::<2, 2>(2 * k, 2 * k).copy_from(&d.diagonal[k]);
            m.fixed_view_mut::<2, 2>(2 * k, 2 * l).copy_from(&d.across[k]);
            m.fixed_view_mut::<2, 2>(2 * l, 2 * k).copy_from(&d.across[k].transpose());
        }
        m
    }

    fn check<E: IsotropicEnergy>(energy: &E, rest: &RestTriangle, x: &V6) -> Result<(), TestCaseError> {
        let hat = HatGradients::new(rest);
        let d = jacobian(&hat, x).determinant();
        let h = 1e-5 * d.abs().min(1.0);
        let mut differences = Matrix6::zeros();
        let g = gradient(energy, &hat, x);
        let scale = 1.0 + g.norm();
        for k in 0..6 {
            let mut step = V6::zeros();
            step[k] = h;
            let df = (value(energy, &hat, &(x + step)) - value(energy, &hat, &(x - step))) / (2.0 * h);
            prop_assert!((df - g[k]).abs() < 1e-4 * scale, "gradient {k}: {df} {}", g[k]);
            let dg = (gradient(energy, &hat, &(x + step)) - gradient(energy, &hat, &(x - step))) / (2.0 * h);
            differences.set_column(k, &dg);
        }
        let projected = hessian(energy, &hat, x);
        let size = 1.0 + differences.norm();
        prop_assert!((projected - projected.transpose()).norm() < 1e-9 * size);
        let eigen = projected.symmetric_eigen();
        prop_assert!(eigen.eigenvalues.min() > -1e-9 * size, "not positive: {}", eigen.eigenvalues);
        // Projection only adds: what it adds is positive semidefinite, and nothing where the exact
        // Hessian (in J) has no negative eigenvalue.
        let added = (projected - 0.5 * (differences + differences.transpose())).symmetric_eigen().eigenvalues;
        prop_assert!(added.min() > -1e-4 * size, "projection took away: {added}");
        let exact = (0.5 * (differences + differences.transpose())).symmetric_eigen().eigenvalues;
        if exact.min() > -1e-6 * size {
            prop_assert!(added.max() < 1e-3 * size, "projection changed a positive Hessian: {added}");
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn derivatives_match_finite_differences(
            rest in (0.3..3.0_f64, -1.0..3.0_f64, 0.2..3.0_f64),
            x in prop::array::uniform6(-2.0..2.0_f64),
            w in 0.0..1.0_f64,
            epsilon in 0.1..1.0_f64,
            peak in 1.0..3.0_f64,
        ) {
            let rest = RestTriangle { x1: rest.0, x2: rest.1, y2: rest.2 };
            let mut x = V6::from(x);
            check(&FoldoverEnergy { epsilon }, &rest, &x)?;
            let d = jacobian(&HatGradients::new(&rest), &x).determinant();
            prop_assume!(d.abs() > 0.05);
            if d < 0.0 {
                for k in 0..3 {
                    x[2 * k] = -x[2 * k];
                }
            }
            check(&StretchEnergy::new(w), &rest, &x)?;
            let j = jacobian(&HatGradients::new(&rest), &x);
            let peak = peak * 0.5 * j.norm_squared() / d.powi(2);
            check(&PeakEnergy::new(w, peak), &rest, &x)?;
        }

        #[test]
        fn projection_keeps_positive_and_drops_negative(a in -3.0..3.0_f64, b in -3.0..3.0_f64, c in -3.0..3.0_f64) {
            let [p, q, r] = project(a, b, c);
            let eigen = Matrix2::new(a, b, b, c).symmetric_eigen();
            let v = eigen.eigenvectors;
            let clamped = v * Matrix2::from_diagonal(&eigen.eigenvalues.map(|l| l.max(0.0))) * v.transpose();
            prop_assert!((clamped - Matrix2::new(p, q, q, r)).norm() < 1e-12);
        }
    }

    #[test]
    fn isometries_and_degenerate_maps() {
        let rest = RestTriangle { x1: 1.0, x2: 0.3, y2: 0.8 };
        let hat = HatGradients::new(&rest);
        for w in [0.0, 0.15, 1.0] {
            let energy = StretchEnergy::new(w);
            assert!((energy.value(2.0, 1.0) - 1.0).abs() < 1e-15);
            assert_eq!(energy.value(2.0, 0.0), f64::INFINITY);
            assert_eq!(energy.value(2.0, -1.0), f64::INFINITY);
            let d = face_derivatives(&energy, &hat, &Matrix2::identity());
            assert!(d.gradient.iter().all(|g| g.norm() < 1e-14));
        }
        // A collapsed triangle has finite derivatives under the regularised energy.
        let d = face_derivatives(&FoldoverEnergy { epsilon: 1e-2 }, &hat, &Matrix2::zeros());
        assert!(d.diagonal.iter().all(|m| m.iter().all(|x| x.is_finite())));
    }

    #[test]
    fn hat_gradients_agree_with_the_rest_triangle() {
        let rest = RestTriangle { x1: 0.7, x2: -0.2, y2: 1.3 };
        let p = [[0.1, 0.4], [1.2, -0.3], [0.9, 2.0]].map(|[x, y]| nalgebra::Point2::new(x, y));
        let j = HatGradients::new(&rest).jacobian(p[1] - p[0], p[2] - p[0]);
        assert!((j - rest.jacobian(p)).norm() < 1e-14);
    }
}
