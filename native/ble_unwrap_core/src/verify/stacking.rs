//! Charts that lie on each other on purpose.

use std::collections::BTreeMap;

use super::boundary::{Boundary, BoundaryEdge, Vertices};
use super::{Point, orientation};
use crate::metrics::UvMesh;

/// Which chart lies on which, by their places among the labels in ascending order.
pub(super) struct Stacking {
    /// The chart that each chart lies on: of its stack the first whose first triangle is positive, or just the first;
    /// its own place where it is that one or lies alone.
    base: Vec<usize>,
    /// Number of charts that share their place with others.
    stacked: usize,
    /// Whether the first triangle of each chart that lies in a stack is negative.
    is_turned: Vec<bool>,
}

impl Stacking {
    /// Of the charts of a layout, whose labels are given in ascending order. O(n log n).
    pub(super) fn of(mesh: &UvMesh, labels: &[i32]) -> Self {
        let stack = |label: i32| mesh.stack(label);
        let mut turn: Vec<Option<bool>> = vec![None; labels.len()];
        if labels.iter().any(|&label| stack(label).is_some()) {
            for f in 0..mesh.triangle_count() {
                let Some(uv) = mesh.corner_uv(f) else { continue };
                if uv.iter().flatten().all(|x| x.is_finite()) {
                    let chart = labels.partition_point(|&label| label < mesh.label(f));
                    turn[chart].get_or_insert_with(|| orientation(uv[0], uv[1], uv[2]) < 0);
                }
            }
        }
        Self::new(labels, stack, turn.into_iter().map(|turn| turn.unwrap_or(false)).collect())
    }

    /// `stack` gives the number that the labels of one stack share.
    fn new(labels: &[i32], stack: impl Fn(i32) -> Option<i32>, is_turned: Vec<bool>) -> Self {
        let mut of_stack: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
        for (chart, &label) in labels.iter().enumerate() {
            if let Some(stack) = stack(label) {
                of_stack.entry(stack).or_default().push(chart);
            }
        }
        let mut base: Vec<usize> = (0..labels.len()).collect();
        for charts in of_stack.values() {
            let first = charts.iter().find(|&&chart| !is_turned[chart]).unwrap_or(&charts[0]);
            charts.iter().for_each(|&chart| base[chart] = *first);
        }
        let stacked = of_stack.values().map(Vec::len).filter(|&count| count > 1).sum();
        Self { base, stacked, is_turned }
    }

    /// Number of charts that share their place with others.
    pub(super) fn stacked(&self) -> usize {
        self.stacked
    }

    /// The chart that another one lies on, if it does.
    pub(super) fn lies_on(&self, chart: usize) -> Option<usize> {
        Some(self.base[chart]).filter(|&base| base != chart)
    }

    /// Whether all triangles of a chart should be negative, because it lies on another and its first triangle is.
    pub(super) fn is_mirrored(&self, chart: usize) -> bool {
        self.lies_on(chart).is_some() && self.is_turned[chart]
    }

    /// The charts that lie on others and do not have the same boundary chain, ascending.
    pub(super) fn apart(&self, below: &Boundary, above: &Boundary) -> Vec<usize> {
        let chains = [below, above].map(|boundary| chains(boundary, self.base.len()));
        let is_apart = |&chart: &usize| {
            let Some(base) = self.lies_on(chart) else { return false };
            chains[0][base] != chains[1][chart]
        };
        (0..self.base.len()).filter(is_apart).collect()
    }
}

/// A directed edge, to the bit.
type Edge = [[u32; 2]; 2];

/// The edges of the boundary chain of each chart, in an order that depends on them alone.
fn chains(boundary: &Boundary, chart_count: usize) -> Vec<Vec<Edge>> {
    let mut chains: Vec<Vec<Edge>> = vec![Vec::new(); chart_count];
    for BoundaryEdge { ends, chart, .. } in &boundary.edges {
        chains[*chart as usize].push(ends.map(|p| p.map(f32::to_bits)));
    }
    chains.iter_mut().for_each(|chain| chain.sort_unstable());
    chains
}

/// Triangles with finite UVs, each with its number and its chart.
#[derive(Default)]
pub(super) struct Triangles {
    corners: Vec<[Point; 3]>,
    source: Vec<u32>,
    chart: Vec<u32>,
}

impl Triangles {
    /// Adds one, with its number and its chart.
    pub(super) fn push(&mut self, corners: [Point; 3], source: u32, chart: u32) {
        self.corners.push(corners);
        self.source.push(source);
        self.chart.push(chart);
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// The boundary chains of their charts.
    pub(super) fn boundary(&self, chart_count: usize) -> Boundary {
        let vertices = Vertices::new(&self.corners, &self.chart);
        Boundary::new(&vertices, &self.chart, &self.source, chart_count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_chart_of_each_stack_that_is_not_turned_is_its_base() {
        let labels = [2, 3, 5, 7, 9, 11];
        let stack = |label: i32| match label {
            3 | 9 => Some(4),
            5 | 7 | 11 => Some(0),
            _ => None,
        };
        let on = |turned: &[usize]| {
            let stacking = Stacking::new(&labels, stack, (0..6).map(|chart| turned.contains(&chart)).collect());
            assert_eq!(stacking.stacked(), 5);
            let mirrored: Vec<usize> = (0..6).filter(|&chart| stacking.is_mirrored(chart)).collect();
            ((0..6).map(|chart| stacking.lies_on(chart)).collect::<Vec<_>>(), mirrored)
        };
        assert_eq!(on(&[]), (vec![None, None, None, Some(2), Some(1), Some(2)], vec![]));
        assert_eq!(on(&[0, 2, 4]), (vec![None, None, Some(3), None, Some(1), Some(3)], vec![2, 4]));
        // Where all are, the first is at fault.
        assert_eq!(on(&[1, 4]), (vec![None, None, None, Some(2), Some(1), Some(2)], vec![4]));
        let alone = Stacking::new(&labels, |label| (label == 5).then_some(1), vec![false; 6]);
        assert_eq!(alone.stacked(), 0, "alone in its stack");
    }

    #[test]
    fn chains_are_the_same_or_not_whatever_triangles_are_inside() {
        let mut square = Triangles::default();
        let at = |x: f32, y: f32| [x, y];
        square.push([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], 0, 0);
        square.push([at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)], 1, 0);
        let mut other = Triangles::default();
        // Chart 1 by the other diagonal, chart 2 without one triangle, chart 3 with a corner elsewhere.
        other.push([at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)], 2, 1);
        other.push([at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)], 3, 1);
        other.push([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], 4, 2);
        other.push([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0f32.next_down())], 5, 3);
        other.push([at(0.0, 0.0), at(1.0, 1.0f32.next_down()), at(0.0, 1.0)], 6, 3);
        let stacking = Stacking::new(&[0, 1, 2, 3], |_| Some(0), vec![false; 4]);
        assert_eq!(stacking.apart(&square.boundary(4), &other.boundary(4)), [2, 3]);
    }
}
