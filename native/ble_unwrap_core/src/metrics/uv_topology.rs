//! Charts, islands, seams and boundary edges of a layout, from nothing but vertices and UVs.

use std::cmp::Ordering;

use nalgebra::Point3;

use super::uv_mesh::UvMesh;

/// Stands for "none" in arrays of u32.
pub(crate) const NONE: u32 = u32::MAX;

/// What belongs together in a layout.
///
/// Corners at the same mesh vertex with the same float32 UV are one UV vertex, unless they are of different charts that
/// lie in a stack. Two triangles are in one *chart* if they share a mesh edge with the same UV vertices at both ends;
/// charts that share a UV vertex are one *island*.
pub(crate) struct UvTopology {
    /// Chart of each triangle, numbered by lowest triangle; [`NONE`] where it has no finite UV.
    pub(crate) chart: Vec<u32>,
    pub(crate) chart_count: usize,
    /// Whether a triangle winds against the lowest triangle of its chart in the input.
    pub(crate) against: Vec<bool>,
    /// Island of each triangle, numbered likewise.
    pub(crate) island: Vec<u32>,
    pub(crate) island_count: usize,
    /// Half-edges `3·triangle + slot` with a UV that no other triangle of the chart shares.
    pub(crate) boundary: Vec<u32>,
    /// Length on the surface of the mesh edges whose triangles are not joined in the layout. Edges
    /// with one triangle only are no seams.
    pub(crate) seam_length: f64,
    /// Number of triangles whose UV is not finite.
    pub(crate) nonfinite: usize,
}

impl UvTopology {
    /// `positions` may be scaled; seam lengths are in their unit. O(n log n).
    pub(crate) fn new(mesh: &UvMesh, positions: &[Point3<f64>]) -> Self {
        let m = mesh.triangle_count();
        let (uv_vertex, uv_vertex_count, nonfinite) = weld(mesh);
        let mapped = |f: usize| uv_vertex[f][0] != NONE;
        let mut sets = ParitySets::new(m);
        let mut is_boundary: Vec<bool> = (0..3 * m).map(|h| mapped(h / 3)).collect();
        let mut seam_length = 0.0;
        let triangles = mesh.triangles();
        let ends = |h: usize| (triangles[h / 3][h % 3], triangles[h / 3][(h % 3 + 1) % 3]);
        let uv_ends = |h: u32| {
            let h = h as usize;
            let (a, b) = (uv_vertex[h / 3][h % 3], uv_vertex[h / 3][(h % 3 + 1) % 3]);
            // An edge from a vertex to itself, as a face has it that uses a vertex twice, has a direction in the layout only.
            let forward = match ends(h).0.cmp(&ends(h).1) {
                Ordering::Equal => a < b,
                order => order == Ordering::Less,
            };
            if forward { (a, b, forward) } else { (b, a, forward) }
        };
        let mut sorted = Vec::new();
        for_each_edge(
            positions.len(),
            3 * m,
            |h| Some(ends(h)),
            |group| {
                if let [a, b] = *group {
                    let (fa, fb) = (a as usize / 3, b as usize / 3);
                    let (ua, ub) = (uv_ends(a), uv_ends(b));
                    if mapped(fa) && mapped(fb) && (ua.0, ua.1) == (ub.0, ub.1) {
                        is_boundary[a as usize] = false;
                        is_boundary[b as usize] = false;
                        sets.join(fa, fb, ua.2 == ub.2);
                    } else if mapped(fa) || mapped(fb) {
                        seam_length += edge_length(positions, ends(a as usize));
                    }
                } else if group.len() > 2 {
                    // More than two triangles on an edge: no telling which winding is right, so trust it.
                    sorted.clear();
                    sorted.extend(
                        group.iter().filter(|&&h| mapped(h as usize / 3)).map(|&h| (uv_ends(h).0, uv_ends(h).1, h)),
                    );
                    sorted.sort_unstable();
                    let mut classes = usize::from(sorted.len() < group.len());
                    for class in sorted.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
                        classes += 1;
                        for pair in class.windows(2) {
                            is_boundary[pair[0].2 as usize] = false;
                            is_boundary[pair[1].2 as usize] = false;
                            sets.join(pair[0].2 as usize / 3, pair[1].2 as usize / 3, false);
                        }
                    }
                    if classes > 1 && !sorted.is_empty() {
                        seam_length += edge_length(positions, ends(group[0] as usize));
                    }
                }
            },
        );
        let mut chart = vec![NONE; m];
        let mut against = vec![false; m];
        let chart_count = number(m, mapped, |f| sets.find(f).0, &mut chart);
        for f in 0..m {
            against[f] = sets.find(f).1;
        }
        let mut by_vertex = ParitySets::new(uv_vertex_count);
        for t in uv_vertex.iter().filter(|t| t[0] != NONE) {
            by_vertex.join(t[0] as usize, t[1] as usize, false);
            by_vertex.join(t[0] as usize, t[2] as usize, false);
        }
        let mut island = vec![NONE; m];
        let island_count = number(m, mapped, |f| by_vertex.find(uv_vertex[f][0] as usize).0, &mut island);
        let boundary = (0..3 * m as u32).filter(|&h| is_boundary[h as usize]).collect();
        Self { chart, chart_count, against, island, island_count, boundary, seam_length, nonfinite }
    }
}

/// Length of an edge; 0 where an end is not finite.
fn edge_length(positions: &[Point3<f64>], (a, b): (u32, u32)) -> f64 {
    let d = (positions[a as usize] - positions[b as usize]).norm();
    if d.is_finite() { d } else { 0.0 }
}

/// Numbers the sets of the mapped triangles by lowest triangle and returns how many there are.
fn number(m: usize, mapped: impl Fn(usize) -> bool, mut root: impl FnMut(usize) -> usize, out: &mut [u32]) -> usize {
    let mut name = std::collections::HashMap::new();
    for f in (0..m).filter(|&f| mapped(f)) {
        let next = name.len() as u32;
        out[f] = *name.entry(root(f)).or_insert(next);
    }
    name.len()
}

/// UV vertices of each triangle, their number, and the number of triangles with non-finite UVs.
fn weld(mesh: &UvMesh) -> (Vec<[u32; 3]>, usize, usize) {
    let m = mesh.triangle_count();
    let mut uv_vertex = vec![[NONE; 3]; m];
    let mut nonfinite = 0;
    let mut mapped = vec![false; m];
    let mut start = vec![0u32; mesh.positions().len() + 1];
    for f in 0..m {
        let Some(uv) = mesh.corner_uv(f) else { continue };
        if uv.iter().flatten().all(|x| x.is_finite()) {
            mapped[f] = true;
            for &v in &mesh.triangles()[f] {
                start[v as usize + 1] += 1;
            }
        } else {
            nonfinite += 1;
        }
    }
    for v in 1..start.len() {
        start[v] += start[v - 1];
    }
    let mut entries = vec![(0u64, 0u32, 0u32); start.last().copied().unwrap_or(0) as usize];
    let mut next = start.clone();
    for f in (0..m).filter(|&f| mapped[f]) {
        let Some(uv) = mesh.corner_uv(f) else { continue };
        // A chart and its mirror image that lie on each other meet in UV, too, where they meet on the surface.
        let label = mesh.label(f);
        let stacked = if mesh.stack(label).is_some() { label.unsigned_abs() + 1 } else { 0 };
        for k in 0..3 {
            let slot = &mut next[mesh.triangles()[f][k] as usize];
            let bits = u64::from(uv[k][0].to_bits()) << 32 | u64::from(uv[k][1].to_bits());
            entries[*slot as usize] = (bits, stacked, (3 * f + k) as u32);
            *slot += 1;
        }
    }
    let mut count = 0;
    for bucket in start.windows(2) {
        let bucket = &mut entries[bucket[0] as usize..bucket[1] as usize];
        bucket.sort_unstable();
        for same in bucket.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            for &(.., c) in same {
                uv_vertex[c as usize / 3][c as usize % 3] = count;
            }
            count += 1;
        }
    }
    (uv_vertex, count as usize, nonfinite)
}

/// Calls `visit` once for each edge, with the half-edges on it in ascending order; edges in the
/// order of their lower, then their higher vertex. `ends` gives the vertices of half-edges below
/// `count`, or none to leave one out. O(n log n) at worst, O(n) for bounded degree.
pub(crate) fn for_each_edge(
    vertex_count: usize,
    count: usize,
    ends: impl Fn(usize) -> Option<(u32, u32)>,
    mut visit: impl FnMut(&[u32]),
) {
    let mut start = vec![0u32; vertex_count + 1];
    for h in 0..count {
        if let Some((a, b)) = ends(h) {
            start[a.min(b) as usize + 1] += 1;
        }
    }
    for v in 1..start.len() {
        start[v] += start[v - 1];
    }
    let mut entries = vec![(0u32, 0u32); start.last().copied().unwrap_or(0) as usize];
    let mut next = start.clone();
    for h in 0..count {
        if let Some((a, b)) = ends(h) {
            let slot = &mut next[a.min(b) as usize];
            entries[*slot as usize] = (a.max(b), h as u32);
            *slot += 1;
        }
    }
    let mut group = Vec::new();
    for bucket in start.windows(2) {
        let bucket = &mut entries[bucket[0] as usize..bucket[1] as usize];
        bucket.sort_unstable();
        for same in bucket.chunk_by(|a, b| a.0 == b.0) {
            group.clear();
            group.extend(same.iter().map(|e| e.1));
            visit(&group);
        }
    }
}

/// Disjoint sets whose elements also know whether they are turned against the set's root.
struct ParitySets {
    parent: Vec<u32>,
    turned: Vec<bool>,
}

impl ParitySets {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect(), turned: vec![false; n] }
    }

    /// The root of `x`, and whether `x` is turned against it.
    fn find(&mut self, x: usize) -> (usize, bool) {
        let (mut root, mut parity) = (x, false);
        while self.parent[root] as usize != root {
            parity ^= self.turned[root];
            root = self.parent[root] as usize;
        }
        let (mut node, mut rest) = (x, parity);
        while node != root {
            let (up, turned) = (self.parent[node] as usize, self.turned[node]);
            self.parent[node] = root as u32;
            self.turned[node] = rest;
            rest ^= turned;
            node = up;
        }
        (root, parity)
    }

    /// Joins the sets of `a` and `b`, which are turned against each other if `turned`. The lower root
    /// stays, so roots are lowest elements. A contradiction inside one set is ignored.
    fn join(&mut self, a: usize, b: usize, turned: bool) {
        let ((ra, pa), (rb, pb)) = (self.find(a), self.find(b));
        if ra != rb {
            let (keep, drop) = (ra.min(rb), ra.max(rb));
            self.parent[drop] = keep as u32;
            self.turned[drop] = pa ^ pb ^ turned;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Texture;

    fn topology(triangles: &[[u32; 3]], uv: &[[f32; 2]], corners: &[[u32; 3]]) -> UvTopology {
        let n = triangles.iter().flatten().max().map_or(0, |&v| v as usize + 1);
        let positions: Vec<_> = (0..n).map(|i| Point3::new(i as f64, (i * i) as f64, 0.0)).collect();
        let mesh = UvMesh::new(&positions, triangles, uv, corners, &[], Texture::square(64, 0.0)).expect("valid");
        UvTopology::new(&mesh, &positions)
    }

    #[test]
    fn corners_weld_by_vertex_and_uv() {
        // Two triangles over the edge 1-2, each with its own corners; −0 is 0.
        let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -0.0], [-0.0, 1.0]];
        let t = topology(&[[0, 1, 2], [3, 2, 1]], &uv, &[[0, 1, 2], [3, 5, 4]]);
        assert_eq!((t.chart_count, t.island_count, t.boundary.len()), (1, 1, 4));
        assert_eq!(t.seam_length, 0.0);
        assert_eq!(t.against, [false, false]);
    }

    #[test]
    fn a_shared_vertex_makes_an_island_not_a_chart() {
        let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 1.0], [2.0, 0.5]];
        // The second triangle keeps vertex 1 at its UV and has vertex 2 elsewhere.
        let t = topology(&[[0, 1, 2], [3, 2, 1]], &uv, &[[0, 1, 2], [3, 4, 1]]);
        assert_eq!((t.chart_count, t.island_count), (2, 1));
        assert!((t.seam_length - 10f64.sqrt()).abs() < 1e-15);
        assert_eq!(t.boundary.len(), 6);
    }

    #[test]
    fn a_triangle_is_joined_over_an_edge_from_a_vertex_to_itself() {
        // A pentagon 0 1 2 0 3, fanned from its first corner: its second diagonal leads from vertex 0 to vertex 0.
        let uv = [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [1.0, 2.0], [0.0, 1.0]];
        let corners = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
        let t = topology(&[[0, 1, 2], [0, 2, 0], [0, 0, 3]], &uv, &corners);
        assert_eq!((t.chart_count, t.boundary.len()), (1, 5));
        assert_eq!(t.against, [false; 3]);
    }

    #[test]
    fn winding_against_the_chart_is_noticed() {
        let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]];
        // The second triangle runs along 1-2 as the first does, the third agrees with the second.
        let triangles = [[0, 1, 2], [1, 2, 3], [1, 3, 4]];
        let t = topology(&triangles, &uv, &triangles);
        assert_eq!(t.chart_count, 1);
        assert_eq!(t.against, [false, true, true]);
    }

    #[test]
    fn a_fan_of_many_triangles_on_one_edge_is_cheap_and_joined() {
        let n = 20_000u32;
        let triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, 1, i + 2]).collect();
        let uv: Vec<[f32; 2]> = (0..n + 2).map(|i| [i as f32, (i % 7) as f32]).collect();
        let t = topology(&triangles, &uv, &triangles);
        assert_eq!((t.chart_count, t.seam_length), (1, 0.0));
        assert_eq!(t.boundary.len(), 2 * n as usize);
    }

    #[test]
    fn nonfinite_uvs_are_left_out() {
        let uv = [[0.0, 0.0], [1.0, 0.0], [f32::NAN, 1.0], [1.0, 1.0]];
        let t = topology(&[[0, 1, 2], [0, 1, 3]], &uv, &[[0, 1, 2], [0, 1, 3]]);
        assert_eq!((t.nonfinite, t.chart_count), (1, 1));
        assert_eq!(t.chart, [NONE, 0]);
        assert!(t.seam_length > 0.0, "an edge between a mapped and an unmapped triangle is a seam");
    }
}
