//! Exact nearest neighbours of points in any number of dimensions.

/// Points in a leaf: few enough that scanning them costs no more than the branches it saves.
const LEAF: usize = 12;

/// A k-d tree (J. L. Bentley, 1975): the points sorted so that each node is a contiguous range,
/// halved at the median along its widest axis.
///
/// Every search is exact in any dimension; above ten dimensions or so it looks at most points.
#[derive(Debug)]
pub(super) struct KdTree<'p> {
    points: &'p [f64],
    dimension: usize,
    order: Vec<u32>,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    begin: u32,
    end: u32,
    axis: u32,
    /// Points of the first child have at most this coordinate along the axis, of the second at least.
    split: f64,
    /// Index of the second child, the first follows its parent; 0 for a leaf.
    second: u32,
}

impl<'p> KdTree<'p> {
    /// Sorts points (row-major, `dimension` coordinates each) into a tree. Points with a coordinate
    /// that is not finite are left out. O(n log n).
    pub(super) fn new(points: &'p [f64], dimension: usize) -> Self {
        let count = points.len().checked_div(dimension).unwrap_or(0);
        let order = (0..count as u32)
            .filter(|&i| points[i as usize * dimension..][..dimension].iter().all(|x| x.is_finite()))
            .collect();
        let mut tree = Self { points, dimension, order, nodes: Vec::new() };
        tree.build();
        tree
    }

    fn coordinate(&self, point: u32, axis: usize) -> f64 {
        self.points[point as usize * self.dimension + axis]
    }

    fn build(&mut self) {
        // A pending range and, if it is a second child, its parent. The first child is built next.
        let mut pending = vec![(0usize, self.order.len(), None)];
        while let Some((begin, end, parent)) = pending.pop() {
            if let Some(parent) = parent {
                let here = self.nodes.len() as u32;
                let node: &mut Node = &mut self.nodes[parent];
                node.second = here;
            }
            let index = self.nodes.len();
            self.nodes.push(Node { begin: begin as u32, end: end as u32, axis: 0, split: 0.0, second: 0 });
            if end - begin <= LEAF {
                continue;
            }
            let (axis, width) = self.widest_axis(begin, end);
            if width <= 0.0 {
                continue; // all in one place
            }
            let middle = begin + (end - begin) / 2;
            let (points, dimension) = (self.points, self.dimension);
            let key = |i: u32| points[i as usize * dimension + axis];
            self.order[begin..end]
                .select_nth_unstable_by(middle - begin, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
            self.nodes[index].axis = axis as u32;
            self.nodes[index].split = self.coordinate(self.order[middle], axis);
            pending.push((middle, end, Some(index)));
            pending.push((begin, middle, None));
        }
    }

    fn widest_axis(&self, begin: usize, end: usize) -> (usize, f64) {
        let mut best = (0, -1.0);
        for axis in 0..self.dimension {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for &i in &self.order[begin..end] {
                let x = self.coordinate(i, axis);
                low = low.min(x);
                high = high.max(x);
            }
            if high - low > best.1 {
                best = (axis, high - low);
            }
        }
        best
    }

    /// The `k` points nearest to point `query`, itself excluded: squared distance and index, by
    /// distance and then by index, so that ties do not depend on the tree. Fewer if there are fewer.
    /// `found` is cleared first.
    pub(super) fn nearest(&self, query: usize, k: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        let q = &self.points[query * self.dimension..(query + 1) * self.dimension];
        if k == 0 || self.nodes.is_empty() || !q.iter().all(|x| x.is_finite()) {
            return;
        }
        // Nodes to visit, with a lower bound of the squared distance to anything in them.
        let mut pending = vec![(0u32, 0.0f64)];
        while let Some((index, bound)) = pending.pop() {
            if found.len() == k && bound > found[k - 1].0 {
                continue;
            }
            let node = self.nodes[index as usize];
            if node.second == 0 {
                for &i in &self.order[node.begin as usize..node.end as usize] {
                    if i as usize != query {
                        self.consider(q, i, k, found);
                    }
                }
                continue;
            }
            let offset = q[node.axis as usize] - node.split;
            let far = bound.max(offset * offset);
            let (near_child, far_child) =
                if offset < 0.0 { (index + 1, node.second) } else { (node.second, index + 1) };
            pending.push((far_child, far));
            pending.push((near_child, bound));
        }
    }

    fn consider(&self, q: &[f64], i: u32, k: usize, found: &mut Vec<(f64, u32)>) {
        let p = &self.points[i as usize * self.dimension..(i as usize + 1) * self.dimension];
        let square: f64 = p.iter().zip(q).map(|(a, b)| (a - b) * (a - b)).sum();
        let entry = (square, i);
        let place = found.partition_point(|&(d, j)| d < square || (d == square && j < i));
        if place < k {
            found.insert(place, entry);
            found.truncate(k);
        }
    }
}
