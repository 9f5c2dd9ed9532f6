//! Regions between guides.

use std::collections::VecDeque;

use crate::mesh::TriMesh;

use super::polygon_graph::PolygonGraph;

/// Regions are taken whole only if every part keeps this share of the area: a part of crumbs is no split.
const LEAST_SHARE: f64 = 0.1;

/// Where guides divide the surface into regions, gives each region the label of most of its area, so that the borders
/// between labels run along guides. Where that would leave a label with next to nothing, but guides divide the surface
/// into some large regions, those become the parts; returns whether that was so. Else changes nothing. O(n).
pub(super) fn snap(mesh: &TriMesh, graph: &PolygonGraph, label: &mut Vec<u32>) -> bool {
    if !mesh.has_guides() {
        return false;
    }
    let (region, regions) = regions(mesh, graph);
    let labels = label.iter().max().map_or(0, |most| *most as usize + 1);
    let mut share = vec![0.0; labels * regions];
    for (p, area) in graph.area.iter().enumerate() {
        share[region[p] as usize * labels + label[p] as usize] += area;
    }
    let mut kept = vec![0.0; labels];
    let (mut most_of, mut size) = (Vec::with_capacity(regions), Vec::with_capacity(regions));
    for shares in share.chunks_exact(labels.max(1)) {
        let most = (0..labels).fold(0, |best, l| if shares[l] > shares[best] { l } else { best });
        let area: f64 = shares.iter().sum();
        kept[most] += area;
        most_of.push(most as u32);
        size.push(area);
    }
    let least = LEAST_SHARE * graph.area.iter().sum::<f64>();
    if kept.iter().all(|area| *area >= least) {
        label.iter_mut().zip(&region).for_each(|(l, r)| *l = most_of[*r as usize]);
        return false;
    }
    let large: Vec<bool> = size.iter().map(|area| *area >= least).collect();
    if large.iter().filter(|large| **large).count() < 2 {
        return false;
    }
    *label = grown(graph, &region, &large);
    true
}

/// The large region that each polygon is in or, of those in small ones, reached from first.
fn grown(graph: &PolygonGraph, region: &[u32], large: &[bool]) -> Vec<u32> {
    let mut label = vec![u32::MAX; graph.len()];
    let mut queue: VecDeque<usize> = (0..graph.len()).filter(|&p| large[region[p] as usize]).collect();
    queue.iter().for_each(|&p| label[p] = region[p]);
    while let Some(p) = queue.pop_front() {
        for link in graph.links.group(p) {
            let q = link.to as usize;
            if label[q] == u32::MAX {
                label[q] = label[p];
                queue.push_back(q);
            }
        }
    }
    label
}

/// The region of each polygon, numbered by first polygon, and how many there are.
fn regions(mesh: &TriMesh, graph: &PolygonGraph) -> (Vec<u32>, usize) {
    let mut region = vec![u32::MAX; graph.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    for seed in 0..graph.len() {
        if region[seed] != u32::MAX {
            continue;
        }
        region[seed] = count;
        stack.push(seed);
        while let Some(p) = stack.pop() {
            for link in graph.links.group(p).iter().filter(|link| !mesh.is_guide(link.halfedge)) {
                if region[link.to as usize] == u32::MAX {
                    region[link.to as usize] = count;
                    stack.push(link.to as usize);
                }
            }
        }
        count += 1;
    }
    (region, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{HalfedgeId, test_surfaces};

    #[test]
    fn regions_between_guides_go_to_one_label_as_a_whole() {
        let mesh = test_surfaces::grid(10, 10, [1.0, 1.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let graph = PolygonGraph::new(&mesh, &polygon);
        let guided = |at: &[f64]| {
            let on = |h: HalfedgeId, x: f64| {
                [mesh.from(h), mesh.to(h)].iter().all(|v| (mesh.position(*v).x - x).abs() < 1e-9)
            };
            let marks = mesh.halfedges().map(|h| at.iter().any(|&x| on(h, x))).collect();
            mesh.clone().with_guides(marks)
        };
        let halves: Vec<u32> = (0..100).map(|p| u32::from(p % 10 >= 5)).collect();
        let snapped = |at: &[f64]| {
            let mut label = halves.clone();
            snap(&guided(at), &graph, &mut label);
            label
        };
        assert_eq!(snapped(&[0.3]), (0..100).map(|p| u32::from(p % 10 >= 3)).collect::<Vec<_>>());
        assert_eq!(snapped(&[0.2, 0.7]), (0..100).map(|p| u32::from(p % 10 >= 7)).collect::<Vec<_>>());
        // All of it would go to one label: the regions are the parts then.
        let mut label: Vec<u32> = (0..100).map(|p| u32::from(p % 10 == 9)).collect();
        assert!(snap(&guided(&[0.4]), &graph, &mut label));
        assert_eq!(label, (0..100).map(|p| u32::from(p % 10 >= 4)).collect::<Vec<_>>());
        assert_eq!(snapped(&[]), halves, "no guides");
        assert_eq!(snapped(&[0.0]), halves, "guides that divide nothing");
    }
}
