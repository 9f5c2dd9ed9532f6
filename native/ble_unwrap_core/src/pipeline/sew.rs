//! Two flattened charts laid side by side and joined along their border.
//!
//! Both are flat already and hardly stretched, so the union needs neither distances nor an embedding: one chart is
//! moved rigidly until the border meets, what does not meet is shared between both sides, and the stretch is minimised
//! from there. How far the border stays apart tells early that a union is hopeless.

use nalgebra::Point2;

use crate::charts::{Chart, Patch};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Cancelled;
use crate::settings::{Holes, Settings};

use super::flatten::{self, Polished};
use super::memo::Run;
use super::rigid::Motion;
use crate::flattening::Rungs;

/// What came of sewing two charts together.
pub(super) enum Joined {
    Chart(Box<Chart>),
    /// Over the limit, or not of a chart's topology.
    Refused,
    /// The charts, as they lie, do not fit together without flips or overlap.
    Misfit,
}

/// The union of two neighbouring charts of `mesh` as one chart under the limit. First sewn all along their border; where that has several stretches, also along the longest alone,
/// and cut open along the others.
pub(super) fn joined(
    mesh: &TriMesh,
    polygon: &[u32],
    [a, b]: [&Chart; 2],
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Joined, Cancelled> {
    let sides = Sides { mesh, a: Side::new(a), b: Side::new(b) };
    let stretches = sides.stretches();
    let length = |s: &[Sewn]| s.iter().map(|e| mesh.edge_length(e.surface)).sum::<f64>();
    let longest = stretches.iter().max_by(|s, t| length(s).total_cmp(&length(t)).then(t[0].surface.cmp(&s[0].surface)));
    let Some(longest) = longest else { return Ok(Joined::Refused) };
    let mut verdict = Joined::Refused;
    let everything = stretches.concat();
    let mut ways = vec![everything.as_slice()];
    if stretches.len() > 1 {
        ways.push(longest);
    }
    for seam in ways {
        progress.check()?;
        let patch = sides.union(polygon, seam);
        let topology = patch.mesh.topology();
        if !topology.is_chart() || (settings.holes != Holes::Keep && topology.loops > 1) {
            continue;
        }
        match flatten::sewn(&patch, &sides.drawn(&patch, seam), settings, rungs, progress)? {
            Polished::Flat(flat) => return Ok(Joined::Chart(Box::new(flat.into_chart(patch)))),
            Polished::BadStart => verdict = Joined::Misfit,
            Polished::Refused => {}
        }
    }
    Ok(verdict)
}

/// An edge of the border: on the surface and on both charts.
#[derive(Clone, Copy)]
struct Sewn {
    surface: HalfedgeId,
    a: HalfedgeId,
    b: HalfedgeId,
}

/// A chart, and where the surface's faces are in it.
struct Side<'a> {
    chart: &'a Chart,
    place: Vec<(FaceId, FaceId)>,
}

impl<'a> Side<'a> {
    fn new(chart: &'a Chart) -> Self {
        let mut place: Vec<_> = chart.patch.faces.iter().enumerate().map(|(i, &f)| (f, FaceId::new(i))).collect();
        place.sort_unstable();
        Self { chart, place }
    }

    fn local(&self, f: FaceId) -> Option<FaceId> {
        self.place.binary_search_by_key(&f, |e| e.0).ok().map(|at| self.place[at].1)
    }

    /// A half-edge of the surface as one of the chart.
    fn halfedge(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        Some(self.local(h.face())?.halfedge(h.slot()))
    }

    fn mesh(&self) -> &TriMesh {
        &self.chart.patch.mesh
    }

    fn uv(&self, v: VertexId) -> Point2<f64> {
        self.chart.uv[v.index()]
    }
}

/// Two neighbouring charts of a surface.
struct Sides<'a> {
    mesh: &'a TriMesh,
    a: Side<'a>,
    b: Side<'a>,
}

impl Sides<'_> {
    /// The stretches of the border, each an unbroken run of edges along both charts.
    fn stretches(&self) -> Vec<Vec<Sewn>> {
        let shared = |h: HalfedgeId| {
            let surface = self.a.chart.patch.faces[h.face().index()].halfedge(h.slot());
            let twin = self.mesh.twin(surface);
            if twin.is_none() {
                return None;
            }
            Some(Sewn { surface, a: h, b: self.b.halfedge(twin)? })
        };
        let goes_on = |s: &Sewn, next: &Sewn| {
            self.a.mesh().next_boundary(s.a) == next.a && self.b.mesh().next_boundary(next.b) == s.b
        };
        let mut stretches: Vec<Vec<Sewn>> = Vec::new();
        for edges in self.a.mesh().boundary_loops().iter() {
            let first = stretches.len();
            for sewn in edges.iter().filter_map(|&h| shared(h)) {
                match stretches[first..].last_mut() {
                    Some(run) if run.last().is_some_and(|last| goes_on(last, &sewn)) => run.push(sewn),
                    _ => stretches.push(vec![sewn]),
                }
            }
            // The run that the loop's beginning has cut in two.
            if stretches.len() > first + 1 {
                let (head, tail) = (&stretches[first], &stretches[stretches.len() - 1]);
                if goes_on(&tail[tail.len() - 1], &head[0])
                    && let Some(mut tail) = stretches.pop()
                {
                    tail.append(&mut stretches[first]);
                    stretches[first] = tail;
                }
            }
        }
        stretches
    }

    /// Both charts as one patch, open where they were, and where their border is not in `seam`.
    fn union(&self, polygon: &[u32], seam: &[Sewn]) -> Patch {
        let mut sewn: Vec<HalfedgeId> = seam.iter().map(|s| s.surface).collect();
        sewn.sort_unstable();
        let mut faces: Vec<FaceId> = self.a.place.iter().chain(&self.b.place).map(|p| p.0).collect();
        faces.sort_unstable();
        let is_cut = |h: HalfedgeId| {
            let side = if self.a.local(h.face()).is_some() { &self.a } else { &self.b };
            let inside = side.halfedge(h).is_some_and(|local| !side.mesh().is_boundary(local));
            !inside && sewn.binary_search(&h).is_err() && sewn.binary_search(&self.mesh.twin(h)).is_err()
        };
        Patch::cut_out(self.mesh, polygon, faces, is_cut)
    }

    /// Where each face of the union is drawn, the second chart laid against the first.
    fn drawn(&self, patch: &Patch, seam: &[Sewn]) -> Vec<[Point2<f64>; 3]> {
        let moved = self.alignment(seam);
        let draw = |f: &FaceId| match (self.a.local(*f), self.b.local(*f)) {
            (Some(local), _) => self.a.mesh().triangle(local).map(|v| self.a.uv(v)),
            (None, Some(local)) => self.b.mesh().triangle(local).map(|v| moved.apply(self.b.uv(v))),
            (None, None) => [Point2::origin(); 3],
        };
        patch.faces.iter().map(draw).collect()
    }

    /// The rigid motion of the second chart that takes its side of the seam nearest to the first's, by length.
    fn alignment(&self, seam: &[Sewn]) -> Motion {
        let pairs: Vec<_> = seam
            .iter()
            .flat_map(|s| {
                let (a, b) = (self.a.mesh(), self.b.mesh());
                let weight = self.mesh.edge_length(s.surface);
                [(a.from(s.a), b.to(s.b)), (a.to(s.a), b.from(s.b))]
                    .map(|(v, w)| ([self.a.uv(v), self.b.uv(w)], weight))
            })
            .collect();
        Motion::fit(&pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use nalgebra::{Rotation2, Vector2};

    /// The faces of a square sheet with their middle in x between two bounds, drawn in the plane turned by some angle.
    fn part(mesh: &TriMesh, from: f64, to: f64, angle: f64) -> Chart {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let middle = |f: &FaceId| mesh.triangle_positions(*f).iter().map(|p| p.x).sum::<f64>() / 3.0;
        let patch =
            Patch::of_surface(mesh, &polygon, mesh.faces().filter(|f| (from..to).contains(&middle(f))).collect());
        let turn = Rotation2::new(angle);
        let uv = patch.mesh.positions().iter().map(|p| turn * p.xy() + Vector2::new(3.0 * angle, 5.0)).collect();
        Chart { patch, uv, l2: 1.0 }
    }

    fn join(mesh: &TriMesh, charts: [&Chart; 2]) -> Joined {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        joined(mesh, &polygon, charts, &Settings::default(), &mut Rungs::default(), &run).expect("not cancelled")
    }

    #[test]
    fn halves_of_a_sheet_meet_whatever_their_pose() {
        let mesh = test_surfaces::grid(12, 12, [1.0, 1.0], 0.0);
        let (left, right) = (part(&mesh, -1.0, 0.5, 0.0), part(&mesh, 0.5, 2.0, 2.3));
        let sides = Sides { mesh: &mesh, a: Side::new(&left), b: Side::new(&right) };
        let stretches = sides.stretches();
        assert_eq!((stretches.len(), stretches[0].len()), (1, 12));
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let patch = sides.union(&polygon, &stretches[0]);
        let drawn = sides.drawn(&patch, &stretches[0]);
        let mut place = vec![None; patch.mesh.vertex_count()];
        for (v, p) in patch.mesh.triangles().iter().zip(&drawn).flat_map(|(t, p)| t.iter().zip(p)) {
            let first = *place[v.index()].get_or_insert(*p);
            assert!((first - p).norm() < 1e-12, "an isometry: nothing is left to share");
        }
        let Joined::Chart(whole) = join(&mesh, [&left, &right]) else { panic!("one chart") };
        assert!(whole.l2 < 1.0 + 1e-9 && whole.patch.faces.len() == mesh.face_count());
    }

    #[test]
    fn charts_that_do_not_touch_are_not_joined() {
        let mesh = test_surfaces::grid(12, 12, [1.0, 1.0], 0.0);
        let apart = join(&mesh, [&part(&mesh, -1.0, 0.25, 0.0), &part(&mesh, 0.75, 2.0, 1.0)]);
        assert!(matches!(apart, Joined::Refused));
    }
}
