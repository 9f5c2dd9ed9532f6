//! Parts of a chart that a short cut takes off: limbs, ears, the ends of a boomerang.

use std::f64::consts::TAU;

use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use crate::charts::Patch;
use crate::collections::DisjointSets;
use crate::mesh::{FaceId, Groups, HalfedgeId, measure};
use crate::progress::{Cancelled, Progress};
use crate::segmentation;

/// Directions from which a line sweeps over the chart.
const DIRECTIONS: usize = 16;
/// Places at which each line stops.
const STOPS: usize = 32;
/// A lobe has at least this share of the chart's area, and the rest, too.
const LEAST_SHARE: f64 = 0.08;
/// Parts beyond lines that are looked at, those with the shortest borders for their size first.
const MOST_LOOKED_AT: usize = 40;
/// Two parts are one if their areas and their borders differ by less than this share.
const SAME: f64 = 0.1;
/// The border of a lobe is redrawn among polygons fewer than so many sides away.
const RINGS: usize = 10;

/// A part of a chart, beyond a line in its map.
#[derive(Clone, Debug)]
pub(super) struct Lobe {
    /// Its faces in the chart, ascending.
    pub(super) faces: Vec<FaceId>,
    /// The edges between it and the rest, on its side.
    pub(super) border: Vec<HalfedgeId>,
    /// On the surface.
    pub(super) area: f64,
}

/// A line and the side of it.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    direction: Vector2<f64>,
    /// How far the chart reaches in that direction.
    high: f64,
    /// Between two stops, and at how many of them the line is away from there.
    step: f64,
    stop: usize,
}

impl Sweep {
    /// At how many stops of its way the line has passed a point.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to STOPS")]
    fn stop_of(&self, p: &Point2<f64>) -> usize {
        (((self.high - p.coords.dot(&self.direction)) / self.step).max(0.0) as usize).min(STOPS)
    }

    fn is_beyond(&self, p: &Point2<f64>) -> bool {
        self.stop_of(p) < self.stop
    }
}

/// A connected part beyond a line, by one of its polygons.
#[derive(Clone, Copy)]
struct Found {
    sweep: Sweep,
    polygon: usize,
    /// Its area, and what a seam along its border costs.
    size: [f64; 2],
    /// That cost over the root of the smaller part's area.
    score: f64,
}

/// The polygons of a chart that are not cut.
pub(super) struct Pieces<'a> {
    patch: &'a Patch,
    /// The polygon of each face.
    of_face: Vec<u32>,
    middle: Vec<Point2<f64>>,
    area: Vec<f64>,
    /// For each the neighbours, and what a border there costs.
    links: Groups<(u32, f64)>,
}

impl<'a> Pieces<'a> {
    /// `uv` is the chart's map; cut is only where `may_be_cut`, and never a polygon. O(n).
    pub(super) fn new(patch: &'a Patch, uv: &[Point2<f64>], may_be_cut: impl Fn(HalfedgeId) -> bool) -> Self {
        let mesh = &patch.mesh;
        let inner = || mesh.edges().filter(|&h| !mesh.is_boundary(h));
        let mut sets = DisjointSets::new(mesh.face_count());
        for h in inner().filter(|&h| patch.is_diagonal(h) || !may_be_cut(h)) {
            sets.join(h.face().index(), mesh.twin(h).face().index());
        }
        let (of_face, count) = sets.labels();
        let (mut middle, mut area) = (vec![Vector2::zeros(); count], vec![0.0; count]);
        for (f, t) in mesh.faces().zip(mesh.triangles()) {
            let polygon = of_face[f.index()] as usize;
            // A polygon without area has a middle, too.
            let own = measure::triangle_area(mesh.triangle_positions(f)).max(f64::MIN_POSITIVE);
            middle[polygon] += t.iter().map(|v| uv[v.index()].coords).sum::<Vector2<f64>>() * (own / 3.0);
            area[polygon] += own;
        }
        let middle = middle.into_iter().zip(&area).map(|(sum, area)| Point2::from(sum / *area)).collect();
        let beyond = |h: HalfedgeId| of_face[mesh.twin(h).face().index()];
        let sides: Vec<HalfedgeId> =
            mesh.halfedges().filter(|&h| !mesh.is_boundary(h) && beyond(h) != of_face[h.face().index()]).collect();
        let owners: Vec<u32> = sides.iter().map(|h| of_face[h.face().index()]).collect();
        let link = |k: usize| (beyond(sides[k]), mesh.edge_length(sides[k]) * mesh.border_cost(sides[k]));
        let links = Groups::by_label(&owners, count, link);
        Self { patch, of_face, middle, area, links }
    }

    /// Up to `count` lobes, no two much the same, which leave the rest in one piece, those with the shortest border for their size first. O(n log n).
    pub(super) fn lobes(&self, count: usize) -> Vec<Lobe> {
        let directions = (0..DIRECTIONS).into_par_iter().map(|k| TAU * k as f64 / DIRECTIONS as f64);
        let swept: Vec<Vec<Found>> =
            directions.map(|angle| self.swept(Vector2::new(angle.cos(), angle.sin()))).collect();
        let mut found = swept.concat();
        found.sort_by(|a, b| a.score.total_cmp(&b.score));
        let mut lobes: Vec<Lobe> = Vec::new();
        let mut seen: Vec<[f64; 2]> = Vec::new();
        for found in found {
            if lobes.len() >= count || seen.len() >= MOST_LOOKED_AT {
                break;
            }
            // What has nearly the same area and border is the same, or its mirror image, but for rare chance.
            let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < SAME * a.min(*b);
            if seen.iter().any(|other| other.iter().zip(&found.size).all(is_near)) {
                continue;
            }
            seen.push(found.size);
            let inside = self.inside(&found);
            if self.is_connected_without(&inside) {
                lobes.push(self.lobe(&inside));
            }
        }
        lobes
    }

    /// Whether what is left of the chart is in one piece.
    fn is_connected_without(&self, inside: &[bool]) -> bool {
        let Some(first) = inside.iter().position(|inside| !inside) else { return false };
        let mut reached = inside.to_vec();
        reached[first] = true;
        let mut open = vec![first];
        while let Some(p) = open.pop() {
            for q in self.links.group(p).iter().map(|link| link.0 as usize) {
                if !std::mem::replace(&mut reached[q], true) {
                    open.push(q);
                }
            }
        }
        reached.into_iter().all(|reached| reached)
    }

    fn area_of(&self, is_counted: impl Fn(usize) -> bool) -> f64 {
        self.area.iter().enumerate().filter(|(p, _)| is_counted(*p)).map(|(_, area)| area).sum()
    }

    /// Connected parts beyond a line, as it sweeps over the chart against a direction.
    fn swept(&self, direction: Vector2<f64>) -> Vec<Found> {
        let at = || self.middle.iter().map(|p| p.coords.dot(&direction));
        let (low, high) = at().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
        let sweep = Sweep { direction, high, step: (high - low) / STOPS as f64, stop: 0 };
        let whole: f64 = self.area.iter().sum();
        let stops: Vec<u32> = self.middle.iter().map(|p| sweep.stop_of(p) as u32).collect();
        let order = Groups::by_label(&stops, STOPS + 1, |polygon| polygon);
        let mut sets = DisjointSets::new(self.area.len());
        let (mut area, mut cost) = (self.area.clone(), vec![0.0; self.area.len()]);
        let mut is_beyond = vec![false; self.area.len()];
        let mut large: Vec<usize> = Vec::new();
        let mut found = Vec::new();
        for stop in 1..STOPS {
            for &p in order.group(stop - 1) {
                is_beyond[p] = true;
                let mut root = p;
                for &(q, border) in self.links.group(p) {
                    let q = q as usize;
                    if !is_beyond[q] {
                        cost[root] += border;
                        continue;
                    }
                    let other = sets.root(q);
                    if other == root {
                        cost[root] -= border;
                    } else {
                        sets.join(other, root);
                        let joined = sets.root(root);
                        (area[joined], cost[joined]) = (area[root] + area[other], cost[root] + cost[other] - border);
                        root = joined;
                    }
                }
                large.push(root);
            }
            large.iter_mut().for_each(|root| *root = sets.root(*root));
            large.sort_unstable();
            large.dedup();
            for &root in &large {
                let least = area[root].min(whole - area[root]);
                // The larger part is a lobe of a line from the other side, if it is one.
                if area[root] <= 0.55 * whole && least >= LEAST_SHARE * whole {
                    let sweep = Sweep { stop, ..sweep };
                    let size = [area[root], cost[root]];
                    found.push(Found { sweep, polygon: root, size, score: cost[root] / least.sqrt() });
                }
            }
        }
        found
    }

    /// The polygons of a lobe.
    fn inside(&self, found: &Found) -> Vec<bool> {
        let mut inside = vec![false; self.area.len()];
        inside[found.polygon] = true;
        let mut open = vec![found.polygon];
        while let Some(p) = open.pop() {
            for q in self.links.group(p).iter().map(|link| link.0 as usize) {
                if !inside[q] && found.sweep.is_beyond(&self.middle[q]) {
                    inside[q] = true;
                    open.push(q);
                }
            }
        }
        inside
    }

    fn lobe(&self, inside: &[bool]) -> Lobe {
        let mesh = &self.patch.mesh;
        let is_in = |f: FaceId| inside[self.of_face[f.index()] as usize];
        let faces: Vec<FaceId> = mesh.faces().filter(|&f| is_in(f)).collect();
        let sides = faces.iter().flat_map(|f| f.halfedges());
        let border = sides.filter(|&h| !mesh.is_boundary(h) && !is_in(mesh.twin(h).face())).collect();
        let area = self.area_of(|p| inside[p]);
        Lobe { faces, border, area }
    }

    /// The same lobe with its border redrawn where it is short, runs along creases and has no stairs. O(n log n) and two cuts.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn smoothed(&self, lobe: &Lobe, crease_weight: f64, progress: &Progress) -> Result<Lobe, Cancelled> {
        let mesh = &self.patch.mesh;
        let mut label = vec![0; mesh.face_count()];
        lobe.faces.iter().for_each(|f| label[f.index()] = 1);
        let parts = segmentation::straighten(mesh, &self.of_face, &label, RINGS, crease_weight, progress)?;
        // The part that has most of the lobe; the rest may lie on several sides of it.
        let mut shared = vec![0; parts.parts];
        lobe.faces.iter().for_each(|f| shared[parts.label[f.index()] as usize] += 1);
        let most = (0..parts.parts).max_by_key(|&part| (shared[part], std::cmp::Reverse(part)));
        let Some(own) = most.filter(|_| parts.parts > 1) else { return Ok(lobe.clone()) };
        let mut inside = vec![false; self.area.len()];
        for f in mesh.faces().filter(|f| parts.label[f.index()] as usize == own) {
            inside[self.of_face[f.index()] as usize] = true;
        }
        Ok(self.lobe(&inside))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::test_surfaces;

    /// A cross of five squares of 8 by 8 cells, but the arms narrower where they meet the middle.
    fn cross() -> (Patch, Vec<Point2<f64>>) {
        let whole = test_surfaces::grid(24, 24, [24.0, 24.0], 0.0);
        let middle =
            |f: FaceId| whole.triangle_positions(f).iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0;
        let is_kept = |f: &FaceId| {
            let at = middle(*f);
            let [x, y] = [(at.x - 12.0).abs(), (at.y - 12.0).abs()];
            let (far, near) = (x.max(y), x.min(y));
            near < if (4.0..6.0).contains(&far) { 2.0 } else { 4.0 }
        };
        let patch = Patch::of_surface(
            &whole,
            &(0..whole.face_count() as u32).map(|f| f / 2).collect::<Vec<_>>(),
            whole.faces().filter(is_kept).collect(),
        );
        let patch = Patch::whole(Arc::clone(&patch.mesh), patch.polygon);
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        (patch, uv)
    }

    fn length(patch: &Patch, lobe: &Lobe) -> f64 {
        lobe.border.iter().map(|&h| patch.mesh.edge_length(h)).sum()
    }

    #[test]
    fn an_arm_of_a_cross_is_a_lobe_with_a_short_border() {
        let (patch, uv) = cross();
        let lobes = Pieces::new(&patch, &uv, |_| true).lobes(4);
        // The other arms are of the same size.
        assert!(!lobes.is_empty());
        for lobe in &lobes[..1] {
            assert!((length(&patch, lobe) - 4.0).abs() < 1e-9, "as wide as the neck");
            let area: f64 = lobe.faces.iter().map(|f| measure::triangle_area(patch.mesh.triangle_positions(*f))).sum();
            assert!((48.0..=56.0 + 1e-9).contains(&area), "{area}");
        }
    }

    #[test]
    fn a_cut_is_moved_to_where_it_is_short_and_only_where_it_may_be() {
        let (patch, uv) = cross();
        let mesh = &patch.mesh;
        let progress = Progress::new();
        // Only the line at x = 7 may be cut, in the middle of the neck of the arm on the left.
        let on_line = |h: HalfedgeId| [mesh.from(h), mesh.to(h)].iter().all(|v| mesh.position(*v).x == 7.0);
        let pieces = Pieces::new(&patch, &uv, on_line);
        let lobes = pieces.lobes(4);
        assert_eq!(lobes.len(), 1);
        assert!(lobes[0].border.iter().all(|&h| on_line(h)) && lobes[0].border.len() == 4);
        // An arm cut off where it is wide.
        let pieces = Pieces::new(&patch, &uv, |_| true);
        let left: Vec<bool> = pieces.middle.iter().map(|p| p.x < 5.0).collect();
        let wide = pieces.lobe(&left);
        assert!(length(&patch, &wide) > 7.9);
        let short = pieces.smoothed(&wide, 0.0, &progress).expect("not cancelled");
        assert!((length(&patch, &short) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn a_square_has_no_lobe_with_a_shorter_border_than_its_side() {
        let mesh = test_surfaces::grid(16, 16, [16.0, 16.0], 0.0);
        let polygon = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let patch = Patch::whole(Arc::new(mesh), polygon);
        let uv: Vec<_> = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        // But for corners cut off along stairs.
        let lobes = Pieces::new(&patch, &uv, |_| true).lobes(3);
        assert!(!lobes.is_empty() && lobes.iter().all(|lobe| length(&patch, lobe) >= 8.0));
    }
}
