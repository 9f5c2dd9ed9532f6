//! Where charts lie side by side on the surface.

use nalgebra::Point2;

use crate::mesh::HalfedgeId;

use super::rigid_motion::Motion;
use super::state::{ChartId, Cutting};

/// An unbroken run of edges along the boundaries of two charts.
#[derive(Debug, PartialEq)]
pub(super) struct BorderRun {
    /// The chart on the other side.
    pub(super) beyond: ChartId,
    /// Half-edges of the surface on this side, in the order of the boundary.
    pub(super) edges: Vec<HalfedgeId>,
    /// Whether the last edge is followed by the first.
    pub(super) is_loop: bool,
}

/// The runs along a chart's boundary beyond which wanted charts lie, loop by loop; the run on which a loop begins comes first.
/// O(n) in the length of the boundary, and another O(log n) for charts that are looked at.
pub(super) fn runs(cutting: &Cutting<'_>, id: ChartId, is_wanted: impl Fn(ChartId) -> bool) -> Vec<BorderRun> {
    let Some(chart) = cutting.chart(id) else { return Vec::new() };
    let beyond = |h: HalfedgeId| cutting.sides(h).map(|sides| sides[1]).filter(|&other| is_wanted(other));
    // On the other side, too, the boundary runs on without a third chart or a cut between.
    let runs_on = |g: HalfedgeId, h: HalfedgeId| {
        let [Some(here), Some(there)] = [beyond(g), beyond(h)] else { return false };
        let [before, after] = [h, g].map(|e| cutting.local(cutting.mesh().twin(e)));
        let (Some((chart, before)), Some((_, after))) = (before, after) else { return false };
        here == there && chart.patch.mesh.next_boundary(before) == after
    };
    let mut runs = Vec::new();
    for around in chart.patch.mesh.boundary_loops().iter() {
        let border: Vec<HalfedgeId> =
            around.iter().map(|h| chart.patch.faces[h.face().index()].halfedge(h.slot())).collect();
        let n = border.len();
        let mut starts: Vec<usize> = (0..n).filter(|&k| !runs_on(border[(k + n - 1) % n], border[k])).collect();
        if starts.is_empty() {
            runs.extend(beyond(border[0]).map(|beyond| BorderRun { beyond, edges: border, is_loop: true }));
            continue;
        }
        if starts[0] > 0 {
            starts.rotate_right(1);
        }
        for (at, &first) in starts.iter().enumerate() {
            let length = (starts[(at + 1) % starts.len()] + n - first - 1) % n + 1;
            let edges = || (first..first + length).map(|k| border[k % n]).collect();
            runs.extend(beyond(border[first]).map(|beyond| BorderRun { beyond, edges: edges(), is_loop: false }));
        }
    }
    runs
}

/// The rigid motion of the chart beyond some edges that takes its side of them nearest to this one, by length.
pub(super) fn alignment(cutting: &Cutting<'_>, edges: &[HalfedgeId]) -> Motion {
    let pairs: Vec<([Point2<f64>; 2], f64)> = edges
        .iter()
        .flat_map(|&h| {
            let (t, weight) = (cutting.mesh().twin(h), cutting.mesh().edge_length(h));
            [([cutting.start(h), cutting.end(t)], weight), ([cutting.end(h), cutting.start(t)], weight)]
        })
        .collect();
    Motion::fit(&pairs)
}

#[cfg(test)]
mod tests {
    use super::super::state::tests::strips;
    use super::*;
    use crate::charts::{Chart, Patch};
    use crate::mesh::{FaceId, TriMesh, test_surfaces};
    use nalgebra::{Rotation2, Vector2};

    #[test]
    fn strips_border_on_their_neighbours_along_one_run_each() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 3);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let ids: Vec<ChartId> = cutting.ids().collect();
        let found = runs(&cutting, ids[1], |other| other != ids[1]);
        let mut beyond: Vec<_> = found.iter().map(|run| (run.beyond, run.edges.len(), run.is_loop)).collect();
        beyond.sort_unstable();
        assert_eq!(beyond, [(ids[0], 4, false), (ids[2], 4, false)]);
        for run in &found {
            let ends = |pair: &[HalfedgeId]| mesh.to(pair[0]) == mesh.from(pair[1]);
            assert!(run.edges.windows(2).all(ends), "in the order of the boundary");
            assert!(run.edges.iter().all(|&h| cutting.sides(h) == Some([ids[1], run.beyond])));
        }
        assert_eq!(runs(&cutting, ids[1], |other| other == ids[2]).len(), 1);
        assert!(runs(&cutting, ids[0], |other| other == ids[2]).is_empty());
    }

    /// The faces whose middle a function accepts and the others, each drawn as it is but turned.
    fn parts(mesh: &TriMesh, is_first: impl Fn([f64; 2]) -> bool, turn: f64) -> (Vec<u32>, Vec<Chart>) {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let middle = |f: FaceId| {
            let sum = mesh.triangle_positions(f).iter().fold(Vector2::zeros(), |sum, p| sum + p.coords.xy());
            [sum.x / 3.0, sum.y / 3.0]
        };
        let part = |wanted: bool| {
            let faces = mesh.faces().filter(|&f| is_first(middle(f)) == wanted).collect();
            let patch = Patch::of_surface(mesh, &polygon, faces);
            let turn = if wanted { Rotation2::identity() } else { Rotation2::new(turn) };
            let uv = patch.mesh.positions().iter().map(|p| turn * p.xy()).collect();
            Chart { patch, uv, l2: 1.0 }
        };
        let charts = vec![part(true), part(false)];
        (polygon, charts)
    }

    #[test]
    fn an_island_borders_on_what_surrounds_it_all_around() {
        let mesh = test_surfaces::grid(6, 6, [6.0, 6.0], 0.0);
        let (polygon, charts) = parts(&mesh, |[x, y]| x > 2.0 && x < 4.0 && y > 2.0 && y < 4.0, 0.0);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let ids: Vec<ChartId> = cutting.ids().collect();
        let found = runs(&cutting, ids[0], |_| true);
        assert_eq!((found.len(), found[0].edges.len(), found[0].is_loop), (1, 8, true));
    }

    #[test]
    fn a_turned_chart_is_laid_back() {
        let mesh = test_surfaces::grid(12, 12, [1.0, 1.0], 0.0);
        let (polygon, charts) = parts(&mesh, |[x, _]| x < 0.5, 2.3);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let ids: Vec<ChartId> = cutting.ids().collect();
        let run = runs(&cutting, ids[0], |_| true).pop().expect("a run");
        assert_eq!((run.beyond, run.edges.len()), (ids[1], 12));
        let back = alignment(&cutting, &run.edges);
        let chart = cutting.chart(ids[1]).expect("the other half");
        for (p, q) in chart.patch.mesh.positions().iter().zip(&chart.uv) {
            assert!((back.apply(*q) - p.xy()).norm() < 1e-12);
        }
    }
}
