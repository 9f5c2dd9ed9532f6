//! Charts that leave a texture empty, opened where their parts then lie close together.
//!
//! One or two charts with limbs seldom fill a square, and what stays empty is resolution that is lost. A short cut in a place
//! that is hardly seen lets a limb lie beside the body. How much of the texture is covered is found out by packing, and weighed against seam.

use std::rc::Rc;

use nalgebra::Vector2;
use rayon::prelude::*;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::packing::PackSettings;
use crate::progress::Cancelled;
use crate::settings::Settings;
use crate::stretch;

use super::super::cost;
use super::super::edit::Edit;
use super::super::state::{ChartId, Cutting};
use super::super::trial::{self, Verdict, trial};
use super::across;
use super::lobe::{Lobe, Pieces};
use super::{Proposal, Start};

/// Charts of at least this share of all area are looked at.
const LARGE: f64 = 0.2;
/// Lobes of each of them that are looked at.
const MOST_LOBES: usize = 10;
/// Cuts of which it is found out by packing what they bring, before one is made.
const MOST_PACKED: usize = 4;
/// Cuts that are made, one after the other.
const MOST_CUTS: usize = 3;
/// Parts of less than this share of all area are not cut off.
const LEAST_PART: f64 = 0.01;
/// Charts of less than this share of all area find a place between the others.
const LEAST_COUNTED: f64 = 0.005;

/// The share of a texture that charts cover; `None` where they cannot be packed.
pub(crate) type Cover<'a> = dyn Fn(&[&Chart]) -> Result<Option<f64>, Cancelled> + Sync + 'a;

/// For each side of a mesh, and charts that are to be cut, the side that is cut, too: its mirror image, or itself where nothing is mirrored. None where nothing
/// may be cut.
pub(crate) type Images<'a> = dyn Fn(&[&Chart]) -> Result<Vec<HalfedgeId>, Cancelled> + 'a;

/// What has to be known of a surface beyond its mesh, where its charts are folded.
pub(crate) struct Folds<'a> {
    /// Whether a chart may be cut: not one that copies are made of, nor a copy.
    pub(crate) may_be_cut: &'a dyn Fn(&Chart) -> bool,
    pub(crate) images: &'a Images<'a>,
    pub(crate) cover: &'a Cover<'a>,
}

/// The charts of a surface, large ones cut where that covers so much more of the texture that it is worth the seam
/// ([`cost::value_of_cover`]). Sorted by lowest face. Packs up to 16 times, roughly; once where the texture is well covered, and never
/// where no chart is [large](LARGE).
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn fold(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    folds: &Folds<'_>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let area: f64 = charts.iter().map(|chart| chart.patch.area()).sum();
    let is_large = |chart: &Chart| {
        let is_large = chart.patch.area() >= LARGE * area;
        is_large && (folds.may_be_cut)(chart) && cost::may_be_folded(chart, box_filled(chart))
    };
    let large: Vec<&Chart> = charts.iter().filter(|chart| is_large(chart)).collect();
    if large.is_empty() {
        return Ok(charts);
    }
    let Some(mut covered) = (folds.cover)(&counted(charts.iter(), area))? else { return Ok(charts) };
    if !cost::is_ill_covered(covered) {
        return Ok(charts);
    }
    let images = (folds.images)(&large)?;
    let mut cutting = Cutting::new(mesh, polygon, charts);
    let seams = mesh.edges().filter(|&h| !mesh.is_boundary(h) && cutting.is_seam(h));
    let (mut seam, mut length) = (0.0, 0.0);
    for h in seams {
        seam += cutting.seam_length(h);
        length += mesh.edge_length(h);
    }
    let mut added = 0.0;
    for _ in 0..MOST_CUTS {
        run.progress.check()?;
        if !cost::is_ill_covered(covered) {
            break;
        }
        let large = cutting.ids().filter(|id| cutting.chart(*id).is_some_and(is_large)).collect();
        let affordable = cost::affordable_seam(length) - added;
        let search = Search {
            cutting: &cutting,
            large,
            images: &images,
            area,
            seam,
            affordable,
            covered,
            cover: folds.cover,
            settings,
        };
        let Some((edit, parts, after)) = search.best_cut(rungs, run)? else { break };
        rungs.take(Rung::Fold);
        added += edit.opened_length(&cutting);
        cutting.replace(&edit.charts(&cutting), parts);
        covered = after;
    }
    Ok(cutting.into_charts())
}

/// Charts that tell how much of a texture is covered: small ones fit anywhere.
fn counted<'c>(charts: impl Iterator<Item = &'c Chart>, area: f64) -> Vec<&'c Chart> {
    charts.filter(|chart| chart.patch.area() >= LEAST_COUNTED * area).collect()
}

/// A cut that may be made, and what it costs.
struct Candidate<'a> {
    chart: &'a Chart,
    pieces: Rc<Pieces<'a>>,
    lobe: Lobe,
    cut: Cut,
}

/// Edges that take a lobe off, its mirror image, too, where that is another.
struct Cut {
    edit: Edit,
    /// One or two.
    lobes: usize,
    cost: f64,
}

/// One round, in which the best of some cuts is made.
struct Search<'a> {
    cutting: &'a Cutting<'a>,
    /// The charts that may be cut.
    large: Vec<ChartId>,
    images: &'a [HalfedgeId],
    /// That of all charts.
    area: f64,
    /// That of all charts before any was cut.
    seam: f64,
    /// The length that a cut may add, whatever it brings and however little of it can be seen.
    affordable: f64,
    /// What is covered now.
    covered: f64,
    cover: &'a Cover<'a>,
    settings: &'a Settings,
}

impl Search<'_> {
    /// The edit, the charts that come of it, and what is covered then; `None` where no cut is worth its seam.
    fn best_cut(&self, rungs: &mut Rungs, run: &Run<'_>) -> Result<Option<(Edit, Vec<Chart>, f64)>, Cancelled> {
        let cutting = self.cutting;
        let value = |cost: f64, after: f64| cost::value_of_cover(cost / self.seam, after - self.covered, self.settings);
        let mut candidates: Vec<Candidate<'_>> = Vec::new();
        for chart in self.large.iter().filter_map(|id| cutting.chart(*id)) {
            run.progress.check()?;
            let image = |h: HalfedgeId| self.images[surface(chart, h).index()];
            let may_be_cut = |h: HalfedgeId| !image(h).is_none() && !self.is_in_plane(surface(chart, h));
            let pieces = Rc::new(Pieces::new(&chart.patch, &chart.uv, may_be_cut));
            for lobe in pieces.lobes(MOST_LOBES) {
                let cut = self.cut(chart, &lobe);
                // The symmetric part between two lobes is to be no smaller than these: else they are the two halves of a face.
                if cut.lobes == 2 && self.is_mirrored_in_itself(chart, &lobe) && lobe.area > chart.patch.area() / 3.0 {
                    continue;
                }
                // No texture that holds the larger part is covered by more than this.
                if cut.lobes == 1 && value(cut.cost, self.most_covered(chart, &lobe)).is_none() {
                    continue;
                }
                candidates.push(Candidate { chart, pieces: Rc::clone(&pieces), lobe, cut });
            }
        }
        // What would not be worth it even if nothing were left empty is not packed.
        candidates.retain(|candidate| self.is_affordable(&candidate.cut) && value(candidate.cut.cost, 1.0).is_some());
        candidates.sort_by(|a, b| a.cut.cost.total_cmp(&b.cut.cost));
        candidates.truncate(MOST_PACKED);
        let cuts: Vec<&Cut> = candidates.iter().map(|candidate| &candidate.cut).collect();
        let covers: Vec<Result<Option<f64>, Cancelled>> = cuts
            .par_iter()
            .with_max_len(1)
            .map(|cut| self.parts(cut).map_or(Ok(None), |parts| self.cover_with(&cut.edit, &parts)))
            .collect();
        let mut best: Option<(f64, &Candidate<'_>)> = None;
        for (candidate, after) in candidates.iter().zip(covers) {
            let Some(value) = after?.and_then(|after| value(candidate.cut.cost, after)) else { continue };
            if best.is_none_or(|(most, _)| value > most) {
                best = Some((value, candidate));
            }
        }
        let Some((_, best)) = best else { return Ok(None) };
        let lobe = best.pieces.smoothed(&best.lobe, self.settings.segmentation.crease_weight, run.progress)?;
        let cut = self.cut(best.chart, &lobe);
        if !self.is_affordable(&cut) || self.parts(&cut).is_none() {
            return Ok(None);
        }
        let proposal = Proposal { edit: cut.edit, start: Start::Lying };
        let Verdict::Charts(parts) = trial(cutting, &proposal, self.settings, rungs, run)? else { return Ok(None) };
        let after = self.cover_with(&proposal.edit, &parts)?.filter(|after| value(cut.cost, *after).is_some());
        Ok(after.map(|after| (proposal.edit, parts, after)))
    }

    fn is_affordable(&self, cut: &Cut) -> bool {
        cut.edit.opened_length(self.cutting) <= self.affordable
    }

    /// Whether an edge lies in the plane that mirrors the surface.
    fn is_in_plane(&self, h: HalfedgeId) -> bool {
        let image = self.images[h.index()];
        !image.is_none() && image == self.cutting.mesh().twin(h)
    }

    /// Whether the mirror image of a lobe is part of the same chart.
    fn is_mirrored_in_itself(&self, chart: &Chart, lobe: &Lobe) -> bool {
        let image = lobe.border.first().map(|&h| self.images[surface(chart, h).index()]).filter(|h| !h.is_none());
        image.is_some_and(|h| {
            self.cutting.owner(h.face()) == self.cutting.owner(chart.patch.faces[lobe.faces[0].index()])
        })
    }

    /// The share of a texture that can be covered if it holds a lobe and the rest of its chart.
    fn most_covered(&self, chart: &Chart, lobe: &Lobe) -> f64 {
        let mesh = &chart.patch.mesh;
        let mut in_lobe = vec![false; mesh.vertex_count()];
        lobe.faces.iter().flat_map(|f| mesh.triangle(*f)).for_each(|v| in_lobe[v.index()] = true);
        let PackSettings { width, height, .. } = self.settings.packing;
        let texture = [width, height].map(f64::from);
        let side = |is_wanted: bool| {
            let points = chart.uv.iter().zip(&in_lobe).filter(|(_, is_in)| **is_in == is_wanted).map(|(p, _)| *p);
            across::hold(&points.collect::<Vec<_>>(), texture)
        };
        self.area / (texture[0] * texture[1] * side(true).max(side(false)).powi(2))
    }

    fn cut(&self, chart: &Chart, lobe: &Lobe) -> Cut {
        let mesh = self.cutting.mesh();
        let edges = |sides: &dyn Fn(HalfedgeId) -> HalfedgeId| {
            let sides = lobe.border.iter().map(|&h| sides(surface(chart, h))).filter(|h| !h.is_none());
            let mut edges: Vec<HalfedgeId> = sides.map(|h| h.min(mesh.twin(h))).collect();
            edges.sort_unstable();
            edges
        };
        let (own, images) = (edges(&|h| h), edges(&|h| self.images[h.index()]));
        let lobes = if own == images { 1 } else { 2 };
        let mut open = [own, images].concat();
        open.sort_unstable();
        open.dedup();
        let cost = open.iter().map(|&h| self.cutting.seam_length(h)).sum();
        Cut { edit: Edit::new(mesh, &[], &open), lobes, cost }
    }

    /// What a cut makes of the charts that it changes, where they lie; `None` where it leaves crumbs, or more than the lobes and the rest: a face that is
    /// held together by the forehead alone stays in one piece.
    fn parts(&self, cut: &Cut) -> Option<Vec<Chart>> {
        let patches = cut.edit.patches(self.cutting);
        let is_part = |patch: &Patch| patch.area() >= LEAST_PART * self.area;
        if patches.len() != cut.edit.charts(self.cutting).len() + cut.lobes || !patches.iter().all(is_part) {
            return None;
        }
        let chart = |patch: Patch| {
            let uv = trial::positions(self.cutting, &patch, &[]);
            Chart { patch, uv, l2: 1.0 }
        };
        Some(patches.into_iter().map(chart).collect())
    }

    /// What is covered if some charts take the place of those that an edit changes.
    fn cover_with(&self, edit: &Edit, parts: &[Chart]) -> Result<Option<f64>, Cancelled> {
        let changed = edit.charts(self.cutting);
        let kept = self.cutting.ids().filter(|id| !changed.contains(id)).filter_map(|id| self.cutting.chart(id));
        (self.cover)(&counted(kept.chain(parts), self.area))
    }
}

/// The share of the smallest box around a chart, of any turn, that it fills.
fn box_filled(chart: &Chart) -> f64 {
    let box_area = across::directions()
        .map(|along| across::extent(&chart.uv, along) * across::extent(&chart.uv, Vector2::new(-along.y, along.x)))
        .fold(f64::INFINITY, f64::min);
    stretch::plane_area(&chart.patch.mesh, &chart.uv) / box_area
}

/// The side of the surface that a side of a chart is.
fn surface(chart: &Chart, h: HalfedgeId) -> HalfedgeId {
    chart.patch.faces[h.face().index()].halfedge(h.slot())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::mesh::{FaceId, test_surfaces};
    use crate::progress::Progress;

    /// A square of 16 by 16 quads in two charts: one has those for which `is_first` holds, by column and row.
    fn two(is_first: impl Fn(usize, usize) -> bool, l2: f64) -> (TriMesh, Vec<u32>, Vec<Chart>) {
        let mesh = test_surfaces::grid(16, 16, [16.0, 16.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let chart = |first: bool| {
            let mine = |f: &FaceId| {
                let middle = mesh.triangle_positions(*f).iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0;
                is_first(middle.x as usize, middle.y as usize) == first
            };
            let patch = Patch::of_surface(&mesh, &polygon, mesh.faces().filter(mine).collect());
            let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
            Chart { patch, uv, l2 }
        };
        let charts = vec![chart(true), chart(false)];
        (mesh, polygon, charts)
    }

    fn folded(
        (mesh, polygon, charts): &(TriMesh, Vec<u32>, Vec<Chart>),
        images: &Images<'_>,
        cover: &Cover<'_>,
        settings: &Settings,
    ) -> Vec<Chart> {
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let folds = Folds { may_be_cut: &|_| true, images, cover };
        let run = Run::new(&progress, None);
        fold(mesh, polygon, charts.clone(), &folds, settings, &mut rungs, &run).expect("not cancelled")
    }

    /// Each chart besides the first two covers so much more.
    fn growing(by: f64) -> impl Fn(&[&Chart]) -> Result<Option<f64>, Cancelled> + Sync {
        move |charts| Ok(Some(0.4 + by * (charts.len() as f64 - 2.0)))
    }

    #[test]
    fn a_chart_is_cut_where_it_is_narrow_if_that_covers_more() {
        let corner = |l2| two(|x, y| x < 4 || y < 4, l2);
        let surface = corner(1.01);
        let alone = |_: &[&Chart]| Ok(surface.0.halfedges().collect());
        let settings = Settings::default();
        let parts = folded(&surface, &alone, &growing(0.35), &settings);
        assert_eq!(parts.len(), 3);
        // A seam of 24 is longer by 4: an arm of the corner is cut off across.
        let around: f64 = parts.iter().map(|c| c.patch.mesh.boundary_length()).sum();
        assert!((around - (64.0 + 2.0 * 24.0 + 2.0 * 4.0)).abs() < 1e-9, "{around}");
        assert!(parts.iter().all(|part| stretch::boundary_is_simple(&part.patch.mesh, &part.uv)));
        let count = |surface: &_, by, settings: &Settings| folded(surface, &alone, &growing(by), settings).len();
        assert_eq!(count(&surface, 0.05, &settings), 2, "too little to tell");
        let price = |cover_price: f64| Settings { cover_price, ..Settings::default() };
        // A sixth more seam, for a tenth of the texture.
        assert_eq!([1.5, 1.8].map(|p| count(&surface, 0.1, &price(p)).min(3)), [2, 3]);
        assert_eq!(count(&corner(1.0), 0.35, &settings), 2, "what unrolls keeps its shape");
        assert_eq!(count(&two(|x, _| x < 8, 1.01), 0.35, &settings), 2, "rectangles stay");
    }

    #[test]
    fn what_is_mirrored_stays_so() {
        // Three sides of a square.
        let surface = two(|x, y| !(2..14).contains(&x) || y < 2, 1.01);
        let mesh = &surface.0;
        let place = |v| {
            let p: nalgebra::Point3<f64> = mesh.position(v);
            (p.x as i32, p.y as i32)
        };
        let sides: BTreeMap<_, HalfedgeId> =
            mesh.halfedges().map(|h| ((place(mesh.from(h)), place(mesh.to(h))), h)).collect();
        let mirrored = |(x, y): (i32, i32)| (16 - x, y);
        let image = |h: HalfedgeId| {
            let ends = (mirrored(place(mesh.to(h))), mirrored(place(mesh.from(h))));
            sides.get(&ends).copied().unwrap_or(HalfedgeId::NONE)
        };
        let images = |_: &[&Chart]| Ok(mesh.halfedges().map(image).collect());
        let parts = folded(&surface, &images, &growing(0.2), &Settings::default());
        assert_eq!(parts.len(), 4, "both arms are cut off");
        let cutting = Cutting::new(mesh, &surface.1, parts);
        let is_alike = |h: HalfedgeId| image(h).is_none() || cutting.is_seam(h) == cutting.is_seam(image(h));
        assert!(mesh.halfedges().filter(|&h| !mesh.is_boundary(h)).all(is_alike));
    }

    #[test]
    fn copies_and_full_textures_are_left_alone() {
        let (mesh, polygon, charts) = two(|x, y| x < 4 || y < 4, 1.01);
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let run = Run::new(&progress, None);
        let images = |_: &[&Chart]| Ok(mesh.halfedges().collect());
        let full = |_: &[&Chart]| Ok(Some(0.75));
        let unknown = |_: &[&Chart]| Ok(None);
        let grows = growing(0.35);
        let cases: [(&Cover<'_>, bool); 3] = [(&full, true), (&unknown, true), (&grows, false)];
        for (cover, may_be_cut) in cases {
            let folds = Folds { may_be_cut: &|_| may_be_cut, images: &images, cover };
            let settings = Settings::default();
            let left = fold(&mesh, &polygon, charts.clone(), &folds, &settings, &mut rungs, &run);
            assert_eq!(left.expect("not cancelled").len(), 2);
        }
    }
}
