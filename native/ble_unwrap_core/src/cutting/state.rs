//! The state of the search: which chart has which face, and so which edges are seams.

use nalgebra::Point2;

use crate::charts::{Chart, Patch};
use crate::mesh::{FaceId, HalfedgeId, TriMesh};

/// The corners of a face in the plane of its chart.
pub(super) type Corners = [Point2<f64>; 3];

/// A chart of a [`Cutting`]. Names are given once: a chart that is replaced takes its name with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct ChartId(usize);

/// A surface cut into charts.
///
/// An edge is a seam if the chart of the face on one side of it is cut there: between two charts, along the cuts that open a
/// chart, and at the boundary of the surface.
pub(super) struct Cutting<'a> {
    mesh: &'a TriMesh,
    /// The polygon of each face.
    polygon: &'a [u32],
    /// By name; those that have been replaced are gone.
    charts: Vec<Option<Chart>>,
    /// The chart of each face of the surface, and what the face is called there.
    place: Vec<Option<(ChartId, FaceId)>>,
}

impl<'a> Cutting<'a> {
    /// `charts` are made of faces of `mesh`, each of which is in one of them at most.
    pub(super) fn new(mesh: &'a TriMesh, polygon: &'a [u32], charts: Vec<Chart>) -> Self {
        let mut cutting = Self { mesh, polygon, charts: Vec::new(), place: vec![None; mesh.face_count()] };
        charts.into_iter().for_each(|chart| {
            cutting.add(chart);
        });
        cutting
    }

    fn add(&mut self, chart: Chart) -> ChartId {
        let id = ChartId(self.charts.len());
        for (local, f) in chart.patch.faces.iter().enumerate() {
            self.place[f.index()] = Some((id, FaceId::new(local)));
        }
        self.charts.push(Some(chart));
        id
    }

    pub(super) fn mesh(&self) -> &'a TriMesh {
        self.mesh
    }

    pub(super) fn polygon(&self, f: FaceId) -> u32 {
        self.polygon[f.index()]
    }

    /// The charts there are, by name.
    pub(super) fn ids(&self) -> impl Iterator<Item = ChartId> + '_ {
        (0..self.charts.len()).map(ChartId).filter(|id| self.charts[id.0].is_some())
    }

    /// `None` if it has been replaced.
    pub(super) fn chart(&self, id: ChartId) -> Option<&Chart> {
        self.charts[id.0].as_ref()
    }

    pub(super) fn face_count(&self, id: ChartId) -> usize {
        self.chart(id).map_or(0, |chart| chart.patch.faces.len())
    }

    /// The chart that a face is in, if any.
    pub(super) fn owner(&self, f: FaceId) -> Option<ChartId> {
        self.place[f.index()].map(|place| place.0)
    }

    /// The charts on this side of an edge and beyond; `None` where there is none on one of them.
    pub(super) fn sides(&self, h: HalfedgeId) -> Option<[ChartId; 2]> {
        let beyond = self.mesh.twin(h);
        if beyond.is_none() { None } else { Some([self.owner(h.face())?, self.owner(beyond.face())?]) }
    }

    /// The chart of a half-edge's face, and the half-edge there.
    pub(super) fn local(&self, h: HalfedgeId) -> Option<(&Chart, HalfedgeId)> {
        let (id, face) = self.place[h.face().index()]?;
        Some((self.chart(id)?, face.halfedge(h.slot())))
    }

    /// Whether the surface is cut along this edge; so it is where there are no charts.
    pub(super) fn is_seam(&self, h: HalfedgeId) -> bool {
        self.local(h).is_none_or(|(chart, local)| chart.patch.mesh.is_boundary(local))
    }

    /// Where the start of a half-edge lies in the chart of its face.
    pub(super) fn start(&self, h: HalfedgeId) -> Point2<f64> {
        self.local(h).map_or_else(Point2::origin, |(chart, local)| chart.uv[chart.patch.mesh.from(local).index()])
    }

    /// Where the end of a half-edge lies in the chart of its face.
    pub(super) fn end(&self, h: HalfedgeId) -> Point2<f64> {
        self.start(h.next())
    }

    pub(super) fn corners(&self, f: FaceId) -> Corners {
        f.halfedges().map(|h| self.start(h))
    }

    /// The length of a seam along an edge: longer where a border is less wanted.
    pub(super) fn seam_length(&self, h: HalfedgeId) -> f64 {
        self.mesh.edge_length(h) * self.mesh.border_cost(h)
    }

    /// The length of the seam between each pair of neighbouring charts, or of the pairs of one chart, sorted by pair, whose
    /// lower name comes first.
    pub(super) fn neighbours(&self, of: Option<ChartId>) -> Vec<([ChartId; 2], f64)> {
        let side = |h: HalfedgeId| {
            let [a, b] = self.sides(h)?;
            (a != b).then(|| ([a.min(b), a.max(b)], self.seam_length(h)))
        };
        let mut sides: Vec<([ChartId; 2], f64)> = match of {
            None => self.mesh.edges().filter_map(side).collect(),
            Some(id) => {
                let faces = self.chart(id).into_iter().flat_map(|chart| &chart.patch.faces);
                faces.flat_map(|f| f.halfedges()).filter_map(side).collect()
            }
        };
        sides.sort_by_key(|s| s.0);
        let total = |group: &[([ChartId; 2], f64)]| (group[0].0, group.iter().map(|s| s.1).sum());
        sides.chunk_by(|s, t| s.0 == t.0).map(total).collect()
    }

    /// The patch made of some faces, in ascending order, cut along every edge for which `is_cut` holds.
    pub(super) fn patch(&self, faces: Vec<FaceId>, is_cut: impl Fn(HalfedgeId) -> bool) -> Patch {
        Patch::cut_out(self.mesh, self.polygon, faces, is_cut)
    }

    /// Puts charts in the place of others that were made of the same faces. Returns their names, which are new.
    pub(super) fn replace(&mut self, old: &[ChartId], new: Vec<Chart>) -> Vec<ChartId> {
        for id in old {
            self.charts[id.0] = None;
        }
        new.into_iter().map(|chart| self.add(chart)).collect()
    }

    /// The charts, sorted by lowest face.
    pub(super) fn into_charts(self) -> Vec<Chart> {
        let mut charts: Vec<Chart> = self.charts.into_iter().flatten().collect();
        charts.sort_by_key(|c| c.patch.faces.iter().min().copied());
        charts
    }

    /// Checks every promise of the type and names the first one broken.
    #[cfg(test)]
    pub(super) fn check_invariants(&self) -> Result<(), String> {
        let mut seen = vec![None; self.mesh.face_count()];
        for id in self.ids() {
            let chart = self.chart(id).ok_or("a chart without a name")?;
            if chart.uv.len() != chart.patch.mesh.vertex_count() {
                return Err(format!("{id:?} has {} positions", chart.uv.len()));
            }
            if !chart.patch.faces.is_sorted() {
                return Err(format!("the faces of {id:?} do not ascend"));
            }
            for (local, f) in chart.patch.faces.iter().enumerate() {
                if seen[f.index()].replace((id, FaceId::new(local))).is_some() {
                    return Err(format!("{f} is in two charts"));
                }
                if chart.patch.polygon[local] != self.polygon(*f) {
                    return Err(format!("{f} is of another polygon in {id:?}"));
                }
            }
        }
        if seen != self.place {
            return Err("a face's place is not where its chart has it".into());
        }
        for h in self.mesh.edges().filter(|&h| !self.mesh.is_boundary(h)) {
            let t = self.mesh.twin(h);
            if self.is_seam(h) != self.is_seam(t) {
                return Err(format!("{h} is a seam on one side only"));
            }
            let is_charted = self.owner(h.face()).is_some();
            if is_charted && self.polygon(h.face()) == self.polygon(t.face()) && self.is_seam(h) {
                return Err(format!("{h} is inside a polygon and a seam"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::edit::Edit;
    use super::*;
    use crate::mesh::test_surfaces;

    /// Squares of two triangles, and each of `count` upright strips of it a chart that lies as it is.
    pub(in crate::cutting) fn strips(mesh: &TriMesh, width: f64, count: usize) -> (Vec<u32>, Vec<Chart>) {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let strip = |f: FaceId| {
            let x = mesh.triangle_positions(f).iter().map(|p| p.x).sum::<f64>() / 3.0;
            (x / width * count as f64) as usize
        };
        let chart = |wanted: usize| {
            let patch = Patch::of_surface(mesh, &polygon, mesh.faces().filter(|&f| strip(f) == wanted).collect());
            let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
            Chart { patch, uv, l2: 1.0 }
        };
        let charts = (0..count).map(chart).collect();
        (polygon, charts)
    }

    #[test]
    fn seams_run_between_charts_and_around_the_surface() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 3);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        cutting.check_invariants().expect("sound");
        let is_upright_at = |h: HalfedgeId, x: f64| [mesh.from(h), mesh.to(h)].iter().all(|v| mesh.position(*v).x == x);
        for h in mesh.edges() {
            let between = is_upright_at(h, 2.0) || is_upright_at(h, 4.0);
            assert_eq!(cutting.is_seam(h), between || mesh.is_boundary(h), "{h}");
        }
        let ids: Vec<ChartId> = cutting.ids().collect();
        let pairs = cutting.neighbours(None);
        assert_eq!(pairs, [([ids[0], ids[1]], 4.0), ([ids[1], ids[2]], 4.0)]);
        assert_eq!(cutting.neighbours(Some(ids[1])), pairs);
        assert_eq!(cutting.neighbours(Some(ids[2])), pairs[1..]);
    }

    #[test]
    fn a_chart_that_is_replaced_is_gone_and_its_faces_are_the_new_ones() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 3);
        let mut cutting = Cutting::new(&mesh, &polygon, charts);
        let ids: Vec<ChartId> = cutting.ids().collect();
        let glue: Vec<HalfedgeId> = mesh.halfedges().filter(|&h| cutting.sides(h) == Some([ids[0], ids[1]])).collect();
        let patch = Edit::new(&mesh, &glue, &[]).patches(&cutting).pop().expect("one");
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        let new = cutting.replace(&ids[..2], vec![Chart { patch, uv, l2: 1.0 }]);
        cutting.check_invariants().expect("sound");
        assert_eq!(cutting.ids().collect::<Vec<_>>(), [ids[2], new[0]]);
        assert_eq!(cutting.face_count(new[0]), 32);
        assert!(cutting.chart(ids[0]).is_none());
        let charts = cutting.into_charts();
        assert!(charts.len() == 2 && charts[0].patch.faces.len() == 32, "the lowest face first");
    }

    #[test]
    fn a_face_outside_of_all_charts_has_seams_around_it() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, mut charts) = strips(&mesh, 6.0, 3);
        charts.truncate(1);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        cutting.check_invariants().expect("sound");
        assert!(cutting.neighbours(None).is_empty());
        let outside = mesh.faces().find(|f| cutting.owner(*f).is_none()).expect("two strips of them");
        assert!(outside.halfedges().iter().all(|&h| cutting.is_seam(h) && cutting.sides(h).is_none()));
    }
}
