//! The middle of a face kept whole: darts in pairs make the room that a cut along the mirror plane would make.
//!
//! Halves of a mirrored surface meet in the plane, and are joined there as far as they fit. Where the plane runs over a bulge, as it does in a face, they
//! do not fit, and a cut stays in the middle of it, where everyone looks. So the other way is tried, too: that part of the plane is glued, what can be seen less
//! is cut, and then the surface is cut from where it bulges to its border, and from the mirror image of that place to the mirror image of that border,
//! where this costs least.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use crate::cache::Run;
use crate::charts;
use crate::mesh::{FaceId, HalfedgeId, Mirror, TriMesh, VertexId};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::super::cost::{self, CutPrice, Price};
use super::super::edit::Edit;
use super::super::history::{History, MoveKind, Place};
use super::super::state::{ChartId, Cutting};
use super::dart::Bulging;
use super::{Move, Proposal, Site, Start};

/// A face that needs more pairs of darts is cut in its middle: each costs the search a map of all of it.
const MOST_PAIRS: usize = 6;
/// Of a line that is closed so many edges stay cut: one alone would open nothing.
const LEAST_CUT: usize = 2;

/// A face without a cut in its middle.
pub(crate) struct Face<'a> {
    pub(crate) mirror: &'a Mirror,
    pub(crate) settings: &'a Settings,
}

impl Move for Face<'_> {
    fn kind(&self) -> MoveKind {
        MoveKind::Face
    }

    // Two halves were divided for the sake of symmetry, not because they unroll; and less seam down the middle is worth more than less elsewhere.
    fn price(&self, usual: Price, cutting: &Cutting<'_>, edit: &Edit) -> Price {
        let middle = middle(cutting.mesh(), &self.line(cutting, &edit.charts(cutting)));
        let length = |edges: &[HalfedgeId]| {
            let there = edges.iter().filter(|h| middle.contains(h));
            there.map(|&h| cutting.seam_length(h)).sum::<f64>()
        };
        usual.bending().with_mended_face(length(edit.glued()) - length(edit.opened()))
    }

    // Of few darts and many.
    fn takes_cheapest(&self) -> bool {
        true
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, _price: &Price) -> Vec<Site> {
        let mut lines: BTreeMap<[ChartId; 2], Vec<HalfedgeId>> = BTreeMap::new();
        let mesh = cutting.mesh();
        for h in mesh.edges().filter(|&h| self.mirror.is_between(mesh, h)) {
            if let Some([a, b]) = cutting.sides(h) {
                lines.entry([a.min(b), a.max(b)]).or_default().push(h);
            }
        }
        let mut sites: Vec<(f64, Site)> = Vec::new();
        for ([a, b], line) in lines {
            let place = Place::between(a, b);
            let middle = middle(mesh, &line);
            let cut: f64 = middle.into_iter().filter(|&h| cutting.is_seam(h)).map(|h| cutting.seam_length(h)).sum();
            if cut > 0.0 && history.refusals(MoveKind::Face, place) == 0 {
                let charts = if a == b { vec![a] } else { vec![a, b] };
                sites.push((cut, Site { place, charts, ways: Vec::new() }));
            }
        }
        sites.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.place.cmp(&y.1.place)));
        sites.into_iter().map(|site| site.1).collect()
    }

    fn ways(&self, cutting: &Cutting<'_>, site: &Site, run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        let mesh = cutting.mesh();
        let is_mine = |h: HalfedgeId| cutting.owner(h.face()).is_some_and(|id| site.charts.contains(&id));
        let within = |h: &HalfedgeId| !mesh.is_boundary(*h) && is_mine(*h) && is_mine(mesh.twin(*h));
        let mut faces: Vec<FaceId> = site
            .charts
            .iter()
            .filter_map(|&id| cutting.chart(id))
            .flat_map(|chart| &chart.patch.faces)
            .copied()
            .collect();
        faces.sort_unstable();
        let line = self.line(cutting, &site.charts);
        let middle = middle(mesh, &line);
        // Both sides of each edge that is cut.
        let mut cut: BTreeSet<HalfedgeId> =
            line.into_iter().filter(|h| !middle.contains(h)).flat_map(|h| [h, mesh.twin(h)]).collect();
        let seams: Vec<HalfedgeId> =
            faces.iter().flat_map(|f| f.halfedges()).filter(|h| within(h) && cutting.is_seam(*h)).collect();
        let mut ways = Vec::new();
        for _ in 0..=MOST_PAIRS {
            let patch = cutting.patch(faces.clone(), |h| cut.contains(&h));
            let Some(bulging) = Bulging::of(Cow::Borrowed(&patch), self.settings, run)? else { break };
            if bulging.is_promising() {
                let glue: Vec<HalfedgeId> = seams.iter().copied().filter(|h| !cut.contains(h)).collect();
                let open: Vec<HalfedgeId> = cut.iter().copied().filter(|&h| !cutting.is_seam(h)).collect();
                // What cuts the middle again is no way to mend it.
                if glue.iter().any(|h| middle.contains(h)) {
                    ways.push(Proposal { edit: Edit::new(mesh, &glue, &open), start: Start::Embedded });
                }
            }
            let of_surface = |h: HalfedgeId| patch.faces[h.face().index()].halfedge(h.slot());
            let price = CutPrice::new(self.settings);
            let dart = bulging.ends().and_then(|(tip, root)| {
                let around: Vec<HalfedgeId> = patch.mesh.outgoing(tip).map(of_surface).collect();
                let is_allowed = self.side_of(mesh, &around);
                let forbidden = |h: HalfedgeId| h.is_none() || patch.is_diagonal(h) || !is_allowed(of_surface(h));
                charts::shortest_path_to_boundary(&patch.mesh, tip, root, |h| price.of(&patch.mesh, h), forbidden)
            });
            let Some(dart) = dart else { break };
            let pair = dart.into_iter().map(of_surface).flat_map(|h| [h, self.mirror.likeness.image(h)]);
            cut.extend(pair.filter(|h| !h.is_none()).flat_map(|h| [h, mesh.twin(h)]));
        }
        Ok(ways)
    }
}

impl Face<'_> {
    /// The edges in the plane at which some charts meet each other or themselves.
    fn line(&self, cutting: &Cutting<'_>, charts: &[ChartId]) -> Vec<HalfedgeId> {
        let mesh = cutting.mesh();
        let is_there = |h: &HalfedgeId| {
            self.mirror.is_between(mesh, *h)
                && cutting.sides(*h).is_some_and(|sides| sides.iter().all(|side| charts.contains(side)))
        };
        mesh.edges().filter(is_there).collect()
    }

    /// The sides of edges along which a dart may run from a tip that these leave: on its own side of the plane, or in the plane. A dart from a tip in the plane stays there:
    /// with its image it would cut something out.
    fn side_of<'s>(&'s self, mesh: &'s TriMesh, around: &[HalfedgeId]) -> impl Fn(HalfedgeId) -> bool + 's {
        let is_in_plane = |h: HalfedgeId| self.mirror.is_between(mesh, h);
        let starts_in_plane = around.iter().any(|&h| is_in_plane(h));
        let own_side = around.first().map(|h| self.mirror.is_in_first(h.face()));
        move |h| is_in_plane(h) || !starts_in_plane && own_side == Some(self.mirror.is_in_first(h.face()))
    }
}

/// Of edges in the mirror plane the run along which a cut would be dearest beside one at places that are seen as much as others.
fn middle(mesh: &TriMesh, line: &[HalfedgeId]) -> BTreeSet<HalfedgeId> {
    let mut best: (f64, Vec<HalfedgeId>) = (0.0, Vec::new());
    for (run, is_loop) in runs(mesh, line) {
        let (n, most) =
            if is_loop { (2 * run.len(), run.len().saturating_sub(LEAST_CUT)) } else { (run.len(), run.len()) };
        let around: Vec<HalfedgeId> = run.iter().chain(&run).copied().take(n).collect();
        for first in 0..run.len() {
            let mut worth = 0.0;
            for last in first..n.min(first + most) {
                worth += cost::dearness(mesh, around[last]);
                if worth > best.0 {
                    best = (worth, around[first..=last].to_vec());
                }
            }
        }
    }
    best.1.into_iter().collect()
}

/// Edges that are given in any order as unbroken runs, and whether each is closed.
fn runs(mesh: &TriMesh, edges: &[HalfedgeId]) -> Vec<(Vec<HalfedgeId>, bool)> {
    let mut at: BTreeMap<VertexId, Vec<HalfedgeId>> = BTreeMap::new();
    for &h in edges {
        at.entry(mesh.from(h)).or_default().push(h);
        at.entry(mesh.to(h)).or_default().push(h);
    }
    let is_end = |v: VertexId| at[&v].len() != 2;
    let mut left: BTreeSet<HalfedgeId> = edges.iter().copied().collect();
    let mut runs = Vec::new();
    while let Some(first) = left.iter().find(|&&h| is_end(mesh.from(h)) || is_end(mesh.to(h))).or(left.first()).copied()
    {
        let start = if is_end(mesh.to(first)) { mesh.to(first) } else { mesh.from(first) };
        let (mut run, mut v, mut next) = (Vec::new(), start, Some(first));
        while let Some(h) = next {
            left.remove(&h);
            run.push(h);
            v = if mesh.from(h) == v { mesh.to(h) } else { mesh.from(h) };
            next = if is_end(v) { None } else { at[&v].iter().copied().find(|h| left.contains(h)) };
        }
        let is_loop = v == start && !is_end(v);
        runs.push((run, is_loop));
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::super::super::divide::divide;
    use super::super::super::search::search;
    use super::super::dart::tests::moved;
    use super::*;
    use crate::charts::{Chart, Patch};
    use crate::flattening::Rungs;
    use crate::mesh::{self, test_surfaces};
    use crate::progress::Progress;
    use nalgebra::Point3;

    /// A sheet of 12 by 12 quads with two bumps, which mirror each other at x = 6; in that plane seams count for so many times as much as elsewhere.
    fn cheeks(weight: f32) -> (TriMesh, Vec<u32>) {
        let sheet = test_surfaces::grid(12, 12, [12.0, 12.0], 0.0);
        let bump = |p: Point3<f64>, x: f64| 5.0 * (-((p.x - x).powi(2) + (p.y - 6.0).powi(2)) / 4.0).exp();
        let sheet = moved(&sheet, |p| Point3::new(p.x, p.y, bump(p, 3.0) + bump(p, 9.0)));
        let polygon = (0..sheet.face_count() as u32).map(|f| f / 2).collect();
        let weights = sheet.positions().iter().map(|p| if p.x == 6.0 { weight } else { 1.0 }).collect();
        (sheet.with_seam_weights(weights), polygon)
    }

    /// What the move makes of the two halves of a sheet, which meet in the plane.
    fn mended(mesh: &TriMesh, polygon: &[u32]) -> Vec<Chart> {
        let (progress, settings) = (Progress::new(), Settings::default());
        let run = Run::new(&progress, None);
        let mirror = mesh::mirror(mesh, polygon, &progress).expect("not cancelled").expect("a plane at x = 6");
        let half = |is_first: bool| {
            let faces = mesh.faces().filter(|&f| mirror.is_in_first(f) == is_first).collect();
            Patch::of_surface(mesh, polygon, faces)
        };
        let halves = vec![half(true), half(false)];
        let charting = divide(halves, &Price::new(mesh, &settings), &settings, &|_| (), &run).expect("not cancelled");
        let mut cutting = Cutting::new(mesh, polygon, charting.charts);
        let face = Face { mirror: &mirror, settings: &settings };
        search(&mut cutting, &mut History::default(), &[&face], &settings, &mut Rungs::default(), &run)
            .expect("not cancelled");
        cutting.check_invariants().expect("sound");
        cutting.into_charts()
    }

    #[test]
    fn a_face_is_glued_in_its_middle_and_cut_in_pairs() {
        let (mesh, polygon) = cheeks(5.0);
        let charts = mended(&mesh, &polygon);
        assert_eq!(charts.len(), 1);
        let patch = &charts[0].patch.mesh;
        let is_at = |h: HalfedgeId, x: f64| [patch.from(h), patch.to(h)].iter().all(|&v| patch.position(v).x == x);
        let border: Vec<HalfedgeId> = patch.halfedges().filter(|&h| patch.is_boundary(h)).collect();
        assert!(border.iter().all(|&h| !is_at(h, 6.0)), "the middle is whole");
        assert!(
            patch.boundary_length() > 48.0 + 4.0,
            "there are darts: a bump of that height is no map under the limit"
        );
        // To each edge of the border belongs one on the other side.
        let ends = |h: HalfedgeId| [patch.from(h), patch.to(h)].map(|v| patch.position(v));
        let is_image = |g: HalfedgeId, h: HalfedgeId| {
            let ([a, b], [c, d]) = (ends(g), ends(h));
            let near = |p: Point3<f64>, q: Point3<f64>| (Point3::new(12.0 - p.x, p.y, p.z) - q).norm() < 1e-9;
            near(a, d) && near(b, c)
        };
        assert!(border.iter().all(|&h| border.iter().any(|&g| is_image(g, h))));
    }

    #[test]
    fn what_is_seen_no_more_than_other_places_has_no_middle_to_be_kept() {
        let (mesh, polygon) = cheeks(1.0);
        assert!(mended(&mesh, &polygon).len() > 1);
    }

    #[test]
    fn runs_are_unbroken_and_closed_ones_keep_two_edges_cut() {
        let mesh = test_surfaces::grid(8, 2, [8.0, 2.0], 0.0);
        let is_in = |h: &HalfedgeId| [mesh.from(*h), mesh.to(*h)].iter().all(|v| mesh.position(*v).y == 1.0);
        let mut line: Vec<HalfedgeId> = mesh.edges().filter(is_in).collect();
        line.retain(|&h| (mesh.position(mesh.from(h)).x + mesh.position(mesh.to(h)).x) / 2.0 != 2.5);
        let mut lengths: Vec<usize> = runs(&mesh, &line)
            .iter()
            .map(|(run, is_loop)| {
                assert!(!is_loop);
                run.len()
            })
            .collect();
        lengths.sort_unstable();
        assert_eq!(lengths, [2, 5]);
        let dear = mesh.clone().with_seam_weights(vec![2.0; mesh.vertex_count()]);
        assert_eq!(middle(&dear, &line).len(), 5, "the longer run");
        let tube = test_surfaces::cylinder(8, 2, 2.0);
        let around =
            |h: &HalfedgeId| [tube.from(*h), tube.to(*h)].iter().all(|v| (tube.position(*v).z - 1.0).abs() < 1e-9);
        let ring: Vec<HalfedgeId> = tube.edges().filter(around).collect();
        assert!(runs(&tube, &ring).len() == 1 && runs(&tube, &ring)[0].1);
        let dear = tube.clone().with_seam_weights(vec![2.0; tube.vertex_count()]);
        assert_eq!(middle(&dear, &ring).len(), ring.len() - LEAST_CUT);
    }
}
