//! What is disliked about a cutting, and how much: every weight of the search is here.
//!
//! The cost of the charts of a surface of area A is the sum over them of
//!
//! [`CHART`] + ½·seam/√A + p·(area/A)·(L2² − 1)
//!
//! in units of √A. A seam has two sides, hence the half; p is [`Settings::stretch_price`]. A move is made only if the cost
//! falls. The limit is no part of the cost: what is over it is no chart.

use crate::charts::{Chart, Patch};
use crate::mesh::{TriMesh, measure};
use crate::settings::Settings;

/// A chart costs as much as a seam of so many √A: with less, strips are left that nobody would cut off; with more, charts hang
/// together by a few edges.
pub(super) const CHART: f64 = 1.5;
/// A chart of at most this L2 stretch is unrolled: half a degree between the normals of two faces gives 1.0001, and nobody sees a
/// tenth of a per cent.
const UNROLLED: f64 = 1.001;

/// The prices on one surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Price {
    area: f64,
    /// [`Settings::stretch_price`].
    stretch: f64,
}

impl Price {
    pub(crate) fn new(mesh: &TriMesh, settings: &Settings) -> Self {
        Self { area: measure::total_area(mesh).max(f64::MIN_POSITIVE), stretch: settings.stretch_price }
    }

    /// What some length of seam costs.
    pub(super) fn of_seam(&self, length: f64) -> f64 {
        length / self.area.sqrt()
    }

    /// The excess of squared stretch, times area, that some length of seam is worth.
    pub(super) fn excess_worth(&self, length: f64) -> f64 {
        self.area * self.of_seam(length) / self.stretch
    }

    /// What the stretch of a chart costs.
    fn of_stretch(&self, chart: &Chart) -> f64 {
        self.stretch * chart.patch.area() / self.area * (chart.l2 * chart.l2 - 1.0).max(0.0)
    }

    /// What a chart costs.
    pub(super) fn of(&self, chart: &Chart) -> f64 {
        let mesh = &chart.patch.mesh;
        let border = mesh.halfedges().filter(|&h| mesh.is_boundary(h));
        let seam: f64 = border.map(|h| mesh.edge_length(h) * mesh.border_cost(h)).sum();
        CHART + 0.5 * self.of_seam(seam) + self.of_stretch(chart)
    }

    /// The stretch up to which a patch is made one chart. With more, a cut may be worth its seam, if it took all of the stretch away
    /// and were as long as the patch is wide. Where it was not, the parts are joined again.
    pub(super) fn limit(&self, patch: &Patch, settings: &Settings) -> f64 {
        let width = (patch.area() / self.area).sqrt();
        // Without a price there is no bound, and one that is not a number, of no area, is none.
        settings.stretch_limit.min((1.0 + 1.0 / (self.stretch * width)).sqrt())
    }

    /// Whether what unrolls may be bent: where stretch has no price, the limit alone says so.
    pub(super) fn may_bend(&self) -> bool {
        self.stretch <= 0.0
    }

    /// Whether some charts are better than those in whose place they would come. That the limit allows it is no reason to bend what
    /// unrolls.
    pub(super) fn is_worth(&self, old: &[&Chart], new: &[Chart]) -> bool {
        let unrolls = |chart: &Chart| chart.l2 <= UNROLLED;
        if !self.may_bend() && old.iter().all(|chart| unrolls(chart)) && !new.iter().all(unrolls) {
            return false;
        }
        let before: f64 = old.iter().map(|chart| self.of(chart)).sum();
        let after: f64 = new.iter().map(|chart| self.of(chart)).sum();
        after < before
    }
}

#[cfg(test)]
mod tests {
    use super::super::state::tests::strips;
    use super::*;
    use crate::mesh::test_surfaces;

    fn price(mesh: &TriMesh, stretch_price: f64) -> Price {
        Price::new(mesh, &Settings { stretch_price, ..Settings::default() })
    }

    #[test]
    fn the_terms_are_in_roots_of_the_area() {
        for scale in [1.0, 1e-3, 1e3] {
            let mesh = test_surfaces::grid(6, 4, [6.0 * scale, 4.0 * scale], 0.0);
            let (_, charts) = strips(&mesh, 6.0 * scale, 2);
            let mut half = charts[0].clone();
            let root = 24.0_f64.sqrt();
            let price = price(&mesh, 8.0);
            // Half of a rectangle of 6 by 4: 14 around.
            assert!((price.of(&half) - CHART - 7.0 / root).abs() < 1e-9);
            assert!((price.of_seam(4.0 * scale) - 4.0 / root).abs() < 1e-9);
            half.l2 = 1.1;
            assert!((price.of_stretch(&half) - 8.0 * 0.5 * 0.21).abs() < 1e-9);
        }
    }

    #[test]
    fn stretch_is_weighed_against_seam_and_charts() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (one, two) = (strips(&mesh, 6.0, 1).1, strips(&mesh, 6.0, 2).1);
        let stretched = |l2: f64| vec![Chart { l2, ..one[0].clone() }];
        let gain = CHART + 4.0 / 24.0_f64.sqrt();
        let even = (1.0 + gain / 8.0_f64).sqrt();
        let price = price(&mesh, 8.0);
        let bent: Vec<Chart> = two.iter().map(|c| Chart { l2: 1.01, ..c.clone() }).collect();
        let worth = |old: &[Chart], new: &[Chart]| price.is_worth(&old.iter().collect::<Vec<_>>(), new);
        assert!(worth(&bent, &stretched(even - 0.01)) && !worth(&bent, &stretched(even + 0.02)));
        assert!(worth(&stretched(even + 0.01), &two) && !worth(&stretched(even - 0.01), &two));
        assert!(worth(&two, &one) && !worth(&two, &two));
    }

    #[test]
    fn what_unrolls_is_bent_only_where_stretch_has_no_price() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (one, two) = (strips(&mesh, 6.0, 1).1, strips(&mesh, 6.0, 2).1);
        let bent = [Chart { l2: 1.002, ..one[0].clone() }];
        let old: Vec<&Chart> = two.iter().collect();
        assert!(!price(&mesh, 1e-3).is_worth(&old, &bent) && price(&mesh, 0.0).is_worth(&old, &bent));
        assert!(price(&mesh, 1e-3).is_worth(&old, &one));
    }

    #[test]
    fn large_patches_are_cut_at_less_stretch_than_small_ones_and_none_over_the_limit() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (whole, half) = (strips(&mesh, 6.0, 1).1[0].patch.clone(), strips(&mesh, 6.0, 2).1[0].patch.clone());
        let limits = |p: f64| {
            let settings = Settings { stretch_price: p, stretch_limit: 1.1, ..Settings::default() };
            let price = Price::new(&mesh, &settings);
            [price.limit(&whole, &settings), price.limit(&half, &settings)]
        };
        assert_eq!(limits(0.0), [1.1, 1.1]);
        let [of_whole, of_half] = limits(20.0);
        assert!((of_whole - 1.05_f64.sqrt()).abs() < 1e-12 && of_whole < of_half && of_half < 1.1);
        assert_eq!(limits(1.0), [1.1, 1.1], "the limit is the limit");
    }
}
