//! The side to start from, and the order of polygons that follows from it.

use super::colours::{Colours, joined};
use super::polygons::Polygons;
use crate::mesh::index::{HalfedgeId, VertexId};
use crate::mesh::tri_mesh::TriMesh;

/// Vertices are as far from the middle as the farthest if they are so by this share of the distance: far above rounding.
const AS_FAR: f64 = 1.0 - 1e-6;
/// Numbers of polygons around a side by which sides that look the same are told apart, one after the other.
const DEPTHS: [usize; 4] = [4, 64, 1024, usize::MAX];
/// Sides that still look the same are compared at the next depth only if that takes at most so many visits for each polygon
/// of the component, so that the time stays linear, or [`FREE_VISITS`] in all.
const VISITS_A_POLYGON: usize = 16;
/// So many visits take a millisecond, and are made however small the component is.
const FREE_VISITS: usize = 1 << 16;

/// Visits the polygons of a mesh from sides.
pub(super) struct Traversal<'a> {
    mesh: &'a TriMesh,
    pub(super) polygons: &'a Polygons<'a>,
    /// The visit in which each polygon was reached last, and as which one.
    reached: Vec<(u32, u32)>,
    visit: u32,
    queue: Vec<HalfedgeId>,
}

impl<'a> Traversal<'a> {
    pub(super) fn new(mesh: &'a TriMesh, polygons: &'a Polygons<'a>) -> Self {
        Self { mesh, polygons, reached: vec![(0, 0); polygons.len()], visit: 0, queue: Vec::new() }
    }

    /// The side of a component to start from: of those that leave a vertex farthest from the middle one that looks like
    /// the fewest others.
    pub(super) fn start(&mut self, colours: &Colours<'_>, polygons: &[u32], vertices: &[VertexId]) -> HalfedgeId {
        let farthest = vertices.iter().map(|v| colours.radius[v.index()]).fold(0.0, f64::max);
        let is_far = |h: HalfedgeId| colours.radius[self.mesh.from(h).index()] >= AS_FAR * farthest;
        let sides = polygons.iter().flat_map(|&polygon| self.polygons.sides(polygon as usize));
        let far = sides.filter(|&h| is_far(h)).map(|h| (colours.of(h), h)).collect();
        let mut alike = rarest(far);
        for depth in DEPTHS {
            let visits = alike.len().saturating_mul(depth.min(polygons.len()));
            if alike.len() < 2 || visits > VISITS_A_POLYGON.saturating_mul(polygons.len()).saturating_add(FREE_VISITS) {
                break;
            }
            let told_apart = alike.iter().map(|&h| (self.walk(colours, h, depth), h)).collect();
            alike = rarest(told_apart);
        }
        alike
            .first()
            .copied()
            .unwrap_or_else(|| self.polygons.sides(polygons[0] as usize).next().unwrap_or(HalfedgeId::NONE))
    }

    /// All polygons of a component by the side by which each is reached, and a hash of what was met on the way.
    pub(super) fn whole(&mut self, colours: &Colours<'_>, start: HalfedgeId) -> (Vec<HalfedgeId>, u64) {
        let hash = self.walk(colours, start, usize::MAX);
        (self.queue.clone(), hash)
    }

    /// Visits at most `most` polygons breadth first, each side by side from the one by which it is reached.
    fn walk(&mut self, colours: &Colours<'_>, start: HalfedgeId, most: usize) -> u64 {
        if self.visit == u32::MAX {
            self.reached.fill((0, 0));
            self.visit = 0;
        }
        self.visit += 1;
        self.queue.clear();
        self.queue.push(start);
        self.reached[self.polygons.of(start)] = (self.visit, 0);
        let (mut hash, mut head) = (0, 0);
        while let Some(&entry) = self.queue.get(head).filter(|_| head < most) {
            head += 1;
            for h in self.polygons.around(entry) {
                hash = joined(hash, colours.of(h));
                let beyond = self.mesh.twin(h);
                if beyond.is_none() {
                    continue;
                }
                let reached = &mut self.reached[self.polygons.of(beyond)];
                if reached.0 != self.visit {
                    *reached = (self.visit, self.queue.len() as u32);
                    self.queue.push(beyond);
                }
                hash = joined(hash, u64::from(reached.1));
            }
        }
        hash
    }
}

/// Of sides with what they look like, those that look like the fewest others; if several groups are as small, those of
/// the lowest look. Ascending.
fn rarest(mut sides: Vec<(u64, HalfedgeId)>) -> Vec<HalfedgeId> {
    sides.sort_unstable();
    let groups = sides.chunk_by(|a, b| a.0 == b.0);
    let rarest = groups.min_by_key(|group| (group.len(), group[0].0)).unwrap_or_default();
    rarest.iter().map(|side| side.1).collect()
}
