//! Borders drawn short and along creases in a narrow band of the fine mesh.
//!
//! Labels prolonged from a coarse mesh follow its edges in steps. A minimum cut a few polygons wide around every border
//! finds the short way and the crease, diffusion takes out the stairs that a cut along edges cannot see, and a last
//! narrow cut the single teeth that are left.

use std::collections::VecDeque;

use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

use super::bends::{Bends, capacity};
use super::polygon_graph::PolygonGraph;
use super::smooth::{Guard, smooth};
use super::{CutGraph, Segmentation, finish_labels};

/// Sides by which the last cut may move a smooth border: enough to take single teeth off, too few for a detour.
const TEETH: usize = 2;

/// Redraws the borders between labels, each by one minimum cut among the polygons fewer than `rings`
/// sides away from it, and makes every label connected (fragments go to a neighbour).
///
/// `label` holds any number a face; a polygon goes to the label of most of its area. `polygon` names
/// the polygon of each face; `crease_weight` as in [`SegmentationSettings`](super::SegmentationSettings). O(n log n) and a cut a pair of neighbouring labels.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn straighten(
    mesh: &TriMesh,
    polygon: &[u32],
    label: &[u32],
    rings: usize,
    crease_weight: f64,
    progress: &Progress,
) -> Result<Segmentation, Cancelled> {
    let graph = PolygonGraph::new(mesh, polygon);
    let mut label = graph.majority(mesh, label);
    super::repair::absorb_fragments(&graph, &mut label);
    let bends = Bends::new(mesh, &graph, crease_weight);
    let guard = Guard::new(&graph, &label);
    for rings in [rings, rings.min(TEETH)] {
        let before = label.clone();
        cut_borders(&graph, &bends, &mut label, rings, progress)?;
        guard.restore(&graph, &before, &mut label);
        if rings > TEETH {
            smooth(&graph, &bends, &mut label, rings, progress)?;
        }
    }
    Ok(finish_labels(&graph, label))
}

/// Makes every border the cheapest fewer than `rings` sides away.
fn cut_borders(
    graph: &PolygonGraph,
    bends: &Bends,
    label: &mut [u32],
    rings: usize,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for p in 0..graph.len() {
        let beyond = graph.links.group(p).iter().map(|l| label[l.to as usize]);
        pairs.extend(beyond.filter(|&q| q > label[p]).map(|q| (label[p], q)));
    }
    pairs.sort_unstable();
    pairs.dedup();
    let mut band = Band { ring: vec![usize::MAX; graph.len()], node: vec![usize::MAX; graph.len()], order: Vec::new() };
    for (a, b) in pairs {
        progress.check()?;
        band.gather(graph, label, a, b, rings);
        band.cut(graph, bends, label, a, b, progress)?;
        band.clear();
    }
    Ok(())
}

/// The polygons around one border, by distance from it in sides.
struct Band {
    ring: Vec<usize>,
    node: Vec<usize>,
    order: Vec<usize>,
}

impl Band {
    fn gather(&mut self, graph: &PolygonGraph, label: &[u32], a: u32, b: u32, rings: usize) {
        let inside = |p: usize| label[p] == a || label[p] == b;
        let at_border = |p: usize| {
            let other = if label[p] == a { b } else { a };
            inside(p) && graph.links.group(p).iter().any(|l| label[l.to as usize] == other)
        };
        let mut queue: VecDeque<usize> = (0..graph.len()).filter(|&p| at_border(p)).collect();
        for &p in &queue {
            self.ring[p] = 0;
        }
        while let Some(p) = queue.pop_front() {
            self.node[p] = self.order.len();
            self.order.push(p);
            if self.ring[p] + 1 >= rings {
                continue;
            }
            for link in graph.links.group(p) {
                let q = link.to as usize;
                if self.ring[q] == usize::MAX && inside(q) {
                    self.ring[q] = self.ring[p] + 1;
                    queue.push_back(q);
                }
            }
        }
    }

    fn cut(
        &self,
        graph: &PolygonGraph,
        bends: &Bends,
        label: &mut [u32],
        a: u32,
        b: u32,
        progress: &Progress,
    ) -> Result<(), Cancelled> {
        let mut cut = CutGraph::new(self.order.len());
        let mut anchored = [false; 2];
        for (i, &p) in self.order.iter().enumerate() {
            for (k, link) in graph.links.group(p).iter().enumerate() {
                let q = link.to as usize;
                let capacity = capacity(bends.crease(p, k) * link.length / bends.mean_length);
                if self.node[q] != usize::MAX {
                    if p < q {
                        cut.add_edge(i, self.node[q], capacity);
                    }
                } else if label[q] == a {
                    cut.add_terminals(i, capacity, 0);
                    anchored[0] = true;
                } else if label[q] == b {
                    cut.add_terminals(i, 0, capacity);
                    anchored[1] = true;
                }
            }
        }
        // A label that lies wholly in the band would vanish: its innermost polygon stays.
        for (side, name) in [a, b].into_iter().enumerate() {
            if !anchored[side] {
                let members = self.order.iter().enumerate().filter(|(_, p)| label[**p] == name);
                let Some((i, _)) = members.max_by_key(|&(i, &p)| (self.ring[p], i)) else { return Ok(()) };
                if side == 0 { cut.fix_to_source(i) } else { cut.fix_to_sink(i) }
            }
        }
        for (&p, on_side_of_a) in self.order.iter().zip(cut.min_cut(progress)?) {
            label[p] = if on_side_of_a { a } else { b };
        }
        Ok(())
    }

    fn clear(&mut self) {
        for p in self.order.drain(..) {
            self.ring[p] = usize::MAX;
            self.node[p] = usize::MAX;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;

    /// A 20 by 20 sheet of quads, folded by a right angle at x = 0.4 if asked, and its left half.
    fn sheet(folded: bool) -> (TriMesh, Vec<u32>, Vec<u32>) {
        let mut mesh = test_surfaces::grid(20, 20, [1.0, 1.0], 0.0);
        if folded {
            let fold = |p: &nalgebra::Point3<f64>| nalgebra::Point3::new(p.x.min(0.4), p.y, (p.x - 0.4).max(0.0));
            let positions: Vec<_> = mesh.positions().iter().map(fold).collect();
            let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
            mesh = TriMesh::from_triangles(&positions, &triangles).0;
        }
        let polygon = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let label = mesh.faces().map(|f| u32::from(f.index() / 2 % 20 >= 10)).collect();
        (mesh, polygon, label)
    }

    fn border(mesh: &TriMesh, label: &[u32]) -> Vec<crate::mesh::HalfedgeId> {
        let differs = |h: &crate::mesh::HalfedgeId| {
            let t = mesh.twin(*h);
            !t.is_none() && label[h.face().index()] != label[t.face().index()]
        };
        mesh.edges().filter(differs).collect()
    }

    #[test]
    fn a_border_follows_guides_even_if_they_are_longer() {
        let (mesh, polygon, label) = sheet(false);
        // Steps of one column and one row around x = 0.4: twice as long as the straight line.
        let step = |f: u32| (f / 2 % 20) + (f / 40 % 2) < 8;
        let steps: Vec<u32> = (0..mesh.face_count() as u32).map(|f| u32::from(!step(f))).collect();
        let guides = border(&mesh, &steps);
        let mut marks = vec![false; mesh.halfedge_count()];
        guides.iter().for_each(|&h| (marks[h.index()], marks[mesh.twin(h).index()]) = (true, true));
        let straight = |mesh: &TriMesh| {
            let parts = straighten(mesh, &polygon, &label, 8, 1.0, &Progress::new()).expect("not cancelled");
            assert_eq!(parts.parts, 2);
            border(mesh, &parts.label)
        };
        let without = straight(&mesh);
        assert!((without.iter().map(|&h| mesh.edge_length(h)).sum::<f64>() - 1.0).abs() < 1e-9);
        assert_eq!(straight(&mesh.clone().with_guides(marks)), guides);
    }

    #[test]
    fn the_crease_weight_says_whether_a_border_goes_to_a_fold() {
        let (mesh, polygon, label) = sheet(true);
        let run = |weight| straighten(&mesh, &polygon, &label, 8, weight, &Progress::new()).expect("not cancelled");
        let at_fold = |h: &crate::mesh::HalfedgeId| (mesh.position(mesh.from(*h)).x - 0.4).abs() < 1e-9;
        let on_fold = |label: &[u32]| {
            let border = border(&mesh, label);
            border.len() == 20 && border.iter().all(|h| at_fold(h) && mesh.position(mesh.from(*h)).z.abs() < 1e-9)
        };
        assert!(on_fold(&run(1.0).label) && on_fold(&run(2.0).label));
        let graph = PolygonGraph::new(&mesh, &polygon);
        let creases = |weight| {
            let bends = Bends::new(&mesh, &graph, weight);
            let all = (0..graph.len()).flat_map(|p| (0..graph.links.group(p).len()).map(move |k| (p, k)));
            all.map(|(p, k)| bends.crease(p, k)).collect::<Vec<f64>>()
        };
        assert!(creases(0.0).iter().all(|c| *c == 1.0), "folds count nothing");
        assert!(creases(1.0).iter().zip(creases(2.0)).all(|(once, twice)| (once * once - twice).abs() < 1e-12));
    }

    #[test]
    fn a_staircase_becomes_a_straight_line() {
        let mesh = test_surfaces::grid(20, 20, [1.0, 1.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        // A border that swings about the middle by two columns.
        let label: Vec<u32> = mesh
            .faces()
            .map(|f| {
                let c = mesh.triangle_positions(f).iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0;
                let swing = 0.1 * ((c.y * 20.0).floor() * 1.7).sin();
                u32::from(c.x > 0.5 + swing)
            })
            .collect();
        let border = |label: &[u32]| -> f64 {
            let differs = |h: &crate::mesh::HalfedgeId| {
                let t = mesh.twin(*h);
                !t.is_none() && label[h.face().index()] != label[t.face().index()]
            };
            mesh.edges().filter(differs).map(|h| mesh.edge_length(h)).sum()
        };
        let straight = straighten(&mesh, &polygon, &label, 8, 1.0, &Progress::new()).expect("not cancelled");
        assert_eq!(straight.parts, 2);
        assert!(border(&label) > 2.0, "the start is ragged: {}", border(&label));
        assert!((border(&straight.label) - 1.0).abs() < 1e-9, "{}", border(&straight.label));
        for (f, p) in polygon.iter().enumerate() {
            assert_eq!(straight.label[f], straight.label[2 * *p as usize], "polygon {p} is whole");
        }
    }
}
