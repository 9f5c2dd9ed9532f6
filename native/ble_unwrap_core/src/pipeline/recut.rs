//! Borders moved to where a chart is crushed against them.
//!
//! The worst stretch of a chart is often in a few polygons at its border: another part of the border is in their way, or
//! the border should have run behind them. Such a crest is handed over the border: cut off, glued to the chart beyond,
//! or to the other side of a cut of its own chart, and unfolded there. The border then runs where the crest was measured.
//! Nothing else moves, so nothing has to be minimised again.

use std::collections::BTreeSet;

use nalgebra::{Point2, Vector2};

use crate::charts::{Chart, Patch};
use crate::distortion::{self, RestTriangle};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::settings::{Holes, Settings};
use crate::stretch;

use super::flatten::{self, NEGLIGIBLE};
use crate::flattening::{Rung, Rungs};

/// A crest has a face of more L-infinity stretch than this. Over 16 models in several triangulations 2, 2.5 and 3 take 14, 12
/// and 11 % off the atlases' L-infinity stretch (geometric means) and add 0.8, 0.3 and 0.1 % to their seams.
const CRUSHED: f64 = 2.5;
/// It goes as far as the stretch is more than this,
const CREST: f64 = 2.0;
/// over no more polygons once it has so many faces.
const MOST_FACES: usize = 32;
/// A crest of more triangles, as large polygons have, stays.
const LARGEST: usize = 256;
/// Faces of a chart, its worst, at which a crest may begin.
const MOST_BEGINNINGS: usize = 8;
/// Ways to hand over a crest that are tried.
const MOST_WAYS: usize = 3;
/// It pays where the logarithm of the stretch it began at falls by so many times the share of the chart's boundary that is
/// added to the border: a third less stretch for 1 % more of it.
const PRICE: f64 = 40.0;

/// The charts with their crests handed over. They are made of faces of `mesh` and come sorted by lowest face; those under
/// the limit stay so, the L2 stretch of all together does not rise, all stay injective, and edges of guides stay borders.
/// At most 2 · [`MOST_BEGINNINGS`] · [`MOST_WAYS`] trials a chart, each O(n log n) in the faces of two charts; mostly none.
pub(super) fn recut(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Progress,
) -> Result<Vec<Chart>, Cancelled> {
    if !settings.merge || !settings.wants_darts() {
        return Ok(charts);
    }
    let unit = mesh.halfedges().map(|h| mesh.edge_length(h)).sum::<f64>() / mesh.halfedge_count().max(1) as f64;
    let place = vec![(usize::MAX, FaceId::NONE); mesh.face_count()];
    let boundary = vec![0.0; charts.len()];
    let mut table = Table { mesh, polygon, settings, unit, place, charts, boundary };
    (0..table.charts.len()).for_each(|i| table.claim(i));
    let mut tried = BTreeSet::new();
    for (before, worst) in table.crushed() {
        progress.check()?;
        // Gone with another.
        if table.stretch(worst) < before {
            continue;
        }
        let whole = if tried.contains(&worst) { Vec::new() } else { table.crest(worst, CREST) };
        let alone = table.crest(worst, f64::INFINITY);
        if table.hand_over(&whole, before) || (alone != whole && table.hand_over(&alone, before)) {
            rungs.take(Rung::Recut);
        }
        tried.extend(whole);
    }
    let mut charts = table.charts;
    charts.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok(charts)
}

/// The corners of a face in the plane.
type Corners = [Point2<f64>; 3];

struct Table<'a> {
    mesh: &'a TriMesh,
    polygon: &'a [u32],
    settings: &'a Settings,
    /// Mean length of an edge.
    unit: f64,
    /// The chart of each face, and its number there.
    place: Vec<(usize, FaceId)>,
    charts: Vec<Chart>,
    /// Lengths of the charts' boundaries.
    boundary: Vec<f64>,
}

impl Table<'_> {
    /// Enters the faces of a chart.
    fn claim(&mut self, i: usize) {
        for (local, f) in self.charts[i].patch.faces.iter().enumerate() {
            self.place[f.index()] = (i, FaceId::new(local));
        }
        self.boundary[i] = self.charts[i].patch.mesh.boundary_length();
    }

    /// The charts on both sides of an edge.
    fn sides(&self, h: HalfedgeId) -> [usize; 2] {
        [h, self.mesh.twin(h)].map(|h| self.place[h.face().index()].0)
    }

    /// Whether a half-edge of the mesh is on the boundary of its chart.
    fn is_border(&self, h: HalfedgeId) -> bool {
        let (i, local) = self.place[h.face().index()];
        self.charts[i].patch.mesh.is_boundary(local.halfedge(h.slot()))
    }

    fn corners(&self, f: FaceId) -> Corners {
        let (i, local) = self.place[f.index()];
        self.charts[i].patch.mesh.triangle(local).map(|v| self.charts[i].uv[v.index()])
    }

    fn rest(&self, f: FaceId) -> RestTriangle {
        RestTriangle::new(self.mesh.triangle_positions(f), self.unit)
    }

    /// L-infinity stretch of a face; charts are as large as their surface.
    fn stretch(&self, f: FaceId) -> f64 {
        self.stretch_at(f, self.corners(f))
    }

    fn stretch_at(&self, f: FaceId, corners: Corners) -> f64 {
        1.0 / distortion::singular_values(&self.rest(f).jacobian(corners))[1]
    }

    fn length(&self, edges: &[HalfedgeId]) -> f64 {
        edges.iter().map(|&h| self.mesh.edge_length(h)).sum()
    }

    /// The most crushed faces at the border of each chart, worst of all first, and how much they are.
    fn crushed(&self) -> Vec<(f64, FaceId)> {
        let worst_first = |a: &(f64, FaceId), b: &(f64, FaceId)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        let mut crushed = Vec::new();
        for chart in self.charts.iter().filter(|c| c.l2 <= self.settings.stretch_limit) {
            let (mesh, names) = (&chart.patch.mesh, &chart.patch.faces);
            let at_border = |f: &FaceId| mesh.triangle(*f).iter().any(|&v| mesh.is_boundary_vertex(v));
            let measured = mesh.faces().filter(at_border).map(|f| (self.stretch(names[f.index()]), names[f.index()]));
            let mut own: Vec<(f64, FaceId)> = measured.filter(|s| s.0 > CRUSHED).collect();
            own.sort_by(worst_first);
            own.truncate(MOST_BEGINNINGS);
            crushed.extend(own);
        }
        crushed.sort_by(worst_first);
        crushed
    }

    /// A face with those that hang together with it in its chart and are stretched more than this, by whole polygons,
    /// ascending; none where these are large.
    fn crest(&self, worst: FaceId, least: f64) -> Vec<FaceId> {
        let mut faces = vec![worst];
        let mut at = 0;
        while at < faces.len() {
            let has_room = faces.len() < MOST_FACES;
            for h in faces[at].halfedges().into_iter().filter(|&h| !self.is_border(h)) {
                let next = self.mesh.twin(h).face();
                let is_same = self.polygon[h.face().index()] == self.polygon[next.index()];
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

    /// Hands a crest over the border where that pays.
    fn hand_over(&mut self, crest: &[FaceId], before: f64) -> bool {
        let Some((way, changed)) = self.ways(crest).into_iter().find_map(|way| {
            let changed = self.handed_over(crest, &way, before)?;
            Some((way, changed))
        }) else {
            return false;
        };
        for (i, chart) in self.sides(way[0]).into_iter().zip(changed) {
            if let Some(chart) = chart {
                self.charts[i] = chart;
                self.claim(i);
            }
        }
        true
    }

    /// Along which edges of its outline a crest may be glued to what lies beyond: all towards one chart, or the longest of
    /// them, longest first.
    fn ways(&self, crest: &[FaceId]) -> Vec<Vec<HalfedgeId>> {
        let mesh = self.mesh;
        let is_way = |h: &HalfedgeId| {
            let t = mesh.twin(*h);
            !t.is_none() && self.is_border(*h) && !mesh.is_guide(*h) && !is_in(crest, t.face())
        };
        let beyond = |h: HalfedgeId| self.sides(h)[1];
        let mut edges: Vec<HalfedgeId> = crest.iter().flat_map(|f| f.halfedges()).filter(is_way).collect();
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

    /// What becomes of the chart of a crest, unless it stays in that, and of the chart that it goes to. `None` where that
    /// does not pay or makes no chart.
    fn handed_over(&self, crest: &[FaceId], way: &[HalfedgeId], before: f64) -> Option<[Option<Chart>; 2]> {
        let mesh = self.mesh;
        let [a, b] = self.sides(way[0]);
        let is_new = |h: &HalfedgeId| !self.is_border(*h) && !is_in(crest, mesh.twin(*h).face());
        let new: Vec<HalfedgeId> = crest.iter().flat_map(|f| f.halfedges()).filter(is_new).collect();
        let added = (self.length(&new) - self.length(way)) / self.boundary[a];
        let pays = |after: f64| after < before && (before / after).ln() >= PRICE * added;
        let stays: Vec<FaceId> = self.charts[a].patch.faces.iter().copied().filter(|f| !is_in(crest, *f)).collect();
        if stays.is_empty() || !pays(1.0) {
            return None;
        }
        let is_cut = |h: HalfedgeId| {
            let t = mesh.twin(h);
            let is_outline = is_in(crest, h.face()) != is_in(crest, t.face());
            if is_outline { !way.contains(&h) && !way.contains(&t) } else { self.is_border(h) }
        };
        let cut_out = |faces: Vec<FaceId>| Patch::cut_out(mesh, self.polygon, faces, is_cut);
        let mut faces = self.charts[b].patch.faces.clone();
        if a != b {
            faces.extend_from_slice(crest);
            faces.sort_unstable();
        }
        let to = self.lying(cut_out(faces), &self.unfolded(crest, way[0]))?;
        let drawn = to.patch.faces.iter().zip(to.patch.mesh.triangles()).filter(|(f, _)| is_in(crest, **f));
        let after = drawn.map(|(f, t)| self.stretch_at(*f, t.map(|v| to.uv[v.index()]))).fold(0.0, f64::max);
        if !pays(after) {
            return None;
        }
        let from = if a == b { None } else { Some(self.lying(cut_out(stays), &[])?) };
        let energy = |c: &Chart| c.patch.area() * c.l2.powi(2);
        let old = if a == b { energy(&self.charts[a]) } else { energy(&self.charts[a]) + energy(&self.charts[b]) };
        (energy(&to) + from.as_ref().map_or(0.0, energy) <= old).then_some([from, Some(to)])
    }

    /// A crest unfolded from the other side of an edge of its outline; by face.
    fn unfolded(&self, crest: &[FaceId], first: HalfedgeId) -> Vec<(FaceId, Corners)> {
        let twin = self.mesh.twin(first);
        let beyond = self.corners(twin.face());
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
            for g in f.halfedges().into_iter().filter(|&g| !self.is_border(g)) {
                let t = self.mesh.twin(g);
                if is_in(crest, t.face()) {
                    open.push((t, [corners[(g.slot() + 1) % 3], corners[g.slot()]]));
                }
            }
        }
        drawn.sort_by_key(|d| d.0);
        drawn
    }

    /// A patch as a chart whose faces lie where they lay, but for those drawn anew. `None` where that is not injective or
    /// over the limit.
    fn lying(&self, patch: Patch, drawn: &[(FaceId, Corners)]) -> Option<Chart> {
        let mesh = &patch.mesh;
        let topology = mesh.topology();
        if !topology.is_chart() || (self.settings.holes == Holes::Cut && !topology.is_disk()) {
            return None;
        }
        let mut uv = vec![Point2::origin(); mesh.vertex_count()];
        let mut put = |t: &[VertexId; 3], corners: Corners| t.iter().zip(corners).for_each(|(v, p)| uv[v.index()] = p);
        let anew = |f: &FaceId| drawn.binary_search_by_key(f, |d| d.0).ok().map(|at| drawn[at].1);
        let faces = || patch.faces.iter().zip(mesh.triangles());
        faces().filter_map(|(f, t)| Some((t, anew(f)?))).for_each(|(t, corners)| put(t, corners));
        // What has been there stays, so it comes last.
        faces().filter(|(f, _)| anew(f).is_none()).for_each(|(f, t)| put(t, self.corners(*f)));
        if stretch::first_flip(mesh, &uv).is_some() || !stretch::boundary_is_simple(mesh, &uv) {
            return None;
        }
        let l2 = stretch::l2_of_positions(mesh, &uv, NEGLIGIBLE);
        let good = l2 <= self.settings.stretch_limit && flatten::is_sharp(mesh, &RestTriangle::of_mesh(mesh), &uv);
        good.then_some(Chart { patch, uv, l2 })
    }
}

/// Whether a face is among some in ascending order.
fn is_in(faces: &[FaceId], face: FaceId) -> bool {
    faces.binary_search(&face).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::settings::NEVER_SEWN;
    use nalgebra::{Point3, Vector3};

    /// Positions along x and y of a vertex in the plane.
    type Place<'a> = &'a dyn Fn(Point3<f64>) -> Point2<f64>;

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
        let l2 = stretch::l2_of_positions(&patch.mesh, &uv, NEGLIGIBLE);
        Chart { patch, uv, l2 }
    }

    fn settings() -> Settings {
        Settings { stretch_limit: 2.0, ..Settings::default() }
    }

    /// The charts recut, and how often; checks that they are whole and injective.
    fn recut_all(mesh: &TriMesh, polygon: &[u32], charts: Vec<Chart>, settings: &Settings) -> (Vec<Chart>, usize) {
        let mut rungs = Rungs::default();
        let charts = recut(mesh, polygon, charts, settings, &mut rungs, &Progress::new()).expect("not cancelled");
        let mut faces: Vec<FaceId> = charts.iter().flat_map(|c| c.patch.faces.iter().copied()).collect();
        faces.sort_unstable();
        assert!(faces.into_iter().eq(mesh.faces()), "each face once");
        for chart in &charts {
            assert!(chart.patch.mesh.topology().is_chart());
            assert_eq!(stretch::first_flip(&chart.patch.mesh, &chart.uv), None);
            assert!(stretch::boundary_is_simple(&chart.patch.mesh, &chart.uv));
            assert_eq!(chart.l2, stretch::l2_of_positions(&chart.patch.mesh, &chart.uv, NEGLIGIBLE));
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
    fn what_is_crushed_at_a_border_goes_to_the_chart_beyond() {
        let mesh = sheet();
        let all = triangles(&mesh);
        let before = charts(&mesh, &all, |p| p.x < 20.0, [&pushed, &flat]);
        assert!(worst(&before) > 5.0);
        let (after, times) = recut_all(&mesh, &all, before.clone(), &settings());
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
        let (after, times) = recut_all(&mesh, &quads, before, &settings());
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
        let flat = flatten::isometric(&patch, &mut Rungs::default()).expect("it unrolls");
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
        chart.l2 = stretch::l2_of_positions(&chart.patch.mesh, &chart.uv, NEGLIGIBLE);
        let before = vec![chart];
        assert!(worst(&before) > 2.5, "{}", worst(&before));
        let (after, times) = recut_all(&mesh, &all, before.clone(), &settings());
        assert_eq!((times, after.len()), (1, 1));
        assert!(worst(&after) < 0.7 * worst(&before), "{} {}", worst(&before), worst(&after));
    }

    #[test]
    fn nothing_moves_where_nothing_is_crushed_or_a_guide_runs_or_it_is_not_wanted() {
        let mesh = sheet();
        let all = triangles(&mesh);
        let wide = |p: Point3<f64>| Point2::new(1.4 * p.x, p.y / 1.4);
        let even = charts(&mesh, &all, |p| p.x < 20.0, [&wide, &flat]);
        assert_eq!(recut_all(&mesh, &all, even, &settings()).1, 0);
        let on_border = |h: HalfedgeId| [mesh.from(h), mesh.to(h)].iter().all(|v| mesh.position(*v).x == 20.0);
        let guided = mesh.clone().with_guides(mesh.halfedges().map(on_border).collect());
        let crushed = |mesh: &TriMesh| charts(mesh, &all, |p| p.x < 20.0, [&pushed, &flat]);
        assert_eq!(recut_all(&guided, &all, crushed(&guided), &settings()).1, 0);
        let apart = Settings { merge: false, ..settings() };
        let no_darts = Settings { least_sewn: NEVER_SEWN, ..settings() };
        let over = Settings { stretch_limit: 1.0 + 1e-6, ..settings() };
        for settings in [apart, no_darts, over] {
            let mut rungs = Rungs::default();
            let charts = recut(&mesh, &all, crushed(&mesh), &settings, &mut rungs, &Progress::new());
            assert!(charts.is_ok() && rungs.taken().is_empty());
        }
    }

    #[test]
    fn a_crest_stays_where_it_would_lie_on_the_border_beyond() {
        let mesh = sheet();
        let all = triangles(&mesh);
        // A window drawn flat, in the shape of an L, leaves no more room than its own panes fill.
        let window = |p: Point3<f64>| {
            let is_arm = (10.0..20.0).contains(&p.x) && (20.0..31.0).contains(&p.y);
            is_arm || ((19.0..20.0).contains(&p.x) && (17.0..20.0).contains(&p.y))
        };
        let before = charts(&mesh, &all, window, [&pushed, &flat]);
        assert!(worst(&before) > 5.0);
        assert_eq!(recut_all(&mesh, &all, before, &settings()).1, 0);
    }

    #[test]
    fn whatever_is_crushed_the_charts_stay_sound_and_the_worst_stretch_does_not_grow() {
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
            let (after, times) = recut_all(&mesh, &all, before.clone(), &settings);
            moved += times;
            let energy = |charts: &[Chart]| charts.iter().map(|c| c.patch.area() * c.l2.powi(2)).sum::<f64>();
            assert!(energy(&after) <= energy(&before) * (1.0 + 1e-12));
            // Measured at each chart's own scale, which the crest has a small part in.
            assert!(worst(&after) <= 1.05 * worst(&before), "{} {}", worst(&before), worst(&after));
        }
        assert!(moved > 5, "{moved}");
    }
}
