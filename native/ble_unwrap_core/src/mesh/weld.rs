//! Vertices at one place as one.

use std::collections::{HashMap, HashSet};

use nalgebra::Point3;
use rayon::slice::ParallelSliceMut;

use super::frame::Frame;
use super::groups::Groups;
use super::input::Polygons;
use crate::progress::{Cancelled, Progress};

/// What single precision cannot tell apart, in its steps (2⁻²³) of the size: a coordinate that went through an object's
/// matrix is a sum of three products and an offset, each rounded by half a step, so two copies of it that came by
/// different ways differ by up to four steps.
const UNRESOLVED: f64 = 4.0 * f32::EPSILON as f64;

/// Binary digits that double precision has more than single precision.
const MORE_DIGITS: u32 = f64::MANTISSA_DIGITS - f32::MANTISSA_DIGITS;

/// The distance found for a mesh is at most this share of its mean side: far from the origin the steps of single
/// precision become as long as the sides, and vertices that a polygon tells apart are not the same.
const MOST_OF_A_SIDE: f64 = 1e-2;

/// Leaders that a vertex tries to join, nearest first. More of them within the distance refuse it only in polygons that
/// fold many corners into it.
const MOST_TRIED: usize = 32;

/// Leaders that are looked at for one vertex. Those of different polygons are a distance apart, so that no more than some
/// 1,600 fit into its neighbourhood; only a polygon of very many corners within it has more.
const MOST_LOOKED_AT: usize = 2048;

/// Cells of the grid are so many distances wide: the neighbourhood of most vertices then lies in one cell.
const CELL: f64 = 4.0;

/// The vertices of an input that polygons use.
pub(super) struct Places<'a> {
    pub(super) polygons: &'a Polygons<'a>,
    /// Which polygons take part.
    pub(super) mapped: &'a [bool],
    /// As in the input.
    pub(super) positions: &'a [[f64; 3]],
    /// Which vertices take part.
    pub(super) used: &'a [bool],
    /// The positions in `frame`.
    pub(super) points: &'a [Point3<f64>],
    pub(super) frame: &'a Frame,
}

/// The vertex that stands for each vertex: the lowest of those welded with it, itself where it is alone.
///
/// Vertices at exactly the same position (−0 is 0) are always one. Others are one within `distance` of the input's unit;
/// if `None`, within what single precision cannot tell apart: four steps of the diagonal of the bounding box or, if all
/// coordinates are numbers of single precision, of the greatest of them where that is larger; at most a hundredth of the
/// mean side.
///
/// Vertices are taken in the order of their coordinates and join the nearest leader within the distance, or become one:
/// so a group lies within the distance around its leader, chains of near vertices are broken up, and the numbering of the
/// vertices does not matter (which way the mesh lies may). Two vertices of one polygon are never welded unless they are
/// at the same position, nor is a vertex with a group in which there is one of its own polygons: no polygon loses a
/// side by it. Vertices that are not used stand for themselves.
///
/// O(n log n); deterministic.
///
/// # Errors
/// [`Cancelled`].
pub(super) fn weld(places: &Places<'_>, distance: Option<f64>, progress: &Progress) -> Result<Vec<u32>, Cancelled> {
    let site_of = coincident(places.positions, places.used);
    progress.check()?;
    let reach = distance.map_or_else(|| unresolved(places), |d| d / places.frame.half_extent);
    // Below, no two different points are so near.
    if reach > f64::EPSILON { Near::new(places, &site_of, reach).joined(progress) } else { Ok(site_of) }
}

/// The lowest vertex at the same position as each vertex, itself where it is alone; equal when every coordinate is.
fn coincident(positions: &[[f64; 3]], used: &[bool]) -> Vec<u32> {
    // Adding 0 turns −0 into 0; equal numbers then have equal bits.
    let mut keyed: Vec<([u64; 3], u32)> = (0..positions.len())
        .filter(|&v| used[v])
        .map(|v| (positions[v].map(|x| (x + 0.0).to_bits()), v as u32))
        .collect();
    keyed.par_sort_unstable();
    let mut representative: Vec<u32> = (0..positions.len() as u32).collect();
    for group in keyed.chunk_by(|a, b| a.0 == b.0) {
        for &(_, v) in &group[1..] {
            representative[v as usize] = group[0].1;
        }
    }
    representative
}

/// The distance, in the frame's unit, that single precision cannot tell from none.
fn unresolved(places: &Places<'_>) -> f64 {
    let (mut length, mut sides) = (0.0, 0usize);
    for corner in (0..places.polygons.corner_count()).filter(|&c| places.mapped[places.polygons.polygon(c)]) {
        let [a, b] = places.polygons.side(corner);
        length += (places.points[b] - places.points[a]).norm();
        sides += 1;
    }
    // Coordinates with more digits are exact to them far from the origin, too.
    let is_single = |x: &f64| x.to_bits() << (64 - MORE_DIGITS) == 0;
    let mut used = places.positions.iter().zip(places.used).filter(|(_, used)| **used);
    let size = if used.all(|(p, _)| p.iter().all(is_single)) {
        places.frame.diagonal.max(places.frame.largest)
    } else {
        places.frame.diagonal
    };
    (UNRESOLVED * size).min(MOST_OF_A_SIDE * length / sides.max(1) as f64)
}

/// The joining of vertices that are near each other. A *site* is a position: vertices that coincide, named by the lowest.
struct Near<'a> {
    places: &'a Places<'a>,
    reach: f64,
    /// In the order of their coordinates.
    sites: Vec<u32>,
    /// The site of each vertex.
    site_of: &'a [u32],
    /// The polygons at each site; made when first needed.
    polygons_at: Option<Groups<u32>>,
    /// Pairs of a group and a polygon at one of its sites, for groups of several sites.
    polygons_of: HashSet<(u32, u32)>,
}

/// A group of sites around the first of them.
struct Group {
    leader: u32,
    /// The lowest of its sites, which stands for all.
    lowest: u32,
    is_alone: bool,
    /// The group before it in its cell of the grid, `u32::MAX` at the end.
    before: u32,
}

impl<'a> Near<'a> {
    fn new(places: &'a Places<'a>, site_of: &'a [u32], reach: f64) -> Self {
        let is_site = |v: &u32| places.used[*v as usize] && site_of[*v as usize] == *v;
        let mut sites: Vec<u32> = (0..site_of.len() as u32).filter(is_site).collect();
        let key = |v: u32| places.points[v as usize];
        let order = |a: &u32, b: &u32| {
            let (p, q) = (key(*a), key(*b));
            p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)).then(a.cmp(b))
        };
        sites.par_sort_unstable_by(order);
        Self { places, reach, sites, site_of, polygons_at: None, polygons_of: HashSet::new() }
    }

    /// The representative of each vertex when sites that are near are joined.
    fn joined(mut self, progress: &Progress) -> Result<Vec<u32>, Cancelled> {
        let mut groups: Vec<Group> = Vec::with_capacity(self.sites.len());
        let mut group_of = vec![u32::MAX; self.site_of.len()];
        let mut grid: HashMap<[i64; 3], u32> = HashMap::with_capacity(self.sites.len());
        let mut near = Vec::new();
        for i in 0..self.sites.len() {
            if i.is_multiple_of(1 << 14) {
                progress.check()?;
            }
            let site = self.sites[i];
            self.leaders_near(site, &groups, &grid, &mut near);
            let joined = near.iter().map(|n| n.1).find(|&g| self.takes(g, &mut groups[g as usize], site));
            group_of[site as usize] = joined.unwrap_or_else(|| {
                let number = groups.len() as u32;
                let before = grid.insert(self.cell(&self.places.points[site as usize]), number).unwrap_or(u32::MAX);
                groups.push(Group { leader: site, lowest: site, is_alone: true, before });
                number
            });
        }
        let lowest = |v: u32| groups.get(group_of[v as usize] as usize).map_or(v, |group| group.lowest);
        Ok(self.site_of.iter().map(|&site| lowest(site)).collect())
    }

    fn cell(&self, p: &Point3<f64>) -> [i64; 3] {
        [p.x, p.y, p.z].map(|x| (x / (CELL * self.reach)).floor() as i64)
    }

    /// The nearest groups whose leader is within reach of a site, nearest first, at equal distance the older one.
    fn leaders_near(&self, site: u32, groups: &[Group], grid: &HashMap<[i64; 3], u32>, near: &mut Vec<(u64, u32)>) {
        let p = self.places.points[site as usize];
        let (low, high) = (self.cell(&p.map(|x| x - self.reach)), self.cell(&p.map(|x| x + self.reach)));
        let mut looked_at = 0;
        near.clear();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let mut next = grid.get(&[x, y, z]).copied().unwrap_or(u32::MAX);
                    while let Some(group) = groups.get(next as usize).filter(|_| looked_at < MOST_LOOKED_AT) {
                        looked_at += 1;
                        let distance = (self.places.points[group.leader as usize] - p).norm();
                        if distance <= self.reach {
                            near.push((distance.to_bits(), next));
                        }
                        next = group.before;
                    }
                }
            }
        }
        // The bits of numbers that are not negative are in their order.
        if near.len() > MOST_TRIED {
            near.select_nth_unstable(MOST_TRIED);
            near.truncate(MOST_TRIED);
        }
        near.sort_unstable();
    }

    /// Adds a site to a group, unless they have a polygon in common; whether it did.
    fn takes(&mut self, number: u32, group: &mut Group, site: u32) -> bool {
        let (places, site_of) = (self.places, self.site_of);
        let polygons_at = self.polygons_at.get_or_insert_with(|| {
            let polygons = places.polygons;
            let site =
                |c: usize| if places.mapped[polygons.polygon(c)] { site_of[polygons.vertex(c)] } else { u32::MAX };
            let label: Vec<u32> = (0..polygons.corner_count()).map(site).collect();
            Groups::by_label(&label, site_of.len(), |c| polygons.polygon(c) as u32)
        });
        if std::mem::take(&mut group.is_alone) {
            self.polygons_of.extend(polygons_at.group(group.leader as usize).iter().map(|&p| (number, p)));
        }
        let more = polygons_at.group(site as usize);
        if more.iter().any(|&p| self.polygons_of.contains(&(number, p))) {
            return false;
        }
        self.polygons_of.extend(more.iter().map(|&p| (number, p)));
        group.lowest = group.lowest.min(site);
        true
    }
}

#[cfg(test)]
#[path = "weld/tests.rs"]
mod tests;
