//! Polygons handed over a border against which they are squeezed.
//!
//! The worst stretch of a chart is often in a few polygons at its border: another part of the border is in their way, or
//! the border should have run behind them. Such polygons are cut off, glued to the chart beyond, or to the other side of a cut
//! of their own chart, and unfolded there. The border then runs where they were squeezed most. Nothing else moves, so nothing
//! has to be minimised again.

use std::collections::BTreeSet;

use nalgebra::Vector2;

use crate::cache::Run;
use crate::charts::Chart;
use crate::distortion::{self, RestTriangle};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::{Moves, Settings};

use super::super::cost;
use super::super::edit::Edit;
use super::super::state::{Corners, Cutting};
use super::super::trial::{Verdict, trial};
use super::{Proposal, Start};

/// Polygons are handed over if one of their triangles has more L-infinity stretch than this. Over 16 models in several
/// triangulations 2, 2.5 and 3 take 14, 12 and 11 % off the atlases' L-infinity stretch (geometric means) and add 0.8, 0.3 and
/// 0.1 % to their seams.
const SQUEEZED: f64 = 2.5;
/// The triangles around that one go with it as far as they have more L-infinity stretch than this.
const SQUEEZED_BESIDE: f64 = 2.0;
/// No more polygons are added once there are so many triangles.
const MOST_FACES: usize = 32;
/// Polygons of more triangles altogether, as large polygons have, stay where they are.
const LARGEST: usize = 256;
/// Triangles of a chart, its worst, around which polygons are handed over.
const MOST_BEGINNINGS: usize = 8;
/// Ways to hand over the same polygons that are tried.
const MOST_WAYS: usize = 3;
/// The charts with their squeezed polygons handed over. They are made of faces of `mesh` and come sorted by lowest face; those
/// under the limit stay so, the L2 stretch of all together does not rise, all stay injective, and edges of guides stay borders.
/// At most 2 · [`MOST_BEGINNINGS`] · [`MOST_WAYS`] trials a chart, each O(n log n) in the faces of two charts; mostly none.
pub(crate) fn hand_over(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    if settings.moves != Moves::All {
        return Ok(charts);
    }
    let unit = mesh.halfedges().map(|h| mesh.edge_length(h)).sum::<f64>() / mesh.halfedge_count().max(1) as f64;
    let mut borders = Borders { cutting: Cutting::new(mesh, polygon, charts), settings, unit };
    let mut tried = BTreeSet::new();
    for (before, worst) in borders.squeezed() {
        run.progress.check()?;
        // Gone with another.
        if borders.stretch(worst) < before {
            continue;
        }
        let all = if tried.contains(&worst) { Vec::new() } else { borders.squeezed_around(worst, SQUEEZED_BESIDE) };
        let alone = borders.squeezed_around(worst, f64::INFINITY);
        if borders.hand_over(&all, before, run)? || (alone != all && borders.hand_over(&alone, before, run)?) {
            rungs.take(Rung::Recut);
        }
        tried.extend(all);
    }
    Ok(borders.cutting.into_charts())
}

struct Borders<'a> {
    cutting: Cutting<'a>,
    settings: &'a Settings,
    /// Mean length of an edge.
    unit: f64,
}

impl Borders<'_> {
    fn rest(&self, f: FaceId) -> RestTriangle {
        RestTriangle::new(self.cutting.mesh().triangle_positions(f), self.unit)
    }

    /// L-infinity stretch of a face; charts are as large as their surface.
    fn stretch(&self, f: FaceId) -> f64 {
        self.stretch_at(f, self.cutting.corners(f))
    }

    fn stretch_at(&self, f: FaceId, corners: Corners) -> f64 {
        1.0 / distortion::singular_values(&self.rest(f).jacobian(corners))[1]
    }

    fn length(&self, edges: &[HalfedgeId]) -> f64 {
        edges.iter().map(|&h| self.cutting.mesh().edge_length(h)).sum()
    }

    /// The most squeezed faces at the border of each chart, worst of all first, and how much they are.
    fn squeezed(&self) -> Vec<(f64, FaceId)> {
        let worst_first = |a: &(f64, FaceId), b: &(f64, FaceId)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        let charts = self.cutting.ids().filter_map(|id| self.cutting.chart(id));
        let mut squeezed = Vec::new();
        for chart in charts.filter(|c| c.l2 <= self.settings.stretch_limit) {
            let (mesh, names) = (&chart.patch.mesh, &chart.patch.faces);
            let at_border = |f: &FaceId| mesh.triangle(*f).iter().any(|&v| mesh.is_boundary_vertex(v));
            let measured = mesh.faces().filter(at_border).map(|f| (self.stretch(names[f.index()]), names[f.index()]));
            let mut own: Vec<(f64, FaceId)> = measured.filter(|s| s.0 > SQUEEZED).collect();
            own.sort_by(worst_first);
            own.truncate(MOST_BEGINNINGS);
            squeezed.extend(own);
        }
        squeezed.sort_by(worst_first);
        squeezed
    }

    /// A face with those that hang together with it in its chart and are stretched more than this, by whole polygons,
    /// ascending; none where these are large.
    fn squeezed_around(&self, worst: FaceId, least: f64) -> Vec<FaceId> {
        let mut faces = vec![worst];
        let mut at = 0;
        while at < faces.len() {
            let has_room = faces.len() < MOST_FACES;
            for h in faces[at].halfedges().into_iter().filter(|&h| !self.cutting.is_seam(h)) {
                let next = self.cutting.mesh().twin(h).face();
                let is_same = self.cutting.polygon(h.face()) == self.cutting.polygon(next);
                if !faces.contains(&next) && (is_same || (has_room && self.stretch(next) > least)) {
                    faces.push(next);
                }
            }
            at += 1;
            if faces.len() > LARGEST {
                return Vec::new();
            }
        }
        faces.sort_unstable();
        faces
    }

    /// Hands faces over the border where that pays.
    fn hand_over(&mut self, faces: &[FaceId], before: f64, run: &Run<'_>) -> Result<bool, Cancelled> {
        for way in self.ways(faces) {
            let Some(proposal) = self.proposal(faces, &way, before) else { continue };
            let verdict = trial(&self.cutting, &proposal, self.settings, &mut Rungs::default(), run)?;
            let Verdict::Charts(charts) = verdict else { continue };
            let old = proposal.edit.charts(&self.cutting);
            if charts.len() == old.len() && self.pays(faces, &way, before, &charts) {
                self.cutting.replace(&old, charts);
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Along which edges of their outline faces may be glued to what lies beyond: all towards one chart, or the longest of
    /// them, longest first.
    fn ways(&self, faces: &[FaceId]) -> Vec<Vec<HalfedgeId>> {
        let mesh = self.cutting.mesh();
        let is_way = |h: &HalfedgeId| {
            let t = mesh.twin(*h);
            !t.is_none() && self.cutting.is_seam(*h) && !mesh.is_guide(*h) && !is_in(faces, t.face())
        };
        let beyond = |h: HalfedgeId| self.cutting.owner(mesh.twin(h).face());
        let mut edges: Vec<HalfedgeId> = faces.iter().flat_map(|f| f.halfedges()).filter(is_way).collect();
        edges.sort_by(|&g, &h| {
            let longest_first = mesh.edge_length(h).total_cmp(&mesh.edge_length(g));
            beyond(g).cmp(&beyond(h)).then(longest_first).then(g.cmp(&h))
        });
        let by_chart = edges.chunk_by(|&g, &h| beyond(g) == beyond(h));
        let mut ways: Vec<Vec<HalfedgeId>> = by_chart.flat_map(|way| [way.to_vec(), vec![way[0]]]).collect();
        ways.sort_by(|v, w| self.length(w).total_cmp(&self.length(v)).then(v.cmp(w)));
        ways.dedup();
        ways.truncate(MOST_WAYS);
        ways
    }

    /// The edges inside the chart of faces along which they are cut off.
    fn cut_off(&self, faces: &[FaceId]) -> Vec<HalfedgeId> {
        let is_new = |h: &HalfedgeId| !self.cutting.is_seam(*h) && !is_in(faces, self.cutting.mesh().twin(*h).face());
        faces.iter().flat_map(|f| f.halfedges()).filter(is_new).collect()
    }

    /// Whether the stretch falls by enough for the border that is added.
    fn falls(&self, faces: &[FaceId], way: &[HalfedgeId], before: f64, after: f64) -> bool {
        let owner = faces.first().and_then(|f| self.cutting.owner(*f));
        let Some(chart) = owner.and_then(|id| self.cutting.chart(id)) else { return false };
        let added = (self.length(&self.cut_off(faces)) - self.length(way)) / chart.patch.mesh.boundary_length();
        cost::lowers_peak(before, after, added)
    }

    /// Faces cut off, glued along a way, and unfolded there. `None` where that cannot pay, or would leave nothing of their chart.
    fn proposal(&self, faces: &[FaceId], way: &[HalfedgeId], before: f64) -> Option<Proposal> {
        let owner = self.cutting.owner(way[0].face())?;
        if self.cutting.face_count(owner) == faces.len() || !self.falls(faces, way, before, 1.0) {
            return None;
        }
        let edit = Edit::new(self.cutting.mesh(), way, &self.cut_off(faces));
        Some(Proposal { edit, start: Start::Redrawn(self.unfolded(faces, way[0])) })
    }

    /// Whether charts with the faces handed over are worth what they cost, and have no more L2 stretch together.
    fn pays(&self, faces: &[FaceId], way: &[HalfedgeId], before: f64, charts: &[Chart]) -> bool {
        let mut after: f64 = 0.0;
        for chart in charts {
            for (f, t) in chart.patch.faces.iter().zip(chart.patch.mesh.triangles()).filter(|(f, _)| is_in(faces, **f))
            {
                after = after.max(self.stretch_at(*f, t.map(|v| chart.uv[v.index()])));
            }
        }
        let energy = |c: &Chart| c.patch.area() * c.l2.powi(2);
        let mut old: Vec<_> = self.cutting.sides(way[0]).into_iter().flatten().collect();
        old.dedup();
        let old: f64 = old.into_iter().filter_map(|id| self.cutting.chart(id)).map(energy).sum();
        self.falls(faces, way, before, after) && charts.iter().map(energy).sum::<f64>() <= old
    }

    /// Faces unfolded from the other side of an edge of their outline; ascending.
    fn unfolded(&self, faces: &[FaceId], first: HalfedgeId) -> Vec<(FaceId, Corners)> {
        let twin = self.cutting.mesh().twin(first);
        let beyond = self.cutting.corners(twin.face());
        let mut drawn: Vec<(FaceId, Corners)> = Vec::new();
        let mut open = vec![(first, [beyond[(twin.slot() + 1) % 3], beyond[twin.slot()]])];
        while let Some((h, [p, q])) = open.pop() {
            let f = h.face();
            if drawn.iter().any(|d| d.0 == f) {
                continue;
            }
            let rest = self.rest(f).corners();
            let [a, b, c] = [0, 1, 2].map(|k| rest[(h.slot() + k) % 3]);
            let (along, side, length) = (b - a, q - p, (b - a).norm());
            let up = Vector2::new(-side.y, side.x).normalize();
            let apex = p + side * (along.dot(&(c - a)) / length.powi(2)) + up * (along.perp(&(c - a)) / length);
            let mut corners = [apex; 3];
            corners[h.slot()] = p;
            corners[(h.slot() + 1) % 3] = q;
            drawn.push((f, corners));
            for g in f.halfedges().into_iter().filter(|&g| !self.cutting.is_seam(g)) {
                let t = self.cutting.mesh().twin(g);
                if is_in(faces, t.face()) {
                    open.push((t, [corners[(g.slot() + 1) % 3], corners[g.slot()]]));
                }
            }
        }
        drawn.sort_by_key(|d| d.0);
        drawn
    }
}

/// Whether a face is among some in ascending order.
fn is_in(faces: &[FaceId], face: FaceId) -> bool {
    faces.binary_search(&face).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Patch;
    use crate::flattening;
    use crate::mesh::VertexId;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::stretch;
    use nalgebra::{Point2, Point3, Vector3};

    /// Positions along x and y of a vertex in the plane.
    type Place<'a> = &'a dyn Fn(Point3<f64>) -> Point2<f64>;

    fn l2(patch: &Patch, uv: &[Point2<f64>]) -> f64 {
        flattening::l2(patch, &RestTriangle::of_mesh(&patch.mesh), uv)
    }

    fn flat(p: Point3<f64>) -> Point2<f64> {
        p.xy()
    }

    /// The vertex of the border at (20, 20) pushed to the left.
    fn pushed(p: Point3<f64>) -> Point2<f64> {
        if p == Point3::new(20.0, 20.0, 0.0) { Point2::new(19.2, 20.0) } else { p.xy() }
    }

    fn triangles(mesh: &TriMesh) -> Vec<u32> {
        (0..mesh.face_count() as u32).collect()
    }

    /// Charts of the faces whose middle is inside and outside a region, drawn in two ways.
    fn charts(
        mesh: &TriMesh,
        polygon: &[u32],
        inside: impl Fn(Point3<f64>) -> bool,
        drawn: [Place<'_>; 2],
    ) -> Vec<Chart> {
        let middle = |f: FaceId| mesh.triangle_positions(f).iter().map(|p| p.coords).sum::<Vector3<f64>>() / 3.0;
        let chart = |(wanted, place): (bool, Place<'_>)| {
            let faces = mesh.faces().filter(|f| inside(Point3::from(middle(*f))) == wanted).collect();
            drawn_as(Patch::of_surface(mesh, polygon, faces), place)
        };
        [true, false].into_iter().zip(drawn).map(chart).collect()
    }

    fn drawn_as(patch: Patch, place: Place<'_>) -> Chart {
        let uv: Vec<_> = patch.mesh.positions().iter().map(|&p| place(p)).collect();
        let l2 = l2(&patch, &uv);
        Chart { patch, uv, l2 }
    }

    fn settings() -> Settings {
        Settings { stretch_limit: 2.0, ..Settings::default() }
    }

    /// The charts after handing over, and how often that was done; checks that they are whole and injective.
    fn all_handed_over(
        mesh: &TriMesh,
        polygon: &[u32],
        charts: Vec<Chart>,
        settings: &Settings,
    ) -> (Vec<Chart>, usize) {
        let mut rungs = Rungs::default();
        let charts = hand_over(mesh, polygon, charts, settings, &mut rungs, &Run::new(&Progress::new(), None))
            .expect("not cancelled");
        let mut faces: Vec<FaceId> = charts.iter().flat_map(|c| c.patch.faces.iter().copied()).collect();
        faces.sort_unstable();
        assert!(faces.into_iter().eq(mesh.faces()), "each face once");
        for chart in &charts {
            assert!(chart.patch.mesh.topology().is_chart());
            assert_eq!(stretch::first_flip(&chart.patch.mesh, &chart.uv), None);
            assert!(stretch::boundary_is_simple(&chart.patch.mesh, &chart.uv));
            assert_eq!(chart.l2, l2(&chart.patch, &chart.uv));
            assert!(chart.l2 <= settings.stretch_limit);
        }
        (charts, rungs.taken().iter().find(|(name, _)| *name == "recut").map_or(0, |r| r.1))
    }

    fn worst(charts: &[Chart]) -> f64 {
        let of = |c: &Chart| stretch::linf_stretch(&c.patch.mesh, &RestTriangle::of_mesh(&c.patch.mesh), &c.uv);
        charts.iter().map(of).fold(0.0, f64::max)
    }

    fn sheet() -> TriMesh {
        test_surfaces::grid(40, 40, [40.0, 40.0], 0.0)
    }

    #[test]
    fn what_is_squeezed_at_a_border_goes_to_the_chart_beyond() {
        let mesh = sheet();
        let all = triangles(&mesh);
        let before = charts(&mesh, &all, |p| p.x < 20.0, [&pushed, &flat]);
        assert!(worst(&before) > 5.0);
        let (after, times) = all_handed_over(&mesh, &all, before.clone(), &settings());
        assert_eq!(times, 1);
        // The two thin triangles at the pushed vertex lie flat beyond.
        let faces = |charts: &[Chart]| charts.iter().map(|c| c.patch.faces.len()).collect::<Vec<_>>();
        assert_eq!((faces(&before), faces(&after)), (vec![1600, 1600], vec![1598, 1602]));
        assert!(worst(&after) < 2.0 && after[0].l2 < before[0].l2, "{}", worst(&after));
        assert!((after[1].l2 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn polygons_go_whole() {
        let mesh = sheet();
        let quads: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let before = charts(&mesh, &quads, |p| p.x < 20.0, [&pushed, &flat]);
        let (after, times) = all_handed_over(&mesh, &quads, before, &settings());
        assert_eq!((times, after[1].patch.faces.len()), (1, 1604), "two squares");
        assert!((worst(&after) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn across_a_cut_it_goes_to_the_other_side_of_the_same_chart() {
        let mesh = test_surfaces::cylinder(48, 16, 2.0);
        let all = triangles(&mesh);
        let on_cut = |v| mesh.position(v).y.abs() < 1e-9 && mesh.position(v).x > 0.0;
        let cut: Vec<_> = mesh.edges().filter(|&h| on_cut(mesh.from(h)) && on_cut(mesh.to(h))).collect();
        let patch = Patch::whole(mesh.clone().into(), all.clone()).cut(&cut);
        let flat = flattening::isometric(&patch, &mut Rungs::default()).expect("it unrolls");
        let mut chart = flat.into_chart(patch);
        // A vertex in the middle of one side, moved in by three quarters of an edge.
        let loops = chart.patch.mesh.boundary_loops();
        let border: Vec<_> = loops.iter().next().expect("a loop").to_vec();
        let inner = |v: &VertexId| {
            on_cut(chart.patch.vertices[v.index()])
                && (mesh.position(chart.patch.vertices[v.index()]).z - 1.0).abs() < 1e-9
        };
        let v = border.iter().map(|&h| chart.patch.mesh.from(h)).find(inner).expect("on the cut");
        let centre = chart.uv.iter().map(|p| p.coords).sum::<Vector2<f64>>() / chart.uv.len() as f64;
        let across = mesh.edge_length(mesh.outgoing(VertexId::new(0)).next().expect("an edge"));
        let to_centre = (centre - chart.uv[v.index()].coords).normalize();
        chart.uv[v.index()] += 0.75 * across * to_centre;
        chart.l2 = l2(&chart.patch, &chart.uv);
        let before = vec![chart];
        assert!(worst(&before) > 2.5, "{}", worst(&before));
        let (after, times) = all_handed_over(&mesh, &all, before.clone(), &settings());
        assert_eq!((times, after.len()), (1, 1));
        assert!(worst(&after) < 0.7 * worst(&before), "{} {}", worst(&before), worst(&after));
    }

    #[test]
    fn nothing_moves_where_nothing_is_squeezed_or_a_guide_runs_or_it_is_not_wanted() {
        let mesh = sheet();
        let all = triangles(&mesh);
        let wide = |p: Point3<f64>| Point2::new(1.4 * p.x, p.y / 1.4);
        let even = charts(&mesh, &all, |p| p.x < 20.0, [&wide, &flat]);
        assert_eq!(all_handed_over(&mesh, &all, even, &settings()).1, 0);
        let on_border = |h: HalfedgeId| [mesh.from(h), mesh.to(h)].iter().all(|v| mesh.position(*v).x == 20.0);
        let guided = mesh.clone().with_guides(mesh.halfedges().map(on_border).collect());
        let squeezed = |mesh: &TriMesh| charts(mesh, &all, |p| p.x < 20.0, [&pushed, &flat]);
        assert_eq!(all_handed_over(&guided, &all, squeezed(&guided), &settings()).1, 0);
        let apart = Settings { moves: Moves::Split, ..settings() };
        let no_darts = Settings { moves: Moves::Join, ..settings() };
        let over = Settings { stretch_limit: 1.0 + 1e-6, ..settings() };
        for settings in [apart, no_darts, over] {
            let mut rungs = Rungs::default();
            let charts =
                hand_over(&mesh, &all, squeezed(&mesh), &settings, &mut rungs, &Run::new(&Progress::new(), None));
            assert!(charts.is_ok() && rungs.taken().is_empty());
        }
    }

    #[test]
    fn polygons_stay_where_they_would_lie_on_the_border_beyond() {
        let mesh = sheet();
        let all = triangles(&mesh);
        // A window drawn flat, in the shape of an L, leaves no more room than its own panes fill.
        let window = |p: Point3<f64>| {
            let is_arm = (10.0..20.0).contains(&p.x) && (20.0..31.0).contains(&p.y);
            is_arm || ((19.0..20.0).contains(&p.x) && (17.0..20.0).contains(&p.y))
        };
        let before = charts(&mesh, &all, window, [&pushed, &flat]);
        assert!(worst(&before) > 5.0);
        assert_eq!(all_handed_over(&mesh, &all, before, &settings()).1, 0);
    }

    #[test]
    fn whatever_is_squeezed_the_charts_stay_sound_and_the_worst_stretch_does_not_grow() {
        let mesh = test_surfaces::grid(16, 24, [16.0, 24.0], 0.1);
        let all = triangles(&mesh);
        let mut moved = 0;
        for seed in 0..40_u64 {
            let shake = |p: Point3<f64>| {
                let word = (p.x.to_bits() ^ p.y.to_bits().rotate_left(17) ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                let part = |shift: u32| f64::from((word >> shift) as u16) / 65_536.0 - 0.5;
                p.xy() + Vector2::new(part(48), part(32)) * 0.7
            };
            let before = charts(&mesh, &all, |p| p.x + (0.5 * p.y).sin() < 9.0, [&shake, &shake]);
            let is_injective = |c: &Chart| {
                stretch::first_flip(&c.patch.mesh, &c.uv).is_none() && stretch::boundary_is_simple(&c.patch.mesh, &c.uv)
            };
            if !before.iter().all(is_injective) || before.iter().any(|c| c.l2 > 3.0) {
                continue;
            }
            let settings = Settings { stretch_limit: 3.0, ..settings() };
            let (after, times) = all_handed_over(&mesh, &all, before.clone(), &settings);
            moved += times;
            let energy = |charts: &[Chart]| charts.iter().map(|c| c.patch.area() * c.l2.powi(2)).sum::<f64>();
            assert!(energy(&after) <= energy(&before) * (1.0 + 1e-12));
            // Measured at each chart's own scale, in which what is handed over has a small part.
            assert!(worst(&after) <= 1.05 * worst(&before), "{} {}", worst(&before), worst(&after));
        }
        assert!(moved > 5, "{moved}");
    }
}
