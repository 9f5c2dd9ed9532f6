//! A chart of the coarse mesh carried to the part of the fine mesh that lies on it: where to cut the part, and
//! where its vertices are in the plane.
//!
//! The coarse chart has already been through geodesics, embedding and stretch minimisation; what it leaves to the
//! fine mesh is detail of the size of a coarse face. So the fine part starts a few Newton steps from its minimum, and
//! neither distances nor an embedding are needed there.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use nalgebra::{Point2, Point3};

use crate::charts::{Chart, Patch};
use crate::collections::DisjointSets;
use crate::mesh::{Coarse, FaceId, HalfedgeId, TriMesh, VertexId};

/// A fine cut replaces a coarse edge; it is looked for this many edge lengths around.
const LONGEST_DETOUR: f64 = 3.0;
/// Cuts are mended so many times at most, so that it ends whatever the mesh. They need it where paths on the fine mesh run side by side.
const MOST_REPAIRS: usize = 16;
/// Outside its coarse face a vertex is placed by linear extrapolation, up to this barycentric coordinate below
/// zero: borders move by about two coarse edges, and further out the plane of a face says nothing.
const FURTHEST_OUTSIDE: f64 = 2.0;

/// A fine patch, cut where the coarse chart was, and a start for its flattening.
pub(super) struct Prolonged {
    pub(super) patch: Patch,
    pub(super) start: Vec<Point2<f64>>,
}

/// Carries `chart`, whose patch is made of faces of `coarse.mesh`, to `part`, made of faces of the fine mesh. `None`
/// where the part does not come out with the topology of the chart, or hardly lies on it. The part is cut already where the
/// chart is along the edges for which `done` holds. O(m log m).
pub(super) fn prolong(
    coarse: &Coarse,
    chart: &Chart,
    part: Patch,
    done: impl Fn(HalfedgeId) -> bool,
) -> Option<Prolonged> {
    let mut local = vec![FaceId::NONE; coarse.mesh.face_count()];
    for (i, f) in chart.patch.faces.iter().enumerate() {
        local[f.index()] = FaceId::new(i);
    }
    let cuts = coarse_cuts(coarse, chart, &local, done);
    let patch = if cuts.edges.is_empty() { part } else { part.cut(&fine_cuts(coarse, &part, &cuts)) };
    let topology = patch.mesh.topology();
    if !topology.is_chart() || topology.loops != chart.patch.mesh.topology().loops {
        return None;
    }
    let base: Vec<FaceId> = patch.faces.iter().map(|f| local[coarse.face[f.index()].index()]).collect();
    let trusted = trusted_faces(&patch.mesh, &chart.patch.mesh, base)?;
    let start = places(&patch.mesh, chart, &trusted);
    Some(Prolonged { patch, start })
}

/// Where a coarse chart is cut open.
struct CoarseCuts {
    /// The edges inside it along which it is cut, by their ends.
    edges: Vec<[VertexId; 2]>,
    /// The ends of cuts on the border of the uncut chart.
    landings: Vec<VertexId>,
    /// The ends of cuts inside it: of darts.
    tips: Vec<VertexId>,
}

fn coarse_cuts(coarse: &Coarse, chart: &Chart, local: &[FaceId], done: impl Fn(HalfedgeId) -> bool) -> CoarseCuts {
    let outside = |h: HalfedgeId| h.is_none() || local[h.face().index()].is_none();
    let mut edges = Vec::new();
    let mut border = vec![false; coarse.mesh.vertex_count()];
    let mesh = &chart.patch.mesh;
    for h in mesh.halfedges().filter(|&h| mesh.is_boundary(h)) {
        let whole = chart.patch.faces[h.face().index()].halfedge(h.slot());
        let twin = coarse.mesh.twin(whole);
        let ends = [coarse.mesh.from(whole), coarse.mesh.to(whole)];
        if outside(twin) || done(whole) {
            ends.iter().for_each(|v| border[v.index()] = true);
        } else if whole < twin {
            edges.push(ends);
        }
    }
    let mut landings: Vec<VertexId> = edges.iter().flatten().copied().filter(|v| border[v.index()]).collect();
    landings.sort_unstable();
    landings.dedup();
    let mut ends: Vec<VertexId> = edges.iter().flatten().copied().filter(|v| !border[v.index()]).collect();
    ends.sort_unstable();
    let tips = ends.chunk_by(|v, w| v == w).filter(|same| same.len() == 1).map(|same| same[0]).collect();
    CoarseCuts { edges, landings, tips }
}

/// Edges of the fine part that run where the coarse cuts do: for each a shortest path between the same vertices, and
/// where the cut comes to the border one to the border of the part, which has been redrawn.
fn fine_cuts(coarse: &Coarse, part: &Patch, cuts: &CoarseCuts) -> Vec<HalfedgeId> {
    let mut at: HashMap<VertexId, VertexId> = HashMap::new();
    for (i, v) in part.vertices.iter().enumerate() {
        at.entry(*v).or_insert(VertexId::new(i));
    }
    let fine = |c: VertexId| at.get(&coarse.source[c.index()]).copied();
    let mut paths = Vec::new();
    let mut longest = 0.0_f64;
    for &[a, b] in &cuts.edges {
        let length = (coarse.mesh.position(a) - coarse.mesh.position(b)).norm();
        longest = longest.max(length);
        // An end that the border has left behind: the cut then ends on the border.
        if let (Some(from), to) | (to, Some(from)) = (fine(a), fine(b)) {
            paths.push(path_between(part, from, to, LONGEST_DETOUR * length));
        }
    }
    let landings = cuts.landings.iter().filter_map(|&v| fine(v));
    paths.extend(landings.map(|from| path_between(part, from, None, LONGEST_DETOUR * longest)));
    let tips: Vec<VertexId> = cuts.tips.iter().filter_map(|&v| fine(v)).collect();
    repaired(part, without_stubs(&part.mesh, paths.concat(), &tips), &tips, LONGEST_DETOUR * longest)
}

/// Cuts that leave the part in one piece and hang together with its border, as the coarse ones do. Two paths that run side by side
/// enclose a few faces, and a path that was not found leaves what is behind it a hole: an edge is left out there, or a path put in,
/// no longer than `reach`.
fn repaired(part: &Patch, mut edges: Vec<HalfedgeId>, tips: &[VertexId], reach: f64) -> Vec<HalfedgeId> {
    let mesh = &part.mesh;
    for _ in 0..MOST_REPAIRS {
        let (label, count) = part.cut(&edges).mesh.components();
        if count > 1 {
            let mut size = vec![0usize; count];
            label.iter().for_each(|&l| size[l as usize] += 1);
            let smallest = (0..count).min_by_key(|&l| size[l]);
            let of = |h: HalfedgeId| label[h.face().index()] as usize;
            let is_way_out = |h: &HalfedgeId| {
                if mesh.is_boundary(*h) {
                    return false;
                }
                let [a, b] = [of(*h), of(mesh.twin(*h))];
                a != b && (Some(a) == smallest || Some(b) == smallest)
            };
            // The rest of that side is a stub then.
            let Some(at) = edges.iter().position(is_way_out) else { return edges };
            edges.remove(at);
            edges = without_stubs(mesh, edges, tips);
        } else if let Some(way) = way_to_border(part, &edges, reach) {
            edges.extend(way);
            edges = without_stubs(mesh, edges, tips);
        } else {
            break;
        }
    }
    edges
}

/// The shortest way from cuts that do not hang together with the border to this or to others that do; `None` where all do, or where
/// none is found.
fn way_to_border(part: &Patch, edges: &[HalfedgeId], reach: f64) -> Option<Vec<HalfedgeId>> {
    let mesh = &part.mesh;
    let ends = |h: HalfedgeId| [mesh.from(h), mesh.to(h)];
    let mut together = DisjointSets::new(mesh.vertex_count());
    edges.iter().map(|&h| ends(h)).for_each(|[a, b]| {
        together.join(a.index(), b.index());
    });
    let cut = together.labels().0;
    let on_cuts = || edges.iter().flat_map(|&h| ends(h));
    let mut landed: Vec<u32> = on_cuts().filter(|&v| mesh.is_boundary_vertex(v)).map(|v| cut[v.index()]).collect();
    landed.sort_unstable();
    let is_landed = |v: VertexId| mesh.is_boundary_vertex(v) || landed.binary_search(&cut[v.index()]).is_ok();
    let mut adrift: Vec<VertexId> = on_cuts().filter(|&v| !is_landed(v)).collect();
    adrift.sort_unstable();
    adrift.dedup();
    let first = cut[adrift.first()?.index()];
    adrift.retain(|v| cut[v.index()] == first);
    let way = path(part, &adrift, is_landed, reach);
    (!way.is_empty()).then_some(way)
}

/// Leaves out edges that lead nowhere, neither to the border nor to the tip of a dart: two paths that meet in a vertex may have run on together, and the sides of a slit
/// are free to overlap in the plane.
fn without_stubs(mesh: &TriMesh, mut edges: Vec<HalfedgeId>, tips: &[VertexId]) -> Vec<HalfedgeId> {
    let edge = |h: HalfedgeId| if mesh.is_boundary(h) { h } else { h.min(mesh.twin(h)) };
    edges.iter_mut().for_each(|h| *h = edge(*h));
    edges.sort_unstable();
    edges.dedup();
    loop {
        let mut ends: HashMap<VertexId, usize> = HashMap::new();
        for v in edges.iter().flat_map(|&h| [mesh.from(h), mesh.to(h)]) {
            *ends.entry(v).or_default() += 1;
        }
        let leads_on = |v: VertexId| ends[&v] > 1 || mesh.is_boundary_vertex(v) || tips.contains(&v);
        let before = edges.len();
        edges.retain(|&h| leads_on(mesh.from(h)) && leads_on(mesh.to(h)));
        if edges.len() == before {
            return edges;
        }
    }
}

/// The shortest path along edges, none of them inside a polygon, from one vertex to another, or to any on the border;
/// empty where there is none within reach.
fn path_between(part: &Patch, from: VertexId, to: Option<VertexId>, reach: f64) -> Vec<HalfedgeId> {
    path(part, &[from], |v| to.map_or_else(|| part.mesh.is_boundary_vertex(v), |to| v == to), reach)
}

/// The shortest path along edges, none of them inside a polygon, from any of some vertices to one for which `arrived` holds; empty
/// where there is none within reach.
fn path(part: &Patch, from: &[VertexId], arrived: impl Fn(VertexId) -> bool, reach: f64) -> Vec<HalfedgeId> {
    let mesh = &part.mesh;
    let mut best: HashMap<VertexId, (f64, HalfedgeId)> = from.iter().map(|&v| (v, (0.0, HalfedgeId::NONE))).collect();
    // Lengths are not negative, so their bits are in their order.
    let mut queue: BinaryHeap<Reverse<(u64, VertexId)>> = from.iter().map(|&v| Reverse((0, v))).collect();
    while let Some(Reverse((bits, v))) = queue.pop() {
        let distance = f64::from_bits(bits);
        if best[&v].0 < distance {
            continue;
        }
        if arrived(v) {
            let mut edges = Vec::new();
            let mut last = best[&v].1;
            while !last.is_none() {
                edges.push(last);
                last = best[&mesh.from(last)].1;
            }
            return edges;
        }
        for h in mesh.outgoing(v) {
            let (w, length) = (mesh.to(h), distance + mesh.edge_length(h));
            if part.is_diagonal(h) || length > reach {
                continue;
            }
            if best.get(&w).is_none_or(|known| length < known.0) {
                best.insert(w, (length, h));
                queue.push(Reverse((length.to_bits(), w)));
            }
        }
    }
    Vec::new()
}

/// Which coarse face (of the chart) each fine face lies on, as far as that is to be trusted: next to a cut a fine face
/// may be nearest to a coarse face on the other side, which is far away in the plane. Neighbours on one side lie on
/// coarse faces that share a vertex of the chart, where the two sides of a cut are apart; the largest group of fine
/// faces that hang together so is taken, and continued over the others. `None` if it is less than half of all.
fn trusted_faces(mesh: &TriMesh, chart: &TriMesh, mut base: Vec<FaceId>) -> Option<Vec<FaceId>> {
    let touch = |f: FaceId, g: FaceId| {
        let corners = chart.triangle(f);
        f == g || chart.triangle(g).iter().any(|v| corners.contains(v))
    };
    let mut group = vec![u32::MAX; base.len()];
    let mut sizes: Vec<usize> = Vec::new();
    let mut stack = Vec::new();
    for seed in mesh.faces() {
        if base[seed.index()].is_none() || group[seed.index()] != u32::MAX {
            continue;
        }
        let name = FaceId::new(sizes.len()).index() as u32;
        sizes.push(0);
        group[seed.index()] = name;
        stack.push(seed);
        while let Some(f) = stack.pop() {
            sizes[name as usize] += 1;
            for h in f.halfedges() {
                let t = mesh.twin(h);
                if t.is_none() {
                    continue;
                }
                let g = t.face();
                let (here, there) = (base[f.index()], base[g.index()]);
                if group[g.index()] == u32::MAX && !there.is_none() && touch(here, there) {
                    group[g.index()] = name;
                    stack.push(g);
                }
            }
        }
    }
    let (largest, size) = sizes.iter().enumerate().max_by_key(|&(i, size)| (*size, Reverse(i)))?;
    if 2 * size < base.len() {
        return None;
    }
    for (face, group) in base.iter_mut().zip(group) {
        if group as usize != largest {
            *face = FaceId::NONE;
        }
    }
    // The others continue the map of the nearest that is trusted, a ring at a time.
    let mut front: Vec<FaceId> = mesh.faces().filter(|f| !base[f.index()].is_none()).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for f in front {
            for t in f.halfedges().into_iter().map(|h| mesh.twin(h)).filter(|t| !t.is_none()) {
                if base[t.face().index()].is_none() {
                    base[t.face().index()] = base[f.index()];
                    next.push(t.face());
                }
            }
        }
        front = next;
    }
    Some(base)
}

/// A position in the plane for each vertex, on the coarse face of a face around it that it is least outside of.
fn places(mesh: &TriMesh, chart: &Chart, base: &[FaceId]) -> Vec<Point2<f64>> {
    let place = |v: VertexId| {
        let p = mesh.position(v);
        let mut best = (f64::INFINITY, Point2::origin());
        let mut last = FaceId::NONE;
        for h in mesh.outgoing(v) {
            let f = base[h.face().index()];
            if f == last {
                continue;
            }
            last = f;
            let found = on_face(chart, f, &p);
            if found.0 < best.0 {
                best = found;
            }
        }
        best.1
    };
    mesh.vertices().map(place).collect()
}

/// How far outside a face of the chart a point of space lies (in barycentric coordinates), and the point of the plane
/// that the map of the face, continued, takes it to.
fn on_face(chart: &Chart, f: FaceId, p: &Point3<f64>) -> (f64, Point2<f64>) {
    let [a, b, c] = chart.patch.mesh.triangle_positions(f);
    let corners = chart.patch.mesh.triangle(f).map(|v| chart.uv[v.index()]);
    let (u, w, d) = (b - a, c - a, p - a);
    let (uu, uw, ww, du, dw) = (u.dot(&u), u.dot(&w), w.dot(&w), d.dot(&u), d.dot(&w));
    let area = uu * ww - uw * uw;
    let third = 1.0 / 3.0;
    let (s, t) = if area > 0.0 { ((ww * du - uw * dw) / area, (uu * dw - uw * du) / area) } else { (third, third) };
    let outside = -(1.0 - s - t).min(s).min(t);
    // Towards the centroid until it is no further out than allowed.
    let keep = if outside > FURTHEST_OUTSIDE { (FURTHEST_OUTSIDE + third) / (outside + third) } else { 1.0 };
    let (s, t) = (third + keep * (s - third), third + keep * (t - third));
    let place = corners[0] + (corners[1] - corners[0]) * s + (corners[2] - corners[0]) * t;
    (outside.max(0.0), place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::mesh::{self, test_surfaces};
    use crate::progress::Progress;

    /// A mesh as a patch of itself, every triangle a polygon.
    fn whole(mesh: &TriMesh) -> Patch {
        Patch::whole(Arc::new(mesh.clone()), (0..mesh.face_count() as u32).collect())
    }

    fn nearest(mesh: &TriMesh, x: f64, y: f64) -> VertexId {
        let away = |v: VertexId| (mesh.position(v) - Point3::new(x, y, 0.0)).norm_squared();
        mesh.vertices().min_by(|&v, &w| away(v).total_cmp(&away(w))).expect("a vertex")
    }

    /// The surface's vertices that a cut has made two of, and whether it ends in `tip`.
    fn slit(patch: &Patch, tip: VertexId) -> (usize, bool) {
        let mut count: HashMap<VertexId, usize> = HashMap::new();
        patch.vertices.iter().for_each(|v| *count.entry(*v).or_default() += 1);
        let twice = count.values().filter(|&&n| n == 2).count();
        let ends = patch.mesh.vertices().filter(|v| patch.vertices[v.index()] == tip).collect::<Vec<_>>();
        (twice, ends.len() == 1 && patch.mesh.is_boundary_vertex(ends[0]))
    }

    #[test]
    fn a_dart_keeps_its_tip_on_the_fine_mesh() {
        let fine = test_surfaces::grid(40, 40, [1.0, 1.0], 0.0);
        let coarse = mesh::coarsen(&fine, 120, &Progress::new()).expect("not cancelled");
        let uncut = whole(&coarse.mesh);
        let tip = nearest(&coarse.mesh, 0.4, 0.5);
        let dart = path_between(&uncut, tip, None, 1.0);
        assert!(dart.len() > 1, "from the middle to the border");
        let patch = uncut.cut(&dart);
        assert_eq!(slit(&patch, tip), (dart.len(), true));
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        let chart = Chart { patch, uv, l2: 1.0 };

        let local: Vec<FaceId> = coarse.mesh.faces().collect();
        assert_eq!(coarse_cuts(&coarse, &chart, &local, |_| false).tips, [tip]);
        let part = whole(&fine);
        let Prolonged { patch, start } =
            prolong(&coarse, &chart, part.clone(), |_| false).expect("it lies on the chart");
        assert!(patch.mesh.topology().is_disk());
        let (twice, ends) = slit(&patch, coarse.source[tip.index()]);
        assert!(ends, "the cut ends where the dart does");
        assert!((10..=40).contains(&twice), "{twice}: 0.4 in steps of 0.025 and their diagonals");
        for (p, q) in patch.mesh.positions().iter().zip(&start) {
            assert!((p.xy() - q).norm() < 1e-9, "the map of the sheet is the identity, on either side of the cut");
        }

        // Where the part is cut already nothing is left to do.
        let Prolonged { patch, .. } = prolong(&coarse, &chart, part.cut(&[]), |_| true).expect("as before");
        assert_eq!(slit(&patch, coarse.source[tip.index()]), (0, false));
    }

    #[test]
    fn edges_that_lead_nowhere_are_left_out_but_for_tips() {
        let mesh = test_surfaces::grid(8, 8, [8.0, 8.0], 0.0);
        let part = whole(&mesh);
        let at = |x, y| nearest(&mesh, x, y);
        let main = path_between(&part, at(5.0, 3.0), Some(at(0.0, 3.0)), 9.0);
        let stub = path_between(&part, at(3.0, 3.0), Some(at(3.0, 6.0)), 9.0);
        assert_eq!((main.len(), stub.len()), (5, 3));
        let mut kept = without_stubs(&mesh, [main.clone(), main.clone()].concat(), &[at(5.0, 3.0)]);
        kept.sort_unstable();
        assert_eq!(kept.len(), 5, "each edge once");
        let branched = [main.clone(), stub.clone()].concat();
        assert_eq!(without_stubs(&mesh, branched.clone(), &[at(5.0, 3.0)]), kept, "a branch without a tip goes");
        assert_eq!(without_stubs(&mesh, branched.clone(), &[at(5.0, 3.0), at(3.0, 6.0)]).len(), 8, "two darts");
        assert!(without_stubs(&mesh, branched, &[]).is_empty());
        let across = path_between(&part, at(0.0, 3.0), Some(at(8.0, 3.0)), 9.0);
        assert_eq!(without_stubs(&mesh, across, &[]).len(), 8, "from border to border");
    }

    #[test]
    fn paths_side_by_side_cut_nothing_off_and_a_cut_adrift_is_joined_to_the_border() {
        let part = whole(&test_surfaces::grid(8, 8, [8.0, 8.0], 0.0));
        let at = |x, y| nearest(&part.mesh, x, y);
        let between = |a, b| path_between(&part, a, Some(b), 9.0);
        let tip = at(5.0, 3.0);
        let beside = [between(tip, at(0.0, 3.0)), between(tip, at(5.0, 4.0)), between(at(5.0, 4.0), at(0.0, 4.0))];
        let beside = beside.concat();
        assert_eq!(part.cut(&beside).mesh.topology().components, 2, "the strip between them");
        let one = repaired(&part, beside, &[tip], 9.0);
        assert!(part.cut(&one).mesh.topology().is_disk() && !one.is_empty());
        let adrift = between(at(3.0, 3.0), tip);
        assert_eq!(part.cut(&adrift).mesh.topology().loops, 2, "a hole without area");
        let landed = repaired(&part, adrift.clone(), &[tip], 9.0);
        assert!(part.cut(&landed).mesh.topology().is_disk());
        assert!(slit(&part.cut(&landed), tip).0 > 0, "it is still cut");
        assert_eq!(repaired(&part, adrift.clone(), &[tip], 1.0), adrift, "no border within reach");
    }
}
