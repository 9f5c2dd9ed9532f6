//! A body with few corners unfolded: cut to all of them it lies flat.
//!
//! The cuts make a tree that reaches every corner. Of a box there are 384 such trees along its edges, and of a cube all are as long; an artist
//! takes one that unfolds to a cross or a T.

use std::borrow::Cow;

use nalgebra::{Point2, Vector2};

use crate::charts::Patch;
use crate::collections::DisjointSets;
use crate::mesh::{HalfedgeId, TriMesh, VertexId, measure};
use crate::stretch;

use super::super::cost::CutPrice;
use super::dart::{cut_to, is_guided};

/// A patch with more corners has no net: a box has eight.
const MOST_CORNERS: usize = 8;
/// Between the corners of a net lie at most so many lines: a box has twelve.
const MOST_LINES: usize = 16;
/// Two triangles whose normals have at most this cosine meet at an edge of a body: about a degree.
const FLAT: f64 = 0.9998;
/// A net that is its own mirror image is worth cuts that cost up to so many times as much.
const SYMMETRIC: f64 = 1.15;
/// At most so many nets are unfolded to find one that is.
const MOST_NETS: usize = 128;
/// Steps of the search for them; a box takes a few hundred.
const MOST_STEPS: usize = 20_000;
/// Two corners of an outline mirror each other up to this share of its width.
const TOLERANCE: f64 = 1e-4;

/// A patch that is flat but for a few corners, cut to all of these: a net, which unfolds without stretch. `None` where it
/// has none, too many, or curvature elsewhere, and where guides run inside it.
pub(crate) fn net(patch: &Patch) -> Option<Patch> {
    let mut net = Cow::Borrowed(patch);
    let is_closed = patch.mesh.halfedges().all(|h| !patch.mesh.is_boundary(h));
    for cuts in 0..=MOST_CORNERS {
        let corners = stretch::corners(&net.mesh, MOST_CORNERS)?;
        if cuts == 0 && (corners.is_empty() || is_guided(patch)) {
            return None;
        }
        // The first cut of a closed surface ends at its sharpest corner.
        let root = if cuts == 0 && is_closed { corners.first().copied() } else { None };
        let mut tips = corners.into_iter().filter(|v| Some(*v) != root).peekable();
        if tips.peek().is_none() {
            return if let Cow::Owned(net) = net { Some(net) } else { None };
        }
        net = Cow::Owned(tips.find_map(|tip| cut_to(&net, tip, root, CutPrice::OF_NET))?);
    }
    None
}

/// The nets of a patch whose cuts run along its edges from corner to corner, or to its boundary, and cost little more than the least, cheapest first. None
/// where its corners are not joined so, or guides run inside it.
pub(crate) fn along_edges(patch: &Patch) -> impl Iterator<Item = Patch> + '_ {
    let corners = stretch::corners(&patch.mesh, MOST_CORNERS).filter(|_| !is_guided(patch));
    let lines = corners.as_deref().map_or_else(Vec::new, |corners| lines(patch, corners));
    let is_open = patch.mesh.halfedges().any(|h| patch.mesh.is_boundary(h));
    let nodes = corners.map_or(0, |corners| corners.len()) + usize::from(is_open);
    let mut trees = Trees { lines: &lines, nodes, steps: 0, most: f64::INFINITY, found: Vec::new() };
    if !lines.is_empty() && lines.len() <= MOST_LINES {
        trees.grow(0, &mut Vec::new(), 0.0);
    }
    let mut found = trees.found;
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    found.into_iter().take(MOST_NETS).map(move |(_, tree)| {
        let edges: Vec<HalfedgeId> = tree.iter().flat_map(|&line| lines[line].edges.iter().copied()).collect();
        patch.cut(&edges)
    })
}

/// A line of edges over which the surface bends.
struct Line {
    /// The numbers of the corners at its ends; the boundary comes after the last.
    ends: [usize; 2],
    edges: Vec<HalfedgeId>,
    cost: f64,
}

/// The lines between corners, and from corners to the boundary, the cheapest first. O(n) for each corner.
fn lines(patch: &Patch, corners: &[VertexId]) -> Vec<Line> {
    let mesh = &patch.mesh;
    let bends = |h: HalfedgeId| {
        let t = mesh.twin(h);
        let normal = |h: HalfedgeId| measure::triangle_normal(mesh.triangle_positions(h.face()));
        !t.is_none() && !patch.is_diagonal(h) && normal(h).dot(&normal(t)) <= FLAT
    };
    let number = |v: VertexId| {
        let boundary = mesh.is_boundary_vertex(v).then_some(corners.len());
        corners.iter().position(|c| *c == v).or(boundary)
    };
    let mut lines = Vec::new();
    for (from, &corner) in corners.iter().enumerate() {
        for first in mesh.outgoing(corner).filter(|&h| bends(h)) {
            let mut edges = vec![first];
            let end = loop {
                let last = edges[edges.len() - 1];
                let at = mesh.to(last);
                if number(at).is_some() || edges.len() > mesh.vertex_count() {
                    break number(at);
                }
                let mut onwards = mesh.outgoing(at).filter(|&h| h != mesh.twin(last) && bends(h));
                match (onwards.next(), onwards.next()) {
                    (Some(next), None) => edges.push(next),
                    _ => break None,
                }
            };
            // Each line between two corners is met from both.
            if let Some(to) = end.filter(|to| *to > from) {
                let cost = edges.iter().map(|&h| CutPrice::OF_NET.of(mesh, h)).sum();
                lines.push(Line { ends: [from, to], edges, cost });
            }
        }
    }
    lines.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.ends.cmp(&b.ends)));
    lines
}

/// The trees of lines that reach every corner.
struct Trees<'a> {
    lines: &'a [Line],
    nodes: usize,
    steps: usize,
    /// What a tree may cost.
    most: f64,
    found: Vec<(f64, Vec<usize>)>,
}

impl Trees<'_> {
    /// Adds lines from a number on to those of a tree.
    fn grow(&mut self, from: usize, tree: &mut Vec<usize>, cost: f64) {
        let missing = self.nodes - 1 - tree.len();
        if missing == 0 {
            // Lines are tried in the order of what they cost, so none is cheaper than the first.
            self.most = self.most.min(SYMMETRIC * cost);
            self.found.push((cost, tree.clone()));
            return;
        }
        for next in from..self.lines.len() {
            self.steps += 1;
            let least = cost + missing as f64 * self.lines[next].cost;
            if least > self.most || self.steps > MOST_STEPS {
                return;
            }
            tree.push(next);
            if self.is_forest(tree) {
                self.grow(next + 1, tree, cost + self.lines[next].cost);
            }
            tree.pop();
        }
    }

    fn is_forest(&self, tree: &[usize]) -> bool {
        let mut joined = DisjointSets::new(self.nodes);
        tree.iter().map(|&line| self.lines[line].ends).all(|[a, b]| joined.join(a, b))
    }
}

/// Whether the outline of a map is its own mirror image across a line along its longest side, or at right angles to that. O(k²) in its corners.
pub(crate) fn has_mirrored_outline(mesh: &TriMesh, uv: &[Point2<f64>]) -> bool {
    let loops = mesh.boundary_loops();
    let [outline] = &loops.iter().collect::<Vec<_>>()[..] else { return false };
    let place = |h: &HalfedgeId| uv[mesh.from(*h).index()];
    let along = |k: usize| (place(&outline[(k + 1) % outline.len()]) - place(&outline[k])).normalize();
    let turns = |k: &usize| along((k + outline.len() - 1) % outline.len()).perp(&along(*k)).abs() > TOLERANCE;
    let corners: Vec<Point2<f64>> = (0..outline.len()).filter(turns).map(|k| place(&outline[k])).collect();
    let side = |k: usize| corners[(k + 1) % corners.len()] - corners[k];
    let Some(longest) = (0..corners.len()).map(side).max_by(|a, b| a.norm().total_cmp(&b.norm())) else { return false };
    let (axis, across) = (longest.normalize(), Vector2::new(-longest.y, longest.x).normalize());
    let laid: Vec<Vector2<f64>> =
        corners.iter().map(|p| Vector2::new(axis.dot(&p.coords), across.dot(&p.coords))).collect();
    let (low, high) = laid.iter().fold((laid[0], laid[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let nearly = TOLERANCE * (high - low).norm();
    (0..2).any(|flipped| {
        let image = |p: &Vector2<f64>| {
            let mut image = *p;
            image[flipped] = low[flipped] + high[flipped] - p[flipped];
            image
        };
        laid.iter().all(|p| laid.iter().any(|q| (image(p) - q).norm() <= nearly))
    })
}

#[cfg(test)]
mod tests {
    use super::super::dart::tests::{moved, whole};
    use super::*;
    use crate::mesh::{FaceId, test_surfaces};
    use nalgebra::Point3;

    #[test]
    fn a_box_has_a_net_whole_or_open_and_a_ball_has_none() {
        let cube = test_surfaces::cubes([1, 1, 1], |_| true);
        let box_of = |mesh| whole(moved(mesh, |p| Point3::new(p.x, 2.0 * p.y, 3.0 * p.z)));
        let closed = box_of(&cube);
        let unfolded = net(&closed).expect("a net");
        assert!(unfolded.mesh.topology().is_disk());
        assert_eq!(stretch::corners(&unfolded.mesh, 0), Some(Vec::new()), "no corner is left inside");
        let ball = whole(test_surfaces::sphere(3));
        assert!(net(&ball).is_none());
        let sheet = whole(test_surfaces::grid(4, 4, [1.0, 1.0], 0.0));
        assert!(net(&sheet).is_none(), "nothing to cut");
        let marks = closed.mesh.halfedges().map(|h| [h, closed.mesh.twin(h)].contains(&HalfedgeId::new(0))).collect();
        let guided = whole(TriMesh::clone(&closed.mesh).with_guides(marks));
        assert!(net(&guided).is_none(), "the user says where it is to be cut");
    }

    #[test]
    fn of_a_cube_all_nets_along_its_edges_are_found_and_some_are_their_own_mirror_image() {
        let cube = whole(test_surfaces::cubes([1, 1, 1], |_| true));
        let quads = Patch { polygon: (0..cube.mesh.face_count() as u32).map(|f| f / 2).collect(), ..cube };
        let corners = stretch::corners(&quads.mesh, MOST_CORNERS).expect("eight");
        let lines = lines(&quads, &corners);
        assert_eq!((corners.len(), lines.len()), (8, 12));
        let mut trees = Trees { lines: &lines, nodes: 8, steps: 0, most: f64::INFINITY, found: Vec::new() };
        trees.grow(0, &mut Vec::new(), 0.0);
        assert_eq!(trees.found.len(), 384, "Kirchhoff's number of spanning trees of a cube");
        let nets: Vec<Patch> = along_edges(&quads).collect();
        assert_eq!(nets.len(), MOST_NETS);
        let unfolded = |net: &Patch| crate::flattening::isometric(net, &mut crate::flattening::Rungs::default());
        let is_mirrored = |net: &Patch| unfolded(net).is_some_and(|flat| has_mirrored_outline(&net.mesh, &flat.uv));
        let count = nets.iter().filter(|net| is_mirrored(net)).count();
        assert!(count > 0 && count < nets.len(), "{count}");
    }

    #[test]
    fn a_net_costs_little_more_than_the_cheapest() {
        let cube = test_surfaces::cubes([2, 2, 2], |_| true);
        let long = whole(moved(&cube, |p| Point3::new(p.x, 2.0 * p.y, 5.0 * p.z)));
        let cost = |net: &Patch| net.mesh.boundary_length();
        let nets: Vec<Patch> = along_edges(&long).collect();
        assert!(nets.iter().all(|net| cost(net) <= SYMMETRIC * cost(&nets[0]) + 1e-9), "all edges bend alike");
        let open = test_surfaces::cubes([1, 1, 1], |_| true);
        let walls: Vec<_> = open.faces().filter(|f| open.triangle_positions(*f).iter().any(|p| p.z < 1.0)).collect();
        let polygon: Vec<u32> = (0..open.face_count() as u32).collect();
        let open = Patch::of_surface(&open, &polygon, walls);
        assert!(along_edges(&open).next().is_some(), "a box without a lid is cut from its corners up");
    }

    #[test]
    fn an_l_is_not_its_own_mirror_image_and_a_t_is() {
        let sheet = test_surfaces::grid(3, 3, [3.0, 3.0], 0.0);
        // The faces that lie in one of two rectangles.
        let part = |rectangles: [[f64; 4]; 2]| {
            let is_in = |f: &FaceId, [left, right, low, high]: [f64; 4]| {
                sheet.triangle_positions(*f).iter().all(|p| p.x >= left && p.x <= right && p.y >= low && p.y <= high)
            };
            let faces: Vec<FaceId> = sheet.faces().filter(|f| rectangles.iter().any(|r| is_in(f, *r))).collect();
            sheet.submesh(&faces, |_| false).0
        };
        let is_mirrored = |mesh: &TriMesh| {
            let turn = nalgebra::Rotation2::new(0.7);
            let uv: Vec<Point2<f64>> = mesh.positions().iter().map(|p| turn * p.xy()).collect();
            has_mirrored_outline(mesh, &uv)
        };
        assert!(!is_mirrored(&part([[0.0, 1.0, 0.0, 3.0], [0.0, 2.0, 0.0, 1.0]])));
        assert!(is_mirrored(&part([[0.0, 3.0, 2.0, 3.0], [1.0, 2.0, 0.0, 3.0]])));
    }
}
