//! Exact nearest neighbours of points in any number of dimensions.

/// Points in a leaf: few enough that scanning them costs no more than the branches it saves. At least as many as
/// dimensions, since a box costs as much as two points and excludes little where there are many.
const LEAF: usize = 12;

/// Sums that run side by side.
const LANES: usize = 4;

/// Stands for several labels below one node of the tree.
const MIXED: u32 = u32::MAX;

/// A k-d tree (J. L. Bentley, 1975): the points sorted so that each node is a contiguous range,
/// halved at the median along its widest axis, and knows the box around its points.
///
/// Every search is exact in any dimension; above ten dimensions or so it looks at most points.
#[derive(Debug)]
pub(super) struct KdTree<'p> {
    points: &'p [f64],
    dimension: usize,
    order: Vec<u32>,
    /// The coordinates in this order: a leaf is one piece of memory.
    sorted: Vec<f64>,
    nodes: Vec<Node>,
    /// For each node its least coordinates and then its greatest.
    boxes: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    begin: u32,
    end: u32,
    /// Index of the second child, the first follows its parent; 0 for a leaf.
    second: u32,
}

/// Two points and the square of the distance between them, the point of lower index first: ordered by
/// distance, then by index.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Pair {
    pub(super) square: f64,
    pub(super) low: u32,
    pub(super) high: u32,
}

impl Pair {
    /// After every pair of points.
    pub(super) const NONE: Self = Self { square: f64::INFINITY, low: u32::MAX, high: u32::MAX };
}

impl<'p> KdTree<'p> {
    /// Sorts the `chosen` ones among points (row-major, `dimension` coordinates each, all of them finite)
    /// into a tree. O(n log n).
    pub(super) fn new(points: &'p [f64], dimension: usize, chosen: Vec<u32>) -> Self {
        let mut tree =
            Self { points, dimension, order: chosen, sorted: Vec::new(), nodes: Vec::new(), boxes: Vec::new() };
        if !tree.order.is_empty() {
            tree.build();
        }
        tree.sorted = tree.order.iter().flat_map(|&i| tree.point(i)).copied().collect();
        tree
    }

    fn point(&self, i: u32) -> &'p [f64] {
        &self.points[i as usize * self.dimension..][..self.dimension]
    }

    /// The points of the tree, so that neighbours are near each other: searches in this order find in the cache what
    /// they need.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    fn build(&mut self) {
        // A pending range and, if it is a second child, its parent. The first child is built next.
        let mut pending = vec![(0usize, self.order.len(), None)];
        while let Some((begin, end, parent)) = pending.pop() {
            let index = self.nodes.len();
            if let Some(parent) = parent {
                let node: &mut Node = &mut self.nodes[parent];
                node.second = index as u32;
            }
            self.nodes.push(Node { begin: begin as u32, end: end as u32, second: 0 });
            let (axis, width) = self.push_box(begin, end);
            if end - begin <= LEAF.max(self.dimension) || width <= 0.0 {
                continue; // few, or all in one place
            }
            let middle = begin + (end - begin) / 2;
            let (points, dimension) = (self.points, self.dimension);
            let key = |i: u32| points[i as usize * dimension + axis];
            self.order[begin..end]
                .select_nth_unstable_by(middle - begin, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
            pending.push((middle, end, Some(index)));
            pending.push((begin, middle, None));
        }
    }

    /// Adds the box of a range of points; its widest axis and width there.
    fn push_box(&mut self, begin: usize, end: usize) -> (usize, f64) {
        let start = self.boxes.len();
        let dimension = self.dimension;
        self.boxes.resize(start + dimension, f64::INFINITY);
        self.boxes.resize(start + 2 * dimension, f64::NEG_INFINITY);
        let (low, high) = self.boxes[start..].split_at_mut(dimension);
        for &i in &self.order[begin..end] {
            let p = &self.points[i as usize * dimension..][..dimension];
            for ((low, high), &x) in low.iter_mut().zip(high.iter_mut()).zip(p) {
                *low = low.min(x);
                *high = high.max(x);
            }
        }
        let mut widest = (0, -1.0);
        for axis in 0..dimension {
            if high[axis] - low[axis] > widest.1 {
                widest = (axis, high[axis] - low[axis]);
            }
        }
        widest
    }

    /// Square of the distance from `q` to the box of a node: never above that to a point in it, in
    /// floating point too, since rounding keeps order and the sums run alike.
    #[inline]
    fn square_to(&self, node: u32, q: &[f64]) -> f64 {
        let bounds = &self.boxes[node as usize * 2 * self.dimension..][..2 * self.dimension];
        let (low, high) = bounds.split_at(self.dimension);
        let mut sums = Sums::default();
        for ((q, low), high) in q.chunks(LANES).zip(low.chunks(LANES)).zip(high.chunks(LANES)) {
            sums.add_squares(q.len(), |i| (low[i] - q[i]).max(q[i] - high[i]).max(0.0));
        }
        sums.total()
    }

    /// Hands leaves, as indices and coordinates, to `visit`, the nearer first more or less. Left out is what lies beyond a squared
    /// distance, at first `farthest` and then what `visit` returned last, and what is below nodes that `skip`.
    fn visit(
        &self,
        q: &[f64],
        mut farthest: f64,
        skip: impl Fn(u32) -> bool,
        mut visit: impl FnMut(&[u32], &[f64]) -> f64,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let mut pending = vec![(0u32, self.square_to(0, q))];
        while let Some((index, square)) = pending.pop() {
            if square > farthest || skip(index) {
                continue;
            }
            let node = self.nodes[index as usize];
            if node.second == 0 {
                let [begin, end] = [node.begin, node.end].map(|at| at as usize);
                let coordinates = &self.sorted[begin * self.dimension..end * self.dimension];
                farthest = visit(&self.order[begin..end], coordinates);
                continue;
            }
            let [a, b] = [index + 1, node.second].map(|child| (child, self.square_to(child, q)));
            let (near, far) = if a.1 <= b.1 { (a, b) } else { (b, a) };
            pending.push(far);
            pending.push(near);
        }
    }

    /// The `k` points of the tree nearest to point `query`, itself excluded: squared distance and index,
    /// by distance and then by index, so that ties do not depend on the tree. Fewer if there are fewer.
    /// `found` is cleared first.
    pub(super) fn nearest(&self, query: u32, k: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        if k == 0 {
            return;
        }
        let q = self.point(query);
        self.visit(
            q,
            f64::INFINITY,
            |_| false,
            |leaf, coordinates| {
                for (&i, p) in leaf.iter().zip(coordinates.chunks_exact(self.dimension)) {
                    let square = square_between(q, p);
                    if i == query || found.len() == k && square > found[k - 1].0 {
                        continue;
                    }
                    let place = found.partition_point(|&(d, j)| d < square || (d == square && j < i));
                    if place < k {
                        found.truncate(k - 1);
                        found.insert(place, (square, i));
                    }
                }
                if found.len() == k { found[k - 1].0 } else { f64::INFINITY }
            },
        );
    }

    /// The least of `best` and the pairs of point `query` with a point of the tree that has another label.
    /// `common` is what [`KdTree::common_labels`] says of these labels.
    pub(super) fn nearest_elsewhere(&self, query: u32, label: &[u32], common: &[u32], best: Pair) -> Pair {
        let mut best = best;
        let (q, own) = (self.point(query), label[query as usize]);
        self.visit(
            q,
            best.square,
            |node| common[node as usize] == own,
            |leaf, coordinates| {
                for (&i, p) in leaf.iter().zip(coordinates.chunks_exact(self.dimension)) {
                    if label[i as usize] == own {
                        continue;
                    }
                    let square = square_between(q, p);
                    let pair = Pair { square, low: query.min(i), high: query.max(i) };
                    if pair < best {
                        best = pair;
                    }
                }
                best.square
            },
        );
        best
    }

    /// For each node the label that all its points have, or one that none has.
    pub(super) fn common_labels(&self, label: &[u32]) -> Vec<u32> {
        let mut common = vec![MIXED; self.nodes.len()];
        // Children come after their parents.
        for (index, node) in self.nodes.iter().enumerate().rev() {
            common[index] = if node.second == 0 {
                let points = &self.order[node.begin as usize..node.end as usize];
                let first = label[points[0] as usize];
                if points.iter().all(|&i| label[i as usize] == first) { first } else { MIXED }
            } else {
                let [a, b] = [common[index + 1], common[node.second as usize]];
                if a == b { a } else { MIXED }
            };
        }
        common
    }
}

#[inline]
pub(super) fn square_between(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = Sums::default();
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let (rest_a, rest_b) = (a.remainder(), b.remainder());
    for (a, b) in a.zip(b) {
        sums.add_squares(LANES, |i| a[i] - b[i]);
    }
    sums.add_squares(rest_a.len().min(rest_b.len()), |i| rest_a[i] - rest_b[i]);
    sums.total()
}

/// A sum of squares in one order wherever it is taken.
#[derive(Default)]
struct Sums([f64; LANES]);

impl Sums {
    /// Adds at most [`LANES`] squares.
    #[inline]
    fn add_squares(&mut self, count: usize, term: impl Fn(usize) -> f64) {
        for (i, sum) in self.0[..count].iter_mut().enumerate() {
            let x = term(i);
            *sum += x * x;
        }
    }

    #[inline]
    fn total(&self) -> f64 {
        (self.0[0] + self.0[1]) + (self.0[2] + self.0[3])
    }
}
