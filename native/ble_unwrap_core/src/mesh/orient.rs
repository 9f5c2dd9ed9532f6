//! One winding for each component, and cuts where a surface has only one side.

use super::glue::Link;
use crate::collections::DisjointSets;

/// Which polygons to turn over, and the links that no choice of windings can satisfy.
#[derive(Clone, Debug, Default)]
pub(super) struct Orientation {
    /// Whether a polygon's winding is to be reversed.
    pub(super) reversed: Vec<bool>,
    /// Links that hold once the polygons are turned.
    pub(super) links: Vec<Link>,
    /// Links that contradict and must be cut.
    pub(super) contradicting: Vec<Link>,
}

/// Settles the winding of `polygon_count` polygons joined by `links`; `polygon(corner)` names the
/// polygon of a side, `area[p]` its area.
///
/// Polygons whose sides already run against each other are taken as one patch, so that a surface
/// with one side is cut where its windings disagree and nowhere else. The patches are then given a
/// parity breadth first. Most area of each component keeps its input winding; on a tie the lowest
/// polygon does. Links keep their order. O(n α(n)).
pub(super) fn orient(
    polygon_count: usize,
    links: Vec<Link>,
    polygon: impl Fn(u32) -> usize,
    area: &[f64],
) -> Orientation {
    let ends = |link: &Link| [polygon(link.sides[0]), polygon(link.sides[1])];
    let mut sets = DisjointSets::new(polygon_count);
    for link in links.iter().filter(|l| !l.same_direction) {
        let [a, b] = ends(link);
        sets.join(a, b);
    }
    let (patch, patch_count) = sets.labels();
    let disputes: Vec<[u32; 2]> =
        links.iter().filter(|l| l.same_direction).map(|l| ends(l).map(|p| patch[p])).filter(|[a, b]| a != b).collect();
    let (parity, component, component_count) = two_colour(patch_count, &disputes);

    let mut balance = vec![[0.0_f64; 2]; component_count];
    for p in 0..polygon_count {
        let patch = patch[p] as usize;
        balance[component[patch] as usize][usize::from(parity[patch])] += area[p];
    }
    // Rounding must not decide a tie.
    let invert: Vec<bool> = balance.iter().map(|[kept, turned]| *turned > kept * (1.0 + 1e-9)).collect();
    let reversed: Vec<bool> = (0..polygon_count)
        .map(|p| parity[patch[p] as usize] != invert[component[patch[p] as usize] as usize])
        .collect();
    let (links, contradicting) = links.into_iter().partition(|link| {
        let [a, b] = ends(link);
        (reversed[a] != reversed[b]) == link.same_direction
    });
    Orientation { reversed, links, contradicting }
}

/// Gives the two ends of every dispute different parity where possible, breadth first from the
/// lowest node of each component. Returns the parity and component of each node and the number of
/// components.
fn two_colour(node_count: usize, disputes: &[[u32; 2]]) -> (Vec<bool>, Vec<u32>, usize) {
    let mut offsets = vec![0usize; node_count + 1];
    for &node in disputes.iter().flatten() {
        offsets[node as usize + 1] += 1;
    }
    for i in 0..node_count {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets.clone();
    let mut neighbour = vec![0u32; 2 * disputes.len()];
    for &[a, b] in disputes {
        for (from, to) in [(a, b), (b, a)] {
            neighbour[next[from as usize]] = to;
            next[from as usize] += 1;
        }
    }
    let mut parity = vec![false; node_count];
    let mut component = vec![u32::MAX; node_count];
    let mut count = 0;
    let mut queue = Vec::new();
    for seed in 0..node_count {
        if component[seed] != u32::MAX {
            continue;
        }
        component[seed] = count;
        queue.clear();
        queue.push(seed);
        let mut head = 0;
        while let Some(&node) = queue.get(head) {
            head += 1;
            for &other in &neighbour[offsets[node]..offsets[node + 1]] {
                let other = other as usize;
                if component[other] == u32::MAX {
                    component[other] = count;
                    parity[other] = !parity[node];
                    queue.push(other);
                }
            }
        }
        count += 1;
    }
    (parity, component, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(a: u32, b: u32, same_direction: bool) -> Link {
        Link { sides: [a, b], same_direction }
    }

    /// One side a polygon: side number and polygon number are the same.
    fn orient_nodes(count: usize, links: Vec<Link>, area: &[f64]) -> Orientation {
        orient(count, links, |side| side as usize, area)
    }

    #[test]
    fn the_smaller_area_is_turned() {
        let links = vec![link(0, 1, true), link(1, 2, false)];
        let o = orient_nodes(3, links.clone(), &[1.0, 0.2, 0.2]);
        assert_eq!(o.reversed, [false, true, true]);
        let o = orient_nodes(3, links.clone(), &[1.0, 0.8, 0.8]);
        assert_eq!(o.reversed, [true, false, false]);
        let o = orient_nodes(3, links, &[1.0, 0.5, 0.5]);
        assert_eq!(o.reversed, [false, true, true], "on a tie the lowest keeps its winding");
        assert!(o.contradicting.is_empty() && o.links.len() == 2);
    }

    #[test]
    fn a_one_sided_band_is_cut_where_its_windings_disagree() {
        // A ring of six that agrees everywhere but between 5 and 0.
        let mut links: Vec<Link> = (0..5).map(|i| link(i, i + 1, false)).collect();
        links.push(link(5, 0, true));
        let o = orient_nodes(6, links, &[1.0; 6]);
        assert_eq!(o.contradicting, [link(5, 0, true)]);
        assert_eq!(o.reversed, [false; 6]);
    }

    #[test]
    fn an_odd_ring_of_disputes_loses_one_link() {
        let links = vec![link(0, 1, true), link(1, 2, true), link(2, 0, true)];
        let o = orient_nodes(3, links, &[1.0; 3]);
        assert_eq!((o.links.len(), o.contradicting.len()), (2, 1));
    }
}
