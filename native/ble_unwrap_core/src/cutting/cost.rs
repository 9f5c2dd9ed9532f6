//! What is disliked about a cutting, and how much: every weight of the search is here.
//!
//! The cost of the charts of a surface of area A is the sum over them of
//!
//! [`CHART`] + ½·seam/√A + p·(area/A)·(L2² − 1)
//!
//! in units of √A. A seam has two sides, hence the half, and counts for more where it is seen and for less on a guide
//! ([`TriMesh::border_cost`]); p is [`Settings::stretch_price`]. A move of the search is made only if the cost
//! falls. The limit is no part of the cost: what is over it is no chart. To measure a weight again, change it and run `make quality` before and after.
//!
//! Three things that the sum does not see are weighed against seam by themselves, after the search: the worst stretch of a place
//! ([`lowers_peak`]), how much of a texture can be filled ([`fill_asks_for_a_cut`], [`fills_better`]) and is covered ([`value_of_cover`]), and whether borders
//! are straight ([`Price::is_worth_straightening`]).

use std::sync::Arc;

use crate::charts::{Chart, Patch};
use crate::distortion::{self, RestTriangle};
use crate::mesh::{FaceId, Groups, HalfedgeId, TriMesh, VertexId, measure};
use crate::settings::Settings;

/// A chart costs as much as a seam of so many √A. It is the rate at which the search traded charts for seam when that was still spread
/// over several rules; no other has been measured since.
pub(super) const CHART: f64 = 1.5;
/// A chart of at most this L2 stretch is unrolled: half a degree between the normals of two faces gives 1.0001, and nobody sees a
/// tenth of a per cent.
const UNROLLED: f64 = 1.001;
/// Where parts that unroll are joined along a part of their border, or a cut is closed from its end, no place is longer or shorter than on the surface by more than this share: where a part hangs on another by two edges with an angle between
/// them, a few faces around these give way by 5 to 40 per cent, which the mean over a chart hardly tells; a cable that winds gently is stretched by
/// less everywhere.
const UNROLLED_PLACE: f64 = 0.04;
/// A face of less than this share of a chart's area is no place, and what it is stretched by may be rounding.
const LEAST_PLACE: f64 = 1e-4;
/// A chart of at most this stretch is as flat as its faces' rounding and half a degree between them leave it.
const EXACT: f64 = 1.0001;

/// To straighten the sides of what unrolls costs so many times the stretch: the wall of a cup, a little wider above than below, becomes a
/// rectangle, and the fan of a cone stays as it is.
const BENDING: f64 = 5.0;
/// Minimisation stops within so much L2 stretch of the minimum.
const AT_REST: f64 = 1e-3;

/// A seam that nobody can see counts for this share of its length: no seam is for nothing.
const LEAST_WEIGHT: f64 = 0.1;
/// A seam in a mirror plane counts for so many times as much where more can be seen of it than of other places: it runs down the middle of a face. With 2 a head
/// made of triangles (`make shapes`) keeps a seam on its forehead, with 3 none of the upright ones does.
const FACE: f64 = 3.0;
/// What is glued of a border is at least so many times as long as the square root of the smaller chart's area: a chart that hangs on
/// by less is no easier to paint than one by itself.
pub(super) const LEAST_GLUED: f64 = 0.2;
/// The worst stretch of a place is lowered if its logarithm falls by so many times the share of the chart's boundary that is added to
/// the border: a third less stretch for 1 % more of it.
const PEAK: f64 = 40.0;
/// A chart is cut across if a texture that holds it, whatever its turn, can be filled to no more than this share by all charts.
const LEAST_FILL: f64 = 0.25;
/// The same for a body that was cut open, with seams all round: there one more shows less than across a plank. Over 16 models 0.25,
/// 0.4 and 0.5 give 3.18, 3.36 and 3.78 charts, seams of 3.20, 3.24 and 3.36 (geometric means), and fill 0.546, 0.567 and 0.584 of
/// the texture.
const LEAST_FILL_OF_BODIES: f64 = 0.4;
/// A body that was cut open borders on itself along at least this share of its boundary.
const LEAST_SELF_BORDER: f64 = 0.5;
/// A chart that is cut across at all, and its parts, are cut until a texture that holds them can be filled to this share.
const GOOD_FILL: f64 = 0.6;
/// A cut across is worth its seam if a texture that holds the parts needs at most this share of the length of one that holds the chart.
/// A cut in the middle of a strip comes to 0.5 to 0.6.
const LEAST_GAIN: f64 = 0.9;

/// A texture of which this share is covered is full enough: few layouts of one to three organic charts cover more.
const WELL_COVERED: f64 = 0.7;
/// A chart that fills this share of the smallest box around it lies well beside others.
const FILLS_ITS_BOX: f64 = 0.8;
/// Cuts that let charts be folded add no more than this share of the length of all seams, whatever they bring: a rock in three pieces is worse than a texture
/// that it half fills.
const MOST_SEAM_ADDED: f64 = 0.2;
/// A cut that lets charts be folded covers at least so much more of the texture: less is lost or won by chance when charts are packed.
const LEAST_COVER_GAINED: f64 = 0.06;

/// A mesh on which seams are the dearer the more they can be seen, by the power [`Settings::hide_seams`] of the visibility: each component by
/// itself, so that in the mean over its surface a border counts for its length, times what it counted for before.
pub(super) fn weighed(
    mesh: &Arc<TriMesh>,
    components: &Groups<FaceId>,
    visibility: &[f32],
    settings: &Settings,
) -> Arc<TriMesh> {
    let mut seam_weight: Vec<f32> = mesh.vertices().map(|v| mesh.seam_weight(v)).collect();
    let seen = |v: VertexId| f64::from(visibility[v.index()]).powf(settings.hide_seams);
    for faces in components.iter() {
        let (mut sum, mut total) = (0.0, 0.0);
        for &f in faces {
            let area = measure::triangle_area(mesh.triangle_positions(f));
            sum += area * mesh.triangle(f).map(seen).iter().sum::<f64>() / 3.0;
            total += area;
        }
        let mean = sum / total;
        // Where there is no area, or nothing at all can be seen, all places are alike.
        if mean > 0.0 {
            for v in faces.iter().flat_map(|f| mesh.triangle(*f)) {
                #[expect(clippy::cast_possible_truncation, reason = "a weight needs no more digits")]
                let weight = (seen(v) / mean).max(LEAST_WEIGHT) as f32;
                seam_weight[v.index()] = mesh.seam_weight(v) * weight;
            }
        }
    }
    Arc::new(TriMesh::clone(mesh).with_seam_weights(seam_weight))
}

/// How much dearer a seam along an edge is than one of the same length at a place that is seen as much as others.
pub(super) fn dearness(mesh: &TriMesh, h: HalfedgeId) -> f64 {
    mesh.edge_length(h) * (mesh.border_cost(h) - 1.0)
}

/// The prices on one surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Price {
    area: f64,
    /// [`Settings::stretch_price`].
    stretch: f64,
    /// Whether what unrolls may be bent where that is worth it.
    may_bend: bool,
    /// Whether a union of what unrolls may not be stretched more than its charts are.
    is_exact: bool,
    /// [`Settings::straighten`].
    straight: f64,
    /// How much more is disliked about charts than about those that are to come in their place, beside what each costs.
    disliked: f64,
}

impl Price {
    pub(crate) fn new(mesh: &TriMesh, settings: &Settings) -> Self {
        let stretch = settings.stretch_price;
        let area = measure::total_area(mesh).max(f64::MIN_POSITIVE);
        Self {
            area,
            stretch,
            may_bend: may_bend(stretch),
            is_exact: false,
            straight: settings.straighten,
            disliked: 0.0,
        }
    }

    /// The same prices where what unrolls is worth no more than what does not: two halves that only their mirror plane keeps apart.
    pub(super) fn bending(self) -> Self {
        Self { may_bend: true, ..self }
    }

    /// The same prices where what unrolls is stretched no more than it is already: to hang on by a part of a border is no reason to bend.
    pub(super) fn exact(self) -> Self {
        Self { is_exact: true, ..self }
    }

    /// The same prices where so much less seam is to run down the middle of a face.
    pub(super) fn with_mended_face(self, length: f64) -> Self {
        Self { disliked: (FACE - 1.0) * self.of_seam(length), ..self }
    }

    /// What some length of seam costs.
    pub(super) fn of_seam(&self, length: f64) -> f64 {
        length / self.area.sqrt()
    }

    /// The excess of squared stretch, times area, that some length of seam is worth.
    pub(super) fn excess_worth(&self, length: f64) -> f64 {
        self.area * self.of_seam(length) / self.stretch
    }

    /// What it costs if the L2 stretch of a chart is so much.
    fn of_stretch(&self, chart: &Chart, l2: f64) -> f64 {
        self.stretch * chart.patch.area() / self.area * (l2 * l2 - 1.0).max(0.0)
    }

    /// What a chart costs.
    pub(super) fn of(&self, chart: &Chart) -> f64 {
        let mesh = &chart.patch.mesh;
        let border = mesh.halfedges().filter(|&h| mesh.is_boundary(h));
        let seam: f64 = border.map(|h| mesh.edge_length(h) * mesh.border_cost(h)).sum();
        CHART + 0.5 * self.of_seam(seam) + self.of_stretch(chart, chart.l2)
    }

    /// What the charts cost that come in the place of others.
    pub(super) fn of_all(&self, new: &[Chart]) -> f64 {
        new.iter().map(|chart| self.of(chart)).sum::<f64>() - self.disliked
    }

    /// The stretch up to which a patch is made one chart. With more, a cut may be worth its seam, if it took all of the stretch away
    /// and were as long as the patch is wide. Where it was not, the parts are joined again.
    pub(super) fn limit(&self, patch: &Patch, settings: &Settings) -> f64 {
        let width = (patch.area() / self.area).sqrt();
        // Without a price there is no bound, and one that is not a number, of no area, is none.
        settings.stretch_limit.min((1.0 + 1.0 / (self.stretch * width)).sqrt())
    }

    /// The L2 stretch that one chart may have if it is to be worth those in whose place it would come ([`Price::is_worth`]), where so much less
    /// seam is left between and inside them. A trial under this limit ends as soon as that is out of reach.
    pub(super) fn limit_of_union(&self, old: &[&Chart], saved: f64, settings: &Settings) -> f64 {
        if may_bend(self.stretch) {
            return settings.stretch_limit;
        }
        if !self.may_bend && is_kept_unrolled(old) {
            // For one chart fewer a tenth of a per cent may do; to close the end of a cut is no reason to bend at all.
            let is_exact = self.is_exact || old.len() == 1;
            let unrolled = old.iter().filter(|chart| unrolls(chart));
            let most = if is_exact { unrolled.fold(EXACT, |most, chart| most.max(chart.l2)) } else { UNROLLED };
            return settings.stretch_limit.min(most);
        }
        let share = old.iter().map(|chart| chart.patch.area()).sum::<f64>() / self.area;
        let seams = CHART * (old.len() as f64 - 1.0) + self.of_seam(saved) + self.disliked;
        let stretch = seams + old.iter().map(|chart| self.of_stretch(chart, chart.l2)).sum::<f64>();
        settings.stretch_limit.min((1.0 + stretch.max(0.0) / (self.stretch * share)).sqrt())
    }

    /// Whether a chart is better with another L2 stretch and so much more of its border, by its length on the surface, straight along the axes.
    pub(crate) fn is_worth_straightening(&self, chart: &Chart, l2: f64, gained: f64) -> bool {
        let added = self.of_stretch(chart, l2) - self.of_stretch(chart, chart.l2);
        let bent = if unrolls(chart) { BENDING * added } else { added };
        !may_bend(self.stretch) && bent <= self.straight * self.of_seam(gained)
    }

    /// Whether some charts are better than those in whose place they would come. That the limit allows it is no reason to bend what
    /// unrolls.
    pub(super) fn is_worth(&self, old: &[&Chart], new: &[Chart]) -> bool {
        if !self.may_bend && is_kept_unrolled(old) {
            let most = old.iter().map(|chart| worst_place(chart)).fold(UNROLLED_PLACE, f64::max);
            let is_exact = self.is_exact || old.len() == 1;
            let is_bent = |chart: &Chart| is_exact && worst_place(chart) > most;
            if new.iter().any(|chart| !unrolls(chart) || is_bent(chart)) {
                return false;
            }
        }
        self.of_all(new) < old.iter().map(|chart| self.of(chart)).sum()
    }
}

/// What a cut along an edge costs beside others, where it opens a patch: its length, less where seams weigh less, and less over a bend.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutPrice {
    /// How strongly cuts are drawn to bends.
    bends: f64,
}

impl CutPrice {
    /// Through a body of flat sides: half as much along an edge of a box as across its sides.
    pub(super) const OF_NET: Self = Self { bends: 1.0 };

    /// As strongly drawn to bends as borders are, but where stretch has no price, and short seams are all that is wanted: over 18 models seams
    /// are 5 % shorter than without at the default price, and on closed organic meshes under tight limits 6 % longer without a price.
    pub(super) fn new(settings: &Settings) -> Self {
        Self { bends: if may_bend(settings.stretch_price) { 0.0 } else { settings.segmentation.crease_weight } }
    }

    /// With d = 1 − cos(dihedral), which is 1 at a right angle, length · weight / (1 + d)^bends.
    pub(super) fn of(self, mesh: &TriMesh, h: HalfedgeId) -> f64 {
        let t = mesh.twin(h);
        let length = mesh.edge_length(h) * mesh.border_cost(h);
        if t.is_none() || self.bends == 0.0 {
            return length;
        }
        let [m, n] = [h, t].map(|h| measure::triangle_normal(mesh.triangle_positions(h.face())));
        // A face without area has no normal, and bends nowhere.
        let is_known = m.norm_squared() > 0.5 && n.norm_squared() > 0.5;
        let bend = if is_known { (1.0 - m.dot(&n)).max(0.0) } else { 0.0 };
        length / (1.0 + bend).powf(self.bends)
    }
}

/// Whether a chart is as good as without stretch.
fn unrolls(chart: &Chart) -> bool {
    chart.l2 <= UNROLLED
}

/// By what share of itself some length in a face of a chart is longer or shorter than on the surface, at most. O(n).
fn worst_place(chart: &Chart) -> f64 {
    let mesh = &chart.patch.mesh;
    let least_area = LEAST_PLACE * chart.patch.area();
    let stretch = |rest: RestTriangle, corners: [VertexId; 3]| {
        let [most, least] = distortion::singular_values(&rest.jacobian(corners.map(|v| chart.uv[v.index()])));
        most.max(1.0 / least) - 1.0
    };
    let faces = RestTriangle::of_mesh(mesh).into_iter().zip(mesh.triangles());
    faces.filter(|(rest, _)| rest.area() >= least_area).map(|(rest, t)| stretch(rest, *t)).fold(0.0, f64::max)
}

/// Whether what comes in the place of some charts has to unroll: where they all do, or one is a part between hard edges.
fn is_kept_unrolled(charts: &[&Chart]) -> bool {
    charts.iter().all(|chart| unrolls(chart)) || charts.iter().any(|chart| is_unrolled_part(chart))
}

/// Whether a chart is made of parts between hard edges, unrolled.
fn is_unrolled_part(chart: &Chart) -> bool {
    unrolls(chart) && chart.patch.mesh.is_all_parts()
}

/// The L2 stretch of charts taken together, each at its own best scale: the quadratic mean, by area. Not a number where there is no area.
pub(super) fn l2_together<'c>(charts: impl IntoIterator<Item = &'c Chart>) -> f64 {
    let (mut stretch, mut area) = (0.0, 0.0);
    for chart in charts {
        let own = chart.patch.area();
        stretch += own * chart.l2 * chart.l2;
        area += own;
    }
    (stretch / area).sqrt()
}

/// Whether a union of some charts cannot come under a limit: its least stretch is no less than that of the charts taken together.
pub(super) fn is_out_of_reach(old: &[&Chart], limit: f64) -> bool {
    l2_together(old.iter().copied()) > limit + AT_REST
}

/// Whether what unrolls may be bent: where stretch has no price, the limit alone says so.
pub(super) fn may_bend(stretch_price: f64) -> bool {
    stretch_price <= 0.0
}

/// Whether a fall of the L-infinity stretch at a place is worth some share of its chart's boundary, added to the border.
pub(super) fn lowers_peak(before: f64, after: f64, added_share: f64) -> bool {
    after < before && (before / after).ln() >= PEAK * added_share
}

/// Whether so little of a texture that holds a chart can be filled that the chart is cut across. `self_border` is the share of its
/// boundary along which it borders on itself.
pub(super) fn fill_asks_for_a_cut(fill: f64, self_border: f64) -> bool {
    fill <= if self_border > LEAST_SELF_BORDER { LEAST_FILL_OF_BODIES } else { LEAST_FILL }
}

/// Whether a part of a chart that has been cut across is cut once more.
pub(super) fn fill_asks_for_another_cut(fill: f64) -> bool {
    fill <= GOOD_FILL
}

/// Whether the parts of a chart let a texture be filled so much better that the cut between them is worth it, by how large a texture
/// must be to hold each.
pub(super) fn fills_better(whole: f64, mut parts: impl Iterator<Item = f64>) -> bool {
    parts.all(|part| part <= LEAST_GAIN * whole)
}

/// Whether so little of a texture is covered that charts may be cut to be folded.
pub(super) fn is_ill_covered(covered: f64) -> bool {
    covered < WELL_COVERED
}

/// How long cuts that let charts be folded may be, all together, beside seams of some length.
pub(super) fn affordable_seam(length: f64) -> f64 {
    MOST_SEAM_ADDED * length
}

/// Whether a chart that fills some share of the smallest box around it may be cut to be folded: what unrolls keeps its shape, and a rectangle is to stay one.
pub(super) fn may_be_folded(chart: &Chart, box_filled: f64) -> bool {
    !unrolls(chart) && box_filled < FILLS_ITS_BOX
}

/// What a cut is worth that makes seams longer by some share of all, and lets so much more of the texture be covered, as a share of the texture; `None` where
/// it is worth nothing, or too little to tell.
pub(super) fn value_of_cover(added_share: f64, gained: f64, settings: &Settings) -> Option<f64> {
    let value = settings.cover_price * gained - added_share;
    (gained >= LEAST_COVER_GAINED && value > 0.0).then_some(value)
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
    fn what_unrolls_is_not_bent_at_a_single_place() {
        let mesh = test_surfaces::grid(24, 16, [24.0, 16.0], 0.0);
        let (_, halves) = strips(&mesh, 24.0, 2);
        let (_, whole) = strips(&mesh, 24.0, 1);
        let price = price(&mesh, 20.0).exact();
        let old: Vec<&Chart> = halves.iter().collect();
        let moved = |by: f64| {
            let mut chart = whole[0].clone();
            let inside = chart.patch.mesh.vertices().find(|v| !chart.patch.mesh.is_boundary_vertex(*v)).expect("one");
            chart.uv[inside.index()].x += by;
            let rest = RestTriangle::of_mesh(&chart.patch.mesh);
            chart.l2 = crate::stretch::l2_stretch(&chart.patch.mesh, &rest, &chart.uv);
            chart
        };
        assert!(price.is_worth(&old, &[moved(0.0)]));
        let bent = moved(0.15);
        assert!(bent.l2 < UNROLLED, "{}: the mean does not tell", bent.l2);
        assert!(!price.is_worth(&old, std::slice::from_ref(&bent)));
        assert!(Price { is_exact: false, ..price }.is_worth(&old, std::slice::from_ref(&bent)));
        // What is bent already may be joined to what is not.
        assert!(worst_place(&bent) > UNROLLED_PLACE && price.is_worth(&[&bent, &bent], std::slice::from_ref(&bent)));
    }

    #[test]
    fn the_terms_are_in_roots_of_the_area() {
        for scale in [1.0, 1e-3, 1e3] {
            let mesh = test_surfaces::grid(6, 4, [6.0 * scale, 4.0 * scale], 0.0);
            let (_, charts) = strips(&mesh, 6.0 * scale, 2);
            let half = charts[0].clone();
            let root = 24.0_f64.sqrt();
            let price = price(&mesh, 8.0);
            // Half of a rectangle of 6 by 4: 14 around.
            assert!((price.of(&half) - CHART - 7.0 / root).abs() < 1e-9);
            assert!((price.of_seam(4.0 * scale) - 4.0 / root).abs() < 1e-9);
            assert!((price.of_stretch(&half, 1.1) - 8.0 * 0.5 * 0.21).abs() < 1e-9);
        }
    }

    #[test]
    fn a_seam_costs_its_length_in_the_mean_and_less_where_it_is_hidden() {
        let mesh = Arc::new(test_surfaces::grid(8, 8, [1.0, 1.0], 0.0));
        let components = Groups::by_label(&vec![0; mesh.face_count()], 1, FaceId::new);
        let visibility: Vec<f32> = mesh.positions().iter().map(|p| if p.x < 0.5 { 0.4 } else { 1.0 }).collect();
        let by = |power: f64| Settings { hide_seams: power, ..Settings::default() };
        let weighed_by = |power: f64| weighed(&mesh, &components, &visibility, &by(power));
        let cost = |mesh: &TriMesh, is_there: fn(f64) -> bool| {
            let middle = |h| 0.5 * (mesh.position(mesh.from(h)).x + mesh.position(mesh.to(h)).x);
            let costs: Vec<f64> = mesh.edges().filter(|&h| is_there(middle(h))).map(|h| mesh.border_cost(h)).collect();
            costs.iter().sum::<f64>() / costs.len() as f64
        };
        let alike = weighed_by(0.0);
        assert!(alike.edges().all(|h| (alike.border_cost(h) - 1.0).abs() < 1e-6));
        for power in [1.0, 2.0] {
            let mesh = weighed_by(power);
            let (hidden, seen) = (cost(&mesh, |x| x < 0.3), cost(&mesh, |x| x > 0.7));
            assert!((hidden / seen - 0.4_f64.powf(power)).abs() < 1e-6, "{hidden} {seen}");
            assert!((cost(&mesh, |_| true) - 1.0).abs() < 0.05);
        }
        let steep = weighed_by(10.0);
        assert!(steep.edges().all(|h| steep.border_cost(h) >= LEAST_WEIGHT - 1e-6), "no seam is for nothing");
        // A part of the mesh keeps the weights, as a coarse copy does.
        let faces: Vec<FaceId> = steep.faces().skip(5).step_by(2).collect();
        let (part, source) = steep.submesh(&faces, |_| false);
        assert_eq!(part.seam_weights_of(&part.vertices().collect::<Vec<_>>()), steep.seam_weights_of(&source));
        let unseen = weighed(&mesh, &components, &vec![0.0; mesh.vertex_count()], &Settings::default());
        assert!(unseen.edges().all(|h| unseen.border_cost(h) == 1.0));
        // What is painted counts besides, and nothing is made up for elsewhere.
        let wishes: Vec<f32> = mesh.positions().iter().map(|p| if p.y < 0.5 { 10.0 } else { 1.0 }).collect();
        let painted = Arc::new(TriMesh::clone(&mesh).with_seam_weights(wishes.clone()));
        let (plain, painted) = (weighed_by(2.0), weighed(&painted, &components, &visibility, &by(2.0)));
        for h in mesh.edges() {
            let wish = [mesh.from(h), mesh.to(h)].map(|v| f64::from(wishes[v.index()]));
            if wish[0] == wish[1] {
                assert!((painted.border_cost(h) / plain.border_cost(h) - wish[0]).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_union_over_its_limit_is_not_worth_it_and_one_under_it_is() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (one, two) = (strips(&mesh, 6.0, 1).1, strips(&mesh, 6.0, 2).1);
        let settings = Settings { stretch_limit: 10.0, ..Settings::default() };
        for (stretch_price, l2) in [(1.0, 1.05), (20.0, 1.05), (20.0, 1.0), (100.0, 1.2)] {
            let price = price(&mesh, stretch_price);
            let old: Vec<Chart> = two.iter().map(|c| Chart { l2, ..c.clone() }).collect();
            let old: Vec<&Chart> = old.iter().collect();
            let limit = price.limit_of_union(&old, 4.0, &settings);
            let is_worth = |l2: f64| price.is_worth(&old, &[Chart { l2, ..one[0].clone() }]);
            assert!(is_worth(limit - 1e-9) && !is_worth(limit + 1e-9), "{stretch_price} {l2}: {limit}");
        }
        let old: Vec<&Chart> = two.iter().collect();
        let tight = Settings { stretch_limit: 1.0005, ..Settings::default() };
        assert_eq!(price(&mesh, 20.0).limit_of_union(&old, 4.0, &tight), 1.0005, "the limit is the limit");
        assert_eq!(price(&mesh, 0.0).limit_of_union(&old, 4.0, &settings), 10.0, "stretch has no price");
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
        assert!(price(&mesh, 1e-3).bending().is_worth(&old, &bent));
        let settings = Settings::default();
        assert_eq!(price(&mesh, 20.0).limit_of_union(&old, 4.0, &settings), UNROLLED);
        assert_eq!(price(&mesh, 20.0).limit_of_union(&old[..1], 4.0, &settings), EXACT, "a cut closed");
        assert!(price(&mesh, 20.0).bending().limit_of_union(&old, 4.0, &settings) > 1.05);
    }

    #[test]
    fn a_part_between_hard_edges_is_not_bent_for_a_neighbour_that_is() {
        let flat = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let halves = strips(&flat, 6.0, 2).1;
        // The first of the two strips is such a part.
        let part = flat.faces().map(|f| u32::from(halves[0].patch.faces.contains(&f))).collect();
        let mesh = flat.clone().with_parts(part);
        let (one, two) = (strips(&mesh, 6.0, 1).1, strips(&mesh, 6.0, 2).1);
        let union = |l2: f64| [Chart { l2, ..one[0].clone() }];
        let bent = Chart { l2: 1.004, ..two[1].clone() };
        let old = [&two[0], &bent];
        let settings = Settings::default();
        assert!(!price(&mesh, 20.0).is_worth(&old, &union(1.003)) && price(&mesh, 20.0).is_worth(&old, &union(1.0009)));
        assert_eq!(price(&mesh, 20.0).limit_of_union(&old, 4.0, &settings), UNROLLED);
        assert_eq!(price(&mesh, 20.0).exact().limit_of_union(&old, 4.0, &settings), EXACT);
        assert!(price(&mesh, 20.0).bending().is_worth(&old, &union(1.003)), "two halves of one thing");
        // The other one is no such part.
        let unrolled = Chart { l2: 1.0, ..two[1].clone() };
        let bent = Chart { l2: 1.004, ..two[0].clone() };
        assert!(price(&mesh, 20.0).is_worth(&[&bent, &unrolled], &union(1.003)));
    }

    #[test]
    fn a_union_is_stretched_no_less_than_its_parts() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let halves = strips(&mesh, 6.0, 2).1;
        let bent = Chart { l2: 1.1, ..halves[0].clone() };
        let mean = (0.5 * (1.0 + 1.21_f64)).sqrt();
        assert!(is_out_of_reach(&[&bent, &halves[1]], mean - 2.0 * AT_REST));
        assert!(!is_out_of_reach(&[&bent, &halves[1]], mean));
        assert!(!is_out_of_reach(&[&halves[0], &halves[1]], 1.0));
    }

    #[test]
    fn straight_sides_are_worth_some_stretch_and_less_of_what_unrolls() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let settings = |straighten, stretch_price| Settings { straighten, stretch_price, ..Settings::default() };
        let bent = Chart { l2: 1.02, ..strips(&mesh, 6.0, 1).1[0].clone() };
        let unrolled = Chart { l2: 1.0, ..bent.clone() };
        let gained = 4.0;
        let worth = 0.25 * gained / 24.0_f64.sqrt();
        let price = Price::new(&mesh, &settings(0.25, 20.0));
        let up_to = |l2: f64, worth: f64| (l2 * l2 + worth / 20.0).sqrt();
        for (chart, limit) in [(&bent, up_to(1.02, worth)), (&unrolled, up_to(1.0, worth / BENDING))] {
            assert!(price.is_worth_straightening(chart, limit - 1e-9, gained));
            assert!(!price.is_worth_straightening(chart, limit + 1e-9, gained));
        }
        assert!(!Price::new(&mesh, &settings(0.0, 20.0)).is_worth_straightening(&bent, 1.021, gained));
        assert!(!Price::new(&mesh, &settings(0.25, 0.0)).is_worth_straightening(&bent, 1.02, gained));
    }

    #[test]
    fn a_cut_over_a_bend_is_cheaper() {
        let cube = test_surfaces::cubes([1, 1, 1], |_| true);
        let is_edge = |h: HalfedgeId| {
            let side = cube.position(cube.to(h)) - cube.position(cube.from(h));
            side.iter().filter(|x| x.abs() > 0.5).count() == 1
        };
        let with = |stretch_price, crease_weight| {
            let mut settings = Settings { stretch_price, ..Settings::default() };
            settings.segmentation.crease_weight = crease_weight;
            CutPrice::new(&settings)
        };
        for (cut, at_edge) in
            [(CutPrice::OF_NET, 0.5), (with(20.0, 1.0), 0.5), (with(20.0, 2.0), 0.25), (with(0.0, 1.0), 1.0)]
        {
            for h in cube.halfedges() {
                let share = cut.of(&cube, h) / cube.edge_length(h);
                assert!((share - if is_edge(h) { at_edge } else { 1.0 }).abs() < 1e-9, "{share}");
            }
        }
    }

    #[test]
    fn a_peak_is_worth_border_in_proportion_to_the_logarithm_of_its_fall() {
        assert!(lowers_peak(3.0, 2.0, 0.01) && lowers_peak(30.0, 20.0, 0.01), "a third less for 1 %");
        assert!(!lowers_peak(3.0, 2.0, 0.011) && !lowers_peak(3.0, 2.1, 0.01));
        assert!(
            lowers_peak(3.0, 2.9, 0.0) && lowers_peak(3.0, 2.9, -0.1),
            "where the border gets no longer any fall is worth it"
        );
        assert!(!lowers_peak(3.0, 3.0, -0.1) && !lowers_peak(3.0, 3.1, -0.5), "but there must be one");
    }

    #[test]
    fn a_chart_that_leaves_a_texture_empty_is_cut_and_more_so_where_it_has_seams_all_round() {
        let (plank, body) = (0.0, 1.0);
        assert!(fill_asks_for_a_cut(0.2, plank) && !fill_asks_for_a_cut(0.3, plank));
        assert!(fill_asks_for_a_cut(0.3, body) && !fill_asks_for_a_cut(0.5, body));
        assert!(
            fill_asks_for_another_cut(0.5) && !fill_asks_for_another_cut(0.7),
            "once begun, until it is well filled"
        );
        assert!(fills_better(10.0, [5.0, 6.0].into_iter()), "a strip cut in the middle");
        assert!(!fills_better(10.0, [5.0, 9.5].into_iter()), "the longest part counts");
    }

    #[test]
    fn a_texture_that_is_covered_better_is_worth_seam_in_proportion() {
        let by = |cover_price: f64| Settings { cover_price, ..Settings::default() };
        assert!(value_of_cover(0.19, 0.08, &by(2.5)).is_some() && value_of_cover(0.21, 0.08, &by(2.5)).is_none());
        assert!(value_of_cover(0.19, 0.08, &by(2.3)).is_none() && value_of_cover(0.0, 0.1, &by(0.0)).is_none());
        assert!(value_of_cover(0.01, 0.05, &by(2.5)).is_none(), "packing differs by as much from one try to the next");
        // Without any seam nothing is a share of it.
        assert!(
            value_of_cover(f64::INFINITY, 0.5, &by(2.5)).is_none() && value_of_cover(f64::NAN, 0.5, &by(2.5)).is_none()
        );
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let flat = strips(&mesh, 6.0, 1).1[0].clone();
        let bent = Chart { l2: 1.02, ..flat.clone() };
        assert!(may_be_folded(&bent, 0.5) && !may_be_folded(&bent, 0.9) && !may_be_folded(&flat, 0.5));
        assert!(is_ill_covered(0.5) && !is_ill_covered(0.8));
        assert!((affordable_seam(10.0) - 2.0).abs() < 1e-12);
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
