//! Connected parts, no fragments.

use super::polygon_graph::PolygonGraph;

/// Parts of fewer triangles than this are fragments: too few to carry a chart an artist would keep.
const LEAST_FACES: usize = 8;
/// Parts of less area than this share of the patch are fragments.
const LEAST_AREA: f64 = 5e-4;
/// Fragments that touch only fragments wait for the next round; a chain longer than this stays.
const MOST_ROUNDS: usize = 16;

/// Makes labels connected and gives fragments to the neighbour they share the longest border with.
/// Keeps at least two parts if there were two: the two largest never count as fragments.
/// O(n log n) a round.
pub(super) fn absorb_fragments(graph: &PolygonGraph, label: &mut [u32]) {
    let total: f64 = graph.area.iter().sum();
    let faces: usize = graph.faces.iter().map(<[_]>::len).sum();
    // A small patch has no eight faces to spare a part.
    let least_faces = LEAST_FACES.min(faces / 8);
    for _ in 0..MOST_ROUNDS {
        let count = graph.split_components(label);
        let mut size = vec![(0.0f64, 0usize); count];
        for (p, &l) in label.iter().enumerate() {
            size[l as usize].0 += graph.area[p];
            size[l as usize].1 += graph.faces.group(p).len();
        }
        let mut by_size: Vec<usize> = (0..count).collect();
        by_size.sort_by(|&a, &b| size[b].0.total_cmp(&size[a].0).then(size[b].1.cmp(&size[a].1)).then(a.cmp(&b)));
        let mut is_fragment = vec![false; count];
        for &c in by_size.iter().skip(2) {
            is_fragment[c] = size[c].1 < least_faces || size[c].0 < LEAST_AREA * total;
        }
        let mut borders: Vec<(u32, u32, f64)> = Vec::new();
        for (p, &l) in label.iter().enumerate().filter(|&(_, &l)| is_fragment[l as usize]) {
            for link in graph.links.group(p) {
                let beyond = label[link.to as usize];
                if beyond != l && !is_fragment[beyond as usize] {
                    borders.push((l, beyond, link.length));
                }
            }
        }
        if borders.is_empty() {
            return;
        }
        borders.sort_by_key(|b| (b.0, b.1));
        let mut best = vec![(f64::NEG_INFINITY, u32::MAX); count];
        for border in borders.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let length: f64 = border.iter().map(|b| b.2).sum();
            let entry = &mut best[border[0].0 as usize];
            if length > entry.0 {
                *entry = (length, border[0].1);
            }
        }
        for l in label.iter_mut() {
            if best[*l as usize].1 != u32::MAX {
                *l = best[*l as usize].1;
            }
        }
    }
}
