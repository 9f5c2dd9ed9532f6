//! Borders without stairs: threshold dynamics.
//!
//! A minimum cut measures a border along the edges of the mesh. On a regular grid all monotone staircases between two
//! points have the same length, so it takes any of them. Here the labels diffuse for a while and every polygon then
//! goes to the label that is strongest there, a few times over: that moves the borders by their curvature, which knows
//! no directions (B. Merriman, J. Bence, S. Osher, Motion of multiple junctions: a level set approach, J. Comput.
//! Phys. 112, 1994), and turns junctions to three even angles. Little diffuses across a crease, so a border that comes
//! near one snaps to it and stays.

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};

use super::bends::Bends;
use super::polygon_graph::PolygonGraph;

/// Rounds of diffusion and decision; borders of few steps come to rest before.
const MOST_ROUNDS: usize = 6;
/// Steps of diffusion a round. A round flattens stairs of up to about ½√steps polygons, and only those: the border moves
/// by less where it bends less than over that many.
const STEPS: usize = 40;
/// Sides from a border within which labels diffuse; fewer reach further in so many steps than one in a hundred.
const REACH: u32 = 10;
/// Share of a polygon's own value that it keeps in a step: without, values swing on two-colourable graphs.
const KEPT: f64 = 0.25;
/// A label that would lose more of its area than this in all stays as it was.
const MOST_LOST: f64 = 0.3;

/// Redraws the borders between labels in place, among the polygons fewer than `rings` sides from where they were.
/// Labels may fall apart. Linear in the size of the band.
pub(super) fn smooth(
    graph: &PolygonGraph,
    bends: &Bends,
    label: &mut [u32],
    rings: usize,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let may_move = near_borders(graph, label, rings);
    let band = Band { graph, bends, may_move: &may_move };
    let guard = Guard::new(graph, label);
    for _ in 0..MOST_ROUNDS {
        progress.check()?;
        let before = label.to_vec();
        let changed = band.round(label, progress)?;
        guard.restore(graph, &before, label);
        if !changed || *label == *before {
            break;
        }
    }
    Ok(())
}

/// Keeps small labels: one as wide as the stairs to be flattened would be taken for a stair.
pub(super) struct Guard {
    area: Vec<f64>,
}

impl Guard {
    pub(super) fn new(graph: &PolygonGraph, label: &[u32]) -> Self {
        Self { area: areas(graph, label, label.iter().max().map_or(0, |l| *l as usize + 1)) }
    }

    /// Gives labels that have lost too much of the area they had at first their polygons of `before` back.
    pub(super) fn restore(&self, graph: &PolygonGraph, before: &[u32], label: &mut [u32]) {
        let now = areas(graph, label, self.area.len());
        for (now_in, &was_in) in label.iter_mut().zip(before) {
            if now[was_in as usize] < (1.0 - MOST_LOST) * self.area[was_in as usize] {
                *now_in = was_in;
            }
        }
    }
}

fn areas(graph: &PolygonGraph, label: &[u32], count: usize) -> Vec<f64> {
    let mut area = vec![0.0; count];
    for (&l, a) in label.iter().zip(&graph.area) {
        area[l as usize] += a;
    }
    area
}

/// The polygons fewer than `rings` sides from a border, those on it being 0 away.
fn near_borders(graph: &PolygonGraph, label: &[u32], rings: usize) -> Vec<bool> {
    let mut near: Vec<bool> =
        (0..graph.len()).map(|p| graph.links.group(p).iter().any(|l| label[l.to as usize] != label[p])).collect();
    let mut front: Vec<usize> = (0..graph.len()).filter(|&p| near[p]).collect();
    for _ in 1..rings {
        let mut next = Vec::new();
        for q in front.iter().flat_map(|&p| graph.links.group(p)).map(|l| l.to as usize) {
            if !std::mem::replace(&mut near[q], true) {
                next.push(q);
            }
        }
        front = next;
    }
    near
}

struct Band<'a> {
    graph: &'a PolygonGraph,
    bends: &'a Bends,
    may_move: &'a [bool],
}

/// The share that one label has in the polygons around its border.
struct Share {
    label: u32,
    polygons: Vec<u32>,
    value: Vec<f64>,
}

impl Band<'_> {
    /// Whether a polygon changed its label.
    fn round(&self, label: &mut [u32], progress: &Progress) -> Result<bool, Cancelled> {
        let mut seeds: Vec<(u32, u32)> = Vec::new();
        for (p, &own) in label.iter().enumerate() {
            for link in self.graph.links.group(p).iter().filter(|l| label[l.to as usize] != own) {
                seeds.extend([(own, link.to), (label[link.to as usize], link.to)]);
            }
        }
        seeds.sort_unstable();
        seeds.dedup();
        let groups: Vec<&[(u32, u32)]> = seeds.chunk_by(|a, b| a.0 == b.0).collect();
        let now: &[u32] = label;
        let shares: Vec<Share> = groups
            .par_iter()
            .with_max_len(1)
            .map(|seeds| {
                progress.check()?;
                Ok(self.diffuse(now, seeds))
            })
            .collect::<Result<_, Cancelled>>()?;
        // The own label's share, 1 far from its borders, and the greatest of the others'.
        let mut own = vec![1.0; label.len()];
        let mut best = vec![(0.0, u32::MAX); label.len()];
        for share in &shares {
            for (&p, &value) in share.polygons.iter().zip(&share.value) {
                let p = p as usize;
                if label[p] == share.label {
                    own[p] = value;
                } else if value > best[p].0 {
                    best[p] = (value, share.label);
                }
            }
        }
        let mut changed = false;
        for (p, l) in label.iter_mut().enumerate() {
            if self.may_move[p] && best[p].0 > own[p] {
                *l = best[p].1;
                changed = true;
            }
        }
        Ok(changed)
    }

    /// What becomes of the indicator of a label around its border, whose polygons `seeds` are.
    fn diffuse(&self, label: &[u32], seeds: &[(u32, u32)]) -> Share {
        let own = seeds[0].0;
        let mut place: std::collections::HashMap<u32, u32> = seeds.iter().zip(0..).map(|(s, i)| (s.1, i)).collect();
        let mut polygons: Vec<u32> = seeds.iter().map(|s| s.1).collect();
        let mut from = 0;
        for _ in 1..REACH {
            let to = polygons.len();
            for i in from..to {
                for link in self.graph.links.group(polygons[i] as usize) {
                    let fresh = polygons.len() as u32;
                    if *place.entry(link.to).or_insert(fresh) == fresh {
                        polygons.push(link.to);
                    }
                }
            }
            from = to;
        }
        // Values beyond stay; each polygon's links as ranges of (neighbour's place, weight), the rest as a constant.
        let indicator = |p: u32| f64::from(label[p as usize] == own);
        let mut first = vec![0usize];
        let mut links: Vec<(u32, f64)> = Vec::new();
        let mut beyond = Vec::with_capacity(polygons.len());
        for &p in &polygons {
            let sides = self.graph.links.group(p as usize);
            let weight = |k: usize| self.bends.conductance(p as usize, k);
            let total: f64 = (0..sides.len()).map(weight).sum::<f64>().max(f64::MIN_POSITIVE);
            let mut constant = 0.0;
            for (k, link) in sides.iter().enumerate() {
                let w = (1.0 - KEPT) * weight(k) / total;
                match place.get(&link.to) {
                    Some(&q) => links.push((q, w)),
                    None => constant += w * indicator(link.to),
                }
            }
            first.push(links.len());
            beyond.push(constant);
        }
        let mut value: Vec<f64> = polygons.iter().map(|&p| indicator(p)).collect();
        let mut next = value.clone();
        for _ in 0..STEPS {
            for i in 0..value.len() {
                let around: f64 = links[first[i]..first[i + 1]].iter().map(|&(q, w)| w * value[q as usize]).sum();
                next[i] = KEPT * value[i] + beyond[i] + around;
            }
            std::mem::swap(&mut value, &mut next);
        }
        Share { label: own, polygons, value }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::mesh::{FaceId, TriMesh, test_surfaces};

    fn centre(mesh: &TriMesh, f: FaceId) -> Point3<f64> {
        let [a, b, c] = mesh.triangle_positions(f);
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    }

    fn smoothed(mesh: &TriMesh, label: impl Fn(Point3<f64>) -> u32, rings: usize) -> (Vec<u32>, Vec<u32>) {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let graph = PolygonGraph::new(mesh, &polygon);
        let start: Vec<u32> = mesh.faces().map(|f| label(centre(mesh, f))).collect();
        let mut end = start.clone();
        smooth(&graph, &Bends::new(mesh, &graph, 1.0), &mut end, rings, &Progress::new()).expect("not cancelled");
        (start, end)
    }

    /// Greatest distance of a border vertex with x between two bounds from a line through the origin of this slope.
    fn farthest(mesh: &TriMesh, label: &[u32], slope: f64, x: [f64; 2]) -> f64 {
        let differs = |h: &crate::mesh::HalfedgeId| {
            let t = mesh.twin(*h);
            !t.is_none() && label[h.face().index()] != label[t.face().index()]
        };
        let ends = mesh.edges().filter(differs).flat_map(|h| [mesh.position(mesh.from(h)), mesh.position(mesh.to(h))]);
        let inner = ends.filter(|p| p.x > x[0] && p.x < x[1]);
        inner.map(|p| (p.y - slope * p.x).abs() / slope.hypot(1.0)).fold(0.0, f64::max)
    }

    #[test]
    fn stairs_that_no_cut_sees_become_a_line() {
        // Steps of six along and three up: as long in edges as any other way of the same rise.
        let mesh = test_surfaces::grid(60, 30, [60.0, 30.0], 0.0);
        let (start, end) = smoothed(&mesh, |p| u32::from(p.y > 3.0 * (p.x / 6.0 + 0.5).floor()), 10);
        let before = farthest(&mesh, &start, 0.5, [15.0, 45.0]);
        let after = farthest(&mesh, &end, 0.5, [15.0, 45.0]);
        assert!(before > 1.2, "{before}");
        assert!(after < 0.8, "within an edge of the line, not {after}");
    }

    #[test]
    fn a_border_near_a_crease_snaps_to_it() {
        let flat = test_surfaces::grid(30, 30, [30.0, 30.0], 0.0);
        let fold: Vec<Point3<f64>> =
            flat.positions().iter().map(|p| Point3::new(p.x.min(15.0), p.y, (p.x - 15.0).max(0.0))).collect();
        let triangles: Vec<[u32; 3]> = flat.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&fold, &triangles);
        let wave = |y: f64| 13.0 + (0.7 * y).sin();
        let (_, end) = smoothed(&mesh, |p| u32::from(p.x + p.z > wave(p.y)), 10);
        for f in mesh.faces() {
            assert_eq!(end[f.index()], u32::from(centre(&mesh, f).z > 0.0), "{f} is on the wrong side of the crease");
        }
    }

    #[test]
    fn small_labels_stay_and_far_polygons_keep_theirs() {
        let mesh = test_surfaces::grid(40, 40, [40.0, 40.0], 0.0);
        let label = |p: Point3<f64>| if p.x.max(p.y) < 3.0 { 2 } else { u32::from(p.x > 20.0 + (p.y * 1.3).sin()) };
        let (start, end) = smoothed(&mesh, label, 4);
        let count = |labels: &[u32], l: u32| labels.iter().filter(|x| **x == l).count();
        assert!(count(&end, 2) * 10 >= count(&start, 2) * 7, "{} of {}", count(&end, 2), count(&start, 2));
        for f in mesh.faces() {
            let p = centre(&mesh, f);
            if (p.x - 20.0).abs() > 6.0 && p.x.max(p.y) > 9.0 {
                assert_eq!(start[f.index()], end[f.index()]);
            }
        }
    }
}
